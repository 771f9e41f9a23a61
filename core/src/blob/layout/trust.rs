//! Per class: how near input of its kind is to the class's frames, and how fast it goes. Input beyond that is not of the
//! database's kind. And how fast the class's joints turn, which limits the first second of an output in its style.

use core::ops::Range;

/// Mean squared distance of the nearest frames of other clips, of which 90% of the class's frames have less, f32,
/// weighted square metres; 0 where the builder could not tell.
pub const FAR: Range<usize> = 0..4;
/// Least smoothed speed of the root over the ground, f32, m/s; negative backwards.
pub const SLOWEST: Range<usize> = 4..8;
/// Greatest smoothed speed of the root over the ground, f32, m/s; negative backwards.
pub const FASTEST: Range<usize> = 8..12;
/// Speed of the fastest joint, of which 99% of the class's frames have less, f32, rad/s; 0 where the builder could not
/// tell.
pub const TURNING: Range<usize> = 12..16;
/// Length of a class.
pub const LENGTH: usize = 16;
