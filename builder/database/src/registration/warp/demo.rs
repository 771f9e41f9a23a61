//! Pairs of motions with a known time warp, and the warps that each method finds (as in Hsu 2005, Figure 2).
//!
//! - [`generated_pair`]: one content, performed by the generator in neutral and in another style. Its timeline is known,
//!   and with it the correspondence of frames.
//! - [`known_pair`]: the first is smooth sums of sines in several dofs; the second is the first on a warped timeline,
//!   every dof with slowly changing scale and offset: the model of style in iterative motion warping.

use thiserror::Error;

use crate::registration::warp::{
    Warp, WarpError,
    dtw::{Constraint, dtw},
    imw::{Config, imw},
    shapes, standardised,
};
use crate::synth::{SynthError, performance};
use gestus_motion::{
    body::{Body, row_at},
    corpus::{Corpus, Cycle, Example},
    landmarks::LandmarkError,
    statistics::variance,
};

/// Frames a second of generated pairs.
const RATE_HZ: f64 = 30.0;

/// Two motions and the warp between them.
#[derive(Debug, Clone)]
pub struct KnownPair {
    /// The first motion, `[frames x dofs]`.
    pub u: Vec<Vec<f64>>,
    /// The second, `[frames x dofs]`.
    pub y: Vec<Vec<f64>>,
    /// Position in the second motion of each frame of the first.
    pub truth: Warp,
    /// The dof that moves most.
    pub most: usize,
}

/// A pair that can't be generated.
#[derive(Debug, Error)]
pub enum PairError {
    /// No such action or style.
    #[error(transparent)]
    Synth(#[from] SynthError),
    /// The skeleton.
    #[error(transparent)]
    Landmark(#[from] LandmarkError),
}

/// One content in neutral and in that style: two cycles of a gait, or the whole of an act. Dofs in standard deviations.
///
/// # Errors
/// [`PairError`] for an unknown action or style.
pub fn generated_pair(content: u64, action: &str, style: &str) -> Result<KnownPair, PairError> {
    let perform = |style: &str| performance(content, action, style, RATE_HZ, 4.0);
    let (neutral, styled) = (perform("neutral")?, perform(style)?);
    let body = Body::of(&Corpus::of_clip(&neutral.clip))?;
    let (u, input) = cut(&body, &neutral);
    let (y, output) = cut(&body, &styled);
    let truth = Warp { positions: input.positions(&output) };
    let spread = |d: &usize| variance(u.iter().map(|row| row[*d]));
    let most = (0..u[0].len()).max_by(|a, b| spread(a).total_cmp(&spread(b))).unwrap_or(0);
    let (u, y) = standardised(&u, &y);
    Ok(KnownPair { u, y, truth, most })
}

/// A clip's first cycles as frames of their own, begun and ended with them.
struct Span<'a> {
    cycles: &'a [Cycle],
    start: f64,
    /// Frames of the clip from one frame to the next.
    step: f64,
    frames: usize,
}

fn cut<'a>(body: &Body, example: &'a Example) -> (Vec<Vec<f64>>, Span<'a>) {
    let cycles = &example.cycles[..example.cycles.len().min(2)];
    let (start, end) = (cycles[0].span().0, cycles[cycles.len() - 1].span().1);
    let steps = (end - start).round();
    let span = Span { cycles, start, step: (end - start) / steps, frames: steps as usize + 1 };
    let rows = shapes(&body.clip_dofs(&example.clip));
    ((0..span.frames).map(|t| row_at(&rows, span.start + t as f64 * span.step)).collect(), span)
}

impl Span<'_> {
    /// Position of each frame in another performance of the same content: at equal phases of the same cycles.
    fn positions(&self, other: &Self) -> Vec<f64> {
        let position = |t: usize| {
            let at = self.start + t as f64 * self.step;
            let last = self.cycles.len() - 1;
            let cycle = self.cycles.iter().position(|c| at < c.span().1).unwrap_or(last);
            (other.cycles[cycle].position(self.cycles[cycle].phase(at)) - other.start) / other.step
        };
        (0..self.frames).map(position).collect()
    }
}

/// The pair of the figure: a neutral punch, and the same punch in the style `old`, which takes a third longer.
///
/// # Errors
/// As [`generated_pair`].
pub fn drawn_pair() -> Result<KnownPair, PairError> {
    generated_pair(2, "punch", "old")
}

/// A pair of `frames` frames and `dofs` dofs; the same for the same seed. `style` is the size of the difference in space,
/// in standard deviations of a dof; with 0 only the timeline differs.
pub fn known_pair(seed: u64, frames: usize, dofs: usize, style: f64) -> KnownPair {
    use rand::{Rng, SeedableRng};
    use std::f64::consts::TAU;
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let mut between = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
    let last = frames.saturating_sub(1).max(1) as f64;
    // One bend of the timeline, with slopes of 0.6 to 1.4.
    let (bend, phase) = (between(0.25, 0.4), between(-0.5, 0.5));
    let shift = |x: f64| bend / TAU * ((TAU * x + phase).sin() - phase.sin());
    let forward = |x: f64| x + shift(x);
    let backward = |v: f64| {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if forward(middle) < v { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    };
    let waves: Vec<[f64; 7]> = (0..dofs)
        .map(|_| {
            [
                between(0.8, 1.2),
                between(0.0, TAU),
                between(0.3, 0.6),
                between(0.0, TAU),
                between(-0.5, 0.5) * style,
                between(0.6, 1.0) * style * if between(-1.0, 1.0) < 0.0 { -1.0 } else { 1.0 },
                between(0.0, TAU),
            ]
        })
        .collect();
    let value =
        |w: &[f64; 7], x: f64| w[0] * (2.0 * TAU * x + w[1]).sin() + w[2] * (4.0 * TAU * x + w[3]).sin();
    let u = (0..frames).map(|i| waves.iter().map(|w| value(w, i as f64 / last)).collect()).collect();
    let y = (0..frames)
        .map(|j| {
            let x = backward(j as f64 / last);
            let drift = |w: &[f64; 7]| 0.15 * style * (0.5 * TAU * x + w[6]).sin();
            waves.iter().map(|w| (1.0 + w[4] + drift(w)) * value(w, x) + w[5] + drift(w)).collect()
        })
        .collect();
    let truth = Warp { positions: (0..frames).map(|i| forward(i as f64 / last) * last).collect() };
    KnownPair { u, y, truth, most: 0 }
}

/// The warps of a known pair by each method: name and correspondence, the truth first.
///
/// # Errors
/// [`WarpError`] where the pair can't be warped.
pub fn compare(pair: &KnownPair) -> Result<Vec<(&'static str, Warp)>, WarpError> {
    Ok(vec![
        ("truth", pair.truth.clone()),
        ("DTW, Type I", dtw(&pair.u, &pair.y, Constraint::TypeI)?),
        ("DTW, Type III", dtw(&pair.u, &pair.y, Constraint::TypeIII)?),
        ("IMW", imw(&pair.u, &pair.y, &Config::default())?.warp),
    ])
}

/// A curve by its name: points of frame and value.
pub type Curve = (String, Vec<(f64, f64)>);

/// The warps of each method and the true warp, as curves of a plot.
///
/// # Errors
/// [`WarpError`] where the pair can't be warped.
pub fn warps(pair: &KnownPair) -> Result<Vec<Curve>, WarpError> {
    let found = compare(pair)?;
    let curve = |warp: Warp| warp.positions.into_iter().enumerate().map(|(i, v)| (i as f64, v)).collect();
    Ok(found.into_iter().map(|(name, warp)| (name.to_owned(), curve(warp))).collect())
}

/// The dof that varies most as curves of a plot (Hsu 2005, Figure 2): of input and output, and of the input on the
/// output's timeline by each method.
///
/// # Errors
/// [`WarpError`] where the pair can't be warped.
pub fn figure2(pair: &KnownPair) -> Result<Vec<Curve>, WarpError> {
    let most = pair.most;
    let plain = |motion: &[Vec<f64>]| motion.iter().enumerate().map(|(i, r)| (i as f64, r[most])).collect();
    let mut curves = vec![("input".to_owned(), plain(&pair.u)), ("output".to_owned(), plain(&pair.y))];
    for (name, warp) in compare(pair)? {
        let points = warp.positions.iter().zip(&pair.u).map(|(&v, row)| (v, row[most])).collect();
        curves.push((format!("input warped by {name}"), points));
    }
    Ok(curves)
}
