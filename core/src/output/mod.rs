//! From the predicted pose to the one that leaves: feet, speed, rest, time and trust; and what a frame may cost.

pub mod foot_lock;
pub mod retime;
pub mod speed_limit;
pub mod stillness;
pub mod trust;
pub mod visit_cap;
