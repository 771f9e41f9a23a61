//! Names that are written in two ways, or in each other's place.

use gestus_motion::corpus::Corpus;

use crate::registration::timeline::Kind;

/// A message for each action or style whose name differs from another's by small and capital letters alone, and one where
/// styles are called like gaits and no action is.
pub(super) fn doubts(corpus: &Corpus) -> Vec<String> {
    let mut doubts = Vec::new();
    let [has_gait, is_style] = [&corpus.actions, &corpus.styles]
        .map(|names| names.iter().find(|name| Kind::of_action(name) == Kind::Gait));
    if let (None, Some(style)) = (has_gait, is_style) {
        doubts.push(format!(
            "a style is called {style}, and no action is called like a gait: are they in each other's place? `patterns` says \
             which is which"
        ));
    }
    for (what, names) in [("actions", &corpus.actions), ("styles", &corpus.styles)] {
        for (i, name) in names.iter().enumerate() {
            let same = names[..i].iter().find(|other| other.to_lowercase() == name.to_lowercase());
            doubts.extend(same.map(|other| {
                format!("{what} {other} and {name} differ by capital letters alone, and are two: rename the files of one")
            }));
        }
    }
    doubts
}
