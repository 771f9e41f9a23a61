//! From the predicted pose to the output: foot lock, speed limit, rest, timing and trust; and a cap on the cost of a frame.

pub mod foot_lock;
pub(crate) mod joint_range;
pub mod retime;
pub mod speed_limit;
pub mod stillness;
pub mod trust;
pub mod visit_cap;
