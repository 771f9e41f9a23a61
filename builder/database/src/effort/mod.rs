//! Laban effort: style as a point in a space of three factors that people can perceive (Torresani, Hackney and Bregler,
//! "Learning Motion Style Synthesis from Perceptual Observations", NIPS 2006: "Torresani 2006" in the comments).
//!
//! Three factors, each from -3 to 3: **flow** from free to bound, **weight** from light to strong, **time** from
//! sustained to sudden (the signs are Laban's: the indulging poles are negative, the fighting ones positive).
//!
//! 1. [`fragment`]: clips are cut into fragments, each an action or a gait cycle;
//! 2. [`align`]: two fragments have the same content if they are near under dynamic time warping (eqs. 3 to 5);
//! 3. [`blend`]: such a pair is interpolated in space and time, by α from -0.25 to 1.25;
//! 4. [`labels`]: people label the Effort of fragments and blends; without labels, [`estimate`] estimates it;
//! 5. [`components`] and [`learn`]: a function from a pair ([`example`]), its Efforts and α to the blend's Effort, by linear
//!    interpolation, linear [`ridge`], kernel ridge or support vectors ([`support`]) (eqs. 6 and 7);
//! 6. [`stage`]: an input is segmented into known fragments by one-stage dynamic programming (eqs. 8 to 11);
//! 7. [`synthesize`]: each segment is replaced by the pair and α whose predicted Effort is nearest to the target (eq. 12).
//!
//! Beyond the paper, [`response`] measures the Effort of mixes of styles as the core synthesises them, and [`dial`] makes a
//! table of it from which the core interpolates style weights, so that a stream can have an Effort too. [`sheet`] writes
//! the form that people fill in.

pub mod align;
pub mod blend;
pub mod components;
pub mod dial;
pub mod estimate;
pub mod example;
pub mod fragment;
pub mod labels;
pub mod learn;
pub mod model;
pub mod outputs;
pub mod response;
pub mod ridge;
pub mod sheet;
pub mod stage;
pub mod support;
pub mod synthesize;

use crate::list::{self, ListError};

/// Flow, weight and time.
pub type Factors = [f64; 3];

/// Names of the factors, in order.
pub const NAMES: [&str; 3] = gestus_core::Effort::NAMES;

/// Greatest value of a factor; the least is its opposite.
pub const POLE: f64 = 3.0;

/// Least and greatest α: a little beyond the two fragments (Torresani 2006, section 7.2).
pub const ALPHA: (f64, f64) = (-0.25, 1.25);

/// Source of Efforts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// Estimated by kinematic descriptors.
    Estimated,
    /// Labelled by people.
    Given,
    /// A known function of the motion with noise, to evaluate learning.
    Generated,
}

impl Source {
    /// Its name in tables and JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Estimated => "estimated",
            Self::Given => "given",
            Self::Generated => "generated",
        }
    }
}

/// Reads `flow=1,weight=-0.5,time=2`; factors that are not named are `None`.
///
/// # Errors
/// An unknown factor, one that is given twice, a value that is not a number from -3 to 3, or an empty list.
pub fn parse(text: &str) -> Result<[Option<f64>; 3], ListError> {
    let expected = "a number from -3 to 3, as in flow=1,weight=-2,time=0.5";
    let mut factors = [None; 3];
    list::check_once(list::items(text).map(|item| item.name))?;
    for item in list::items(text) {
        let k = NAMES.iter().position(|n| *n == item.name);
        let k = k.ok_or_else(|| item.unknown(&NAMES.join(", ")))?;
        factors[k] = Some(item.number(-POLE..=POLE, expected)?);
    }
    if factors.iter().all(Option::is_none) {
        return Err(ListError::Missing { item: text.to_owned(), expected: expected.to_owned() });
    }
    Ok(factors)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_factors_and_refuses_what_is_none() {
        assert_eq!(parse("flow=1, weight=-0.5"), Ok([Some(1.0), Some(-0.5), None]));
        assert_eq!(parse("time=3"), Ok([None, None, Some(3.0)]));
        for bad in ["", "flow", "speed=1", "flow=x", "flow=3.1", "flow=nan", "flow=1,flow=2"] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }
}
