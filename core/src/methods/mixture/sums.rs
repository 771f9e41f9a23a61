//! The examples of a class as sums of products: 13 sums a dof, to which neighbors are added one at a time.
//!
//! **Precision.** Sums are integers, taken about the first neighbor's values, which keeps them small. (About the query they
//! could be large, since it may lie far away.) Each dof has a unit of its own. It begins at a small part of the dof's
//! standard deviation, and grows by powers of two when a neighbor does not fit 12 bits; the sums so far are shifted
//! with it. No sum overflows, no product is shifted, and the largest difference has at least 11 bits, finer than the
//! steps of stored rows.

use crate::{
    math::fixed::magnitude_bits,
    methods::mixture::variables::{Example, FRACTION, X, X_PREV, Y_PREV},
    search::query::ALIGNED,
};

/// Sums over the neighbors: `p`, `q`, `x`, `y` stand for `x[t-1]`, `y[t-1]`, `x[t]`, `y[t]` less the first
/// neighbor's, in units of the dof; their products are in square units.
#[derive(Debug, Clone, Copy)]
struct Sums {
    p: i32,
    q: i32,
    x: i32,
    y: i32,
    pp: i32,
    qp: i32,
    qq: i32,
    xp: i32,
    xq: i32,
    xx: i32,
    py: i32,
    qy: i32,
    xy: i32,
}

impl Sums {
    const ZERO: Self =
        Self { p: 0, q: 0, x: 0, y: 0, pp: 0, qp: 0, qq: 0, xp: 0, xq: 0, xx: 0, py: 0, qy: 0, xy: 0 };

    /// Adds two neighbors whose differences do not fit the unit: coarsens the unit until they do. `size` is their largest
    /// difference, in parts, with half a unit of `bits` added. Returns the number of bits below the new unit.
    #[cold]
    #[inline(never)]
    fn coarsen_and_add(&mut self, batch: [[i32; 4]; BATCH], half: i32, bits: u8, size: i32) -> u8 {
        let needed = (32 - BITS as u8).saturating_sub(size.leading_zeros() as u8);
        self.coarsen(u32::from(needed.saturating_sub(bits)));
        let needed_bits = u32::from(needed & 31);
        let half = ((1 << needed_bits) >> 1) - half;
        self.add(batch.map(|differences| differences.map(|d| (d + half) >> needed_bits)));
        needed
    }

    /// Makes the unit larger by 2 to the power of `bits`.
    fn coarsen(&mut self, bits: u32) {
        for sum in [&mut self.p, &mut self.q, &mut self.x, &mut self.y] {
            *sum >>= bits;
        }
        let Self { pp, qp, qq, xp, xq, xx, py, qy, xy, .. } = self;
        for sum in [pp, qp, qq, xp, xq, xx, py, qy, xy] {
            *sum >>= (2 * bits).min(31);
        }
    }

    /// Adds two neighbors, in units.
    #[inline]
    fn add(&mut self, [[p, q, x, y], [p2, q2, x2, y2]]: [[i32; 4]; BATCH]) {
        self.p += p + p2;
        self.q += q + q2;
        self.x += x + x2;
        self.y += y + y2;
        // Products are added one by one: a single instruction each on processors that multiply and add.
        self.pp = self.pp + p * p + p2 * p2;
        self.qp = self.qp + q * p + q2 * p2;
        self.qq = self.qq + q * q + q2 * q2;
        self.xp = self.xp + x * p + x2 * p2;
        self.xq = self.xq + x * q + x2 * q2;
        self.xx = self.xx + x * x + x2 * x2;
        self.py = self.py + p * y + p2 * y2;
        self.qy = self.qy + q * y + q2 * y2;
        self.xy = self.xy + x * y + x2 * y2;
    }
}

/// Number of examples that are added together, so that the sums are loaded and stored once for all of them.
const BATCH: usize = 2;

/// Scratch memory of a frame: first for the aligned window of the query, then for examples that are not yet in the sums.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Scratch<const J: usize>([Example<J>; BATCH]);

impl<const J: usize> Scratch<J> {
    /// A constant of zeros, which every optimisation level writes in place.
    pub const NEW: Self = Self([[[[0; 4]; 4]; J]; BATCH]);

    /// At least [`ALIGNED`] numbers a joint, for [`Window::feature`](crate::search::query::Window::feature).
    pub fn aligned(&mut self) -> &mut [i32] {
        const { assert!(16 * BATCH >= ALIGNED) };
        self.0.as_flattened_mut().as_flattened_mut().as_flattened_mut()
    }
}

/// Bits of a neighbor's difference from the first one, in units. A product is then at most 2^24, and the sum of 64 products
/// 2^30, so that none overflows.
const BITS: u32 = 12;
/// Bits of a dof's standard deviation in the finest unit. Most neighbors lie within a quarter of it, and fit. Stored
/// rows have some 2^10 steps a deviation.
const SCALE_BITS: i32 = 14;

/// Number of an example's low bits that lie below the finest unit of a dof.
fn finest_bits(step: f32, scale: f32) -> u8 {
    // Of positive numbers the bits grow with the logarithm: this is the logarithm of their ratio, rounded down.
    let scale_bits = (scale.to_bits() as i32 - step.to_bits() as i32) >> 23;
    (FRACTION as i32 + scale_bits - SCALE_BITS).clamp(0, MAX_UNIT_BITS) as u8
}

/// Greatest number of bits below a unit: enough for the difference of any two variables.
const MAX_UNIT_BITS: i32 = 31 - BITS as i32;

/// The examples of one class, as sums.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Examples<const J: usize> {
    /// The first example, about which the sums are taken. It adds nothing to them.
    first: Example<J>,
    sums: [[Sums; 4]; J],
    /// Number of bits of the variables below the unit of each dof.
    fine_bits: [[u8; 4]; J],
    /// Number of examples in the scratch memory that are not yet in the sums.
    pending: u8,
    /// Number of examples.
    count: u16,
}

impl<const J: usize> Examples<J> {
    /// A constant of zeros, which every optimisation level writes in place.
    const NEW: Self = Self {
        first: [[[0; 4]; 4]; J],
        sums: [[Sums::ZERO; 4]; J],
        fine_bits: [[0; 4]; J],
        pending: 0,
        count: 0,
    };

    /// No examples.
    #[inline(never)]
    pub const fn new() -> Self {
        Self::NEW
    }

    /// Removes all examples. `dofs` has the quantisation step and the standard deviation of each dof, in its unit.
    pub fn clear(&mut self, dofs: impl Iterator<Item = [f32; 2]>) {
        self.sums.as_flattened_mut().fill(Sums::ZERO);
        (self.pending, self.count) = (0, 0);
        for (bits, [step, scale]) in self.fine_bits.as_flattened_mut().iter_mut().zip(dofs) {
            *bits = finest_bits(step, scale);
        }
    }

    /// Number of examples.
    pub fn count(&self) -> u16 {
        self.count
    }

    /// The memory for the next example, which the caller writes before it calls [`add`](Self::add).
    pub fn next_slot<'a>(&'a mut self, scratch: &'a mut Scratch<J>) -> &'a mut Example<J> {
        if self.count == 0 { &mut self.first } else { &mut scratch.0[usize::from(self.pending) % BATCH] }
    }

    /// Adds the example that was written to [`next_slot`](Self::next_slot).
    pub fn add(&mut self, dofs: usize, scratch: &Scratch<J>) {
        self.pending += u8::from(self.count > 0);
        self.count += 1;
        if usize::from(self.pending) >= BATCH {
            self.accumulate(dofs, scratch);
        }
    }

    /// Adds the examples that are left in the scratch memory to the sums, after the last one.
    pub fn finish(&mut self, dofs: usize, scratch: &Scratch<J>) {
        if self.pending > 0 {
            self.accumulate(dofs, scratch);
        }
    }

    fn accumulate(&mut self, dofs: usize, scratch: &Scratch<J>) {
        let pending = usize::from(core::mem::take(&mut self.pending));
        let sums = self.sums.as_flattened_mut().get_mut(..dofs).unwrap_or(&mut []);
        // The first example once more adds nothing to any sum.
        let example =
            |i: usize| scratch.0.get(i).filter(|_| i < pending).unwrap_or(&self.first).as_flattened();
        let bits = self.fine_bits.as_flattened_mut();
        accumulate(sums, bits, self.first.as_flattened(), [example(0), example(1)]);
    }

    /// The examples of a dof about their mean; `None` without examples.
    pub(super) fn scatter(&self, dof: usize) -> Option<Scatter> {
        let (sums, first) = (self.sums.as_flattened().get(dof)?, self.first.as_flattened().get(dof)?);
        let bits = *self.fine_bits.as_flattened().get(dof)?;
        (self.count > 0).then(|| Scatter::new(first, sums, u32::from(bits & 31), i32::from(self.count)))
    }

    /// Mean `x[t-1]`, `y[t-1]` and `x[t]` of a dof over the examples, in quantisation steps; zeros without examples.
    pub fn means(&self, dof: usize) -> [f32; 3] {
        let Some(Scatter { bits, first, offsets, .. }) = self.scatter(dof) else { return [0.0; 3] };
        let parts = (1u32 << bits) as f32 * (1.0 / (1 << FINER_BITS) as f32);
        let mean = |i: usize| (first[i] as f32 + offsets[i] as f32 * parts) * (1.0 / (1 << FRACTION) as f32);
        [mean(X_PREV), mean(Y_PREV), mean(X)]
    }
}

/// The examples of a dof about their mean: `p`, `q`, `x`, `y` as in [`Sums`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Scatter {
    /// Number of bits of the variables below the unit.
    pub bits: u32,
    /// The first example, in parts.
    pub first: [i32; 4],
    /// The means less the first example, in units with [`FINER_BITS`] fractional bits.
    pub offsets: [i32; 4],
    /// The means, in whole units.
    pub means: [i32; 4],
    /// Sums of products in square units: pp, qp, qq, xp, xq, xx. Each has an error of at most [`max_rounding_error`].
    pub matrix: [i32; 6],
    /// Sums of products with `y`: py, qy, xy.
    pub right: [i32; 3],
}

impl Scatter {
    // Not inlined, so that it is compiled with the core, optimised for speed.
    #[inline(never)]
    fn new(first: &[i32; 4], sums: &Sums, bits: u32, count: i32) -> Self {
        let &Sums { p, q, x, y, pp, qp, qq, xp, xq, xx, py, qy, xy } = sums;
        let inverse = ((1 << INVERSE_BITS) + count / 2) / count;
        // The mean in whole units, one off at most, and what the sum has beyond it.
        let parts = [p, q, x, y].map(|sum| {
            let offset = mean(sum, inverse);
            (offset, sum - count * offset)
        });
        let offsets = parts.map(|(offset, rest)| (offset << FINER_BITS) + mean(rest << FINER_BITS, inverse));
        // Σ (p - m)(q - k) = Σ pq - n m k - m (Σ q - n k) - k (Σ p - n m), for any m and k.
        let about = |sum: i32, i: usize, j: usize| {
            let ((m, m_rest), (k, k_rest)) = (parts[i], parts[j]);
            sum - count * (m * k) - m * k_rest - k * m_rest
        };
        let half = (1 << bits) >> 1;
        Self {
            bits,
            first: *first,
            offsets,
            means: core::array::from_fn(|i| (first[i].saturating_add(half) >> bits) + parts[i].0),
            matrix: [
                about(pp, 0, 0),
                about(qp, 1, 0),
                about(qq, 1, 1),
                about(xp, 2, 0),
                about(xq, 2, 1),
                about(xx, 2, 2),
            ],
            right: [about(py, 0, 3), about(qy, 1, 3), about(xy, 2, 3)],
        }
    }
}

/// Greatest rounding error of the sums of products of `count` examples, in square units: from coarsening the unit, and
/// as much from the means.
pub(super) fn max_rounding_error(count: u16) -> f32 {
    f32::from(count) * 2.0
}

/// Fractional bits of means in units.
pub(super) const FINER_BITS: u32 = 4;
/// Fractional bits of the inverse of a count.
const INVERSE_BITS: u32 = 17;

/// The mean from a sum and the inverse of the count, rounded to the nearest.
fn mean(sum: i32, inverse: i32) -> i32 {
    (sum * inverse + (1 << (INVERSE_BITS - 1))) >> INVERSE_BITS
}

/// Adds a batch to the sums. Not inlined, so that the loop has all registers to itself.
#[inline(never)]
fn accumulate(
    sums: &mut [Sums],
    fine_bits: &mut [u8],
    first: &[[i32; 4]],
    [first_example, second_example]: [&[[i32; 4]]; BATCH],
) {
    for (((sums, bits), first), examples) in
        sums.iter_mut().zip(fine_bits).zip(first).zip(first_example.iter().zip(second_example))
    {
        let half = 1 << (*bits & 31) >> 1;
        // Rows are at most 98,302 steps apart, 1.62e9 parts. Half a unit more, for rounding to the nearest.
        let first = first.map(|first| first - half);
        let difference =
            |variables: &[i32; 4]| -> [i32; 4] { core::array::from_fn(|i| variables[i] - first[i]) };
        let batch = [difference(examples.0), difference(examples.1)];
        let size = magnitude_bits(batch.as_flattened().iter().copied());
        if size >> (*bits & 31) < 1 << BITS {
            sums.add(batch.map(|differences| differences.map(|d| d >> (*bits & 31))));
        } else {
            *bits = sums.coarsen_and_add(batch, half, *bits, size);
        }
    }
}

impl<const J: usize> Default for Examples<J> {
    fn default() -> Self {
        Self::new()
    }
}
