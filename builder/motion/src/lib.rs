//! Gestus motion: skeletons, poses and clips, and the files that they come from.
//!
//! [`formats`] reads and writes the files, [`capture`] finds them in a folder. What a file holds is an [`animation`]; a
//! [`binding`] turns that into a [`clip`], in metres, Y up. [`landmarks`] finds hips, knees and feet in a skeleton, [`body`] turns poses into degrees of freedom,
//! [`joints`] leaves joints out, and [`corpus`] holds clips with their labels, contacts and cycles.

pub mod animation;
pub mod binding;
pub mod body;
pub mod capture;
pub mod clip;
pub mod corpus;
pub mod euler;
pub mod formats;
pub mod joints;
pub mod landmarks;
pub mod unit;
