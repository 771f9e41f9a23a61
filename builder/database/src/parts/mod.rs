//! Estimates for real parts, by arithmetic instead of emulation: does a database fit, and at how many frames a second?
//!
//! [`table`] lists the parts, [`names`] finds one. [`cost`] models the instructions of a step from its counts, with the
//! costs a unit of work in [`calibration`]. [`worst`] bounds the instructions of any step, [`state`] is the stylizer's RAM,
//! and [`estimate`] combines them. [`choose`] chooses a database for a part by all of these, [`chosen`] tells what, and
//! [`error`] why there is none.

pub mod calibration;
pub mod choose;
pub mod chosen;
pub mod cost;
pub mod error;
pub mod estimate;
pub mod names;
pub mod state;
pub mod table;
pub mod worst;

pub use estimate::{Estimate, Stream};
pub use table::{PARTS, Part};
