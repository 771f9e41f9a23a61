//! Translation by tables: the mean motion and the mean output of each class at every phase of its cycle, without frames.
//! `step` calls the rest in the order of a frame.

mod curve;
mod mix;
mod settle;
pub(crate) mod step;
mod track;
