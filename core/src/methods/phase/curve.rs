//! Interpolation of tables between their knots: uniform Catmull-Rom splines, in integers.

use crate::math::clamp;

/// The fixed-point weight that stands for 1.
pub(super) const ONE: i32 = 4096;

/// A place among the knots of a table: four knots and their weights, which sum to [`ONE`].
///
/// Each weight is between -0.08 and 1, and the sum of their absolute values at most 1.25.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Place {
    /// The knots, in order.
    pub knots: [usize; 4],
    /// Their weights.
    pub weights: [i32; 4],
}

impl Place {
    /// The place of a phase, 0 to 1, among `count` knots, at least 2. The first knot of a cycle follows its last. Any
    /// other table keeps its first and last values beyond its ends.
    pub fn of(phase: f32, count: usize, is_cyclic: bool) -> Self {
        let last = count.saturating_sub(1);
        let at = phase * if is_cyclic { count as f32 } else { last as f32 };
        // The cast turns negative values and NaN into 0.
        let start = (at as usize).min(last);
        let t = clamp(at - start as f32, 0.0, 1.0);
        let (t2, t3) = (t * t, t * t * t);
        let fixed = |weight: f32| (weight * ONE as f32) as i32;
        let (before, after) = (fixed(t2 - 0.5 * (t + t3)), fixed(0.5 * (t3 - t2)));
        let next = fixed(0.5 * t + 2.0 * t2 - 1.5 * t3);
        let follows = |knot: usize| {
            if knot < last {
                knot + 1
            } else if is_cyclic {
                0
            } else {
                last
            }
        };
        let precedes = if start > 0 {
            start - 1
        } else if is_cyclic {
            last
        } else {
            0
        };
        Self {
            knots: [precedes, start, follows(start), follows(follows(start))],
            weights: [before, ONE - before - next - after, next, after],
        }
    }

    /// Adds the codes of four rows, i8 one a byte, to `values`, in 1/4096 of a code.
    #[inline(never)]
    pub fn add_codes(&self, rows: [&[u8]; 4], values: &mut [i32]) {
        let [a, b, c, d] = rows;
        let [wa, wb, wc, wd] = self.weights;
        for ((((value, &a), &b), &c), &d) in values.iter_mut().zip(a).zip(b).zip(c).zip(d) {
            *value += wa * code(a) + wb * code(b) + wc * code(c) + wd * code(d);
        }
    }

    /// The same for rows with two codes for each value. Each code is multiplied by its factor, in 1/256, at most 512.
    #[inline(never)]
    pub fn add_pairs(&self, rows: [&[u8]; 4], factors: [i32; 2], values: &mut [i32]) {
        let [a, b, c, d] = rows.map(|row| row.as_chunks::<2>().0);
        let [wa, wb, wc, wd] = self.weights.map(|w| factors.map(|factor| (w * factor) >> 8));
        let add = |w: [i32; 2], row: &[u8; 2]| w[0] * code(row[0]) + w[1] * code(row[1]);
        for ((((value, a), b), c), d) in values.iter_mut().zip(a).zip(b).zip(c).zip(d) {
            *value += add(wa, a) + add(wb, b) + add(wc, c) + add(wd, d);
        }
    }
}

#[inline]
fn code(byte: u8) -> i32 {
    i32::from(byte as i8)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The spline as its four points define it, in f64.
    fn spline(points: [f64; 4], t: f64) -> f64 {
        let [p0, p1, p2, p3] = points;
        0.5 * (2.0 * p1
            + (p2 - p0) * t
            + (2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3) * t * t
            + (3.0 * p1 - p0 - 3.0 * p2 + p3) * t * t * t)
    }

    #[test]
    fn a_table_is_read_as_a_catmull_rom_spline() {
        let table = [3i8, -120, 90, 7, 55, -8];
        let rows: std::vec::Vec<[u8; 2]> = table.iter().map(|&v| [v as u8, (v / 2) as u8]).collect();
        for is_cyclic in [true, false] {
            for i in 0..=1000 {
                let phase = i as f32 / 1000.0;
                let place = Place::of(phase, table.len(), is_cyclic);
                let (mut found, mut pairs) = ([0; 1], [0; 1]);
                let knots = place.knots.map(|k| &rows[k]);
                place.add_codes(knots.map(|row| &row[..1]), &mut found);
                place.add_pairs(knots.map(|row| &row[..]), [256, -512], &mut pairs);
                let count = table.len() as i32;
                let at = f64::from(phase) * if is_cyclic { 6.0 } else { 5.0 };
                let start = at.floor().min(5.0);
                let value = |of: fn(i8) -> f64| {
                    let point = |k: i32| {
                        let k = start as i32 + k;
                        let k = if is_cyclic { k.rem_euclid(count) } else { k.clamp(0, count - 1) };
                        of(table[k as usize])
                    };
                    spline([point(-1), point(0), point(1), point(2)], at - start)
                };
                let off = f64::from(found[0]) / 4096.0 - value(f64::from);
                assert!(off.abs() < 0.2, "{phase} {is_cyclic}: {off}");
                let off = f64::from(pairs[0]) / 4096.0 - value(|v| f64::from(v) - 2.0 * f64::from(v / 2));
                assert!(off.abs() < 0.4, "{phase} {is_cyclic}: {off}");
                assert_eq!(place.weights.iter().sum::<i32>(), ONE);
                assert!(place.weights.iter().map(|w| w.abs()).sum::<i32>() <= ONE * 5 / 4 + 3);
            }
        }
    }

    #[test]
    fn no_phase_leaves_the_table() {
        for phase in [-1e9, -0.1, 0.0, 1.0, 1.2, 1e9, f32::NAN, f32::INFINITY] {
            for (count, is_cyclic) in [(2, true), (2, false), (64, true)] {
                assert!(Place::of(phase, count, is_cyclic).knots.iter().all(|&k| k < count));
            }
        }
    }
}
