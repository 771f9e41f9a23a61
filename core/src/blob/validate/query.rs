//! The query section: alignment weights, scales, groups, mean cloud and components.

use crate::blob::{
    Database,
    check::{Checked, check, reserved},
    layout::{query, section},
    read::{Record, f32_at},
};

#[inline]
pub(super) fn query_section(db: &Database<'_>) -> Checked {
    let c = &db.counts;
    if c.features == 0 {
        return Ok(());
    }
    let groups = query::groups(c.window, c.joints, c.features);
    let components = query::components(c.window, c.joints, c.features);
    let mut weight = 0.0;
    for j in 0..c.joints {
        let w = f32_at(db.required.query, query::weights(c.window, c.joints) + 4 * j);
        check(section::QUERY, j, (0.0..=1e6).contains(&w))?;
        weight += w;
    }
    check(section::QUERY, 0, weight > 1e-6)?;
    for f in 0..c.features {
        let scale_fits = (1e-9..=1e6).contains(&db.feature_scale(f));
        check(section::QUERY, f, scale_fits && db.feature_group(f) < c.groups)?;
    }
    reserved(section::QUERY, Record(db.required.query).zero(groups + c.features..components))?;
    // Mean cloud and components: coordinates of a body, and entries of unit vectors times weights.
    for range in [0..query::weights(c.window, c.joints), components..db.required.query.len()] {
        for at in range.step_by(4) {
            check(section::QUERY, at / 4, (-1e6..=1e6).contains(&f32_at(db.required.query, at)))?;
        }
    }
    Ok(())
}
