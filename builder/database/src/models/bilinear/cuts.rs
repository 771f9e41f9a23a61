//! The cycles that the model is made of: cut out of their clips, and warped onto one of them.

use gestus_core::blob::layout::dof;
use gestus_motion::{
    body::{Body, row_at},
    corpus::{Corpus, Cycle},
    statistics::mean,
};

use super::error::BilinearError;
use crate::registration::warp::{
    self, WarpError,
    imw::{Config, imw},
};

/// Speeds of a style: its slow, medium and fast cycles, by the quantile of their mean speeds.
pub const SPEEDS: [(&str, f64); 3] = [("slow", 0.1), ("medium", 0.5), ("fast", 0.9)];

/// A gait cycle cut out of its clip.
#[derive(Debug, Clone)]
pub struct Cut {
    /// The number of its clip in the corpus.
    pub clip: usize,
    /// Dofs from the first left strike to the next, shape `[frames][D]`.
    pub rows: Vec<Vec<f64>>,
    /// Where in the rows the right foot strikes, in frames.
    pub middle: f64,
    /// Mean forward speed, metres a second.
    pub speed: f64,
}

/// The slow, medium and fast cycle of an action in a style, by their mean speeds.
///
/// # Errors
/// [`BilinearError::Cycles`] if there are fewer than three.
pub fn cuts(corpus: &Corpus, body: &Body, action: usize, style: usize) -> Result<Vec<Cut>, BilinearError> {
    let all = by_speed(corpus, body, action, style);
    if all.len() < SPEEDS.len() {
        return Err(BilinearError::Cycles {
            action: corpus.actions[action].clone(),
            style: corpus.styles[style].clone(),
            have: all.len(),
            need: SPEEDS.len(),
        });
    }
    Ok(SPEEDS.iter().map(|(_, quantile)| all[at_quantile(*quantile, all.len())].clone()).collect())
}

/// All cycles of an action in a style, the slowest first.
pub fn by_speed(corpus: &Corpus, body: &Body, action: usize, style: usize) -> Vec<Cut> {
    let mut all: Vec<Cut> = Vec::new();
    for (clip, example) in corpus.examples.iter().enumerate() {
        if (example.action, example.style) == (action, style) {
            let rows = body.clip_dofs(&example.clip);
            all.extend(example.cycles.iter().map(|cycle| cut(clip, &rows, cycle)));
        }
    }
    all.sort_by(|a, b| a.speed.total_cmp(&b.speed));
    all
}

/// The index of a quantile in a sorted list, which is not empty.
pub fn at_quantile(quantile: f64, count: usize) -> usize {
    (quantile * (count - 1) as f64).round() as usize
}

fn cut(clip: usize, rows: &[Vec<f64>], cycle: &Cycle) -> Cut {
    let (start, end) = cycle.span();
    let count = ((end - start).round() as usize).max(3);
    let at = |k: usize| start + (end - start) * k as f64 / count as f64;
    let rows: Vec<Vec<f64>> = (0..=count).map(|k| row_at(rows, at(k))).collect();
    let speed = mean(rows.iter().map(|r| r[dof::FORWARD]));
    let middle = (cycle.position(0.5) - start) / (end - start) * count as f64;
    Cut { clip, rows, middle, speed }
}

/// A cycle at the frames of another one, `base`: dofs and logarithm of the time warp, row after row.
///
/// # Errors
/// Where the two can't be warped onto each other.
pub fn aligned(base: &Cut, cut: &Cut, rate_hz: f64) -> Result<Vec<f64>, WarpError> {
    let (u, y) = warp::standardised(&warp::shapes(&base.rows), &warp::shapes(&cut.rows));
    let positions = imw(&u, &y, &Config::default())?.warp.positions;
    // Ends meet ends.
    let last = (base.rows.len() - 1) as f64;
    let scale = (cut.rows.len() - 1) as f64 / last;
    let shift: Vec<f64> = positions.iter().enumerate().map(|(k, p)| p - scale * k as f64).collect();
    let at: Vec<f64> = warp::smoothed_shift(&shift, rate_hz)
        .iter()
        .enumerate()
        .map(|(k, shift)| (scale * k as f64 + shift).clamp(0.0, (cut.rows.len() - 1) as f64))
        .collect();
    Ok((0..base.rows.len())
        .flat_map(|k| {
            let (before, after) = (k.saturating_sub(1), (k + 1).min(base.rows.len() - 1));
            let slope = (at[after] - at[before]) / (after - before) as f64;
            let mut row = row_at(&cut.rows, at[k]);
            row.push(slope.clamp(0.25, 4.0).ln());
            row
        })
        .collect())
}
