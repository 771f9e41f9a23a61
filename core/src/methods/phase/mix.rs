//! The outputs of the classes at their phases, mixed.
//!
//! ```text
//! y = x + Σ w [A - M + S' - S - (1 - g) clamp(X - M - S, ±3 σ)]
//!
//! X      the input                M, A   mean of the input's class and mean output, at the phase
//! w      weight of the pair       S, S'  slopes of both on the drift about the input class's mean
//! g      gain of the class        σ      spread of the class; no bound for dofs of the root's group
//! ```
//!
//! A departure beyond 3 σ is a gesture, which is passed through entirely. A pair without an output class adds nothing: its
//! output is the input.
//!
//! In integers: values in 1/4096 of a dof's code, sums of weighted values in 1/256 of a code and 1/2048 of a weight.
//! Bounds, from i8 codes, a spline's weights (1.25 at most) and factors of at most 2:
//!
//! ```text
//! |A|, |M| <= 128 · 1.25 · 4096 < 2^19.4      |S|, |S'| <= 2 · 2 · 128 · 1.25 · 4096 + rounding < 2^21.4
//! |X| <= 2^24                                 |clamp| <= 2^22
//! |a pair| < 2 · 2^19.4 + 2 · 2^21.4 + 2^22 < 2^23.4, in 1/256 of a code < 2^19.4
//! |sum| < 2^19.4 · (2048 + half a unit a pair, of at most 256 pairs) < 2^31
//! ```

use super::curve::{ONE, Place};
use crate::{
    blob::{Database, PhaseTables, layout::dof},
    math::clamp,
    stylizer::style_mix::Settings,
};

/// Greatest input, in 1/4096 of a code.
const MAX_INPUT: f32 = (1 << 24) as f32;
/// Greatest departure that counts as variation within the class, in 1/4096 of a code.
const MAX_DEPARTURE: i32 = 1 << 22;
/// Standard deviations beyond which a joint outside of the root's group makes a gesture.
const GESTURE_DEVIATIONS: i32 = 3;
/// The fixed-point weight that stands for 1.
const WEIGHT: f32 = 2048.0;
/// Greatest factor of a slope: 2, in 1/256.
const MAX_FACTOR: f32 = 512.0;

/// The sum of the outputs of a frame. Not generic over capacities, so that it is compiled with the core, optimised for
/// speed. All slices are `[dofs]`.
pub(crate) struct TableMix<'a, 'db> {
    database: &'a Database<'db>,
    /// X, in 1/4096 of a code.
    input: &'a mut [i32],
    /// The part that all pairs of the current input class share.
    base: &'a mut [i32],
    /// The current pair, in 1/4096 of a code.
    pair: &'a mut [i32],
    /// Sum of the weighted pairs, in 1/256 of a code and 1/2048 of a weight.
    sum: &'a mut [i32],
}

/// The phase at which a class's tables are read, and the factors of its slopes.
#[derive(Clone, Copy)]
pub(crate) struct CyclePoint {
    /// Phase, 0 to 1.
    pub(crate) phase: f32,
    /// Factors of the slopes, in 1/256 of a code.
    pub(crate) factors: [i32; 2],
}

impl CyclePoint {
    /// A phase, and the drift about the class's mean: m/s and rad/s.
    pub(crate) fn new(database: &Database<'_>, phase: f32, drift: [f32; 2]) -> Self {
        let [speed, yaw] = database.slope_steps();
        let factor = |drift: f32, step: f32| clamp(drift * step * 256.0, -MAX_FACTOR, MAX_FACTOR) as i32;
        Self { phase, factors: [factor(drift[0], speed), factor(drift[1], yaw)] }
    }
}

impl<'a, 'db> TableMix<'a, 'db> {
    /// An empty mix for a frame with dofs `x`. `memory` has at least four numbers a dof.
    #[inline(never)]
    pub(crate) fn new(database: &'a Database<'db>, x: &[f32], memory: &'a mut [i32]) -> Self {
        let mut parts = memory.chunks_exact_mut(x.len().max(1));
        let mut part = || parts.next().unwrap_or_default();
        let mix = Self { database, input: part(), base: part(), pair: part(), sum: part() };
        mix.sum.fill(0);
        for ((input, &x), scale) in mix.input.iter_mut().zip(x).zip(database.phase_dofs()) {
            *input = clamp((x - scale.centre) * scale.inverse * ONE as f32, -MAX_INPUT, MAX_INPUT) as i32;
        }
        mix
    }

    /// Sets the input class of the following pairs: `-M - S - (1 - g) clamp(X - M - S)`.
    #[inline(never)]
    pub(crate) fn set_input(&mut self, tables: &PhaseTables<'_>, point: CyclePoint) {
        self.base.fill(0);
        add(tables, tables.parts().input, point, self.base);
        let removed = clamp((1.0 - tables.gain) * 256.0, -256.0, 256.0) as i32;
        let root = self.database.joint_group(0);
        let mut dofs = self.base.iter_mut().zip(&*self.input).zip(tables.spread());
        for (joint, group) in self.database.groups().enumerate() {
            for ((base, &input), &spread) in dofs.by_ref().take(dofs_of(joint)) {
                let most =
                    if group == root { MAX_DEPARTURE } else { GESTURE_DEVIATIONS * ONE * i32::from(spread) };
                let departure = (input - *base).clamp(-most, most);
                *base = -*base - ((departure * removed) >> 8);
            }
        }
    }

    /// Adds a weighted output of the class to the dofs of the joint groups that have that mix of styles.
    #[inline(never)]
    pub(crate) fn add_output(
        &mut self,
        tables: &PhaseTables<'_>,
        point: CyclePoint,
        weight: f32,
        settings: &Settings,
        mix: usize,
    ) {
        self.pair.iter_mut().zip(&*self.base).for_each(|(pair, &base)| *pair = base);
        add(tables, tables.parts().output, point, self.pair);
        let weight = (clamp(weight, 0.0, 1.0) * WEIGHT + 0.5) as i32;
        let mut dofs = self.sum.iter_mut().zip(&*self.pair);
        for (joint, group) in self.database.groups().enumerate() {
            let weight = if settings.mix_of(group) == mix { weight } else { 0 };
            for (sum, &pair) in dofs.by_ref().take(dofs_of(joint)) {
                *sum += (pair >> 4) * weight;
            }
        }
    }

    /// Writes the mix to `predicted`: the input plus the weighted changes.
    #[inline(never)]
    pub(crate) fn finish(&self, x: &[f32], predicted: &mut [f32]) {
        let dofs = predicted.iter_mut().zip(x).zip(&*self.sum).zip(self.database.phase_dofs());
        for (((predicted, &x), &sum), scale) in dofs {
            *predicted = x + sum as f32 * (scale.step * (1.0 / (256.0 * WEIGHT)));
        }
    }
}

/// Adds the table of a class that begins at byte `at`, and the class's slopes.
fn add(tables: &PhaseTables<'_>, at: usize, point: CyclePoint, values: &mut [i32]) {
    let dofs = tables.spread().len();
    let place = Place::of(point.phase, tables.dof_knots, tables.is_cyclic);
    place.add_codes(place.knots.map(|knot| tables.row(at, dofs, knot)), values);
    let place = Place::of(point.phase, tables.slope_knots, tables.is_cyclic);
    let slopes = tables.parts().slopes;
    place.add_pairs(place.knots.map(|knot| tables.row(slopes, 2 * dofs, knot)), point.factors, values);
}

/// Number of dofs of a joint. The root's include its height and rates.
fn dofs_of(joint: usize) -> usize {
    if joint == 0 { dof::JOINTS } else { 3 }
}
