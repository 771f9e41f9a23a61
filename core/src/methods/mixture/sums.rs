//! The examples of a class, as sums of products: 13 a dof, to which neighbors are added one at a time.
//!
//! **Precision.** The sums are taken about the first neighbor's values, which makes them small (about the query they are
//! not: it may lie far away), and in whole numbers. Each dof has a unit of its own: it begins at a small part of the dof's
//! standard deviation, and grows by powers of two when a neighbor does not fit 12 bits; the sums so far are shifted with
//! it. So no sum overflows, no product is shifted, and the largest difference has 11 bits or more: a row's own steps are
//! coarser.

use crate::{
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

    /// Adds two neighbors whose differences, in parts and with half a unit of `bits` added, are as large as `size`: takes up
    /// units in which they fit. Returns the bits that these leave out.
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

    /// Takes up units that are 2 to the power of `bits` larger.
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
        // One product after the other onto the sum: an instruction each, where the processor multiplies and adds.
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

/// Examples that are taken in together: the sums are loaded and stored once for all of them.
const BATCH: usize = 2;

/// Memory that is used within a frame alone: for the aligned window while the query is made, then for examples that have
/// not yet been added to the sums.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Scratch<const J: usize>([Example<J>; BATCH]);

impl<const J: usize> Scratch<J> {
    /// As a constant that is all zeros it is written where it goes, whatever the level of optimisation.
    pub const NEW: Self = Self([[[[0; 4]; 4]; J]; BATCH]);

    /// At least [`ALIGNED`] numbers a joint, for [`Window::feature`](crate::search::query::Window::feature).
    pub fn aligned(&mut self) -> &mut [i32] {
        const { assert!(16 * BATCH >= ALIGNED) };
        self.0.as_flattened_mut().as_flattened_mut().as_flattened_mut()
    }
}

/// Bits of a neighbor's difference from the first one, in units. So no sum of products overflows: one is 2^24 at most,
/// and the sum of 64 is 2^30.
const BITS: u32 = 12;
/// Bits of a dof's standard deviation in the finest units: most neighbors lie within a quarter of it, and fit. Rows are
/// stored in steps of some 2^10 a deviation.
const SCALE_BITS: i32 = 14;

/// How many bits a dof's finest unit lies above the last one of an example's variables.
fn finest_bits(step: f32, scale: f32) -> u8 {
    // Of positive numbers the bits grow with the logarithm: this is the logarithm of their ratio, rounded down.
    let scale_bits = (scale.to_bits() as i32 - step.to_bits() as i32) >> 23;
    (FRACTION as i32 + scale_bits - SCALE_BITS).clamp(0, MOST_BITS) as u8
}

/// Enough for any two variables.
const MOST_BITS: i32 = 31 - BITS as i32;

/// The examples of one class, as sums.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Examples<const J: usize> {
    /// The first example: what the sums are taken about, and to which it therefore adds nothing.
    first: Example<J>,
    sums: [[Sums; 4]; J],
    /// Of every dof, how many bits of the variables its unit leaves out.
    fine_bits: [[u8; 4]; J],
    /// Examples in the scratch memory, not yet in the sums.
    held: u8,
    /// Examples in all.
    count: u16,
}

impl<const J: usize> Examples<J> {
    /// As a constant that is all zeros it is written where it goes, whatever the level of optimisation.
    const NEW: Self = Self {
        first: [[[0; 4]; 4]; J],
        sums: [[Sums::ZERO; 4]; J],
        fine_bits: [[0; 4]; J],
        held: 0,
        count: 0,
    };

    /// No examples.
    #[inline(never)]
    pub const fn new() -> Self {
        Self::NEW
    }

    /// Forgets the examples; `dofs` has the quantisation step and the standard deviation of every dof.
    pub fn clear(&mut self, dofs: impl Iterator<Item = [f32; 2]>) {
        self.sums.as_flattened_mut().fill(Sums::ZERO);
        (self.held, self.count) = (0, 0);
        for (bits, [step, scale]) in self.fine_bits.as_flattened_mut().iter_mut().zip(dofs) {
            *bits = finest_bits(step, scale);
        }
    }

    /// How many were taken in.
    pub fn count(&self) -> u16 {
        self.count
    }

    /// Where the next example is to be written before [`add`](Self::add) takes it.
    pub fn next_slot<'a>(&'a mut self, scratch: &'a mut Scratch<J>) -> &'a mut Example<J> {
        if self.count == 0 { &mut self.first } else { &mut scratch.0[usize::from(self.held) % BATCH] }
    }

    /// The example that [`next_slot`](Self::next_slot) gave has been written.
    pub fn add(&mut self, dofs: usize, scratch: &Scratch<J>) {
        self.held += u8::from(self.count > 0);
        self.count += 1;
        if usize::from(self.held) >= BATCH {
            self.accumulate(dofs, scratch);
        }
    }

    /// The last example was added: adds what is left in the scratch memory to the sums.
    pub fn finish(&mut self, dofs: usize, scratch: &Scratch<J>) {
        if self.held > 0 {
            self.accumulate(dofs, scratch);
        }
    }

    fn accumulate(&mut self, dofs: usize, scratch: &Scratch<J>) {
        let held = usize::from(core::mem::take(&mut self.held));
        let sums = self.sums.as_flattened_mut().get_mut(..dofs).unwrap_or(&mut []);
        // The first example once more adds nothing to any sum.
        let one = |i: usize| scratch.0.get(i).filter(|_| i < held).unwrap_or(&self.first).as_flattened();
        let bits = self.fine_bits.as_flattened_mut();
        accumulate(sums, bits, self.first.as_flattened(), [one(0), one(1)]);
    }

    /// The examples of a dof about their mean; `None` of no examples.
    pub(super) fn scatter(&self, dof: usize) -> Option<Scatter> {
        let (sums, first) = (self.sums.as_flattened().get(dof)?, self.first.as_flattened().get(dof)?);
        let bits = *self.fine_bits.as_flattened().get(dof)?;
        (self.count > 0).then(|| Scatter::new(first, sums, u32::from(bits & 31), i32::from(self.count)))
    }

    /// Mean `x[t-1]`, `y[t-1]` and `x[t]` of a dof over the examples, in steps; zeros of none.
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
    /// Bits of the variables that a fine unit leaves out.
    pub bits: u32,
    /// The first example, in parts.
    pub first: [i32; 4],
    /// The means less the first example, in units with [`FINER_BITS`] bits behind the point.
    pub offsets: [i32; 4],
    /// The means, in whole units.
    pub means: [i32; 4],
    /// Sums of products in square units: pp, qp, qq, xp, xq, xx. Each is off by [`most_off`] at most.
    pub matrix: [i32; 6],
    /// Sums of products with `y`: py, qy, xy.
    pub right: [i32; 3],
}

impl Scatter {
    // Not inlined: it is compiled with the core, for speed, however its caller is.
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

/// How much the sums of products of so many examples can be off, in square units: by what is left out where a unit grows,
/// and as much for the means.
pub(super) fn most_off(count: u16) -> f32 {
    f32::from(count) * 2.0
}

/// Bits behind the point of means in units.
pub(super) const FINER_BITS: u32 = 4;
/// Bits behind the point of the inverse of a count.
const INVERSE_BITS: u32 = 17;

/// A sum, of [`BITS`] a count, times the inverse of the count, to the nearest.
fn mean(sum: i32, inverse: i32) -> i32 {
    (sum * inverse + (1 << (INVERSE_BITS - 1))) >> INVERSE_BITS
}

/// Adds a batch to the sums. A function of its own, so that what is around it leaves it its registers.
#[inline(never)]
fn accumulate(sums: &mut [Sums], fine_bits: &mut [u8], first: &[[i32; 4]], [one, two]: [&[[i32; 4]]; BATCH]) {
    for (((sums, bits), first), examples) in
        sums.iter_mut().zip(fine_bits).zip(first).zip(one.iter().zip(two))
    {
        let half = 1 << (*bits & 31) >> 1;
        // Rows are at most 98,302 steps apart, 1.62e9 parts. Half a unit more, for rounding to the nearest.
        let first = first.map(|first| first - half);
        let less = |variables: &[i32; 4]| -> [i32; 4] { core::array::from_fn(|i| variables[i] - first[i]) };
        let batch = [less(examples.0), less(examples.1)];
        // The bits of the largest.
        let size = batch.as_flattened().iter().fold(0, |size, &d| size | (d ^ (d >> 31)));
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
