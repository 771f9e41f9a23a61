//! The least squares of one dof: a symmetric positive system of four unknowns, in closed form.

/// Normal equations `A β = r` of four unknowns; `A` by its lower triangle, row after row.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct System {
    /// `A`: 00, 10, 11, 20, 21, 22, 30, 31, 32, 33.
    pub matrix: [f32; 10],
    /// `r`.
    pub right: [f32; 4],
}

impl System {
    /// Solves by L D Lᵀ: 30 multiplications, 4 divisions, no square root. Pivots are held above a 10⁻¹² part of
    /// the diagonal, so that a singular system gives a finite answer.
    pub fn solve(&self) -> [f32; 4] {
        let [a00, a10, a11, a20, a21, a22, a30, a31, a32, a33] = self.matrix;
        let [r0, r1, r2, r3] = self.right;
        let floor = 1e-12 * (a00 + a11 + a22 + a33) + f32::MIN_POSITIVE;
        let invert = |pivot: f32| 1.0 / if pivot > floor { pivot } else { floor };

        let i0 = invert(a00);
        let (l10, l20, l30) = (a10 * i0, a20 * i0, a30 * i0);
        let i1 = invert(a11 - l10 * a10);
        let (u21, u31) = (a21 - l20 * a10, a31 - l30 * a10);
        let (l21, l31) = (u21 * i1, u31 * i1);
        let i2 = invert(a22 - l20 * a20 - l21 * u21);
        let u32 = a32 - l30 * a20 - l31 * u21;
        let l32 = u32 * i2;
        let i3 = invert(a33 - l30 * a30 - l31 * u31 - l32 * u32);

        let z0 = r0;
        let z1 = r1 - l10 * z0;
        let z2 = r2 - l20 * z0 - l21 * z1;
        let z3 = r3 - l30 * z0 - l31 * z1 - l32 * z2;

        let b3 = z3 * i3;
        let b2 = z2 * i2 - l32 * b3;
        let b1 = z1 * i1 - l21 * b2 - l31 * b3;
        let b0 = z0 * i0 - l10 * b1 - l20 * b2 - l30 * b3;
        [b0, b1, b2, b3]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_solution_satisfies_the_equations() {
        // A = M Mᵀ + I for a fixed M.
        let m =
            [[1.0f32, 0.2, -0.4, 0.3], [0.5, 1.1, 0.7, -0.2], [-0.3, 0.9, 0.6, 0.1], [0.8, -0.6, 0.2, 1.3]];
        let a =
            |i: usize, j: usize| (0..4).map(|k| m[i][k] * m[j][k]).sum::<f32>() + f32::from(u8::from(i == j));
        let system = System {
            matrix: [
                a(0, 0),
                a(1, 0),
                a(1, 1),
                a(2, 0),
                a(2, 1),
                a(2, 2),
                a(3, 0),
                a(3, 1),
                a(3, 2),
                a(3, 3),
            ],
            right: [1.0, -2.0, 0.5, 3.0],
        };
        let b = system.solve();
        for i in 0..4 {
            let left: f32 = (0..4).map(|j| a(i, j) * b[j]).sum();
            assert!((left - system.right[i]).abs() < 1e-5, "{i}: {left}");
        }
    }

    #[test]
    fn a_singular_system_gives_finite_numbers() {
        for matrix in [[0.0; 10], [1.0; 10]] {
            let b = System { matrix, right: [1.0; 4] }.solve();
            assert!(b.iter().all(|v| v.is_finite()), "{b:?}");
        }
    }
}
