//! What a row is of.

use serde_json::json;

use crate::{evaluation::row, fold::Fold, report::table};

/// The names of a row of a fold.
pub(super) fn named(fold: &Fold<'_>, part: &str, method: &str, option: &str) -> table::Row {
    let example = &fold.corpus.examples[fold.test];
    row(json!({
        "part": part,
        "method": method,
        "option": option,
        "action": fold.corpus.actions[example.action],
        "style": fold.corpus.styles[fold.style],
        "clip": example.clip.name,
        "truth": fold.corpus.examples[fold.truth].clip.name,
    }))
}
