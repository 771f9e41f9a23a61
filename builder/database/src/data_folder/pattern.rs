//! Labels by patterns of file names.

use std::path::Path;

use gestus_motion::capture::Format;
use thiserror::Error;

use crate::registration::timeline::Kind;

/// The built-in patterns.
pub fn built_in(name: &str) -> Option<[String; 3]> {
    let find = |text: &str| Pattern::new(text).ok().and_then(|pattern| pattern.find(name));
    if let Some(found) = find("dataset-{*}_{action}_{style}_{take}") {
        return Some(found);
    }
    if let Some([action, style, take]) = find("{style}_{action}_{take}") {
        let is_number = |text: &str, digits| text.len() == digits && text.bytes().all(|b| b.is_ascii_digit());
        if is_number(&action, 2) && is_number(&take, 3) {
            let action = match action.as_str() {
                "01" => "walk".to_string(),
                "13" => "run".to_string(),
                _ => action,
            };
            return Some([action, style, take]);
        }
    }
    find("{action}_{style}_{take}")
}

/// A pattern for files like this one, by its path below the folder, or the built-in one where it has no two words. Of a
/// folder and a name, or of two words, the style comes first, unless that word is a gait.
pub(super) fn example(path: &str) -> String {
    let ending = if stem(path) == path { ".bvh" } else { &path[stem(path).len()..] };
    let is_number = |word: &str| word.chars().all(|c| c.is_ascii_digit());
    let is_gait = |word: &str| Kind::of_action(word) == Kind::Gait;
    let mut folders: Vec<&str> = stem(path).split('/').collect();
    let name = folders.pop().unwrap_or_default();
    // Words and what is between them, in turns.
    let parts: Vec<&str> = name.split_inclusive(|c: char| !c.is_alphanumeric()).collect();
    let words: Vec<&str> =
        parts.iter().map(|part| part.trim_end_matches(|c: char| !c.is_alphanumeric())).collect();
    let named: Vec<&str> = words.iter().copied().filter(|word| !is_number(word)).collect();
    let before = folders.pop().or(named.first().copied()).unwrap_or_default();
    let after = named.last().copied().unwrap_or_default();
    let mut holes = ["{style}", "{action}"];
    if is_gait(before) && !is_gait(after) {
        holes.reverse();
    }
    let mut holes = holes.into_iter();
    let mut text = "{*}/".repeat(folders.len());
    if path.contains('/') {
        text += &format!("{}/", holes.next().unwrap_or_default());
    }
    let last = words.iter().rposition(|word| is_number(word));
    for (i, (part, word)) in parts.iter().zip(&words).enumerate() {
        let hole = match is_number(word) {
            true if Some(i) == last => "{take}",
            true => "{*}",
            false => holes.next().unwrap_or("{*}"),
        };
        text += &format!("{hole}{}", &part[word.len()..]);
    }
    text += ending;
    let fits = |pattern: Pattern| pattern.find(path).is_some();
    if Pattern::new(&text).is_ok_and(fits) { text } else { "{action}_{style}_{take}.bvh".to_owned() }
}

/// A part of a pattern.
#[derive(Debug, Clone, PartialEq)]
enum Part {
    Text(String),
    /// A placeholder: which of action, style and take it fills, if any.
    Hole(Option<usize>),
}

/// A name with placeholders.
#[derive(Debug, Clone, PartialEq)]
pub struct Pattern(Vec<Part>);

/// What is wrong with a pattern.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[allow(missing_docs, reason = "the messages say what they are")]
pub enum PatternError {
    #[error("a closing brace without an opening one")]
    NoOpening,
    #[error("an opening brace without a closing one")]
    NoClosing,
    #[error("expected {{action}}, {{style}}, {{take}} or {{*}} in braces")]
    Placeholder,
    #[error("a placeholder other than {{*}} is there twice")]
    Twice,
    #[error("two placeholders touch; put a character between them")]
    Touching,
    #[error("expected both {{action}} and {{style}}")]
    Missing,
    #[error("more than {MAX_HOLES} placeholders")]
    TooMany,
}

/// Most placeholders in a pattern: matching tries their lengths in turn.
const MAX_HOLES: usize = 6;

impl Pattern {
    /// # Errors
    /// What is wrong with the pattern.
    pub fn new(text: &str) -> Result<Pattern, PatternError> {
        let mut parts = Vec::new();
        let mut rest = stem(text);
        while !rest.is_empty() {
            let (before, after) = rest.split_once('{').unwrap_or((rest, ""));
            if before.contains('}') {
                return Err(PatternError::NoOpening);
            }
            if !before.is_empty() {
                parts.push(Part::Text(before.to_string()));
            }
            if before.len() == rest.len() {
                break;
            }
            let Some((hole, after)) = after.split_once('}') else {
                return Err(PatternError::NoClosing);
            };
            let hole = Part::Hole(match hole {
                "action" => Some(0),
                "style" => Some(1),
                "take" => Some(2),
                "*" => None,
                _ => return Err(PatternError::Placeholder),
            });
            if hole != Part::Hole(None) && parts.contains(&hole) {
                return Err(PatternError::Twice);
            }
            if matches!(parts.last(), Some(Part::Hole(_))) {
                return Err(PatternError::Touching);
            }
            parts.push(hole);
            rest = after;
        }
        if !parts.contains(&Part::Hole(Some(0))) || !parts.contains(&Part::Hole(Some(1))) {
            return Err(PatternError::Missing);
        }
        if parts.iter().filter(|p| matches!(p, Part::Hole(_))).count() > MAX_HOLES {
            return Err(PatternError::TooMany);
        }
        Ok(Pattern(parts))
    }

    /// Action, style and take of a name that matches.
    pub fn find(&self, name: &str) -> Option<[String; 3]> {
        let mut found = Default::default();
        // Longer than any real name. Matching takes polynomial time.
        (name.len() <= 512 && fill(&self.0, stem(name), &mut found)).then_some(found)
    }
}

fn fill(parts: &[Part], name: &str, found: &mut [String; 3]) -> bool {
    match parts.split_first() {
        None => name.is_empty(),
        Some((Part::Text(text), rest)) => {
            name.strip_prefix(text.as_str()).is_some_and(|name| fill(rest, name, found))
        }
        Some((Part::Hole(hole), rest)) => {
            let allowed = |c: char| c != '/' && (c != '_' || matches!(hole, None | Some(0)));
            for (at, c) in name.char_indices() {
                if !allowed(c) {
                    return false;
                }
                let (inside, after) = name.split_at(at + c.len_utf8());
                if fill(rest, after, found) {
                    if let Some(hole) = hole {
                        found[*hole] = inside.to_string();
                    }
                    return true;
                }
            }
            false
        }
    }
}

/// A name without the ending of a motion file.
pub(super) fn stem(name: &str) -> &str {
    match name.rsplit_once('.') {
        Some((stem, _)) if Format::of(Path::new(name)).is_some() => stem,
        _ => name,
    }
}
