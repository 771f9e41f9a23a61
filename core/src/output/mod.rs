//! From the predicted pose to the one that leaves: feet, speed and time; and what a frame may cost.

pub mod foot_lock;
pub mod retime;
pub mod speed_limit;
pub mod visit_cap;
