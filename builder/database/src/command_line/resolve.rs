//! Resolves the names and weights of a command line to the numbers of a database.

use anyhow::{Context, Result, bail};
use gestus_core::{MAX_GROUP_STYLES, blob::Names};

use crate::list::{self, Item};

/// Greatest strength of a joint group.
const MAX_STRENGTH: f32 = 2.0;
/// Greatest weight of a style.
const MAX_WEIGHT: f32 = 1e6;

/// The names, separated by commas.
pub(super) fn listed(names: Names<'_>) -> String {
    names.iter().collect::<Vec<_>>().join(", ")
}

/// The number of a name among the database's. `what` says what it names.
///
/// # Errors
/// A name that is not there, with those that are.
pub fn find(name: &str, names: Names<'_>, what: &str) -> Result<u16> {
    names
        .find(name.trim())
        .with_context(|| format!("the database has no {what} `{}`: it has {}", name.trim(), listed(names)))
}

/// Resolves `proud=1,old=0.5`. The whole text is tried as a name first: older databases may have styles with a comma.
///
/// # Errors
/// A name that is not there, with those that are, and a weight that is no number.
pub fn named(words: &str, styles: Names<'_>) -> Result<Vec<(u16, f32)>> {
    if let Some(style) = styles.find(words.trim()) {
        return Ok(vec![(style, 1.0)]);
    }
    let weights = list::items(words).map(|item| weighted(item, styles, "style"));
    weights.collect::<Result<_>>().with_context(|| format!("--style {words}"))
}

/// Resolves `left-arm=proud:2+old:1`.
pub(super) fn group_style(
    part: &str,
    groups: Names<'_>,
    styles: Names<'_>,
) -> Result<(u16, Vec<(u16, f32)>)> {
    let (group, mix) =
        part.split_once('=').with_context(|| format!("--group-style {part}: write left-arm=proud"))?;
    let weights: Vec<(u16, f32)> = mix
        .split('+')
        .map(|s| weighted(Item::new(&s.replacen(':', "=", 1)), styles, "style"))
        .collect::<Result<_>>()
        .with_context(|| format!("--group-style {part}"))?;
    if weights.len() > MAX_GROUP_STYLES {
        bail!(
            "--group-style {part}: {} styles, a joint group mixes {MAX_GROUP_STYLES} at most",
            weights.len()
        );
    }
    check_weights("--group-style", part, &weights)?;
    let group = find(group, groups, "joint group").with_context(|| format!("--group-style {part}"))?;
    Ok((group, weights))
}

/// Resolves `left-arm=0.5`.
pub(super) fn strength(part: &str, groups: Names<'_>) -> Result<(u16, f32)> {
    let item = Item::new(part);
    if item.value.is_none() {
        bail!("--strength {part}: how strong? Write {part}=0.5");
    }
    let (group, strength) =
        weighted(item, groups, "joint group").with_context(|| format!("--strength {part}"))?;
    if !(0.0..=MAX_STRENGTH).contains(&strength) {
        bail!("--strength {part}: from 0 (the input) by 1 (the style) to {MAX_STRENGTH} (beyond it)");
    }
    Ok((group, strength))
}

/// Refuses weights that the core would refuse.
pub(super) fn check_weights(option: &str, words: &str, weights: &[(u16, f32)]) -> Result<()> {
    if let Some((_, bad)) = weights.iter().find(|(_, w)| !(0.0..=MAX_WEIGHT).contains(w)) {
        bail!("{option} {words}: a weight of {bad}; weights are from 0 to {MAX_WEIGHT}");
    }
    if weights.iter().map(|w| w.1).sum::<f32>() <= 1e-6 {
        bail!("{option} {words}: all weights are 0; at least one has to be more");
    }
    Ok(())
}

/// Resolves a name and its weight. The whole item is tried as a name first: names may have a `=`.
fn weighted(item: Item<'_>, names: Names<'_>, what: &str) -> Result<(u16, f32)> {
    if let Some(number) = names.find(item.text) {
        return Ok((number, 1.0));
    }
    let weight = item.weight()?;
    Ok((find(item.name, names, what)?, weight))
}
