//! Exports a blob as arrays and JSON, for independent checks.
//!
//! Shapes: N stored frames, D dofs, F features, S styles. Metres, radians and seconds; `docs/CHECKING.md` lists the names.

mod phase;
mod saver;

use std::{collections::BTreeMap, fs, path::Path};

use anyhow::{Context, Result, bail};
use gestus_core::{
    Database,
    blob::{Class, Counterpart, Manifest, Moment, layout::flag},
    methods::mixture::contact_votes::OutputContacts,
};
use serde_json::{Value, json};

use gestus_motion::{body::dof_names, files};
use saver::Saver;

/// Writes the arrays and `manifest.json` to a folder, which is created if it is missing.
///
/// # Errors
/// A folder that can't be written, and styles whose arrays would have the same name.
pub fn export(database: &Database<'_>, folder: &Path) -> Result<Value> {
    distinct(database.manifest()?.styles.iter())?;
    fs::create_dir_all(folder).with_context(|| format!("{} can't be made", folder.display()))?;
    let save = Saver { folder };
    let counts = *database.counts();
    let (n, d, f) = (counts.frames, counts.dofs, counts.features);
    let rows: Vec<Vec<f32>> = (0..counts.rows).map(|r| row(database, r)).collect();
    save.array("dofs", &[n, d], &rows[..n].concat())?;
    let follows = |r: usize| database.flags(r) & flag::FOLLOWS != 0;
    let previous: Vec<i32> = (0..n).map(|r| if follows(r) { r as i32 - 1 } else { -1 }).collect();
    save.array("previous", &[n], &previous)?;
    let scales: Vec<f32> = (0..f).map(|i| database.feature_scale(i)).collect();
    let features: Vec<f32> = (0..n)
        .flat_map(|r| {
            database.feature(r).iter().zip(&scales).map(|(&c, s)| f32::from(c as i8) * s).collect::<Vec<_>>()
        })
        .collect();
    save.array("features", &[n, f], &features)?;
    let mut class_of = vec![0i32; n];
    for (c, class) in database.classes().enumerate() {
        class_of[class.first_row..class.first_row + class.rows].fill(c as i32);
    }
    save.array("class", &[n], &class_of)?;
    let mut clip_of = vec![0i32; n];
    for i in 0..counts.clips {
        let (first, length) = database.clip(i);
        if first < n {
            clip_of[first..first + length].fill(i as i32);
        }
    }
    save.array("clip", &[n], &clip_of)?;
    let flags = |bit: u8| (0..n).map(move |r| u8::from(database.flags(r) & bit != 0));
    save.array("searchable", &[n], &flags(flag::SEARCHABLE).collect::<Vec<u8>>())?;
    let contacts: Vec<u8> =
        flags(flag::LEFT_CONTACT).zip(flags(flag::RIGHT_CONTACT)).flat_map(|(l, r)| [l, r]).collect();
    save.array("contacts", &[n, 2], &contacts)?;
    if database.has_phase() {
        phase::export(database, &save)?;
    }
    let manifest = manifest(database)?;
    for s in 0..counts.styles {
        outputs(database, &save, &rows, &class_of, s)?;
    }
    files::write(&folder.join("manifest.json"), serde_json::to_string_pretty(&manifest)?)?;
    Ok(manifest)
}

/// `output_S`, `output_prev_S`, `output_step_S`, `output_contacts_S` and `output_valid_S` of one style.
fn outputs(
    database: &Database<'_>,
    save: &Saver<'_>,
    rows: &[Vec<f32>],
    class_of: &[i32],
    style: usize,
) -> Result<()> {
    let counts = database.counts();
    let (n, d) = (counts.frames, counts.dofs);
    let (mut now, mut before) = (Vec::with_capacity(n * d), Vec::with_capacity(n * d));
    let (mut step, mut valid) = (Vec::with_capacity(n), Vec::with_capacity(n));
    let mut contacts = Vec::with_capacity(n * 2);
    let blend = |m: Moment| -> Vec<f32> {
        let next = rows.get(m.row + 1).filter(|_| m.fraction > 0.0).unwrap_or(&rows[m.row]);
        rows[m.row].iter().zip(next).map(|(a, b)| a * (1.0 - m.fraction) + b * m.fraction).collect()
    };
    for (r, &class) in class_of.iter().enumerate() {
        let searchable = database.flags(r) & flag::SEARCHABLE != 0;
        let cycle = database.cycle_of(class as usize, r).filter(|_| searchable);
        let found: Vec<Counterpart> =
            cycle.map_or_else(Vec::new, |c| database.counterparts(c, r, style).collect());
        valid.push(u8::from(!found.is_empty()));
        let mean = |of: &dyn Fn(&Counterpart) -> Vec<f32>| {
            let mut sum = vec![0.0; d];
            for counterpart in &found {
                sum.iter_mut().zip(of(counterpart)).for_each(|(s, v)| *s += v / found.len() as f32);
            }
            sum
        };
        now.extend(mean(&|c| blend(c.now)));
        before.extend(mean(&|c| blend(c.before)));
        step.push(found.iter().map(|c| c.step_s / found.len() as f32).sum::<f32>());
        let mut stands = OutputContacts::default();
        found.iter().for_each(|c| stands.add(database, c.now, r, 1.0 / found.len() as f32));
        contacts.extend(stands.0);
    }
    let names = arrays_of(database.manifest()?.styles.get(style).unwrap_or_default());
    let [outputs, outputs_before, steps, stands, valids] = &names;
    save.array(outputs, &[n, d], &now)?;
    save.array(outputs_before, &[n, d], &before)?;
    save.array(steps, &[n], &step)?;
    save.array(stands, &[n, 2], &contacts)?;
    save.array(valids, &[n], &valid)
}

/// Names of the arrays and files of a style.
fn arrays_of(style: &str) -> [String; 5] {
    // Style names become file names.
    let safe: String = style.chars().map(|c| if matches!(c, '/' | '\\' | '\0') { '_' } else { c }).collect();
    ["", "prev_", "step_", "contacts_", "valid_"].map(|what| format!("output_{what}{safe}"))
}

/// Refuses styles whose arrays would overwrite each other: `x/y` and `x_y`, `prev_z` and `z`.
fn distinct<'a>(styles: impl Iterator<Item = &'a str>) -> Result<()> {
    let mut taken = BTreeMap::new();
    for style in styles {
        for array in arrays_of(style) {
            if let Some(other) = taken.insert(array.clone(), style) {
                bail!(
                    "the styles `{other}` and `{style}` would both be written to {array}.npy: give one of them another name \
                     in gestus.toml, and build again"
                );
            }
        }
    }
    Ok(())
}

/// The dofs of a row.
pub fn row(database: &Database<'_>, row: usize) -> Vec<f32> {
    let mut dofs = vec![0.0; database.counts().dofs];
    database.decode(row, &mut dofs);
    dofs
}

/// The names of a class's action and style.
pub fn class_names<'db>(manifest: &Manifest<'db>, class: Class) -> [Option<&'db str>; 2] {
    [manifest.actions.get(usize::from(class.action)), manifest.styles.get(usize::from(class.style))]
}

/// The manifest and the tables that are not arrays, as JSON.
///
/// # Errors
/// None after a successful `open`.
pub fn manifest(database: &Database<'_>) -> Result<Value> {
    let counts = database.counts();
    let manifest = database.manifest()?;
    let list = |names: gestus_core::blob::Names<'_>| names.iter().map(String::from).collect::<Vec<_>>();
    let joints: Vec<_> = (0..counts.joints).map(|j| database.joint(j)).collect();
    let classes: Vec<Value> = database
        .classes()
        .map(|c| {
            let [action, style] = class_names(&manifest, c);
            json!({
                "action": action, "style": style,
                "first_row": c.first_row, "rows": c.rows, "searchable": c.searchable, "k_cap": c.k_cap,
            })
        })
        .collect();
    let timing: Vec<Value> = (0..counts.timing)
        .map(|i| database.timing(i))
        .map(|t| json!({ "dof": t.dof, "pose": t.pose, "change": t.change }))
        .collect();
    Ok(json!({
        "builder": manifest.builder,
        "unit": manifest.unit,
        "rate_hz": database.rate_hz(),
        "joints": list(manifest.joints),
        "parents": joints.iter().map(|j| j.parent.map_or(-1, |p| p as i64)).collect::<Vec<_>>(),
        "offsets": joints.iter().map(|j| j.offset).collect::<Vec<_>>(),
        "mean_rotations": joints.iter().map(|j| j.mean).collect::<Vec<_>>(),
        "joint_groups": joints.iter().map(|j| j.group).collect::<Vec<_>>(),
        "groups": list(manifest.groups),
        "hips_line": database.hips_line(),
        "dofs": dof_names(manifest.joints.iter()),
        "ranges": database.dof_ranges().collect::<Vec<_>>(),
        "scales": (0..counts.dofs).map(|d| database.scale(d)).collect::<Vec<_>>(),
        "feature_scales": (0..counts.features).map(|f| database.feature_scale(f)).collect::<Vec<_>>(),
        "feature_groups": (0..counts.features).map(|f| database.feature_group(f)).collect::<Vec<_>>(),
        "window": counts.window,
        "timing": timing,
        "phase": phase::manifest(database),
        "actions": list(manifest.actions),
        "styles": list(manifest.styles),
        "classes": classes,
        "clips": list(manifest.clips),
        "licences": list(manifest.licences),
        "parameters": list(manifest.parameters),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_array_is_written_over_another() {
        let said = |styles: &[&str]| distinct(styles.iter().copied()).map_err(|e| e.to_string());
        assert_eq!(said(&["neutral", "proud", "prev", "x_y"]), Ok(()));
        for (styles, name) in [
            (["x/y", "x_y"], "output_x_y"),
            (["z", "prev_z"], "output_prev_z"),
            (["a\\b", "a/b"], "output_a_b"),
        ] {
            let message = said(&styles).unwrap_err();
            assert!(message.contains(&format!("`{}` and `{}`", styles[0], styles[1])), "{message}");
            assert!(message.contains(&format!("{name}.npy")), "{message}");
        }
    }
}
