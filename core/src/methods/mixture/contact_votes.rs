//! Which foot stands: the neighbors vote, each foot by its own leg.
//!
//! Every captured frame says which foot stands ([`flag`]). The neighbors of a frame vote with the labels of their
//! **outputs** (where input and output style are the same these are their own), since what is to stand is the output's
//! foot; between a style strength of 0 and 1 input and output labels are blended. A vote weighs the class's proportion
//! over the square of the squared distance of eq. 1 of Xia 2015, whose section 6 sets the weights of the upper body to 0
//! and weighs by the inverse of the distance: at foot-down and foot-up half of the neighbors stand, and the nearest are
//! more reliable (64 held-out clips: F1 0.986, with the inverse of the squared distance 0.984). Here each foot looks at its own
//! leg alone, from the hip to the ankle:
//!
//! ```text
//! d² = Σ (x - x')² + τ² Σ (ẋ - ẋ')²      over the leg's nine dofs, rad and rad/s; τ = 0.2 s
//! ```
//!
//! The likelihood is smoothed by an exponential filter, which looks at no later frame and delays it by
//! [`DELAY_FRAMES`]; files can use the Gaussian of Xia 2015 (in the builder) instead. A foot stands
//! where the smoothed likelihood is above one half.
//!
//! Cost: 18 differences a neighbor and foot, of [`MOST_VOTERS`] neighbors at most; `docs/PERFORMANCE.md` has the
//! instructions of the stage.

use crate::{
    blob::{
        Database, Leg, Moment,
        layout::{dof, flag},
    },
    math::clamp,
    methods::mixture::variables::{Factor, X, X_PREV, parts_per_unit},
};

/// Seconds τ by which rates of leg dofs count against the dofs.
const RATE_WEIGHT_S: f32 = 0.2;
/// Squared distance under which neighbors count alike, rad²: a hundredth of a degree in one dof.
const LEAST: f32 = 3e-8;
/// Most neighbors of a frame that vote, over all of its classes: where more than four classes of 40 are kept, the nearest
/// of each do.
pub const MOST_VOTERS: usize = 160;
/// Parts of a radian in which legs are compared.
const UNITS: f32 = 131_072.0;
/// How much of a frame's likelihood the filter takes up.
const TAKEN: f32 = 0.9;
/// Mean delay of the filter: what an exponential filter of that gain delays a slope by.
pub const DELAY_FRAMES: f32 = (1.0 - TAKEN) / TAKEN;

/// Which foot stands in an example's outputs: the share of the style weights, left and right.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Stands(pub [f32; 2]);

impl Stands {
    /// Adds an output at `moment` with the weight of its style. `row` is the input's, whose label stands in where the
    /// output is no captured frame but an average.
    pub fn add(&mut self, database: &Database<'_>, moment: Moment, row: usize, weight: f32) {
        let nearest = if moment.fraction > 0.5 { moment.row + 1 } else { moment.row };
        let captured = nearest < database.counts().frames;
        let label = of(database, if captured { nearest } else { row });
        for (sum, stands) in self.0.iter_mut().zip(label) {
            *sum += weight * stands;
        }
    }
}

/// The label of a captured frame, 0 or 1 for left and right.
pub fn of(database: &Database<'_>, row: usize) -> [f32; 2] {
    let flags = database.flags(row);
    [flag::LEFT_CONTACT, flag::RIGHT_CONTACT].map(|bit| if flags & bit != 0 { 1.0 } else { 0.0 })
}

/// What a neighbor votes for: its own label at a style strength of 0, that of its outputs at 1, left and right.
#[inline(never)]
pub(crate) fn label(database: &Database<'_>, row: usize, output: Stands, strength: f32) -> [f32; 2] {
    let mut label = of(database, row);
    for (own, stands) in label.iter_mut().zip(output.0) {
        *own += strength * (stands - *own);
    }
    label
}

/// How many neighbors of each class vote, the nearest, where so many classes are kept.
#[inline]
pub fn voters(classes: usize) -> usize {
    MOST_VOTERS / classes.max(1)
}

/// Votes for the left and the right foot.
#[derive(Debug, Clone, Copy, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Votes {
    stands: [f32; 2],
    total: [f32; 2],
    /// How many neighbors of a class vote.
    pub wanted: usize,
    /// The input's legs, left and right.
    legs: [LegQuery; 2],
}

impl Votes {
    /// No votes yet, in a frame that keeps so many classes.
    #[inline]
    pub fn of(classes: usize) -> Self {
        Self { wanted: voters(classes), ..Self::default() }
    }

    /// Takes in the legs of the input, dofs and those of the frame before, if the blob names any.
    pub fn set_query(&mut self, database: &Database<'_>, x: &[f32], x_prev: &[f32]) {
        for (query, leg) in self.legs.iter_mut().zip(database.legs().iter().flatten()) {
            query.set(database, leg, x, x_prev);
        }
    }

    /// Squared distances of an example from the input, seen from the left and the right foot, rad².
    pub fn distances2(&self, example: &[[i32; 4]]) -> [f32; 2] {
        let [left, right] = &self.legs;
        [left.distance2(example), right.distance2(example)]
    }

    /// Counts a neighbor: its label, left and right from 0 to 1, its squared distance seen from each foot, and its
    /// class's proportion.
    // Not inlined: it is compiled with the core, for speed, however its caller is.
    #[inline(never)]
    pub fn add(&mut self, label: [f32; 2], distance2: [f32; 2], proportion: f32) {
        let sums = self.stands.iter_mut().zip(&mut self.total);
        for ((stands, total), (label, distance2)) in sums.zip(label.into_iter().zip(distance2)) {
            // A neighbor at no distance wins the vote and does not divide by zero.
            let near = 1.0 / (distance2 + LEAST);
            let weight = proportion * (near * near);
            *stands += weight * label;
            *total += weight;
        }
    }

    /// Likelihood, 0 to 1, that the left and the right foot stand; 0 without votes.
    pub fn likelihood(&self) -> [f32; 2] {
        let of = |i: usize| match (self.stands.get(i), self.total.get(i)) {
            (Some(&stands), Some(&total)) if total > 0.0 => clamp(stands / total, 0.0, 1.0),
            _ => 0.0,
        };
        [of(0), of(1)]
    }
}

/// A leg of the input, ready to be compared with those of examples.
#[derive(Debug, Clone, Copy, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct LegQuery([QueryJoint; 3]);

#[derive(Debug, Clone, Copy, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct QueryJoint {
    /// The first of its three dofs.
    first: usize,
    dofs: [QueryDof; 3],
}

/// A dof, and the dof in the frame before, in parts as those of examples are.
#[derive(Debug, Clone, Copy, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct QueryDof {
    pose: Factor,
    /// Of the change from frame to frame: τ times the frames a second.
    rate: Factor,
    x: i32,
    x_prev: i32,
}

impl LegQuery {
    /// Takes in a leg of the dofs `x`, which were `x_prev` in the frame before. In its place: to return it would take
    /// its room on the stack once more.
    #[inline(never)]
    fn set(&mut self, database: &Database<'_>, leg: &Leg, x: &[f32], x_prev: &[f32]) {
        let rate = RATE_WEIGHT_S * database.rate_hz();
        for (joint, of) in self.0.iter_mut().zip([leg.hip, leg.knee, leg.ankle]) {
            // No leg begins at joint 0, whose dofs lie elsewhere: `open` has checked it.
            joint.first = dof::JOINTS + 3 * of.saturating_sub(1);
            for (d, dof) in (joint.first..).zip(&mut joint.dofs) {
                let step = database.step(d);
                let parts = parts_per_unit(step);
                let at = |values: &[f32]| (values.get(d).copied().unwrap_or(0.0) * parts) as i32;
                *dof = QueryDof {
                    pose: Factor::new(step, UNITS),
                    rate: Factor::new(step, UNITS * rate),
                    x: at(x),
                    x_prev: at(x_prev),
                };
            }
        }
    }

    /// Squared distance from an example's leg: pose and rate of its nine dofs, rad².
    #[inline(never)]
    fn distance2(&self, example: &[[i32; 4]]) -> f32 {
        let mut sum = 0;
        for joint in &self.0 {
            let Some(theirs) = example.get(joint.first..).and_then(|rest| rest.first_chunk::<3>()) else {
                continue;
            };
            let term = |i: usize| {
                let (dof, theirs) = (&joint.dofs[i], &theirs[i]);
                let pose = dof.x.saturating_sub(theirs[X]);
                let before = dof.x_prev.saturating_sub(theirs[X_PREV]);
                dof.pose.squared(pose) + dof.rate.squared(pose.saturating_sub(before))
            };
            // Written out, so that it is straight code whatever the compiler is told of loops.
            sum += term(0) + term(1) + term(2);
        }
        sum as f32 * (1.0 / (UNITS * UNITS))
    }
}

/// The causal filter of the likelihoods.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Filter {
    likelihood: [f32; 2],
    /// False until the first frame, which passes as it is.
    started: bool,
}

impl Filter {
    /// A filter that has seen no frame.
    pub const fn new() -> Self {
        Self { likelihood: [0.0; 2], started: false }
    }

    /// Filters a frame's likelihoods. Returns which foot stands.
    pub fn filter(&mut self, likelihood: [f32; 2]) -> [bool; 2] {
        for (kept, now) in self.likelihood.iter_mut().zip(likelihood) {
            *kept = if self.started { *kept + TAKEN * (now - *kept) } else { now };
        }
        self.started = true;
        self.likelihood.map(|l| l > 0.5)
    }
}

impl Default for Filter {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_neighbors_outvote_far_ones() {
        let mut votes = Votes::default();
        votes.add([1.0, 0.0], [0.01, 0.01], 1.0);
        for _ in 0..3 {
            votes.add([0.0, 1.0], [0.09, 0.04], 1.0);
        }
        // Left: 10,000 against 370; right: 1,875 against 10,000.
        let [left, right] = votes.likelihood();
        assert!((left - 27.0 / 28.0).abs() < 1e-4, "{left}");
        assert!((right - 1.875 / 11.875).abs() < 1e-4, "{right}");
    }

    #[test]
    fn no_votes_give_no_likelihood() {
        assert_eq!(Votes::default().likelihood(), [0.0; 2]);
        let mut votes = Votes::default();
        votes.add([1.0, 1.0], [0.0, 0.0], 0.4);
        assert_eq!(votes.likelihood(), [1.0; 2]);
    }

    #[test]
    fn the_filter_delays_a_slope_by_a_ninth_of_a_frame() {
        let mut filter = Filter::new();
        let slope = 0.01;
        let mut last = 0.0;
        for t in 0..60 {
            last = slope * t as f32;
            let _ = filter.filter([last, 0.0]);
        }
        let delay = (last - filter.likelihood[0]) / slope;
        assert!((delay - DELAY_FRAMES).abs() < 0.01, "{delay}");
        assert!((DELAY_FRAMES - 1.0 / 9.0).abs() < 1e-6);
    }

    #[test]
    fn one_stray_frame_does_not_lift_a_foot_and_a_change_is_followed_at_once() {
        let mut filter = Filter::new();
        assert_eq!(filter.filter([1.0, 0.2]), [true, false]);
        // 0.9 of 0.45 and 0.1 of 1: above one half.
        assert_eq!(filter.filter([0.45, 0.2]), [true, false]);
        assert_eq!(filter.filter([0.0, 1.0]), [false, true]);
    }
}
