//! Methods that the core does not have, to compare it with.

pub mod gaussian_process;
pub mod models;
pub mod outputs;
