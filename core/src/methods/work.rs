//! An upper bound on the work of a step, for any stream, known before the first pose.
//!
//! Every loop of a step ends after a number of rounds that follows from the database and the current settings. [`Work`] has
//! these numbers; each method computes its own (`methods::context::Translate::worst_step`). `gestus-sim`
//! multiplies them by instructions a unit (`docs/PORTING.md`, "The worst frame"). Tests and a fuzz target compare
//! them with the counted work of steps.

use crate::{
    blob::{
        Class, Database,
        layout::{MAX_GROUPS, MAX_STYLES},
    },
    error::saturating_u32,
    stylizer::style_mix::{MAX_GROUP_STYLES, Settings},
};

/// Counts of the work of a step. Those that do not apply to a method are 0.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Work {
    /// Classes that are searched, or compared with the input.
    pub searched: u32,
    /// Distances computed ([`Report::visits`](crate::Report::visits)).
    pub distances: u32,
    /// Occupied slots that are probed in the visited sets. Rows chosen to collide take that many; those of a blob from the
    /// builder take hundreds a class.
    pub collisions: u32,
    /// Rows that are passed while the neighbors of the last searches are followed to the current frame.
    pub followed: u32,
    /// Classes that are unpacked, once for each mix of output styles.
    pub classes: u32,
    /// Examples that are unpacked and fitted, once for each mix.
    pub examples: u32,
    /// Examples that vote on which foot stands.
    pub voters: u32,
    /// Different mixes of output styles: the body's, and those of joint groups.
    pub mixes: u32,
    /// Outputs of an example in all mixes together: one for each style of a mix, two where the database has two
    /// counterparts a style.
    pub outputs: u32,
    /// Bytes of the blob's features, graph, rows, tables and models that are read
    /// ([`Report::bytes_read`](crate::Report::bytes_read)).
    pub bytes_read: u32,
}

/// The settings on which the work of a step depends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Load {
    /// Label of the input's action.
    pub action: Option<u16>,
    /// Label of the input's style.
    pub input_style: Option<u16>,
    /// Different mixes of output styles.
    pub mixes: u32,
    /// Output styles of each mix, all mixes together.
    pub styles: u32,
}

impl Load {
    /// The settings that cost most: no labels, every style in the body's mix, and a mix of its own for every other
    /// joint group.
    pub fn heaviest(database: &Database<'_>) -> Self {
        let styles = saturating_u32(database.counts().styles.min(MAX_STYLES));
        let other_groups = saturating_u32(database.counts().groups.min(MAX_GROUPS)).saturating_sub(1);
        Self {
            action: None,
            input_style: None,
            mixes: other_groups + 1,
            styles: styles + other_groups * styles.min(saturating_u32(MAX_GROUP_STYLES)),
        }
    }

    /// The load of the current settings.
    pub(crate) fn of(settings: &Settings, database: &Database<'_>) -> Self {
        let mixes = (0..=database.counts().groups).filter(|&mix| settings.uses_mix(database, mix));
        let none = Self { action: settings.action, input_style: settings.input_style, mixes: 0, styles: 0 };
        mixes.fold(none, |load, mix| {
            let styles = settings.mix(mix).weighted(database.counts().styles).count();
            Self { mixes: load.mixes + 1, styles: load.styles + saturating_u32(styles), ..load }
        })
    }

    /// The classes that the labels allow.
    pub(crate) fn classes(&self, database: &Database<'_>) -> impl Iterator<Item = (usize, Class)> {
        database.classes().enumerate().filter(|(_, class)| class.has(self.action, self.input_style))
    }
}
