//! The parameters of a stylizer. Every default was measured: see `docs/experiments/parameters.md` and `gestus evaluate
//! ablation`.
//!
//! [`parameters`] is the one table of them: [`Config`], the link, the C interface and the command line are made from it.

mod choice;
pub mod parameters;
mod refusal;

pub use choice::{Method, Ridge, Safety, Timing, Value, Yaw};
pub use parameters::Config;

use crate::{ConfigError, error::saturating_u16, search::graph::POOL};

impl Config {
    /// The shipped defaults.
    pub const fn new() -> Self {
        Self::DEFAULTS
    }

    /// The constants that Xia 2015 states (K 40, δ 0.7, ρ 0.7), κ 2, and little of what is ours: no interval of the
    /// output, no settling, no following of clips, no rest for a body that stands, no range of joints; every input is given
    /// the style. A frame still drops classes with 0.001 of the weight, and mixes four at most.
    pub const fn paper() -> Self {
        Self::new()
            .k(40)
            .delta(0.7)
            .prune(0.001)
            .kappa(2.0)
            .rho(0.7)
            .output_kappa(1e6)
            .still_speed(0.0)
            .trust(0.0)
            .liveliness(0.0)
            .settle_s(0.0)
            .follow(0.0)
            .joint_margin(0.0)
    }

    /// The ridge on normalised variables, for pairs that were recorded or made as pairs. A small λ lets the slopes among
    /// the neighbors count; a heavier penalty on the feedback forgets an error within a second all the same; K is 40,
    /// because slopes take more examples than means do. Beyond the paper.
    pub const fn normalised() -> Self {
        Self::new().k(40).prune(0.01).ridge(Ridge::Normalised).lambda(0.1).feedback(30.0).kappa(4.0).rho(0.7)
    }

    /// Checks every parameter, for a stylizer with a capacity of that many neighbors.
    #[inline]
    pub(crate) fn check(&self, neighbors: usize) -> Result<(), ConfigError> {
        let have = neighbors.min(POOL);
        if !(1..=have).contains(&usize::from(self.k)) {
            return Err(ConfigError::Neighbors { need: self.k, have: saturating_u16(have) });
        }
        match parameters::out_of_range(self) {
            Some(number) => Err(ConfigError::Parameter { number }),
            None => Ok(()),
        }
    }
}

impl Default for Config {
    fn default() -> Self {
        Self::new()
    }
}
