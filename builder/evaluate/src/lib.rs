//! Gestus evaluate: how near to the truth an output is, how lively, how well timed; each method beside the others.
//!
//! There are no recorded pairs, so the truth for a clip is a held-out clip of the output style, matched in speed
//! and turn, compared at equal canonical time; its own variability is the floor. `docs/METRICS.md` defines every
//! figure.
//!
//! A measure of [`measures`] takes an [`experiment`], holds clips out ([`fold`]), runs the core and the [`baselines`] on them, and compares with
//! [`metrics`]; the [`evaluation`] it returns is written as tables and pages by [`report`], [`plots`] and [`pages`].

pub mod baselines;
pub mod evaluation;
pub mod experiment;
pub mod fold;
pub mod measures;
pub mod metrics;
pub mod pages;
pub mod plots;
pub mod report;
