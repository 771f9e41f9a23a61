//! Linear time-invariant models (Hsu 2005, section 4).
//!
//! Each joint is a separate system from the input's dofs to the output's ([`n4sid`]), which keeps the number of parameters
//! small. The root is two systems: posture (height and tilt), and motion (ground velocities and yaw rate), which also
//! gives the logarithm of the time warp (section 4.2). Inputs and outputs are normalised separately; an input angle that
//! hardly varies counts as constant. [`section`] encodes the models, `gestus_core::methods::linear` streams them, and
//! [`clip`] runs them over a whole clip.

pub mod clip;
pub mod n4sid;
pub mod section;

use gestus_core::blob::layout::dof;
use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::models::{
    correspond::Aligned,
    footplant::{self, Footplant},
};
use crate::registration::warp::STILL;
use gestus_motion::statistics::moments;
use n4sid::{Signal, System};

/// Least standard deviation for normalisation, radians, metres, and their rates; for angles of the input it is [`STILL`].
const MIN_DEVIATION: f64 = 1e-3;
/// Frames at the start of a stretch that are excluded because the state has not settled.
const UNSETTLED_S: f64 = 0.4;

/// A group of dofs with a system of its own.
#[derive(Debug, Clone)]
pub struct Unit {
    /// First input dof.
    pub first_input: usize,
    /// First output dof; D is the logarithm of the time warp.
    pub first_output: usize,
    /// The system between them, in normalised dofs.
    pub system: System,
}

/// A model of one output style.
#[derive(Debug, Clone)]
pub struct Model {
    /// Mean and standard deviation of each input dof. Shape `[D]`.
    pub inputs: Vec<(f64, f64)>,
    /// Mean and standard deviation of each output dof and of the logarithm of the time warp. Shape `[D + 1]`.
    pub outputs: Vec<(f64, f64)>,
    /// The units.
    pub units: Vec<Unit>,
    /// When the left and the right foot stand, by the states.
    pub feet: [Footplant; 2],
}

impl Model {
    /// States of all units.
    pub fn states(&self) -> usize {
        self.units.iter().map(|u| u.system.order()).sum()
    }

    /// Whether every number is one that the format holds, and every unit comes to rest.
    pub fn is_usable(&self) -> bool {
        let fits = |v: &f64| v.abs() < 9e3;
        let feet = self.feet.iter().all(|f| f.projection.iter().chain([&f.boundary]).all(|v| v.abs() < 9e5));
        let moments = self.inputs.iter().chain(&self.outputs).all(|(m, s)| m.abs() < 9e2 && *s < 9e2);
        feet && moments
            && self.units.iter().all(|u| {
                let System { a, b, c, d } = &u.system;
                [a, b, c, d].iter().all(|m| m.iter().all(fits)) && is_stable(a)
            })
    }
}

/// True if every pole lies inside the unit circle by the core's test, in the core's precision. A blob that fails it does
/// not open.
fn is_stable(a: &DMatrix<f64>) -> bool {
    let mut power = a.map(|v| v as f32);
    for _ in 0..10 {
        power = &power * &power;
    }
    (0.0..=1.0).contains(&power.iter().map(|v| v * v).sum::<f32>())
}

/// Inputs and outputs of the units of a body with D dofs: first and number of each.
fn units(dofs: usize) -> Vec<[usize; 4]> {
    let rates = dof::JOINTS - dof::FORWARD;
    let root = [
        [0, dof::FORWARD, 0, dof::FORWARD],
        [dof::FORWARD, rates, dof::FORWARD, rates],
        [dof::FORWARD, rates, dofs, 1],
    ];
    let joints = (dof::JOINTS..dofs).step_by(3).map(|d| [d, 3, d, 3]);
    root.into_iter().chain(joints).collect()
}

/// Estimates a model from stretches of input and output. What input of other styles does when the output's feet stand is
/// learned from `others`, pairs of any input style.
///
/// `None` if there are too few frames, or no stretch is long enough for the state to settle. Cost: for each unit, one
/// product of a Hankel matrix with its transpose.
pub fn estimate(
    stretches: &[Aligned],
    others: &[Aligned],
    rate_hz: f64,
    options: &n4sid::Options,
) -> Option<Model> {
    let dofs = stretches.first()?.inputs.first()?.len();
    let column = |d: usize| stretches.iter().flat_map(move |s| s.inputs.iter().map(move |r| r[d]));
    let output = |d: usize| stretches.iter().flat_map(move |s| s.outputs.iter().map(move |r| r[d]));
    let inputs: Vec<(f64, f64)> = (0..dofs).map(|d| moments(column(d), least(d))).collect();
    let outputs: Vec<(f64, f64)> = (0..=dofs).map(|d| moments(output(d), MIN_DEVIATION)).collect();
    let settled = (UNSETTLED_S * rate_hz) as usize;
    let found: Vec<(Unit, Vec<DMatrix<f64>>)> = units(dofs)
        .into_par_iter()
        .map(|[first_input, m, first_output, p]| {
            let signals: Vec<Signal> = stretches
                .iter()
                .map(|s| Signal {
                    u: normalised(&s.inputs, first_input, m, &inputs),
                    y: normalised(&s.outputs, first_output, p, &outputs),
                })
                .collect();
            let system = n4sid::estimate(&signals, settled, options)?;
            let of_others = others.iter().map(|s| normalised(&s.inputs, first_input, m, &inputs));
            let all = signals.into_iter().map(|signal| signal.u).chain(of_others);
            let states = all.map(|u| system.states(&u)).collect();
            Some((Unit { first_input, first_output, system }, states))
        })
        .collect::<Option<_>>()?;
    let (units, states): (Vec<Unit>, Vec<_>) = found.into_iter().unzip();
    let (mut features, mut contacts) = (Vec::new(), Vec::new());
    for (s, stretch) in stretches.iter().chain(others).enumerate() {
        for t in settled.min(stretch.inputs.len())..stretch.inputs.len() {
            features.push(
                states
                    .iter()
                    .flat_map(|unit| unit[s].column(t).iter().copied().collect::<Vec<_>>())
                    .collect(),
            );
            contacts.push(stretch.contacts[t]);
        }
    }
    if features.is_empty() {
        return None;
    }
    let feet = [0, 1].map(|side| {
        let stands: Vec<bool> = contacts.iter().map(|c| c[side]).collect();
        footplant::fit(&features, &stands)
    });
    Some(Model { inputs, outputs, units, feet })
}

/// Least standard deviation of an input dof.
///
/// Captured knees deviate from one axis by a thousandth of a radian; another body or a sensor deviates by degrees. That
/// would be a hundred standard deviations: every frame would be unexpected, and the input be passed through. So angles
/// that vary by less than [`STILL`] count as constant. With 1e-3 rad, 100% of a CMU walk retargeted to Bandai-Namco's
/// body was blended in, with 0.02 84%, with 0.05 9%; the model alone was off the input by up to 7.7 rad with 1e-3, and
/// 1.1 rad with 0.05.
fn least(dof: usize) -> f64 {
    let is_angle = dof != dof::HEIGHT && !(dof::FORWARD..dof::JOINTS).contains(&dof);
    if is_angle { STILL } else { MIN_DEVIATION }
}

/// Some dofs of rows, normalised. Shape `[dofs x frames]`.
fn normalised(rows: &[Vec<f64>], first: usize, count: usize, moments: &[(f64, f64)]) -> DMatrix<f64> {
    DMatrix::from_fn(count, rows.len(), |d, t| {
        let (mean, deviation) = moments[first + d];
        (rows[t][first + d] - mean) / deviation
    })
}

#[cfg(test)]
mod tests {
    use gestus_core::Database;

    use super::*;
    use crate::{
        build::{BuildOptions, build},
        synth,
    };
    use gestus_motion::corpus::Cycle;

    #[test]
    fn what_does_not_come_to_rest_is_not_usable() {
        let system = |pole: f64| DMatrix::from_row_slice(2, 2, &[pole, 0.3, 0.0, 0.5]);
        assert!(is_stable(&system(0.99)) && is_stable(&DMatrix::zeros(0, 0)));
        assert!(!is_stable(&system(1.01)) && !is_stable(&system(-1.2)) && !is_stable(&system(9e3)));
    }

    #[test]
    fn clips_of_any_length_give_a_database_that_opens() {
        let whole = synth::corpus(&synth::Options {
            actions: vec!["punch".into()],
            styles: vec!["neutral".into(), "proud".into()],
            clips: 2,
            ..synth::Options::default()
        })
        .unwrap();
        for frames in [3, 5, 8, 12, 16, 20] {
            let mut corpus = whole.clone();
            for example in &mut corpus.examples {
                example.clip.frames.truncate(frames);
                example.contacts.truncate(frames);
                example.cycles = vec![Cycle { knots: vec![0.0, (frames - 1) as f64] }];
            }
            let built = build(&corpus, &BuildOptions::default()).unwrap_or_else(|e| panic!("{frames}: {e}"));
            Database::open(&built.bytes).unwrap_or_else(|e| panic!("{frames}: {e}"));
        }
    }
}
