//! Reduces a blob to its models, for boards without memory for frames.
//!
//! The result has names and licences, skeleton, dofs, and the sections of the models. All counts of frames are 0 and all
//! sections of frames are empty, so that the same checks apply as to any other blob.

use anyhow::{Result, bail};
use gestus_core::{
    Database, Method,
    blob::{
        Class, Counts, Manifest, Names,
        layout::{
            class,
            section::{self, Kept},
        },
    },
};

use crate::blob::assemble::{Section, assemble};

/// A blob with the models of a database alone. Licences are kept, since models derive from the clips.
///
/// # Errors
/// A database without a model that translates by itself.
pub fn models_only(database: &Database<'_>) -> Result<Vec<u8>> {
    models_of(database, &Method::ALL)
}

/// The same with the models of some methods.
///
/// # Errors
/// A database with none of them.
pub fn models_of(database: &Database<'_>, methods: &[Method]) -> Result<Vec<u8>> {
    if !methods.iter().any(|method| method.section().is_some() && method.is_available_in(database)) {
        bail!("it holds no model that translates by itself: build it without --no-models");
    }
    let by_phase = database.has_phase() && methods.contains(&Method::Phase);
    let is_left_out = |id: u16| Method::ALL.iter().any(|m| m.section() == Some(id) && !methods.contains(m));
    let is_kept = |id: u16| match section::kept_by_cut(id) {
        Kept::Always => !is_left_out(id),
        Kept::WithPhase => by_phase,
        Kept::Never => false,
    };
    let manifest = Manifest { clips: Names(""), ..database.manifest()? };
    let required = database.sections().into_iter().map(|(id, bytes)| -> Result<Section> {
        Ok(match id {
            _ if !is_kept(id) => (id, Vec::new()),
            section::MANIFEST => (id, postcard::to_stdvec(&manifest)?),
            section::CLASSES => (id, database.classes().flat_map(|c| labels(&c)).collect()),
            _ => (id, bytes.to_vec()),
        })
    });
    let mut sections = required.collect::<Result<Vec<Section>>>()?;
    let optional = database.optional_sections().filter(|(id, _)| is_kept(*id));
    sections.extend(optional.map(|(id, bytes)| (id, bytes.to_vec())));
    let have = *database.counts();
    let only = |count: usize| if by_phase { count } else { 0 };
    let counts = Counts {
        frames: 0,
        rows: 0,
        features: only(have.features),
        window: only(have.window),
        classes: only(have.classes),
        timing: 0,
        cycles: 0,
        clips: 0,
        ..have
    };
    let bytes = assemble(&counts, f64::from(database.rate_hz()), &sections);
    Database::open(&bytes)?;
    Ok(bytes)
}

/// The record of a class without frames.
fn labels(of: &Class) -> [u8; class::LENGTH] {
    let mut record = [0; class::LENGTH];
    record[class::ACTION].copy_from_slice(&of.action.to_le_bytes());
    record[class::STYLE].copy_from_slice(&of.style.to_le_bytes());
    record
}
