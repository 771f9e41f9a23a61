//! A gait cycle as a function of style and speed: bilinear analysis (Hsu 2005, section 5.1; Tenenbaum and Freeman
//! 2000; Vasilescu 2002).
//!
//! One cycle of every style and speed is warped onto a reference cycle by iterative motion warping and written as one
//! vector of its dofs and the logarithm of its time warp. The tensor `[styles][speeds][vector]`, minus its mean, is
//! factored by the singular value decompositions of its two unfoldings:
//!
//! `vector(a, b) = mean + Σ_ij a_i b_j core_ij`
//!
//! A style is a coordinate vector `a`, a speed a coordinate vector `b`; other styles and speeds are
//! interpolated or extrapolated in the coordinates. The cycle is closed and repeated.

use gestus_core::blob::layout::dof;
use nalgebra::{DMatrix, SymmetricEigen};
use thiserror::Error;

use crate::registration::{
    gait_cycles::smooth,
    warp::{
        self, WarpError,
        imw::{Config, imw},
    },
};
use gestus_motion::{
    body::{Body, about_y, row_at},
    clip::{Clip, Frame, interpolate},
    corpus::{Corpus, Cycle},
    statistics::mean,
};
use nalgebra::Vector3;

/// Speeds of a style: its slow, medium and fast cycles.
pub const SPEEDS: [(&str, f64); 3] = [("slow", 0.1), ("medium", 0.5), ("fast", 0.9)];

/// A corpus without the cycles for a bilinear model.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum BilinearError {
    /// A style without cycles of the action.
    #[error("{style} has {have} cycles of {action}, and needs {need}: slow, medium and fast ones")]
    Cycles {
        /// The action.
        action: String,
        /// The style.
        style: String,
        /// Cycles found.
        have: usize,
        /// Cycles needed.
        need: usize,
    },
    /// Cycles that can't be warped.
    #[error("a cycle of {style}: {source}")]
    Warp {
        /// Its style.
        style: String,
        /// Why.
        source: WarpError,
    },
}

/// A gait cycle cut out of its clip.
#[derive(Debug, Clone)]
pub struct Cut {
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
    let mut all: Vec<Cut> = Vec::new();
    for example in corpus.examples.iter().filter(|e| e.action == action && e.style == style) {
        let rows = body.clip_dofs(&example.clip);
        all.extend(example.cycles.iter().map(|cycle| cut(&rows, cycle)));
    }
    if all.len() < SPEEDS.len() {
        return Err(BilinearError::Cycles {
            action: corpus.actions[action].clone(),
            style: corpus.styles[style].clone(),
            have: all.len(),
            need: SPEEDS.len(),
        });
    }
    all.sort_by(|a, b| a.speed.total_cmp(&b.speed));
    let last = (all.len() - 1) as f64;
    Ok(SPEEDS.iter().map(|(_, quantile)| all[(quantile * last).round() as usize].clone()).collect())
}

fn cut(rows: &[Vec<f64>], cycle: &Cycle) -> Cut {
    let (start, end) = cycle.span();
    let count = ((end - start).round() as usize).max(3);
    let at = |k: usize| start + (end - start) * k as f64 / count as f64;
    let rows: Vec<Vec<f64>> = (0..=count).map(|k| row_at(rows, at(k))).collect();
    let speed = mean(rows.iter().map(|r| r[dof::FORWARD]));
    let middle = (cycle.position(0.5) - start) / (end - start) * count as f64;
    Cut { rows, middle, speed }
}

/// The bilinear model.
#[derive(Debug, Clone)]
pub struct Bilinear {
    frames: usize,
    dofs: usize,
    rate_hz: f64,
    mean: Vec<f64>,
    /// Coordinates of each style, `[styles x styles]`, and of each speed, `[speeds x speeds]`.
    styles: DMatrix<f64>,
    speeds: DMatrix<f64>,
    /// `[styles][speeds]` of vectors.
    core: Vec<Vec<Vec<f64>>>,
    /// Mean forward speed of slow, medium and fast cycles over all styles, metres a second.
    pub speeds_m_s: Vec<f64>,
    /// Share of the variance that each style coordinate, and each speed coordinate, explains.
    pub explained: [Vec<f64>; 2],
}

impl Bilinear {
    /// The model of an action; `reference` is the style whose medium cycle the others are warped onto.
    ///
    /// # Errors
    /// [`BilinearError`] where a style has too few cycles.
    pub fn of(corpus: &Corpus, body: &Body, action: usize, reference: usize) -> Result<Self, BilinearError> {
        let all: Vec<Vec<Cut>> =
            (0..corpus.styles.len()).map(|s| cuts(corpus, body, action, s)).collect::<Result<_, _>>()?;
        let base = all[reference][1].clone();
        let mut tensor = Vec::new();
        for (style, cuts) in all.iter().enumerate() {
            let warp = |source| BilinearError::Warp { style: corpus.styles[style].clone(), source };
            let vectors: Result<Vec<Vec<f64>>, _> =
                cuts.iter().map(|c| vector(&base, c, corpus.rate_hz)).collect();
            tensor.push(vectors.map_err(warp)?);
        }
        let speeds_m_s = (0..SPEEDS.len()).map(|v| mean(all.iter().map(|c| c[v].speed))).collect();
        Ok(Self::analyse(&tensor, base.rows.len() - 1, body.dofs(), corpus.rate_hz, speeds_m_s))
    }

    fn analyse(
        tensor: &[Vec<Vec<f64>>],
        frames: usize,
        dofs: usize,
        rate_hz: f64,
        speeds_m_s: Vec<f64>,
    ) -> Self {
        let (styles, speeds, length) = (tensor.len(), tensor[0].len(), tensor[0][0].len());
        let count = (styles * speeds) as f64;
        let mean: Vec<f64> =
            (0..length).map(|k| tensor.iter().flatten().map(|v| v[k]).sum::<f64>() / count).collect();
        let centred: Vec<Vec<Vec<f64>>> = tensor
            .iter()
            .map(|row| row.iter().map(|v| v.iter().zip(&mean).map(|(a, b)| a - b).collect()).collect())
            .collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let by_style = DMatrix::from_fn(styles, styles, |a, b| {
            (0..speeds).map(|v| dot(&centred[a][v], &centred[b][v])).sum()
        });
        let by_speed = DMatrix::from_fn(speeds, speeds, |a, b| {
            (0..styles).map(|s| dot(&centred[s][a], &centred[s][b])).sum()
        });
        let (style_axes, style_share) = axes(by_style);
        let (speed_axes, speed_share) = axes(by_speed);
        let core = (0..styles)
            .map(|i| {
                (0..speeds)
                    .map(|j| {
                        let mut sum = vec![0.0; length];
                        for (s, row) in centred.iter().enumerate() {
                            for (v, vector) in row.iter().enumerate() {
                                let weight = style_axes[(s, i)] * speed_axes[(v, j)];
                                sum.iter_mut().zip(vector).for_each(|(a, b)| *a += weight * b);
                            }
                        }
                        sum
                    })
                    .collect()
            })
            .collect();
        Self {
            frames,
            dofs,
            rate_hz,
            mean,
            styles: style_axes,
            speeds: speed_axes,
            core,
            speeds_m_s,
            explained: [style_share, speed_share],
        }
    }

    /// The vector at a mix of styles (weights that sum to 1; some may be negative) and a speed, metres a second.
    fn vector(&self, weights: &[f64], speed: f64) -> Vec<f64> {
        let styles = self.styles.nrows();
        let a: Vec<f64> =
            (0..styles).map(|i| (0..styles).map(|s| weights[s] * self.styles[(s, i)]).sum()).collect();
        // Between two known speeds, or beyond the last two.
        let known = &self.speeds_m_s;
        let at = known[1..known.len() - 1].iter().take_while(|&&v| v < speed).count();
        let span = (known[at + 1] - known[at]).abs().max(1e-6);
        let t = (speed - known[at]) / span;
        let b: Vec<f64> = (0..known.len())
            .map(|j| (1.0 - t) * self.speeds[(at, j)] + t * self.speeds[(at + 1, j)])
            .collect();
        let mut sum = self.mean.clone();
        for (row, a) in self.core.iter().zip(&a) {
            for (vector, b) in row.iter().zip(&b) {
                sum.iter_mut().zip(vector).for_each(|(s, v)| *s += a * b * v);
            }
        }
        sum
    }

    /// A looped walk of some seconds.
    pub fn walk(&self, body: &Body, weights: &[f64], speed: f64, seconds: f64) -> Clip {
        let vector = self.vector(weights, speed);
        let width = self.dofs + 1;
        let mut rows: Vec<&[f64]> = vector.chunks_exact(width).collect();
        let closing: Vec<f64> = rows[self.frames].iter().zip(rows[0]).map(|(a, b)| a - b).collect();
        rows.truncate(self.frames);
        let closed: Vec<Vec<f64>> = rows
            .iter()
            .enumerate()
            .map(|(k, row)| {
                // What the end has more than the start is taken away evenly.
                let share = k as f64 / self.frames as f64 - 0.5;
                row.iter().zip(&closing).map(|(v, c)| v - share * c).collect()
            })
            .collect();
        let (mut ground, mut heading, mut time) = (Vector3::zeros(), 0.0, 0.0);
        let mut poses: Vec<(f64, Frame)> = Vec::new();
        let mut k = 0;
        while time <= seconds && k < 100_000 {
            let row = &closed[k % self.frames];
            poses.push((time, body.pose(row, [ground.x, ground.z], heading)));
            let step = row[self.dofs].clamp(-1.4, 1.4).exp() / self.rate_hz;
            ground += about_y(heading) * Vector3::new(row[dof::LEFT], 0.0, row[dof::FORWARD]) * step;
            heading += row[dof::YAW] * step;
            time += step;
            k += 1;
        }
        let mut at = 0;
        let count = (poses.last().map_or(0.0, |p| p.0).min(seconds) * self.rate_hz) as usize;
        let frames = (0..=count)
            .map(|i| {
                let now = i as f64 / self.rate_hz;
                while at + 2 < poses.len() && poses[at + 1].0 <= now {
                    at += 1;
                }
                let next = (at + 1).min(poses.len() - 1);
                let span = (poses[next].0 - poses[at].0).max(1e-9);
                interpolate(&poses[at].1, &poses[next].1, ((now - poses[at].0) / span).clamp(0.0, 1.0))
            })
            .collect();
        Clip { name: "loop".into(), skeleton: body.skeleton.clone(), rate_hz: self.rate_hz, frames }
    }
}

/// Eigenvectors of a symmetric matrix, largest first, and the share of each.
fn axes(matrix: DMatrix<f64>) -> (DMatrix<f64>, Vec<f64>) {
    let eigen = SymmetricEigen::new(matrix);
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let total: f64 = eigen.eigenvalues.iter().map(|v| v.max(0.0)).sum::<f64>().max(1e-300);
    let shares = order.iter().map(|&i| eigen.eigenvalues[i].max(0.0) / total).collect();
    (DMatrix::from_fn(order.len(), order.len(), |r, c| eigen.eigenvectors[(r, order[c])]), shares)
}

/// A cycle at the frames of another one: dofs and logarithm of the time warp, row after row.
fn vector(base: &Cut, cut: &Cut, rate_hz: f64) -> Result<Vec<f64>, WarpError> {
    let (u, y) = warp::standardised(&warp::shapes(&base.rows), &warp::shapes(&cut.rows));
    let positions = imw(&u, &y, &Config::default())?.warp.positions;
    // Ends meet ends; the steps of the warp, multiples of a half, are smoothed away.
    let last = (base.rows.len() - 1) as f64;
    let scale = (cut.rows.len() - 1) as f64 / last;
    let shift: Vec<f64> = positions.iter().enumerate().map(|(k, p)| p - scale * k as f64).collect();
    let smoothed = smooth(&shift, 0.06 * rate_hz);
    let at: Vec<f64> = smoothed
        .iter()
        .enumerate()
        .map(|(k, shift)| {
            let edge = ((k as f64).min(last - k as f64) / (0.12 * rate_hz)).min(1.0);
            (scale * k as f64 + edge * shift).clamp(0.0, (cut.rows.len() - 1) as f64)
        })
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth;

    #[test]
    fn known_corners_come_back_and_the_walk_goes_on() {
        let corpus = synth::corpus(&synth::Options {
            actions: vec!["walk".into()],
            styles: vec!["neutral".into(), "proud".into(), "old".into()],
            clips: 3,
            seconds: 6.0,
            ..synth::Options::default()
        })
        .unwrap();
        let body = Body::of(&corpus).unwrap();
        let model = Bilinear::of(&corpus, &body, 0, 0).unwrap();
        assert!(model.explained.iter().all(|e| (e.iter().sum::<f64>() - 1.0).abs() < 1e-9));
        // The coordinates of a known style at a known speed give its own vector.
        let own = cuts(&corpus, &body, 0, 1).unwrap();
        let base = cuts(&corpus, &body, 0, 0).unwrap()[1].clone();
        let truth = vector(&base, &own[2], corpus.rate_hz).unwrap();
        let found = model.vector(&[0.0, 1.0, 0.0], model.speeds_m_s[2]);
        assert!(truth.iter().zip(&found).all(|(a, b)| (a - b).abs() < 1e-9));

        let ground = |weights: &[f64], speed: f64| {
            let clip = model.walk(&body, weights, speed, 6.0);
            assert!((clip.duration_s() - 6.0).abs() < 0.1);
            // No seam: no joint turns by more than a walk does.
            let turned = clip.frames.windows(2).flat_map(|w| {
                w[0].rotations.iter().zip(&w[1].rotations).map(|(a, b)| a.angle_to(b)).collect::<Vec<_>>()
            });
            assert!(turned.fold(0.0, f64::max) < 0.6);
            let way = clip.frames[clip.frames.len() - 1].root - clip.frames[0].root;
            way.norm() / clip.duration_s()
        };
        let speeds = &model.speeds_m_s;
        let (slow, fast) = (ground(&[1.0, 0.0, 0.0], speeds[0]), ground(&[1.0, 0.0, 0.0], speeds[2]));
        assert!(fast > slow, "{slow} {fast}");
        // Between two styles, and beyond one.
        let _ = (ground(&[0.5, 0.0, 0.5], speeds[1]), ground(&[-0.3, 1.3, 0.0], 1.1 * speeds[2]));
    }
}
