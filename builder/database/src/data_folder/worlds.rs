//! Which way is up in a folder's clips: a database has Y up, so clips in another world are turned.
//!
//! A BVH file does not state it, but its body shows it ([`up`]); so does the body in a glTF file that was exported with
//! another axis up. A clip whose body does not show it, because it rolls for example, is taken to be like most of the
//! others. Heights of floors are measured along the clip's own up.

use std::collections::BTreeMap;

use gestus_motion::{capture::Document, clip::Clip};

use crate::retarget::{MapFile, axis, up};

/// Up in a clip's world.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Up {
    /// The format says that it is Y.
    Stated,
    /// The configuration says that axis, or the body shows it, with that sign.
    Known(usize, bool),
    /// The body shows none.
    Unknown,
}

impl Up {
    /// What the configuration or the format of a clip says, or its body shows. A body that walks decides, even against the
    /// format.
    pub fn of(document: &Document, clip: &Clip, told: Option<(usize, f64)>) -> Self {
        match told.or_else(|| up::believed(clip, &MapFile::default().of_document(document))) {
            Some((axis, sign)) => Self::Known(axis, sign > 0.0),
            None if document.has_y_up() => Self::Stated,
            None => Self::Unknown,
        }
    }

    fn axis(self) -> Option<(usize, bool)> {
        match self {
            Self::Known(axis, positive) => Some((axis, positive)),
            _ => None,
        }
    }
}

/// An axis as [`up`] has it.
fn signed((axis, positive): (usize, bool)) -> (usize, f64) {
    (axis, if positive { 1.0 } else { -1.0 })
}

/// Turns clips to Y up; returns which were turned, and what to tell.
pub(super) fn turn(clips: &mut [(&mut Clip, Up)]) -> (Vec<bool>, Option<String>) {
    let mut counts: BTreeMap<(usize, bool), usize> = BTreeMap::new();
    clips.iter().filter_map(|(_, up)| up.axis()).for_each(|axis| *counts.entry(axis).or_default() += 1);
    let usual = counts.iter().max_by_key(|(_, count)| **count).map(|(axis, _)| *axis);
    let mut turned = vec![false; clips.len()];
    let mut axes: BTreeMap<(usize, bool), usize> = BTreeMap::new();
    for ((clip, up), turned) in clips.iter_mut().zip(&mut turned) {
        let axis = if *up == Up::Stated { None } else { up.axis().or(usual) };
        let Some((axis, positive)) = axis.filter(|axis| *axis != (1, true)) else { continue };
        let world = axis::to_y(signed((axis, positive)));
        clip.frames.iter_mut().for_each(|frame| *frame = up::lifted(frame, &world));
        *turned = true;
        *axes.entry((axis, positive)).or_default() += 1;
    }
    let said =
        axes.iter().map(|(&axis, count)| format!("{count} clips have {} up", axis::name(signed(axis))));
    let said: Vec<String> = said.collect();
    let note = (!said.is_empty()).then(|| format!("{}: turned to y", said.join(", ")));
    (turned, note)
}
