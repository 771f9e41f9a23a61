//! Time warps: correspondences between the frames of two motions.
//!
//! A motion is a matrix of dofs, `[frames x dofs]`, each dof scaled such that differences are
//! comparable ([`standardised`]). Both motions have to begin and end at the same moment of the action.
//!
//! - [`dtw`] is dynamic time warping, for comparison: for motions of different style it matches similar poses rather
//!   than the same moments.
//! - [`imw`] is iterative motion warping (Hsu 2005, section 3): it alternates a time warp ([`repeat`]) with a
//!   smooth scale and offset of every dof ([`space`]), so that style does not affect the warp.
//!
//! Both give a [`Warp`]; [`demo`] compares them on known warps.

pub use error::WarpError;
use gestus_core::blob::layout::dof;
use gestus_motion::statistics::{distance2, smooth, variance};

pub mod demo;
pub mod dtw;
mod error;
pub mod imw;
pub mod repeat;
pub mod space;

/// A correspondence: for every frame of the first motion, the position in the second.
#[derive(Debug, Clone, PartialEq)]
pub struct Warp {
    /// Fractional frame indices of the second motion, not descending. Shape [frames of the first].
    pub positions: Vec<f64>,
}

impl Warp {
    /// Position in the second motion at a fractional frame index of the first; clamped at both ends.
    pub fn at(&self, index: f64) -> f64 {
        let last = self.positions.len() - 1;
        let index = index.clamp(0.0, last as f64);
        let i = (index.floor() as usize).min(last.saturating_sub(1));
        let next = self.positions[(i + 1).min(last)];
        self.positions[i] + (index - i as f64) * (next - self.positions[i])
    }

    /// The warp of two whole motions of `from` and `to` frames, if this is the warp of both reduced to fewer, evenly spaced
    /// frames: `thinned` of the second.
    pub fn stretched(self, from: usize, thinned: usize, to: usize) -> Warp {
        if (from, to) == (self.positions.len(), thinned) {
            return self;
        }
        let ratio = |a: usize, b: usize| a.saturating_sub(1) as f64 / b.saturating_sub(1).max(1) as f64;
        let (step, scale) = (ratio(self.positions.len(), from), ratio(to, thinned));
        Warp { positions: (0..from).map(|i| scale * self.at(step * i as f64)).collect() }
    }

    /// Mean distance to another warp of the same frames, in frames of the second motion.
    pub fn mean_error(&self, other: &Warp) -> f64 {
        let sum: f64 = self.positions.iter().zip(&other.positions).map(|(a, b)| (a - b).abs()).sum();
        sum / self.positions.len() as f64
    }
}

/// Standard deviation of the smoothing of [`smoothed_shift`], seconds.
const SMOOTH_S: f64 = 0.06;

/// How far a warp shifts each frame, without the steps that come of differential warps being multiples of one half. Motions
/// begin and end with the same event: nothing is shifted there.
pub fn smoothed_shift(shift: &[f64], rate_hz: f64) -> Vec<f64> {
    let last = shift.len() as f64 - 1.0;
    let edge = |k: f64| (k.min(last - k) / (2.0 * SMOOTH_S * rate_hz)).min(1.0);
    smooth(shift, SMOOTH_S * rate_hz).into_iter().enumerate().map(|(k, s)| s * edge(k as f64)).collect()
}

/// Checks two motions: frames, one number of dofs, finite.
pub(crate) fn check(u: &[Vec<f64>], y: &[Vec<f64>]) -> Result<(), WarpError> {
    let need = u.first().ok_or(WarpError::Empty)?.len();
    if y.is_empty() {
        return Err(WarpError::Empty);
    }
    for motion in [u, y] {
        for (frame, row) in motion.iter().enumerate() {
            if row.len() != need {
                return Err(WarpError::Dofs { need, have: row.len() });
            }
            if row.iter().any(|v| !v.is_finite()) {
                return Err(WarpError::NotFinite { frame });
            }
        }
    }
    Ok(())
}

/// Squared distances of all pairs of frames, [frames of u x frames of y].
pub(crate) fn costs(u: &[Vec<f64>], y: &[Vec<f64>]) -> Vec<Vec<f64>> {
    u.iter().map(|a| y.iter().map(|b| distance2(a, b)).collect()).collect()
}

/// The same, but 0 where the slope limit rules out a match.
pub(crate) fn costs_within(u: &[Vec<f64>], y: &[Vec<f64>], slope: usize) -> Vec<Vec<f64>> {
    let (rows, columns, limit) = (u.len(), y.len() * slope, slope * slope);
    if rows == 0 || rows > columns || columns > rows * limit {
        return costs(u, y);
    }
    let mut before = 0;
    u.iter()
        .enumerate()
        .map(|(i, a)| {
            let (least, most) = repeat::reach(i, rows, columns, limit);
            let mut row = vec![0.0; y.len()];
            for j in before / slope..=(most - 1) / slope {
                row[j] = square_distance(a, &y[j]);
            }
            before = least;
            row
        })
        .collect()
}

/// Squared distance of two rows, in four sums for vectorisation.
fn square_distance(a: &[f64], b: &[f64]) -> f64 {
    let ((a4, a_rest), (b4, b_rest)) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    let mut sums = [0.0; 4];
    for (a, b) in a4.iter().zip(b4) {
        for i in 0..4 {
            let d = a[i] - b[i];
            sums[i] += d * d;
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| (a - b) * (a - b)).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// Standard deviation below which a dof counts as constant, radians and metres.
pub const STILL: f64 = 0.05;

/// Most frames of a motion that are warped, 17 s at 30 Hz. The cost of a warp is quadratic, so longer motions are reduced
/// first ([`Warp::stretched`]).
pub const MAX_FRAMES: usize = 512;

/// The dofs of a row that are warped: all but the root's velocities, which describe where the body goes rather than the
/// moment of the action.
pub fn shape(row: &[f64]) -> Vec<f64> {
    [&row[..dof::FORWARD], &row[dof::JOINTS..]].concat()
}

/// The [`shape`] of every row.
pub fn shapes(rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    rows.iter().map(|row| shape(row)).collect()
}

/// Both motions with every dof divided by its common standard deviation, at least [`STILL`], so that noise does not count
/// as motion.
pub fn standardised(u: &[Vec<f64>], y: &[Vec<f64>]) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let dofs = u.first().map_or(0, Vec::len);
    let mut scales = vec![STILL; dofs];
    for (d, scale) in scales.iter_mut().enumerate() {
        let variance = |m: &[Vec<f64>]| variance(m.iter().map(|r| r[d]));
        *scale = (0.5 * (variance(u) + variance(y))).sqrt().max(STILL);
    }
    let scaled = |m: &[Vec<f64>]| -> Vec<Vec<f64>> {
        m.iter().map(|r| r.iter().zip(&scales).map(|(v, s)| v / s).collect()).collect()
    };
    (scaled(u), scaled(y))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thinned_warp_is_stretched_to_whole_motions() {
        let course = |x: f64| x * (1.5 - 0.5 * x);
        let warp = |from: usize, to: usize| Warp {
            positions: (0..from).map(|i| (to - 1) as f64 * course(i as f64 / (from - 1) as f64)).collect(),
        };
        let whole = warp(500, 801);
        let found = warp(50, 61).stretched(500, 61, 801);
        assert!(
            found.positions.len() == 500 && found.mean_error(&whole) < 0.2,
            "{}",
            found.mean_error(&whole)
        );
        // Ends meet ends, and a warp that is whole stays as it is.
        assert_eq!((found.positions[0], found.positions[499]), (0.0, 800.0));
        assert_eq!(whole.clone().stretched(500, 801, 801), whole);
    }

    #[test]
    fn a_shape_has_no_velocities() {
        let row: Vec<f64> = (0..10).map(f64::from).collect();
        assert_eq!(shapes(&[row]), [[0.0, 1.0, 2.0, 3.0, 7.0, 8.0, 9.0]]);
    }
}
