//! Tables of means and spreads: labels, ranges and unit quaternions.

use super::labels::Labels;
use crate::{
    blob::{
        Database, Numbers,
        check::{Checked, check, in_range, is_deviation, length, reserved},
        layout::{section, statistic},
        read::{Record, u16_at},
    },
    math::quaternion::is_unit,
};

/// Checks the tables of statistics.
#[inline(never)]
pub(super) fn tables(db: &Database<'_>, bytes: &[u8]) -> Checked {
    let c = db.counts();
    let (id, tables) = (section::STATISTIC, db.tables());
    length(id, statistic::HEADER + tables * statistic::length(c.joints), bytes.len())?;
    reserved(id, Record(bytes).zero(statistic::RESERVED))?;
    check(id, tables, usize::from(u16_at(bytes, statistic::FROM.start)) < c.styles)?;
    let mut labels = Labels::new();
    for i in 0..tables {
        let table = db.table(i);
        reserved(id, Record(table.bytes).zero(statistic::TABLE_RESERVED))?;
        let labels_fit =
            usize::from(table.style) < c.styles && table.action.is_none_or(|a| usize::from(a) < c.actions);
        let root_fits = (0..3).all(|r| {
            let [mean, deviation] = table.root(r);
            in_range([mean].into_iter(), 1e3) && is_deviation(deviation)
        });
        let feet = table.bytes.get(..statistic::joints(c.dofs)).unwrap_or(&[]);
        let feet_fit = in_range(Numbers::at(feet, statistic::FEET), 1e6);
        let joints_fit = (0..c.joints).all(|j| {
            let (mean, deviation) = table.joint(j);
            is_unit(mean) && is_deviation(deviation)
        });
        check(
            id,
            i,
            labels_fit && labels.insert(table.style, table.action) && root_fits && feet_fit && joints_fit,
        )?;
    }
    check(id, tables, labels.cover(c.styles, None))
}
