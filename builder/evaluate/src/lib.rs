//! Measures of Gestus: pose and timing errors, variability, contacts, search and more, with baselines to compare with.
//!
//! There are no recorded pairs. The truth for a test clip is a held-out clip of the output style, matched in speed and yaw
//! rate and compared at equal canonical time. The distance between two such clips is the floor of the errors.
//! `docs/METRICS.md` defines every figure.
//!
//! A measure of [`measures`] takes an [`experiment`], holds clips out ([`fold`]), runs the core and the [`baselines`]
//! on them, and compares with [`metrics`]; the [`evaluation`] it returns is written as tables and pages by [`report`],
//! [`plots`] and [`pages`].

pub mod baselines;
pub mod evaluation;
pub mod experiment;
pub mod fold;
pub mod measures;
pub mod metrics;
pub mod outside;
pub mod pages;
pub mod plots;
pub mod report;
