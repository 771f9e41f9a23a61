//! Methods that the core does not have, to compare it with.

pub mod clouds;
pub mod gaussian_process;
pub(crate) mod hsu;
pub mod local_ar;
pub mod models;
pub mod outputs;
