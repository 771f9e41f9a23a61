//! The mixture of local autoregressive models (Xia 2015, section 5), in the order of a frame: `step` calls the rest.

pub mod candidates;
pub mod contact_votes;
pub(crate) mod examples;
mod places;
pub mod regression;
pub mod ridge;
mod settle;
pub(crate) mod step;
pub mod step_time;
pub mod sums;
pub mod variables;
mod work;
