//! The least squares of one dof: a symmetric positive system of three unknowns, in integers.
//!
//! `A = L Lᵀ` (Cholesky), and the wanted `β·v` with `A β = r` is `(L⁻¹ r)·(L⁻¹ v)`: no coefficient is ever made. The
//! unknowns are first scaled by powers of two so that `A`'s diagonal lies in a quarter to 1; then no entry of `L` is
//! above 1, since `L[i][j]² ≤ A[i][i]`, and 29 fractional bits hold them all.

use crate::math::fixed::{BITS, InverseSqrt, bit_length, product, shift};

/// Bits of the largest entry of `r` and of `v` where the pivots' roots are not below one half; each further power of two
/// takes one away, since division by a pivot's root makes entries larger.
const SOLVED_BITS: i32 = 27;
/// No entry of `L⁻¹ r` or `L⁻¹ v` is larger: three products fit 63 bits.
const MAX_ENTRY: i32 = 1 << 30;
/// A pivot is held above that part of the diagonal, 2^-21: a singular system gives a finite answer.
const MIN_PIVOT: i32 = 1 << 8;
/// Bits of an entry of a system, at most.
pub const ENTRY_BITS: i32 = 28;
/// Fractional bits of an answer.
pub const ANSWER_BITS: u32 = 1;

/// Normal equations `A β = r` of three unknowns, in any unit that they share; entries are below 2^28.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct System {
    /// `A` by its lower triangle: 00, 10, 11, 20, 21, 22.
    pub matrix: [i32; 6],
    /// `r`.
    pub right: [i32; 3],
}

impl System {
    /// `β·v`, with [`ANSWER_BITS`] fractional bits, clamped to 31 bits.
    pub fn evaluate(&self, v: [i32; 3]) -> i32 {
        let [a00, a10, a11, a20, a21, a22] = self.matrix;
        let scales = [a00, a11, a22].map(|d| (d.max(1).leading_zeros() as i32 - 3) >> 1);
        let [s0, s1, s2] = scales;
        let at = |entry: i32, power: i32| entry << (power & 31);
        let (a00, a11, a22) = (at(a00, 2 * s0), at(a11, 2 * s1), at(a22, 2 * s2));
        let (a10, a20, a21) = (at(a10, s0 + s1), at(a20, s0 + s2), at(a21, s1 + s2));

        const ONE: i32 = 1 << BITS;
        let i0 = InverseSqrt::new(a00.max(MIN_PIVOT));
        let (l10, l20) = (i0.of(a10, ONE), i0.of(a20, ONE));
        let i1 = InverseSqrt::new((a11 - product(l10, l10, BITS)).max(MIN_PIVOT));
        let l21 = i1.of(a21 - product(l20, l10, BITS), ONE);
        let pivot = a22 - product(l20, l20, BITS) - product(l21, l21, BITS);
        let i2 = InverseSqrt::new(pivot.max(MIN_PIVOT));

        let forward = |[b0, b1, b2]: [i32; 3]| {
            let z0 = i0.of(b0, MAX_ENTRY);
            let z1 = i1.of(b1 - product(l10, z0, BITS), MAX_ENTRY);
            [z0, z1, i2.of(b2 - product(l20, z0, BITS) - product(l21, z1, BITS), MAX_ENTRY)]
        };
        let bits = SOLVED_BITS - i1.power().max(i2.power()) as i32;
        let (right, r_power) = balanced(self.right, scales, bits);
        let (v, v_power) = balanced(v, scales, bits);
        let (z, w) = (forward(right), forward(v));
        let sum: i64 = z.iter().zip(w).map(|(&z, w)| i64::from(z) * i64::from(w)).sum();
        let bits = BITS as i32 - ANSWER_BITS as i32 + r_power + v_power;
        let sum = sum >> bits.clamp(0, 63);
        let most = i64::from(i32::MAX >> (-bits).clamp(0, 31));
        (sum.max(-most).min(most) as i32) << (-bits).clamp(0, 31)
    }
}

/// Three numbers, each times 2 to the power of its scale, brought to one common scale in which the largest has `bits`
/// bits. The second value is the binary logarithm of the factor that they have been multiplied by.
fn balanced(values: [i32; 3], scales: [i32; 3], bits: i32) -> ([i32; 3], i32) {
    let longest = |i: usize| bit_length(values[i]) + scales[i];
    let power = bits - longest(0).max(longest(1)).max(longest(2));
    (core::array::from_fn(|i| shift(values[i], scales[i] + power)), power)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `β·v` in f64, by Gauss and Jordan.
    fn slow(system: &System, v: [i32; 3]) -> f64 {
        let [a00, a10, a11, a20, a21, a22] = system.matrix.map(f64::from);
        let [r0, r1, r2] = system.right.map(f64::from);
        let mut a = [[a00, a10, a20, r0], [a10, a11, a21, r1], [a20, a21, a22, r2]];
        for i in 0..3 {
            let pivot = a[i].map(|entry| entry / a[i][i]);
            for (k, row) in a.iter_mut().enumerate() {
                let factor = row[i];
                for (entry, p) in row.iter_mut().zip(pivot) {
                    *entry = if k == i { p } else { *entry - factor * p };
                }
            }
        }
        a.iter().zip(v).map(|(row, v)| row[3] * f64::from(v)).sum()
    }

    /// Largest answer.
    const MOST_ANSWER: f64 = (i32::MAX >> ANSWER_BITS) as f64;

    fn answer(system: &System, v: [i32; 3]) -> f64 {
        f64::from(system.evaluate(v)) / f64::from(1 << ANSWER_BITS)
    }

    #[test]
    fn any_scale_is_solved_as_in_f64() {
        let mut seed = 1u32;
        let mut random = move |most: i32| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((i64::from(seed) * i64::from(2 * most + 1)) >> 32) as i32 - most
        };
        for bits in [8, 16, 24, 27] {
            for uneven in [0, 2, 5] {
                for _ in 0..500 {
                    // A = M Mᵀ and a ridge of a 16th; the last unknown is smaller.
                    let m: [[i32; 3]; 3] = core::array::from_fn(|_| core::array::from_fn(|_| random(1000)));
                    let scale = [0, uneven, 2 * uneven];
                    let entry = |i: usize, j: usize| {
                        let sum: f64 = (0..3).map(|k| f64::from(m[i][k]) * f64::from(m[j][k])).sum();
                        let sum = sum / 3e6 + if i == j { 1.0 / 16.0 } else { 0.0 };
                        (sum * 2f64.powi(bits - scale[i] - scale[j]) * 0.9) as i32
                    };
                    let system = System {
                        matrix: [
                            entry(0, 0),
                            entry(1, 0),
                            entry(1, 1),
                            entry(2, 0),
                            entry(2, 1),
                            entry(2, 2),
                        ],
                        right: core::array::from_fn(|i| random(1 << (bits - scale[i]).max(1))),
                    };
                    if system.matrix[5] < 16 {
                        continue;
                    }
                    let v = core::array::from_fn(|_| random(1 << 18));
                    let (found, truth) = (answer(&system, v), slow(&system, v));
                    // More is held.
                    let truth = truth.clamp(-MOST_ANSWER, MOST_ANSWER);
                    let size = 2f64.powi(18 + uneven * 2) + truth.abs();
                    assert!(
                        (found - truth).abs() < 6e-6 * size + 0.1,
                        "{system:?} {v:?}: {found} not {truth}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_singular_system_and_any_extreme_are_held() {
        const M: i32 = (1 << ENTRY_BITS) - 1;
        for matrix in [[0; 6], [1; 6], [M; 6], [M, M, 0, 0, 0, 0], [0, 0, 0, 0, 0, M], [M, -M, M, M, -M, M]] {
            for right in [[0; 3], [M; 3], [-M, M, -M]] {
                for v in [[0; 3], [i32::MAX; 3], [i32::MIN, 1, i32::MAX]] {
                    let held = answer(&System { matrix, right }, v);
                    assert!(held.abs() <= MOST_ANSWER + 1.0, "{matrix:?} {right:?} {v:?}: {held}");
                }
            }
        }
    }

    #[test]
    fn what_is_too_large_for_an_answer_is_held() {
        let system = System { matrix: [16, 0, 16, 0, 0, 16], right: [1 << 20, 0, 0] };
        assert!(system.evaluate([1 << 30, 0, 0]) > 1 << 30);
        assert!(system.evaluate([-1 << 30, 0, 0]) < -1 << 30);
    }
}
