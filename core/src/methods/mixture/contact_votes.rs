//! Which feet stand: the neighbors vote, for each foot by its own leg.
//!
//! Every captured frame has a label that says which feet stand ([`flag`]). The neighbors of a frame vote with the labels of
//! their **outputs**, because the output's feet are to stand; between a style strength of 0 and 1, input and output
//! labels are blended. The weight of a vote is the class's proportion over the square of a squared distance. Xia 2015
//! (section 6) uses the distance of eq. 1 with weights of 0 for the upper body, and weighs by its inverse. At foot-down
//! and foot-up, however, half of the neighbors stand, and the nearest are more reliable (64 held-out clips: F1 0.986,
//! with the inverse of the squared distance 0.984). Here each foot compares its own leg alone, from the hip to the
//! ankle:
//!
//! ```text
//! d² = Σ (x - x')² + τ² Σ (ẋ - ẋ')²      over the leg's nine dofs, rad and rad/s; τ = 0.2 s
//! ```
//!
//! A foot stands where its likelihood is above one half. Xia 2015 smooths the likelihood by a Gaussian, which needs
//! later frames (the builder can use it for files). A causal filter is no help, and delays the feet
//! (`docs/experiments/feet.md`).
//!
//! Cost: 18 differences a neighbor and foot, of [`MAX_VOTERS`] neighbors at most; `docs/PERFORMANCE.md` has the
//! instructions of the stage.

use crate::{
    blob::{
        Database, Leg, Moment,
        layout::{dof, flag},
    },
    math::clamp,
    methods::mixture::variables::{Factor, X, X_PREV, parts_per_unit},
};

/// τ: weight of the rates of leg dofs relative to the dofs, seconds.
const RATE_WEIGHT_S: f32 = 0.2;
/// Added to squared distances, rad², so that very near neighbors count alike: a hundredth of a degree in one dof.
const MIN_DISTANCE2: f32 = 3e-8;
/// Greatest number of neighbors that vote in a frame, over all classes. Each class gets an equal part, its nearest
/// neighbors.
pub const MAX_VOTERS: usize = 160;
/// Fixed-point scale of the comparison: units in a radian.
const UNITS: f32 = 131_072.0;
/// Which feet stand in an example's outputs: the sum of the style weights whose output stands, left and right, 0 to 1.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct OutputContacts(pub [f32; 2]);

impl OutputContacts {
    /// Adds an output at `moment` with the weight of its style. If the output is an average and no captured frame, the label
    /// of the input's `row` is used.
    pub fn add(&mut self, database: &Database<'_>, moment: Moment, row: usize, weight: f32) {
        let nearest = if moment.fraction > 0.5 { moment.row + 1 } else { moment.row };
        let captured = nearest < database.counts().frames;
        let vote = captured_contacts(database, if captured { nearest } else { row });
        for (sum, stands) in self.0.iter_mut().zip(vote) {
            *sum += weight * stands;
        }
    }
}

/// The label of a captured frame, 0 or 1 for left and right.
pub fn captured_contacts(database: &Database<'_>, row: usize) -> [f32; 2] {
    let flags = database.flags(row);
    [flag::LEFT_CONTACT, flag::RIGHT_CONTACT].map(|bit| if flags & bit != 0 { 1.0 } else { 0.0 })
}

/// The vote of a neighbor, left and right, 0 to 1: its own label at a style strength of 0, that of its outputs at 1.
#[inline(never)]
pub(crate) fn vote(database: &Database<'_>, row: usize, output: OutputContacts, strength: f32) -> [f32; 2] {
    let mut vote = captured_contacts(database, row);
    for (contact, stands) in vote.iter_mut().zip(output.0) {
        *contact += strength * (stands - *contact);
    }
    vote
}

/// Number of neighbors of each class that vote, if `classes` are kept.
#[inline]
pub fn voters(classes: usize) -> usize {
    MAX_VOTERS / classes.max(1)
}

/// Votes for the left and the right foot.
#[derive(Debug, Clone, Copy, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Votes {
    /// Sum of the weighted votes to stand, left and right.
    stands: [f32; 2],
    /// Sum of the weights, left and right.
    total: [f32; 2],
    /// Number of neighbors of each class that vote, its nearest.
    pub voters_per_class: usize,
    /// The input's legs, left and right.
    legs: [LegQuery; 2],
}

impl Votes {
    /// No votes yet, in a frame that keeps `classes` classes.
    #[inline]
    pub fn new(classes: usize) -> Self {
        Self { voters_per_class: voters(classes), ..Self::default() }
    }

    /// Sets the legs of the input from its dofs and those of the frame before, `[dofs]`, if the database names legs.
    pub fn set_query(&mut self, database: &Database<'_>, x: &[f32], x_prev: &[f32]) {
        for (query, leg) in self.legs.iter_mut().zip(database.legs().iter().flatten()) {
            query.set(database, leg, x, x_prev);
        }
    }

    /// Squared distances of an example from the input by the left and the right leg, rad².
    pub fn distances2(&self, example: &[[i32; 4]]) -> [f32; 2] {
        let [left, right] = &self.legs;
        [left.distance2(example), right.distance2(example)]
    }

    /// Counts the vote of a neighbor, left and right, 0 to 1, with its squared distance by each leg, rad², and its class's
    /// proportion.
    // Not inlined, so that it is compiled with the core, optimised for speed.
    #[inline(never)]
    pub fn add(&mut self, vote: [f32; 2], distance2: [f32; 2], proportion: f32) {
        let sums = self.stands.iter_mut().zip(&mut self.total);
        for ((stands, total), (vote, distance2)) in sums.zip(vote.into_iter().zip(distance2)) {
            // A neighbor at distance 0 wins the vote, without a division by zero.
            let near = 1.0 / (distance2 + MIN_DISTANCE2);
            let weight = proportion * (near * near);
            *stands += weight * vote;
            *total += weight;
        }
    }

    /// Likelihood that the left and the right foot stand, 0 to 1; 0 without votes.
    pub fn likelihood(&self) -> [f32; 2] {
        let likelihood = |i: usize| match (self.stands.get(i), self.total.get(i)) {
            (Some(&stands), Some(&total)) if total > 0.0 => clamp(stands / total, 0.0, 1.0),
            _ => 0.0,
        };
        [likelihood(0), likelihood(1)]
    }
}

/// A leg of the input, prepared for comparison with those of examples.
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

/// A dof of the input and its value in the frame before, in the fixed point of examples.
#[derive(Debug, Clone, Copy, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct QueryDof {
    pose: Factor,
    /// Weight of the change from frame to frame: τ times the frame rate.
    rate: Factor,
    x: i32,
    x_prev: i32,
}

impl LegQuery {
    /// Sets the leg from the dofs `x`, which were `x_prev` in the frame before. Written in place, because a returned value
    /// would need its memory on the stack once more.
    #[inline(never)]
    fn set(&mut self, database: &Database<'_>, leg: &Leg, x: &[f32], x_prev: &[f32]) {
        let rate = RATE_WEIGHT_S * database.rate_hz();
        for (joint, number) in self.0.iter_mut().zip([leg.hip, leg.knee, leg.ankle]) {
            // No leg begins at joint 0, whose dofs lie elsewhere: `open` has checked it.
            joint.first = dof::JOINTS + 3 * number.saturating_sub(1);
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

    /// Squared distance to an example's leg, over pose and rate of its nine dofs, rad².
    #[inline(never)]
    fn distance2(&self, example: &[[i32; 4]]) -> f32 {
        let mut sum = 0;
        for joint in &self.0 {
            let Some(example_dofs) = example.get(joint.first..).and_then(|rest| rest.first_chunk::<3>())
            else {
                continue;
            };
            let term = |i: usize| {
                let (dof, example_dofs) = (&joint.dofs[i], &example_dofs[i]);
                let pose = dof.x.saturating_sub(example_dofs[X]);
                let before = dof.x_prev.saturating_sub(example_dofs[X_PREV]);
                dof.pose.squared(pose) + dof.rate.squared(pose.saturating_sub(before))
            };
            // Written out, so that the code is straight at any optimisation level.
            sum += term(0) + term(1) + term(2);
        }
        sum as f32 * (1.0 / (UNITS * UNITS))
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
}
