//! Options of building a database, and its errors.

use std::ops::RangeInclusive;

use gestus_core::{BlobError, blob::layout::MAX_FEATURES};
use gestus_motion::{corpus::Unknown, landmarks::LandmarkError};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::{
    pairing::Scheme,
    search::groups::{Chosen, GroupError},
};

/// Options of building a database.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BuildOptions {
    /// How output cycles are chosen.
    pub pairing: Scheme,
    /// Frames of the query window.
    pub window: usize,
    /// Mean joint error that packing may cause, centimetres.
    pub error_cm: f64,
    /// Most principal components of a feature, 1 to 32.
    pub features: usize,
    /// Most cycles of a class that are kept, those that stand for the others best; all if 0.
    pub cycles: usize,
    /// Whether frames have edges to similar ones, 16 bytes a frame. Without, a search goes along time alone: it finds fewer
    /// of the nearest frames, and the output is as near to the truth.
    pub graph: bool,
    /// Greatest size of the file: rows, features and cycles are chosen so that it is kept, without a graph; no limit if 0.
    pub bytes: usize,
    /// Rows of a block.
    pub block_rows: usize,
    /// Whether linear models and statistics are built too.
    pub models: bool,
    /// The models' input style; by default `normal` or `neutral`, or else the first.
    pub from: Option<String>,
    /// Whether each action gets a model and a table of its own, besides those of all actions.
    pub models_by_action: bool,
    /// Whether iterative motion warping refines the correspondence of gaits for the linear models.
    pub warp_gaits: bool,
    /// Iterations from the recursive mean of rotations towards the geodesic mean, in the tables of statistics.
    pub mean_rounds: usize,
    /// Joint groups by name, each with its joints ([`crate::search::groups`]); the two arms if empty.
    pub groups: Chosen,
    /// Name of the file of the character that the clips were retargeted to, for the manifest; empty if there is none.
    #[serde(skip)]
    pub rig: String,
}

impl BuildOptions {
    /// What [`error_cm`](Self::error_cm) may be.
    pub const ERRORS_CM: RangeInclusive<f64> = 1e-4..=10.0;
    /// What [`features`](Self::features) may be.
    pub const FEATURES: RangeInclusive<usize> = 1..=MAX_FEATURES;
}

impl Default for BuildOptions {
    fn default() -> Self {
        Self {
            pairing: Scheme::default(),
            window: 5,
            error_cm: 0.045,
            features: MAX_FEATURES,
            cycles: 0,
            graph: true,
            bytes: 0,
            block_rows: 32,
            models: true,
            from: None,
            models_by_action: false,
            warp_gaits: false,
            mean_rounds: 0,
            groups: Chosen::new(),
            rig: String::new(),
        }
    }
}

/// A corpus that can't be built.
#[derive(Debug, Error)]
pub enum BuildError {
    /// The skeleton.
    #[error(transparent)]
    Landmark(#[from] LandmarkError),
    /// The joint groups.
    #[error(transparent)]
    Groups(#[from] GroupError),
    /// A number that is too large to be stored.
    #[error("{clip}, frame {frame}: {dof} is {value}, more than can be stored: is the clip broken there?")]
    TooLarge {
        /// The clip.
        clip: String,
        /// The frame in it, from 0.
        frame: usize,
        /// Name of the dof.
        dof: String,
        /// The number.
        value: f32,
    },
    /// More of something than the format holds.
    #[error("{what}: {have}, and the format holds {most}: {cure}")]
    TooMany {
        /// What there is too much of.
        what: String,
        /// Number.
        have: usize,
        /// Greatest number.
        most: usize,
        /// What to do.
        cure: &'static str,
    },
    /// One cycle of each class is more than the wanted size.
    #[error(
        "{wanted} bytes are too few: these clips take {least} at least (leave out actions, styles or the models)"
    )]
    Size {
        /// Wanted bytes.
        wanted: usize,
        /// Least bytes.
        least: usize,
    },
    /// The models' input style is unknown.
    #[error("the models' input style: {0}")]
    From(Unknown),
    /// No action exists in every style.
    #[error(
        "not every style has an output ({0}): a frame needs an output in each; choose --actions and --styles that are complete"
    )]
    Unpaired(String),
    /// The blob does not open: a bug of the builder.
    #[error("the blob that was built does not open; this is a bug of the builder, please report it")]
    Blob(#[from] BlobError),
}

impl BuildError {
    pub(super) fn too_many(what: impl Into<String>, have: usize, most: usize, cure: &'static str) -> Self {
        Self::TooMany { what: what.into(), have, most, cure }
    }
}
