//! The effort dial: a target in Laban's Effort space becomes style weights, at run time.
//!
//! Laban Movement Analysis describes *how* something is done by factors between two poles; three of them can be
//! seen in motion alone (Torresani 2006, section 2):
//!
//! | factor | -3 | 3 |
//! |---|---|---|
//! | flow | free: fluid, released | bound: controlled, contained |
//! | weight | light: gentle, delicate | strong: powerful, forceful |
//! | time | sustained: stretching, indulging | sudden: urgent, quick |
//!
//! A mix of styles has an Effort. The builder inverts this relation once, at the nodes of a grid over the Efforts that the
//! styles can reach. Here a target is interpolated linearly between the eight nodes around it, and the mix goes to
//! [`Stylizer::set_style`]. A step does not use the dial.
//!
//! ```text
//! weights(e) = Σ over 8 nodes of (product of 3 fractions) · node     a mix: not negative, of sum 1
//! reached(e) = Σ over styles  of weights(e) · effort of the style    estimated Effort of the mix
//! ```
//!
//! The Effort of a mix is not the mean of its styles' Efforts. Where two styles move a joint in different ways, their
//! mean is smoother and lighter than either. The builder therefore streams clips through this core at many mixes and
//! measures the output. Along each axis of the grid, where one factor changes alone, the measured factor rises from end
//! to end for any input; between the axes the mixes add up. Not every Effort is a mix of the available styles: the axes
//! end where the styles do ([`Dial::range`]), and [`Reached`] says which Effort a target became, and whether that is
//! far from it.
//!
//! Cost: 8 S reads and multiplications for S styles whenever the target changes; no RAM.

use crate::{
    ConfigError, Database, Stylizer,
    blob::{
        layout::{MAX_STYLES, effort, section},
        read::{Record, f32_at, u16_at},
    },
    math::{maximum, minimum},
};

/// A place in Effort space, or a change in it. Each factor runs from -3 to 3; 0 is what is usual for the data.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Effort {
    /// From free (-3) to bound (3).
    pub flow: f32,
    /// From light (-3) to strong (3).
    pub weight: f32,
    /// From sustained (-3) to sudden (3).
    pub time: f32,
}

impl Effort {
    /// Names of the factors, in order.
    pub const NAMES: [&'static str; 3] = ["flow", "weight", "time"];
    /// Greatest value of a factor; the least is its opposite.
    pub const POLE: f32 = 3.0;

    /// From flow, weight and time.
    pub const fn new(factors: [f32; 3]) -> Self {
        let [flow, weight, time] = factors;
        Self { flow, weight, time }
    }

    /// Flow, weight and time.
    pub const fn factors(self) -> [f32; 3] {
        [self.flow, self.weight, self.time]
    }
}

/// Where a dial's styles got their Efforts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Labels {
    /// Estimated from the motion by kinematic descriptors, without an observer.
    Estimated,
    /// Rated by people who watched the motion.
    Given,
}

/// The Effort that a target became.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use = "not every Effort is within the styles' reach: this says what the target became"]
pub struct Reached {
    /// Estimated Effort of the mix of styles.
    pub effort: Effort,
    /// For flow, weight and time: true if it is further than [`TOLERANCE`] from the target.
    pub clamped: [bool; 3],
}

impl Reached {
    /// True where some factor misses its target.
    pub fn is_clamped(&self) -> bool {
        self.clamped.iter().any(|&c| c)
    }
}

/// Distance from its target up to which a factor counts as reached: a twenty-fourth of the distance between the poles.
pub const TOLERANCE: f32 = 0.25;

/// The effort dial of a database.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Dial<'db> {
    section: &'db [u8],
    styles: usize,
}

impl<'db> Dial<'db> {
    /// The dial in a validated section of a database with `styles` styles.
    pub(crate) fn of(section: &'db [u8], styles: usize) -> Self {
        Self { section, styles }
    }

    /// Where the styles' Efforts come from.
    pub fn labels(&self) -> Labels {
        if Record(self.section).u8(effort::LABELS) == effort::GIVEN {
            Labels::Given
        } else {
            Labels::Estimated
        }
    }

    /// Least and greatest flow, weight and time that the dial reaches, each with the other two at rest: the ends of the
    /// grid. Targets beyond an end are moved to it.
    pub fn range(&self) -> [(f32, f32); 3] {
        core::array::from_fn(|k| {
            let at = effort::AXES.start + 8 * k;
            (f32_at(self.section, at), f32_at(self.section, at + 4))
        })
    }

    /// The Effort of the dial at rest: that of the even mix of all styles, if it was measured.
    pub fn rest(&self) -> Effort {
        Effort::new(core::array::from_fn(|k| f32_at(self.section, effort::REST.start + 4 * k)))
    }

    /// Contribution of a style to the Effort of a mix, as fitted to the measured Efforts of mixes.
    pub fn of_style(&self, style: usize) -> Effort {
        let at = effort::STYLES + style * effort::STYLE_LENGTH;
        Effort::new(core::array::from_fn(|k| f32_at(self.section, at + 4 * k)))
    }

    /// Nodes of the grid along flow, weight and time.
    pub fn nodes(&self) -> [usize; 3] {
        core::array::from_fn(|k| usize::from(u16_at(self.section, effort::NODES.start + 2 * k)))
    }

    /// Weights of the styles for a target, `[styles]`, of sum 1, and the Effort that they reach. A target beyond the grid is
    /// moved to its end, NaN to the lower one.
    pub fn weights(&self, target: Effort) -> ([f32; MAX_STYLES], Reached) {
        let (nodes, range, factors) = (self.nodes(), self.range(), target.factors());
        // The cell that the target lies in, and how far along it.
        let mut cell = [(0usize, 0.0f32); 3];
        for (((slot, &count), &(low, high)), &value) in cell.iter_mut().zip(&nodes).zip(&range).zip(&factors)
        {
            let last = count.saturating_sub(2);
            let place = (value - low) / (high - low) * (count.saturating_sub(1)) as f32;
            // Also 0 for NaN.
            let place = maximum(place, 0.0);
            let index = (place as usize).min(last);
            let fraction = place - index as f32;
            *slot = (index, minimum(fraction, 1.0));
        }
        let mut weights = [0.0; MAX_STYLES];
        for corner in 0..8usize {
            let (mut share, mut node) = (1.0, 0usize);
            for (k, (&(index, fraction), &count)) in cell.iter().zip(&nodes).enumerate() {
                let upper = corner >> k & 1;
                share *= if upper == 1 { fraction } else { 1.0 - fraction };
                node = node.saturating_mul(count).saturating_add(index + upper);
            }
            let stored = Record::of(self.table(), node, self.styles).0;
            for (weight, &byte) in weights.iter_mut().zip(stored) {
                *weight += share * (f32::from(byte) / f32::from(effort::WHOLE));
            }
        }
        (weights, self.reached(&weights, target))
    }

    /// Estimated Effort of a mix of styles, compared with a target.
    pub fn reached(&self, weights: &[f32], target: Effort) -> Reached {
        let mut sums = [0.0; 3];
        for (style, weight) in weights.iter().enumerate().take(self.styles) {
            for (sum, effort) in sums.iter_mut().zip(self.of_style(style).factors()) {
                *sum += weight * effort;
            }
        }
        let mut clamped = [false; 3];
        for ((clamped, sum), wanted) in clamped.iter_mut().zip(&sums).zip(target.factors()) {
            let off = sum - wanted;
            *clamped = !(-TOLERANCE..=TOLERANCE).contains(&off);
        }
        Reached { effort: Effort::new(sums), clamped }
    }

    fn table(&self) -> &'db [u8] {
        self.section.get(effort::table(self.styles)..).unwrap_or(&[])
    }
}

impl<'db> Database<'db> {
    /// The effort dial, if the database has one.
    pub fn dial(&self) -> Option<Dial<'db>> {
        self.optional(section::EFFORT).map(|bytes| Dial::of(bytes, self.counts().styles))
    }
}

impl<const J: usize, const K: usize, const C: usize> Stylizer<'_, J, K, C> {
    /// Sets the output style to the mix whose Effort is nearest to a target. May change at any time.
    ///
    /// # Errors
    /// [`ConfigError::NoDial`] where the database has no dial; the current style stays.
    pub fn set_effort(&mut self, target: Effort) -> Result<Reached, ConfigError> {
        let dial = self.database().dial().ok_or(ConfigError::NoDial)?;
        let (weights, reached) = dial.weights(target);
        let mut mix = [(0u16, 0.0f32); MAX_STYLES];
        for (style, (slot, weight)) in mix.iter_mut().zip(weights).enumerate() {
            *slot = (style as u16, weight);
        }
        self.set_style(mix.get(..self.database().counts().styles).unwrap_or(&[]))?;
        Ok(reached)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two styles, free and light and sustained, bound and strong and sudden, on a grid of 2 x 3 x 2.
    fn section() -> [u8; effort::STYLES + 24 + 24] {
        let mut bytes = [0; effort::STYLES + 24 + 24];
        let nodes: [u16; 3] = [2, 3, 2];
        for (slot, n) in bytes[effort::NODES].chunks_exact_mut(2).zip(nodes) {
            slot.copy_from_slice(&n.to_le_bytes());
        }
        let numbers = [-1.0f32, 1.0, -2.0, 2.0, -1.0, 1.0, 0.5, 0.0, 0.0];
        let styles = [-1.0f32, -2.0, -1.0, 1.0, 2.0, 1.0];
        for (slot, v) in bytes[effort::AXES.start..].chunks_exact_mut(4).zip(numbers.iter().chain(&styles)) {
            slot.copy_from_slice(&v.to_le_bytes());
        }
        // How much of the second style: grows with each index.
        for node in 0..12 {
            let (f, w, t) = (node / 6, node / 2 % 3, node % 2);
            let second = (255 * (f + w + t) / 4) as u8;
            let at = effort::table(2) + 2 * node;
            bytes[at..at + 2].copy_from_slice(&[255 - second, second]);
        }
        bytes
    }

    #[test]
    fn interpolates_between_the_nodes_as_three_loops_would() {
        let bytes = section();
        let dial = Dial::of(&bytes, 2);
        let second = |f: usize, w: usize, t: usize| {
            f64::from(bytes[effort::table(2) + 2 * (6 * f + 2 * w + t) + 1]) / 255.0
        };
        for (flow, weight, time) in [(0.3, -0.7, -0.2), (-1.0, 2.0, 1.0), (0.0, 0.0, 0.0), (0.9, 1.3, -0.99)]
        {
            let (u, v, s) = ((flow + 1.0) / 2.0, (weight + 2.0) / 2.0, (time + 1.0) / 2.0);
            let cell = f64::min(f64::floor(v), 1.0);
            let mut wanted = 0.0;
            for (f, a) in [(0, 1.0 - u), (1, u)] {
                for (w, b) in [(0, 1.0 - (v - cell)), (1, v - cell)] {
                    for (t, c) in [(0, 1.0 - s), (1, s)] {
                        wanted += a * b * c * second(f, cell as usize + w, t);
                    }
                }
            }
            let (weights, reached) = dial.weights(Effort::new([flow as f32, weight as f32, time as f32]));
            assert!(
                (f64::from(weights[1]) - wanted).abs() < 1e-6,
                "{flow} {weight} {time}: {weights:?} {wanted}"
            );
            assert!((weights[0] + weights[1] - 1.0).abs() < 1e-6);
            assert!((reached.effort.weight - 2.0 * (weights[1] - weights[0])).abs() < 1e-6);
        }
    }

    #[test]
    fn beyond_the_grid_is_its_end_and_is_said() {
        let bytes = section();
        let dial = Dial::of(&bytes, 2);
        let end = dial.weights(Effort::new([1.0, 2.0, 1.0]));
        assert_eq!(end.1, Reached { effort: Effort::new([1.0, 2.0, 1.0]), clamped: [false; 3] });
        let beyond = dial.weights(Effort::new([f32::INFINITY, 3.0, 1.2]));
        assert_eq!(beyond.0, end.0);
        assert_eq!(beyond.1.clamped, [true, true, false]);
        let nan = dial.weights(Effort::new([f32::NAN; 3]));
        assert_eq!(nan.0, dial.weights(Effort::new([-9.0; 3])).0);
        assert!(nan.1.is_clamped());
        assert_eq!(dial.labels(), Labels::Estimated);
        assert_eq!(dial.rest(), Effort::new([0.5, 0.0, 0.0]));
        assert_eq!(dial.range(), [(-1.0, 1.0), (-2.0, 2.0), (-1.0, 1.0)]);
    }
}
