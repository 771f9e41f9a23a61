//! Feet that stand stay where they are.
//!
//! A regression moves the feet of its output by a few centimetres while they should stand. Here, after the prediction and
//! without look-ahead, each foot that stands
//! ([`crate::methods::mixture::contact_votes`]) is held by the joint that carries it, heel (ankle) or toes, whichever is
//! lower:
//!
//! 1. At foot-down the position of the foot is stored; nothing moves yet. From then on the foot's **offset** moves it back
//!    there. When the weight rolls from heel to toes, the toes are held where they were.
//!    A sole rolls: a joint r over the point of contact moves on by r times the angle that the foot turns by. The place that
//!    it is held at moves so too, with the rolls that the builder has measured ([`crate::blob::Leg`]); the point of contact
//!    stays.
//! 2. The root goes as fast as predicted. Legs are predicted as means of many steps, which are shorter; held feet lengthen
//!    them. In a stream's first frames, and where a held foot is out of reach, the root goes with its feet.
//! 3. The root takes the height that all standing feet have in common, slowly (a critically damped spring), and the hips
//!    drop where a leg would be stretched beyond its length; the legs take the rest.
//! 4. Votes to stand end a few frames late. A foot whose heel is up, and which the prediction moves as no standing foot
//!    moves, leaves: it goes with the prediction, its offset is eased out, and it is no contact. Held on, it would be
//!    10 cm behind when it swings.
//! 5. At foot-up the offset is eased out by a smoothstep; a foot that comes down meanwhile is held where it then is. A foot
//!    that is held further than `release_m` from its prediction does not slide there but **steps**: it is lifted a little,
//!    does not count as standing meanwhile, and is held again when it has come down.
//! 6. No foot sinks through the floor, in the air or held: a foot more than 1 cm too low is lifted. A body
//!    that is further than 40 cm below is elsewhere, and is left there.
//! 7. Each leg reaches its target by [`crate::body::two_bone_ik`].
//!
//! The prediction that is fed back stays unchanged: the lock changes the output alone.
//! Source: Xia 2015, section 6; Kovar, Schreiner and Gleicher 2002 ("Footskate cleanup"), in a causal form.
//! Cost: 5,500 instructions a frame on a Cortex-M4F, 8,000 at most.

mod foot;
mod root;

pub(crate) use foot::lowest;
pub use foot::{Tuning, kept};

use self::{
    foot::{DEEPEST_M, Foot, Phase, lower, over_floor, reach, too_deep},
    root::RootShift,
};
use crate::{
    blob::Database,
    body::{pose::Pose, two_bone_ik::Chain},
    math::{
        clamp,
        vector::{add, norm, subtract},
    },
};

/// Highest speed at which the floor under a foot follows the caller's height, m/s.
const FLOOR_SPEED: f32 = 0.8;
/// A foot predicted this high over the floor does not stand, whatever the votes. Metres.
const UP_M: f32 = 0.06;

/// The locks of both feet: all that is kept between frames.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Lock {
    feet: [Foot; 2],
    root: RootShift,
    /// The floor under each foot as the caller says it, metres, and as the feet are led to it.
    wanted_floor: [f32; 2],
    floor: [f32; 2],
}

impl Lock {
    /// No foot held, the floor at height 0.
    pub const fn new() -> Self {
        Self { feet: [Foot::FREE; 2], root: RootShift::NONE, wanted_floor: [0.0; 2], floor: [0.0; 2] }
    }

    /// Forgets the stream; the floor stays.
    pub fn reset(&mut self) {
        *self = Self { wanted_floor: self.wanted_floor, floor: self.wanted_floor, ..Self::new() };
    }

    /// Heights of the floor under the left and the right foot, metres.
    pub fn set_floor(&mut self, heights: [f32; 2]) {
        self.wanted_floor = heights;
    }

    /// Which feet are held.
    pub fn held(&self) -> [bool; 2] {
        self.feet.map(|f| f.is_held())
    }

    /// How far the feet are from where the prediction has them, metres.
    #[inline(never)]
    pub fn offsets(&self) -> [f32; 2] {
        self.feet.map(|f| norm(f.offset))
    }

    /// Whether a pose would be changed by what is left of held feet.
    pub fn is_engaged(&self) -> bool {
        let moved = |foot: &Foot| foot.is_held() || foot.offset != [0.0; 3];
        self.feet.iter().any(moved) || self.root.is_engaged()
    }

    /// Holds the feet of `pose` that stand; `step_s` is the time since the last pose. Feet that are clearly in the air
    /// or step are taken out of `contacts`. Without legs in the database nothing happens.
    #[inline(never)]
    pub fn hold<const J: usize>(
        &mut self,
        database: &Database<'_>,
        contacts: &mut [bool; 2],
        step_s: f32,
        tuning: Tuning,
        pose: &mut Pose<J>,
    ) {
        let Some(legs) = database.legs() else { return };
        self.root.apply_shift(&mut pose.position);
        // Not by `map`, whose copies would take half of this function's stack.
        let [left, right] = &legs;
        let chains = [Chain::of(database, left, pose), Chain::of(database, right, pose)];
        for (floor, wanted) in self.floor.iter_mut().zip(self.wanted_floor) {
            *floor += clamp(wanted - *floor, -FLOOR_SPEED * step_s, FLOOR_SPEED * step_s);
        }
        for ((stands, &floor), (leg, chain)) in
            contacts.iter_mut().zip(&self.floor).zip(legs.iter().zip(&chains))
        {
            // Over the floor as the root is lifted, or as it was predicted: a lift that is wrong has to end.
            let over = lower(over_floor(leg, chain, floor));
            let least = over + if self.root.lift < 0.0 { self.root.lift } else { 0.0 };
            *stands = *stands && least < UP_M && over > -DEEPEST_M;
        }
        let stands = contacts.map(|stands| stands && tuning.on);
        let standing =
            [(left, &chains[0], self.floor[0], stands[0]), (right, &chains[1], self.floor[1], stands[1])];
        self.root.lift(standing, step_s, tuning.on);
        let mut slid = [0.0; 3];
        let feet = self.feet.iter_mut().zip(self.floor.iter().zip(stands));
        for ((foot, (&floor, stands)), (leg, chain)) in feet.zip(legs.iter().zip(&chains)) {
            let over = over_floor(leg, chain, floor - self.root.lift);
            foot.roll(leg, chain);
            slid = add(slid, foot.advance(chain, over, stands, step_s, tuning, self.root.hip_drop));
        }
        for (stands, foot) in contacts.iter_mut().zip(&self.feet) {
            *stands = *stands && foot.phase != Phase::Step && !foot.leaves;
        }
        let way = self.root.start(slid, step_s);
        self.root.move_on_ground(&mut self.feet, way, &mut pose.position);
        if self.root.drop_hips(&self.feet, &chains, step_s) {
            let way = self.root.out_of_reach(&self.feet, &chains, step_s);
            self.root.move_on_ground(&mut self.feet, way, &mut pose.position);
        }
        let feet = self.feet.iter().zip(&self.floor);
        for ((leg, chain), (foot, &floor)) in legs.iter().zip(&chains).zip(feet) {
            // The ankle's, before the root goes up or down.
            let mut target = add(chain.ankle, foot.offset);
            if foot.is_held() {
                // A foot that is held does not come down with the root.
                target[1] -= self.root.hip_drop;
            } else if tuning.on {
                let over = over_floor(leg, chain, floor - self.root.lift);
                target[1] += too_deep(over, foot.offset[1] + self.root.hip_drop);
            }
            // Nothing to do is done to the bit.
            if norm(subtract(target, chain.ankle)) > 1e-6 {
                chain.place(leg, target, reach(chain), pose);
            }
        }
        pose.position[1] += self.root.lift + self.root.hip_drop;
    }
}

impl Default for Lock {
    fn default() -> Self {
        Self::new()
    }
}
