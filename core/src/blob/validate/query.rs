//! The query section: unit, scales, alignment weights, groups and components. Any mean cloud will do.

use crate::blob::{
    Database,
    check::{Checked, check, reserved},
    layout::{query, section},
    read::Record,
};

#[inline]
pub(super) fn query_section(db: &Database<'_>) -> Checked {
    let c = &db.counts;
    if c.features == 0 {
        return Ok(());
    }
    let unit = db.length_unit();
    let is_power_of_two = unit.to_bits() & 0x7f_ffff == 0;
    check(section::QUERY, 0, is_power_of_two && (1e-9..=1e6).contains(&unit))?;
    let groups = query::groups(c.window, c.joints, c.features);
    let weights = query::weights(c.window, c.joints, c.features)..groups;
    let weights = db.required.query.get(weights).unwrap_or(&[]);
    let weight = c.window * weights.iter().map(|&w| usize::from(w)).sum::<usize>();
    check(section::QUERY, 0, (1..=query::MAX_WEIGHT_SUM).contains(&weight))?;
    for f in 0..c.features {
        let numbers_fit =
            [db.feature_scale(f), db.component_step(f)].iter().all(|n| (1e-9..=1e6).contains(n));
        check(section::QUERY, f, numbers_fit && db.feature_group(f) < c.groups)?;
    }
    let components = query::components(c.window, c.joints, c.features);
    reserved(section::QUERY, Record(db.required.query).zero(groups + c.features..components))?;
    // So that no product with a coordinate overflows.
    for (i, number) in
        db.required.query.get(components..).unwrap_or(&[]).as_chunks::<2>().0.iter().enumerate()
    {
        let fits = i16::from_le_bytes(*number).unsigned_abs() <= query::MAX_COMPONENT;
        check(section::QUERY, components / 2 + i, fits)?;
    }
    Ok(())
}
