//! Gestus motion: skeletons, poses and clips, and their file formats.
//!
//! [`formats`] reads and writes files, [`capture`] finds them in a folder, [`files`] opens and replaces them. The
//! content of a file is an [`animation`]; a [`binding`] converts it to a [`clip`], in metres, Y up. [`names`] knows
//! what tools call joints, [`landmarks`] finds hips, knees and feet in a skeleton, [`body`] converts poses to degrees
//! of freedom, [`joints`] removes joints, [`corpus`] holds clips with their labels, contacts and cycles, and
//! [`statistics`] has means, deviations, quantiles and correlations.

pub mod animation;
pub mod binding;
pub mod body;
pub mod capture;
pub mod clip;
pub mod corpus;
pub mod euler;
pub mod files;
mod format;
pub mod formats;
mod height;
pub mod joints;
pub mod landmarks;
pub mod names;
pub mod statistics;
pub mod unit;
