//! Space-time interpolation: a pair of fragments blended in pose and in timing (Torresani 2006, section 5).
//!
//! The alignment is a curve `(p*(n), q*(n))`, `n` from 0 to L. `n⁰(u)` is its parameter at the frames of the first
//! fragment in their own timing, `n¹(u)` at those of the second, u from 0 to 1 over the output:
//!
//! ```text
//! T = (1-α) T_i + α T_j           frames of the output
//! n(u) = (1-α) n⁰(u) + α n¹(u)    position along the curve
//! X(u) = (1-α) X_i(p*(n(u))) + α X_j(q*(n(u)))
//! ```
//!
//! α = 0 is the first fragment and α = 1 the second, exactly; α from -0.25 to 1.25 extrapolates a little. Speeds of the
//! root are scaled by the pace of the output in each fragment, so that strides keep their length.

use gestus_core::blob::layout::dof;

use crate::effort::{ALPHA, align::align, fragment::Fragment};
use gestus_motion::body::row_at;

/// Least step along the curve per frame of the output, so that extrapolated timing never runs backwards.
const MIN_STEP: f64 = 0.02;

/// Two fragments that can be blended.
#[derive(Debug, Clone)]
pub struct Pair<'a> {
    first: &'a Fragment,
    second: &'a Fragment,
    /// Position along the curve of each frame of the first and of the second; ascending, from 0 to the end.
    meets: [Vec<f64>; 2],
}

impl<'a> Pair<'a> {
    /// Aligns two fragments.
    pub fn new(first: &'a Fragment, second: &'a Fragment) -> Self {
        let alignment = align(&first.content, &second.content);
        let end = (alignment.path.len() - 1) as f64;
        let meets = |count: usize, pick: fn(&(usize, usize)) -> usize| {
            let mut sums = vec![(0.0, 0.0); count];
            for (n, step) in alignment.path.iter().enumerate() {
                let slot = &mut sums[pick(step)];
                *slot = (slot.0 + n as f64, slot.1 + 1.0);
            }
            // Every frame is met; where it is held for a while, in the middle of that.
            let mut at: Vec<f64> = sums.iter().map(|(sum, count)| sum / count).collect();
            at[0] = 0.0;
            at[count - 1] = end;
            at
        };
        let both = [meets(first.rows.len(), |s| s.0), meets(second.rows.len(), |s| s.1)];
        Self { first, second, meets: both }
    }

    /// Number of frames of a blend.
    pub fn frames(&self, alpha: f64) -> usize {
        let (a, b) = (self.first.rows.len() as f64, self.second.rows.len() as f64);
        ((1.0 - alpha) * a + alpha * b).round().max(2.0) as usize
    }

    /// Positions in both fragments at each frame of the blend, in frames. Shape `[frames]`.
    pub fn positions(&self, alpha: f64) -> Vec<[f64; 2]> {
        let alpha = alpha.clamp(ALPHA.0, ALPHA.1);
        let count = self.frames(alpha);
        let ends = self.meets.each_ref().map(|m| (m.len() - 1) as f64);
        let end = self.meets[0][self.meets[0].len() - 1];
        let mut along: Vec<f64> = (0..count)
            .map(|k| {
                let u = k as f64 / (count - 1) as f64;
                let [own, theirs] = [0, 1].map(|side| at(&self.meets[side], u * ends[side]));
                (1.0 - alpha) * own + alpha * theirs
            })
            .collect();
        for k in 1..count {
            along[k] = along[k].max(along[k - 1] + MIN_STEP).min(end);
        }
        along[count - 1] = end;
        along.into_iter().map(|n| [0, 1].map(|side| inverse(&self.meets[side], n.clamp(0.0, end)))).collect()
    }

    /// The blend's dofs, shape `[frames][D]`.
    pub fn blend(&self, alpha: f64) -> Vec<Vec<f64>> {
        let alpha = alpha.clamp(ALPHA.0, ALPHA.1);
        let positions = self.positions(alpha);
        let last = positions.len() - 1;
        let pace = |k: usize, side: usize| {
            // Frames of the fragment for one of the output, over the two steps around it.
            let (before, after) = (k.saturating_sub(1), (k + 1).min(last));
            (positions[after][side] - positions[before][side]) / (after - before) as f64
        };
        positions
            .iter()
            .enumerate()
            .map(|(k, &[p, q])| {
                let (a, b) = (row_at(&self.first.rows, p), row_at(&self.second.rows, q));
                let paces = [pace(k, 0), pace(k, 1)];
                a.iter()
                    .zip(&b)
                    .enumerate()
                    .map(|(d, (a, b))| {
                        let speed = (dof::FORWARD..=dof::YAW).contains(&d);
                        let [a, b] = if speed { [a * paces[0], b * paces[1]] } else { [*a, *b] };
                        (1.0 - alpha) * a + alpha * b
                    })
                    .collect()
            })
            .collect()
    }
}

impl Pair<'_> {
    /// Which foot stands in the blend, from which stand in the two fragments. Shape `[frames]`.
    pub fn stands(&self, alpha: f64, of: &[Vec<[bool; 2]>; 2]) -> Vec<[bool; 2]> {
        let share = alpha.clamp(0.0, 1.0);
        let weights = [1.0 - share, share];
        let votes = |places: &[f64; 2], foot: usize| -> f64 {
            let vote = |side: usize| {
                let at = (places[side].round() as usize).min(of[side].len().saturating_sub(1));
                of[side].get(at).map_or(0.0, |feet| f64::from(u8::from(feet[foot])))
            };
            weights[0] * vote(0) + weights[1] * vote(1)
        };
        self.positions(alpha).iter().map(|places| [0, 1].map(|foot| votes(places, foot) > 0.5)).collect()
    }
}

/// Linear interpolation of values at integer positions.
fn at(values: &[f64], place: f64) -> f64 {
    let i = (place as usize).min(values.len() - 1);
    let next = (i + 1).min(values.len() - 1);
    values[i] + (place - i as f64) * (values[next] - values[i])
}

/// The position at which ascending values reach `value`.
fn inverse(values: &[f64], value: f64) -> f64 {
    let next = values.partition_point(|&v| v <= value).clamp(1, values.len() - 1);
    let (low, high) = (values[next - 1], values[next]);
    let t = if high > low { (value - low) / (high - low) } else { 0.0 };
    (next - 1) as f64 + t.clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effort::fragment::Span;

    fn fragment(frames: usize, course: impl Fn(f64) -> f64, size: f64) -> Fragment {
        let rows = (0..frames)
            .map(|i| {
                let x = course(i as f64 / (frames - 1) as f64);
                let mut row = vec![0.9, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
                // Forward speed: two metres over the whole, by the course.
                let before = course((i as f64 - 1.0) / (frames - 1) as f64);
                row[dof::FORWARD] = if i == 0 { 0.0 } else { 2.0 * (x - before) * 30.0 };
                row.extend([size * (4.0 * x).sin(), (2.0 * x).cos(), x]);
                row
            })
            .collect();
        Fragment::new(Span { clip: String::new(), from: 0, to: frames }, 0, 0, rows)
    }

    #[test]
    fn the_ends_are_the_fragments_and_lengths_go_between() {
        let (a, b) = (fragment(30, |x| x, 1.0), fragment(50, |x| x * x * (1.5 - 0.5 * x), 1.2));
        let pair = Pair::new(&a, &b);
        for (alpha, whole) in [(0.0, &a), (1.0, &b)] {
            let blend = pair.blend(alpha);
            assert_eq!(blend.len(), whole.rows.len());
            for (row, wanted) in blend.iter().zip(&whole.rows) {
                for d in (0..4).chain(7..10) {
                    assert!((row[d] - wanted[d]).abs() < 1e-9, "dof {d}: {} {}", row[d], wanted[d]);
                }
            }
        }
        for (alpha, frames) in [(-0.25, 25), (0.5, 40), (1.25, 55)] {
            let positions = pair.positions(alpha);
            assert_eq!(positions.len(), frames);
            assert_eq!((positions[0], positions[frames - 1]), ([0.0, 0.0], [29.0, 49.0]));
            for w in positions.windows(2) {
                assert!(w[1][0] >= w[0][0] && w[1][1] >= w[0][1], "{alpha}: {w:?}");
            }
        }
    }

    #[test]
    fn a_blend_covers_the_ground_of_both() {
        let (a, b) = (fragment(40, |x| x, 1.0), fragment(60, |x| x, 1.0));
        let covered = |rows: &[Vec<f64>]| rows.iter().map(|r| r[dof::FORWARD] / 30.0).sum::<f64>();
        let half = Pair::new(&a, &b).blend(0.5);
        assert!((covered(&half) - 2.0).abs() < 0.08, "{}", covered(&half));
    }
}
