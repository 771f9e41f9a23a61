//! Retargeting of other skeletons made from generated motion, so that the truth is known.

mod bodies;
mod checks;
#[path = "../common/mod.rs"]
mod common;
mod foreign;
mod lying;
mod names;
mod shapes;
