//! Phase tables as arrays: decoded, in the units of the dofs.

use anyhow::Result;
use gestus_core::{
    Database,
    blob::{PhaseTables, layout::phase::CONTACTS},
};
use serde_json::{Value, json};

use super::saver::Saver;

/// The whitening matrix and the arrays of every class.
pub(super) fn export(database: &Database<'_>, save: &Saver<'_>) -> Result<()> {
    let counts = database.counts();
    let f = counts.features;
    let mut whitening = vec![0.0; f * f];
    let (mut first, mut numbers) = (0, database.whitening());
    for size in database.features_by_group() {
        for row in first..first + size {
            let slots = &mut whitening[row * f + first..row * f + first + size];
            slots.iter_mut().zip(&mut numbers).for_each(|(slot, number)| *slot = number);
        }
        first += size;
    }
    save.array("phase_whitening", &[f, f], &whitening)?;
    (0..counts.classes).try_for_each(|class| tables(database, save, class))
}

/// `phase_features_C`, `phase_input_C`, `phase_output_C`, `phase_slopes_C`, `phase_spread_C` and `phase_contacts_C`.
fn tables(database: &Database<'_>, save: &Saver<'_>, class: usize) -> Result<()> {
    let (f, d) = (database.counts().features, database.counts().dofs);
    let tables = database.phase_tables(class);
    let parts = tables.parts();
    let code = |byte: u8| f32::from(byte as i8);
    let step = database.phase_step();
    let features: Vec<f32> =
        tables.knots().flat_map(|(codes, _)| codes.iter().map(|&c| step * code(c))).collect();
    save.array(&format!("phase_features_{class}"), &[tables.feature_knots, f], &features)?;
    let n = tables.dof_knots;
    for (name, at) in [("input", parts.input), ("output", parts.output)] {
        let rows = (0..n).flat_map(|k| tables.row(at, d, k).iter().zip(database.phase_dofs()));
        let values: Vec<f32> = rows.map(|(&c, dof)| dof.centre + dof.step * code(c)).collect();
        save.array(&format!("phase_{name}_{class}"), &[n, d], &values)?;
    }
    let slope_steps = database.slope_steps();
    let rows = (0..tables.slope_knots).flat_map(|k| {
        tables.row(parts.slopes, 2 * d, k).as_chunks::<2>().0.iter().zip(database.phase_dofs())
    });
    let slopes: Vec<f32> =
        rows.flat_map(|(pair, dof)| [0, 1].map(|i| dof.step * slope_steps[i] * code(pair[i]))).collect();
    save.array(&format!("phase_slopes_{class}"), &[tables.slope_knots, d, 2], &slopes)?;
    let spread: Vec<f32> =
        tables.spread().iter().zip(database.phase_dofs()).map(|(&s, dof)| f32::from(s) * dof.step).collect();
    save.array(&format!("phase_spread_{class}"), &[d], &spread)?;
    let contacts: Vec<f32> = (0..CONTACTS).flat_map(|k| tables.contact(k)).collect();
    save.array(&format!("phase_contacts_{class}"), &[CONTACTS, 2], &contacts)
}

/// The numbers of every class that are not arrays; null where there are no tables.
pub(super) fn manifest(database: &Database<'_>) -> Value {
    if !database.has_phase() {
        return Value::Null;
    }
    let of_class = |tables: PhaseTables<'_>| {
        json!({
            "cyclic": tables.is_cyclic, "gain": tables.gain, "far": tables.far, "drift": tables.drift,
            "seconds": tables.seconds, "output_seconds": tables.output_seconds,
        })
    };
    (0..database.counts().classes).map(|class| of_class(database.phase_tables(class))).collect()
}
