//! A look inside a step, for those who check it: `gestus translate --trace`, and tests.
//!
//! Every method does nothing by default: a step without an observer costs nothing.

use crate::{
    body::pose::Dofs,
    search::{found::Found, query::Feature},
};

/// A part of the work of a step, for its cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Stage {
    /// Window of poses to search feature ([`crate::search::query`]).
    Query,
    /// Nearest frames in every class ([`crate::search::graph`]).
    Search,
    /// Rows of the neighbors and their counterparts unpacked (`crate::methods::mixture::examples`).
    Decode,
    /// Sums and solves ([`crate::methods::mixture::regression`]).
    Regression,
    /// Time step ([`crate::methods::mixture::step_time`]).
    Timing,
    /// Pose to dofs and back, proportions of the classes, and what no other stage is.
    Rest,
    /// Votes of the neighbors' legs on which foot stands ([`crate::methods::mixture::contact_votes`]).
    Contacts,
    /// Feet held where they stand ([`crate::output::foot_lock`], [`crate::body::two_bone_ik`]).
    Lock,
}

impl Stage {
    /// Every stage, by name, in the order of their numbers (`stage as usize`).
    pub const NAMES: [&'static str; 8] =
        ["query", "search", "decode", "regression", "timing", "rest", "contacts", "lock"];

    /// Every stage, in the order of their numbers.
    pub const ALL: [Self; Self::NAMES.len()] = [
        Self::Query,
        Self::Search,
        Self::Decode,
        Self::Regression,
        Self::Timing,
        Self::Rest,
        Self::Contacts,
        Self::Lock,
    ];
}

/// Sees what a step computes, in the order in which it does.
pub trait Observer<const J: usize> {
    /// From here on the work is of that stage. A step begins with [`Stage::Rest`], which is not announced; stages
    /// come more than once, decode and regression in turns for every neighbor.
    #[inline(always)]
    fn stage(&mut self, _stage: Stage) {}
    /// The query.
    fn query(&mut self, _feature: &Feature) {}
    /// What was found of a class.
    fn searched(&mut self, _class: usize, _found: &Found<'_>) {}
    /// The neighbors of a kept class in the order in which the timing weighs them, and their weights.
    fn timed(&mut self, _class: usize, _rows: &[u16], _weights: &[f32]) {}
    /// The variables of the frame, and what was predicted (after yaw and strength).
    fn predicted(&mut self, _x: &Dofs<J>, _x_prev: &Dofs<J>, _y_prev: &Dofs<J>, _predicted: &Dofs<J>) {}
}

impl<const J: usize> Observer<J> for () {}
