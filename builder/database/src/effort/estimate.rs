//! Efforts estimated from motion, without labels.
//!
//! The literature ties each factor to a derivative of the joints' positions (Larboulette and Gibet, "A Review of
//! Computable Expressive Descriptors of Human Motion", MOCO 2015, section on Laban's Effort; before it Hachimura et al.
//! 2005 and Samadani et al. 2013):
//!
//! | factor | descriptor | unit before the logarithm |
//! |---|---|---|
//! | weight | greatest kinetic energy, `max over t of Σ_k |v_k(t)|²`, all masses 1 | m²/s² |
//! | time | mean acceleration, `1/T Σ_t Σ_k |a_k(t)|` | m/s² |
//! | flow | mean jerk, `1/T Σ_t Σ_k |j_k(t)|`, against speed and acceleration: `j v / a²` | 1 |
//!
//! Jerk alone adds little to acceleration, since a fast movement has more of all derivatives. The ratio `j v / a²` does not
//! change when a movement is made larger or faster, like dimensionless jerk (Hogan and Sternad, "Sensitivity of Smoothness
//! Measures", 2009). It is high for movement that is checked and corrected (bound), and low for movement that flows
//! (free).
//!
//! Factors are logarithms of descriptors, standardised over the fragments of an action and limited to -3 to 3 by [`held`].
//! So 0 is the usual value, for walks among walks. **These are estimates, and labelled so everywhere**: they agree with
//! observers only in part.
//!
//! Descriptors are computed over stretches about as long as a step of a walk; a longer motion has the mean over its
//! stretches, since the greatest energy of a motion grows with its length. So fragments, blends, whole clips and streams
//! are comparable.

use nalgebra::Vector3;

use crate::effort::{
    Factors, POLE,
    fragment::{Library, walk},
};
use gestus_motion::{
    body::Body,
    clip::Frame,
    statistics::{hermite, mean, moments, smooth},
};

/// Standard deviation of the smoothing before derivatives are taken, seconds: captures are noisy at 30 Hz.
const SMOOTH_S: f64 = 0.04;

/// Length of a stretch, seconds.
const STRETCH_S: f64 = 1.2;
/// Greatest distance between the starts of consecutive stretches, seconds.
const HOP_S: f64 = 0.1;
/// Start of a stream that is ignored, seconds: there the last output is a guess, and a foot that was held before the
/// root's speed was known is released with a jerk that is unrelated to style.
const SETTLE_S: f64 = 0.5;

/// Logarithms of the three descriptors of a stretch of motion, in the order of the factors. `None` for fewer than eight
/// frames.
pub fn descriptors(body: &Body, rows: &[Vec<f64>], rate_hz: f64) -> Option<Factors> {
    of_positions(&positions(body, rows, rate_hz), rate_hz)
}

/// Positions of the joints in the world, shape `[frames][J]`.
fn positions(body: &Body, rows: &[Vec<f64>], rate_hz: f64) -> Vec<Vec<Vector3<f64>>> {
    walk(body, rows, rate_hz).iter().map(|f| f.positions(&body.skeleton)).collect()
}

/// Means of the descriptors over stretches of joint positions. The stretches overlap and start every tenth of a second:
/// without overlap, all would shift and their number change if a clip were a frame longer. Shorter motion is one stretch.
fn of_stretches(positions: &[Vec<Vector3<f64>>], rate_hz: f64) -> Option<Factors> {
    let length = ((STRETCH_S * rate_hz).round() as usize).min(positions.len());
    let room = positions.len() - length;
    let hops = (room as f64 / (HOP_S * rate_hz)).ceil().max(1.0) as usize;
    let found: Vec<Factors> =
        (0..=hops).filter_map(|i| of_positions(&positions[i * room / hops..][..length], rate_hz)).collect();
    if found.is_empty() {
        return None;
    }
    Some(std::array::from_fn(|k| mean(found.iter().map(|d| d[k]))))
}

/// [`descriptors`] of joints' positions. They do not depend on position and heading.
fn of_positions(positions: &[Vec<Vector3<f64>>], rate_hz: f64) -> Option<Factors> {
    let count = positions.len();
    if count < 8 {
        return None;
    }
    let joints = positions[0].len();
    let mut energy = vec![0.0; count - 1];
    let (mut speed, mut acceleration, mut jerk) = (0.0, 0.0, 0.0);
    for j in 0..joints {
        let axis = |c: usize| -> Vec<f64> {
            smooth(&positions.iter().map(|p| p[j][c]).collect::<Vec<_>>(), SMOOTH_S * rate_hz)
        };
        let path = [axis(0), axis(1), axis(2)];
        let at = |t: usize| Vector3::new(path[0][t], path[1][t], path[2][t]);
        for t in 1..count {
            let v = (at(t) - at(t - 1)) * rate_hz;
            energy[t - 1] += v.norm_squared();
            speed += v.norm() / (count - 1) as f64;
        }
        for t in 2..count {
            let a = at(t) - at(t - 1) * 2.0 + at(t - 2);
            acceleration += a.norm() * rate_hz.powi(2) / (count - 2) as f64;
        }
        for t in 3..count {
            let j = at(t) - at(t - 1) * 3.0 + at(t - 2) * 3.0 - at(t - 3);
            jerk += j.norm() * rate_hz.powi(3) / (count - 3) as f64;
        }
    }
    let greatest = energy.iter().fold(0.0, |a: f64, &b| a.max(b));
    let ln = |v: f64| v.max(1e-9).ln();
    Some([ln(jerk) + ln(speed) - 2.0 * ln(acceleration), ln(greatest), ln(acceleration)])
}

/// A number limited monotonically to the poles: unchanged up to a magnitude of 2, compressed beyond.
pub fn held(value: f64) -> f64 {
    let beyond = (value.abs() - (POLE - 1.0)).max(0.0);
    value.signum() * ((value.abs() - beyond) + beyond / (1.0 + beyond))
}

/// Mean and standard deviation of each descriptor.
type Spread = [(f64, f64); 3];

/// Estimates factors of motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimator {
    /// By action; an action of fewer than four fragments has the whole library's.
    actions: Vec<Spread>,
    all: Spread,
}

impl Estimator {
    /// The spreads of a library.
    pub fn of(library: &Library) -> Self {
        use rayon::prelude::*;
        let found: Vec<(usize, Factors)> = library
            .fragments
            .par_iter()
            .filter_map(|f| {
                let ways = positions(&library.body, &f.rows, library.rate_hz);
                Some((f.action, of_stretches(&ways, library.rate_hz)?))
            })
            .collect();
        let all = spread(&found.iter().map(|f| f.1).collect::<Vec<_>>());
        let actions = (0..library.actions.len())
            .map(|a| {
                let own: Vec<Factors> = found.iter().filter(|f| f.0 == a).map(|f| f.1).collect();
                if own.len() < 4 { all } else { spread(&own) }
            })
            .collect();
        Self { actions, all }
    }

    /// The factors of descriptors; with `None`, relative to all actions.
    pub fn factors(&self, action: Option<usize>, descriptors: &Factors) -> Factors {
        let spread = action.and_then(|a| self.actions.get(a)).unwrap_or(&self.all);
        std::array::from_fn(|k| held((descriptors[k] - spread[k].0) / spread[k].1))
    }

    /// The estimated Effort of rows of dofs: a fragment, a blend, a whole clip. `None` where they are too short.
    pub fn estimate(
        &self,
        body: &Body,
        rows: &[Vec<f64>],
        rate_hz: f64,
        action: Option<usize>,
    ) -> Option<Factors> {
        Some(self.factors(action, &of_stretches(&positions(body, rows, rate_hz), rate_hz)?))
    }

    /// The same for poses at given ascending times, seconds: the output of a stream without its start. Joint positions are
    /// interpolated by cubics. Linear interpolation has corners at the poses, and the jerk there, hence flow, would depend
    /// on the phase between both frame rates.
    pub fn stream(
        &self,
        body: &Body,
        frames: &[Frame],
        times: &[f64],
        rate_hz: f64,
        action: Option<usize>,
    ) -> Option<Factors> {
        let (first, last) = (times.first()?, times.last()?);
        // Of a short stream there is no more to see than all of it.
        let settled = if last - first < SETTLE_S + STRETCH_S { *first } else { first + SETTLE_S };
        let from = times.partition_point(|&t| t < settled);
        let positions: Vec<Vec<Vector3<f64>>> =
            frames.get(from..)?.iter().map(|f| f.positions(&body.skeleton)).collect();
        let ways = resampled(&positions, &times[from..], rate_hz);
        Some(self.factors(action, &of_stretches(&ways, rate_hz)?))
    }
}

/// Positions at even times, by cubic Hermite curves whose slopes are those of parabolas through three poses.
fn resampled(positions: &[Vec<Vector3<f64>>], times: &[f64], rate_hz: f64) -> Vec<Vec<Vector3<f64>>> {
    let last = positions.len().min(times.len()).saturating_sub(1);
    if last == 0 {
        return positions.to_vec();
    }
    let span = |i: usize| (times[i + 1] - times[i]).max(1e-6);
    let pace = |i: usize, j: usize| (positions[i + 1][j] - positions[i][j]) / span(i);
    let slope = |i: usize, j: usize| match i {
        0 => pace(0, j),
        i if i == last => pace(last - 1, j),
        i => (pace(i - 1, j) * span(i) + pace(i, j) * span(i - 1)) / (span(i - 1) + span(i)),
    };
    let count = ((times[last] - times[0]) * rate_hz + 1e-6) as usize + 1;
    let mut at = 0;
    (0..count)
        .map(|k| {
            let time = times[0] + k as f64 / rate_hz;
            while at + 1 < last && times[at + 1] <= time {
                at += 1;
            }
            let s = ((time - times[at]) / span(at)).clamp(0.0, 1.0);
            let [h0, g0, h1, g1] = hermite(s);
            (0..positions[at].len())
                .map(|j| {
                    positions[at][j] * h0
                        + positions[at + 1][j] * h1
                        + (slope(at, j) * g0 + slope(at + 1, j) * g1) * span(at)
                })
                .collect()
        })
        .collect()
}

fn spread(values: &[Factors]) -> Spread {
    // Motion that is all alike has no spread to divide by.
    std::array::from_fn(|k| moments(values.iter().map(|v| v[k]), 0.01))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth;

    #[test]
    fn faster_is_stronger_and_more_sudden_and_no_more_bound() {
        let options = synth::Options::of(&["walk"], &["neutral"], 1, 6.0);
        let corpus = synth::corpus(&options).unwrap();
        let body = Body::of(&corpus).unwrap();
        let rows = body.clip_dofs(&corpus.examples[0].clip);
        let slow = descriptors(&body, &rows, 30.0).unwrap();
        // The same frames at another rate. Velocities are stored by the second.
        let mut quick = rows.clone();
        for row in &mut quick {
            row[4..7].iter_mut().for_each(|v| *v *= 2.0);
        }
        let fast = descriptors(&body, &quick, 60.0).unwrap();
        assert!((fast[1] - slow[1] - 4f64.ln()).abs() < 0.25, "{slow:?} {fast:?}");
        assert!((fast[2] - slow[2] - 4f64.ln()).abs() < 0.35, "{slow:?} {fast:?}");
        assert!((fast[0] - slow[0]).abs() < 0.35, "{slow:?} {fast:?}");
        assert!(descriptors(&body, &rows[..7], 30.0).is_none());
    }

    /// Joints on circles of several sizes and speeds, at any time.
    fn turning(time: f64) -> Vec<Vector3<f64>> {
        (1..4)
            .map(f64::from)
            .map(|j| {
                Vector3::new((6.0 * j * time).cos(), 0.3 * j * (9.0 * time).sin(), (6.0 * j * time).sin())
            })
            .collect()
    }

    #[test]
    fn flow_is_the_same_at_whatever_times_the_poses_stand() {
        let flow = |positions: &[Vec<Vector3<f64>>]| of_positions(positions, 30.0).unwrap()[0];
        let wanted = flow(&(0..60).map(|k| turning(f64::from(k) / 30.0)).collect::<Vec<_>>());
        let straight = |positions: &[Vec<Vector3<f64>>], times: &[f64]| -> Vec<Vec<Vector3<f64>>> {
            (0..58)
                .map(|k| {
                    let at = times.partition_point(|&t| t <= f64::from(k) / 30.0).clamp(1, times.len() - 1);
                    let s = (f64::from(k) / 30.0 - times[at - 1]) / (times[at] - times[at - 1]);
                    positions[at - 1].iter().zip(&positions[at]).map(|(a, b)| a.lerp(b, s)).collect()
                })
                .collect()
        };
        let mut worst = [0.0f64; 2];
        for pace in [0.9, 0.97, 1.03, 1.1] {
            let times: Vec<f64> =
                (0..70).map(|i| (f64::from(i) + 0.2 * (0.4 * f64::from(i)).sin()) * pace / 30.0).collect();
            let poses: Vec<_> = times.iter().map(|&t| turning(t)).collect();
            let cubic = resampled(&poses, &times, 30.0);
            worst[0] = worst[0].max((flow(&cubic[..58]) - wanted).abs());
            worst[1] = worst[1].max((flow(&straight(&poses, &times)) - wanted).abs());
        }
        assert!(worst[0] < 0.005 && worst[1] > 1.5 * worst[0], "cubic and straight: {worst:?}");
    }

    #[test]
    fn a_frame_more_and_a_start_that_jerks_change_little() {
        let options = synth::Options::of(&["run"], &["neutral"], 1, 4.0);
        let corpus = synth::corpus(&options).unwrap();
        let body = Body::of(&corpus).unwrap();
        let estimator = Estimator { actions: Vec::new(), all: [(0.0, 1.0); 3] };
        let mut frames = corpus.examples[0].clip.frames.clone();
        let times: Vec<f64> = (0..frames.len()).map(|i| i as f64 / 30.0).collect();
        let seen =
            |frames: &[Frame]| estimator.stream(&body, frames, &times[..frames.len()], 30.0, None).unwrap();
        let whole = seen(&frames);
        for less in 1..12 {
            let cut = seen(&frames[..frames.len() - less]);
            let longer = seen(&frames[..frames.len() - less + 1]);
            assert!((0..3).all(|k| (cut[k] - longer[k]).abs() < 0.02), "{less}: {cut:?} {longer:?}");
        }
        frames[3].root.y += 0.1;
        assert_eq!(seen(&frames), whole);
        frames[20].root.y += 0.3;
        assert!(seen(&frames)[0] > whole[0] + 0.002, "{:?} {whole:?}", seen(&frames));
        assert!(estimator.stream(&body, &[], &[], 30.0, None).is_none());
    }

    #[test]
    fn factors_are_deviations_held_to_the_poles() {
        let estimator = Estimator { actions: vec![[(1.0, 0.5); 3]], all: [(0.0, 1.0); 3] };
        assert_eq!(estimator.factors(Some(0), &[1.0, 1.5, 2.5]), [0.0, 1.0, 2.5]);
        assert_eq!(estimator.factors(None, &[1.0, 1.5, -3.0]), [1.0, 1.5, -2.5]);
        let far: Vec<f64> = (-20..=20).map(|i| held(f64::from(i))).collect();
        assert!(far.windows(2).all(|w| w[0] < w[1]) && far.iter().all(|v| v.abs() < POLE), "{far:?}");
    }

    /// Fragments were measured whole and streams by stretches of 1.2 s: of acts, which last longer, whatever came out was
    /// lighter than what it was held against, by three quarters of its spread and more.
    #[test]
    fn streams_and_fragments_of_acts_are_on_one_scale() {
        let options = synth::Options {
            actions: ["walk-to-run", "run-to-walk"].map(String::from).to_vec(),
            styles: ["neutral", "angry", "old"].map(String::from).to_vec(),
            clips: 2,
            ..synth::Options::default()
        };
        let corpus = synth::corpus(&options).unwrap();
        let library = Library::found(&corpus).unwrap();
        let estimator = Estimator::of(&library);
        for action in 0..2 {
            let weights: Vec<f64> = corpus
                .examples
                .iter()
                .filter(|e| e.action == action)
                .map(|e| {
                    let times: Vec<f64> = (0..e.clip.frames.len()).map(|i| i as f64 / 30.0).collect();
                    estimator.stream(&library.body, &e.clip.frames, &times, 30.0, Some(action)).unwrap()[1]
                })
                .collect();
            let mean = weights.iter().sum::<f64>() / weights.len() as f64;
            // Of streams half a second at the start does not count: 0.17 at most.
            assert!(mean.abs() < 0.4, "{mean} {weights:?}");
        }
    }
}
