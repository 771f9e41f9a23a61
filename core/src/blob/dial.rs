//! Checks of the effort dial's section: axes that have a length, Efforts that are numbers, and weights that add up at
//! every node.

use super::{
    Database,
    check::{Checked, as_u32, check, reserved},
    layout::{effort, section},
    read::{Record, f32_at, u16_at},
};
use crate::BlobError;

#[inline]
pub(super) fn effort(db: &Database<'_>) -> Checked {
    let Some(bytes) = db.optional(section::EFFORT) else { return Ok(()) };
    let styles = db.counts.styles;
    let head = Record(bytes);
    let bad = |record, fits| check(section::EFFORT, record, fits);
    let length = |need| match bytes.len() == need {
        true => Ok(()),
        false => {
            Err(BlobError::Length { section: section::EFFORT, need: as_u32(need), have: as_u32(bytes.len()) })
        }
    };
    if bytes.len() < effort::table(styles) {
        return length(effort::table(styles));
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
        bad(10 + i, factor(effort::styles() + 4 * i).is_some())?;
    }
    length(effort::table(styles) + nodes * styles)?;
    let table = bytes.get(effort::table(styles)..).unwrap_or(&[]);
    for node in 0..nodes {
        let sum: u16 = Record::of(table, node, styles).0.iter().map(|&w| u16::from(w)).sum();
        bad(10 + 3 * styles + node, sum == effort::WHOLE)?;
    }
    Ok(())
}
