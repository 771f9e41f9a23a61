//! Why no database suits a part.

use gestus_core::{BlobError, Method};
use thiserror::Error;

use super::chosen::Timed;

/// No database of these clips suits the part.
#[derive(Debug, Error)]
pub enum FitError {
    /// Too little RAM.
    #[error(
        "{board}: {joints} joints and {classes} classes take {needed} bytes of RAM (stylizer, link, stack{}), {} more than \
         the part has: {}",
        if *code_runs_from_ram { " and code" } else { "" },
        needed - have,
        ram_cure(*most_joints, *most_classes)
    )]
    Ram {
        /// The part.
        board: String,
        /// Joints of the database.
        joints: usize,
        /// Its classes.
        classes: usize,
        /// Bytes needed.
        needed: u64,
        /// Bytes of the part.
        have: u64,
        /// Whether the code is part of what is needed.
        code_runs_from_ram: bool,
        /// Most joints that would fit with as many classes, if that is a body.
        most_joints: Option<usize>,
        /// Most classes that would fit with as many joints.
        most_classes: Option<usize>,
    },
    /// Too little memory for the smallest database.
    #[error(
        "{board}: the smallest database of these clips takes {least} bytes, {} more than the {room} that the code leaves \
         free: use fewer --actions, --styles or --joints{}",
        least.saturating_sub(*room),
        if *has_models { "" } else { ", or build the models too: they have no frames" }
    )]
    Flash {
        /// The part.
        board: String,
        /// Bytes of the largest place.
        room: u64,
        /// Bytes of the smallest database.
        least: u64,
        /// Whether there are models that translate without frames.
        has_models: bool,
    },
    /// No method is fast enough.
    #[error(
        "{board}: nothing keeps {fps} frames a second on this part: by the estimate the fastest reaches {:.1} in its slowest \
         frame ({}): use fewer --actions, --styles or --joints, or a lower --fps{}",
        timed.iter().map(|t| t.estimate.worst.frames_per_second()[1]).fold(0.0, f64::max),
        listed(timed),
        if timed.iter().all(|t| t.method == Method::Mar) { ", or build the models too: they are faster" } else { "" }
    )]
    Time {
        /// The part.
        board: String,
        /// Frames a second that were wanted.
        fps: f64,
        /// Every method that was timed.
        timed: Vec<Timed>,
    },
    /// The database can't be built.
    #[error(transparent)]
    Build(#[from] anyhow::Error),
    /// A blob that was built does not open: a bug of the builder.
    #[error("the blob that was built does not open; this is a bug of the builder, please report it")]
    Blob(#[from] BlobError),
}

fn ram_cure(most_joints: Option<usize>, most_classes: Option<usize>) -> String {
    let joints = most_joints.map(|most| format!("keep {most} joints at most (--joints)"));
    let classes = most_classes.map(|most| format!("use {most} classes at most (--actions, --styles)"));
    let cures: Vec<String> = joints.into_iter().chain(classes).collect();
    if cures.is_empty() {
        "use fewer --joints, --actions and --styles, or a part with more RAM".to_owned()
    } else {
        cures.join(", or ")
    }
}

fn listed(timed: &[Timed]) -> String {
    let one = |t: &Timed| format!("{} {:.1}", t.name(), t.estimate.worst.frames_per_second()[1]);
    timed.iter().map(one).collect::<Vec<_>>().join("; ")
}
