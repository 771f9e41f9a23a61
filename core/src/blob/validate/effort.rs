//! The effort dial: nodes, axes that have a length, Efforts in range, and weights that add up at every node.

use crate::blob::{
    Database,
    check::{Checked, check, length, reserved},
    layout::{effort, section},
    read::{Record, f32_at, u16_at},
};

/// Checks the effort dial.
#[inline]
pub(super) fn dial(db: &Database<'_>, bytes: &[u8]) -> Checked {
    let styles = db.counts.styles;
    let head = Record(bytes);
    let bad = |record, fits| check(section::EFFORT, record, fits);
    if bytes.len() < effort::table(styles) {
        return length(section::EFFORT, effort::table(styles), bytes.len());
    }
    let mut nodes = 1usize;
    for k in 0..3 {
        let count = usize::from(u16_at(bytes, effort::NODES.start + 2 * k));
        bad(k, (2..=effort::MAX_NODES).contains(&count))?;
        nodes = nodes.saturating_mul(count);
    }
    bad(3, [effort::ESTIMATED, effort::GIVEN].contains(&head.u8(effort::LABELS)))?;
    reserved(section::EFFORT, head.zero(effort::RESERVED))?;
    let factor = |at| {
        let value = f32_at(bytes, at);
        (-10.0..=10.0).contains(&value).then_some(value)
    };
    for k in 0..3 {
        let at = effort::AXES.start + 8 * k;
        let ends = factor(at).zip(factor(at + 4));
        // A hundredth at least: places on the axis stay finite.
        bad(4 + k, ends.is_some_and(|(low, high)| high - low >= 0.01))?;
        bad(7 + k, factor(effort::REST.start + 4 * k).is_some())?;
    }
    for i in 0..3 * styles {
        bad(10 + i, factor(effort::STYLES + 4 * i).is_some())?;
    }
    length(section::EFFORT, effort::table(styles) + nodes * styles, bytes.len())?;
    let table = bytes.get(effort::table(styles)..).unwrap_or(&[]);
    for node in 0..nodes {
        let sum: u16 = Record::of(table, node, styles).0.iter().map(|&w| u16::from(w)).sum();
        bad(10 + 3 * styles + node, sum == effort::WHOLE)?;
    }
    Ok(())
}
