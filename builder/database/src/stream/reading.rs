//! The reading of a clip for a database: its unit and its hips, where those of the database's body fit.

use std::path::Path;

use anyhow::{Context, Result};
use gestus_core::Database;
use gestus_motion::{
    animation::Recording,
    binding::{Binding, ConvertError, Options},
    body::database_skeleton,
    capture::{self, Document},
    clip::{Clip, Skeleton},
    unit::Unit,
};

use crate::stream::body_mapping::same_body;

/// Reads a motion file for a database: the document, its binding, and the clip at its own rate.
///
/// Without a unit, the one is used in which the body has the size of the database's, or else a guess by an adult's height.
/// `hips` is the joint to take as the hips, where that is stated and the joint carries the body: has a place of its own in
/// each frame.
///
/// # Errors
/// Where it can't be read.
pub fn read_clip(
    path: &Path,
    database: &Database<'_>,
    unit: Option<Unit>,
    hips: Option<&String>,
) -> Result<(Document, Binding, Clip)> {
    bind(capture::read(path)?, path, database, unit, hips)
}

/// [`read_clip`] for a document that was read before.
pub(super) fn bind(
    document: Document,
    path: &Path,
    database: &Database<'_>,
    unit: Option<Unit>,
    hips: Option<&String>,
) -> Result<(Document, Binding, Clip)> {
    let name = path.display();
    let target = database_skeleton(database);
    let carries = |root: &String| document.joints().iter().any(|j| j.name == *root && j.moves == [true; 3]);
    let hips = hips.filter(|hips| carries(hips));
    let mut binding = binding_of(&document, unit, hips, &target).with_context(|| name.to_string())?;
    // A joint that carries the hips may be animated, as Biped's is; they carry its motion if they move themselves.
    let root = target.names.first().filter(|root| binding.skeleton().names.first() != Some(root));
    if let Some(root) = root.filter(|root| hips.is_none() && carries(root)) {
        let other = binding_of(&document, unit, Some(root), &target).with_context(|| name.to_string())?;
        if same_body(other.skeleton(), &target).is_some() {
            binding = other;
        }
    }
    let mut clip = binding.to_clip(&document).with_context(|| name.to_string())?;
    clip.name = path.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    Ok((document, binding, clip))
}

/// The binding of a document from that joint on, in the unit in which its body is the database's, if there is one.
fn binding_of(
    document: &Document,
    unit: Option<Unit>,
    root: Option<&String>,
    database: &Skeleton,
) -> Result<Binding, ConvertError> {
    let bound = |unit| Binding::new(document, &Options { unit, root: root.cloned() });
    let binding = bound(unit)?;
    match unit_of_database_body(&binding, database).filter(|_| unit.is_none()) {
        Some(unit) => bound(Some(unit)),
        None => Ok(binding),
    }
}

/// The unit in which a body has the size of the database's, if it is not the guessed one.
fn unit_of_database_body(guessed: &Binding, database: &Skeleton) -> Option<Unit> {
    let fits_database = |unit: &Unit| {
        let scale = unit.metres() / guessed.unit().metres();
        let offsets = guessed.skeleton().offsets.iter().map(|offset| offset * scale).collect();
        same_body(&Skeleton { offsets, ..(**guessed.skeleton()).clone() }, database).is_some()
    };
    if fits_database(&guessed.unit()) { None } else { Unit::KNOWN.into_iter().find(fits_database) }
}
