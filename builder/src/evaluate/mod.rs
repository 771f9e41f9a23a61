//! Measures: how near to the truth, how lively, how well timed; each method beside the others.
//!
//! There are no recorded pairs, so the truth for a clip is a held-out clip of the output style, matched in speed
//! and turn, compared at equal canonical time; its own variability is the floor. `docs/METRICS.md` defines every
//! figure.

pub mod loo;
pub mod methods;
pub mod metrics;
