//! A blob cut to its models: for boards that have no room for frames.
//!
//! What is left is what a method without frames reads: names and licences, skeleton, dofs, and the sections of the
//! models. Every count that is about frames is 0, and every section that is about frames is there and empty, so that
//! the blob is checked by the same rules as any other.

use anyhow::{Result, bail};
use gestus_core::{
    Database,
    blob::{Counts, Manifest, Names, layout::section},
};

use crate::blob::assemble::{Section, assemble};

/// The models of a database as a blob of their own. Licences stay: models are made of the clips too.
///
/// # Errors
/// Where the database holds no model that translates by itself.
pub fn models_only(database: &Database<'_>) -> Result<Vec<u8>> {
    if database.linear_from().is_none() && database.statistic_from().is_none() {
        bail!("it holds neither linear models nor statistics: build it without --no-models");
    }
    let manifest = Manifest { clips: Names(""), ..database.manifest()? };
    let required = database.sections().into_iter().map(|(id, bytes)| -> Result<Section> {
        Ok(match id {
            section::MANIFEST => (id, postcard::to_stdvec(&manifest)?),
            _ if section::is_kept_by_cut(id) => (id, bytes.to_vec()),
            _ => (id, Vec::new()),
        })
    });
    let mut sections = required.collect::<Result<Vec<Section>>>()?;
    let optional = database.optional_sections().filter(|(id, _)| section::is_kept_by_cut(*id));
    sections.extend(optional.map(|(id, bytes)| (id, bytes.to_vec())));
    let counts = Counts {
        frames: 0,
        rows: 0,
        features: 0,
        window: 0,
        classes: 0,
        timing: 0,
        cycles: 0,
        clips: 0,
        ..*database.counts()
    };
    let bytes = assemble(&counts, f64::from(database.rate_hz()), &sections);
    Database::open(&bytes)?;
    Ok(bytes)
}
