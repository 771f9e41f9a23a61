//! A pair of motions whose time warp is known, and what each method makes of it (as paper 001's Figure 2).
//!
//! The first is smooth sums of sines in several dofs; the second is the first on a warped timeline, every dof with a
//! scale and an offset that change slowly: the same content in another style.

use super::{
    Warp, WarpError,
    dtw::{Constraint, dtw},
    imw::{Config, imw},
};

/// Two motions and the warp between them.
#[derive(Debug, Clone)]
pub struct KnownPair {
    /// The first motion, `[frames x dofs]`.
    pub u: Vec<Vec<f64>>,
    /// The second, `[frames x dofs]`.
    pub y: Vec<Vec<f64>>,
    /// Where each frame of the first is in the second.
    pub truth: Warp,
}

/// A pair of `frames` frames and `dofs` dofs; the same for the same seed. `style` is how far the second is off in space,
/// in standard deviations of a dof: 0 is the same motion on another timeline.
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
    KnownPair { u, y, truth }
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

/// The warps themselves: where each method puts every frame of the input in the output, and the truth.
///
/// # Errors
/// [`WarpError`] where the pair can't be warped.
pub fn warps() -> Result<Vec<Curve>, WarpError> {
    let found = compare(&known_pair(2, 120, 8, 1.0))?;
    let curve = |warp: Warp| warp.positions.into_iter().enumerate().map(|(i, v)| (i as f64, v)).collect();
    Ok(found.into_iter().map(|(name, warp)| (name.to_owned(), curve(warp))).collect())
}

/// The plot like paper 001's Figure 2: the dof `input` and `output`, and the input moved onto the output's timeline by
/// each method.
///
/// # Errors
/// [`WarpError`] where the pair can't be warped.
pub fn figure2() -> Result<Vec<Curve>, WarpError> {
    let pair = known_pair(2, 120, 8, 1.0);
    let plain = |motion: &[Vec<f64>]| motion.iter().enumerate().map(|(i, r)| (i as f64, r[0])).collect();
    let mut curves = vec![("input".to_owned(), plain(&pair.u)), ("output".to_owned(), plain(&pair.y))];
    for (name, warp) in compare(&pair)? {
        let points = warp.positions.iter().zip(&pair.u).map(|(&v, row)| (v, row[0])).collect();
        curves.push((format!("input warped by {name}"), points));
    }
    Ok(curves)
}
