//! Estimates for real parts, by arithmetic instead of emulation: does a database fit, and at how many frames a second?
//!
//! [`table`] lists the parts. [`cost`] models the instructions of a step from its counts, with the costs a unit of work
//! in [`calibration`]. [`worst`] bounds the instructions of any step, [`state`] is the stylizer's RAM, and [`estimate`]
//! combines them.

pub mod calibration;
pub mod cost;
pub mod estimate;
pub mod state;
pub mod table;
pub mod worst;

pub use estimate::{Estimate, Stream};
pub use table::{PARTS, Part};
