//! Phase tables: knots within their bounds, tables side by side, and numbers in range.

use crate::{
    blob::{
        Database,
        check::{Checked, check, in_range, length, reserved},
        layout::{
            phase::{self, MAX_DOF_KNOTS, MAX_FEATURE_KNOTS, tables},
            section,
        },
        read::Record,
    },
    math::abs,
};

/// Most of a time, a speed or a value of a dof.
const MAX_VALUE: f32 = 1e3;

#[inline]
pub(super) fn tables_by_phase(db: &Database<'_>, bytes: &[u8]) -> Checked {
    let (c, id) = (db.counts(), section::PHASE);
    check(id, 0, c.classes > 0 && (1e-6..=1e6).contains(&db.phase_step()))?;
    reserved(id, Record(bytes).zero(phase::RESERVED))?;
    // The query is whitened group by group: features lie that way.
    for f in 1..c.features {
        check(section::QUERY, f, db.feature_group(f - 1) <= db.feature_group(f))?;
    }
    let dofs_at = db.phase_dofs_at();
    check(id, 0, bytes.len() >= db.phase_classes_at() + c.classes * tables::LENGTH)?;
    let count = (dofs_at - phase::HEADER) / 4;
    check(id, 0, in_range(db.whitening().take_first(count), 1e6))?;
    check(id, 0, in_range(db.slope_steps().into_iter(), MAX_VALUE))?;
    for (d, scale) in db.phase_dofs().enumerate() {
        let is_code =
            (1e-6..=MAX_VALUE).contains(&scale.step) && abs(scale.step * scale.inverse - 1.0) < 1e-3;
        check(id, d, in_range([scale.centre].into_iter(), MAX_VALUE) && is_code)?;
    }
    let mut next = db.phase_classes_at() + c.classes * tables::LENGTH;
    for class in 0..c.classes {
        let record = db.phase_record(class);
        reserved(id, record.zero(tables::RESERVED) && record.zero(tables::END))?;
        check(id, class, record.u32(tables::OFFSET) as usize == next && record.u8(tables::CYCLIC) <= 1)?;
        let found = db.phase_tables(class);
        let knots = (2..=MAX_FEATURE_KNOTS).contains(&found.feature_knots)
            && (2..=MAX_DOF_KNOTS).contains(&found.dof_knots)
            && (2..=MAX_DOF_KNOTS).contains(&found.slope_knots);
        check(id, class, knots)?;
        let seconds = found.seconds.into_iter().chain(found.output_seconds);
        let numbers = (0.0..=2.0).contains(&found.gain)
            && (1e-6..=1e9).contains(&found.far)
            && in_range(found.drift.into_iter(), MAX_VALUE)
            && seconds.into_iter().all(|s| (1e-3..=MAX_VALUE).contains(&s));
        check(id, class, numbers)?;
        next += found.parts().end;
        check(id, class, next <= bytes.len())?;
        for (codes, norm2) in found.knots() {
            let square = |code: u8| i32::from(code as i8) * i32::from(code as i8);
            let squares: i32 = codes.iter().map(|&code| square(code)).sum();
            check(id, class, norm2 == squares)?;
        }
    }
    length(id, next, bytes.len())
}
