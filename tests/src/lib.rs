//! Whole-system tests of Gestus; helpers that they share.
//!
//! [`motion`] generates walks and databases of them, [`trace`] records what a stream computes, [`mod@reference`] computes
//! the same slowly in `f64`, [`patch`] changes bytes of a blob and repairs its checksums, [`real_clips`]
//! finds captured motion.

pub mod motion;
pub mod patch;
pub mod real_clips;
pub mod reference;
pub mod trace;
