//! Keeps standing feet in place.
//!
//! A regression moves the feet of its output by a few centimetres while they should stand. The lock holds each standing foot
//! ([`crate::methods::mixture::contact_votes`]) at the joint that carries it, heel (ankle) or toes, whichever is lower. It
//! works after the prediction and without look-ahead:
//!
//! 1. **Foot-down.** The position of the foot is stored; nothing moves yet. From then on the foot's **offset** moves it back
//!    to that position. When the weight rolls from heel to toes, the toes are held where they were.
//!    A sole rolls: a joint at height r above the point of contact moves by r times the angle that the foot turns by. The
//!    held position moves with it, by the rolls that the builder has measured ([`crate::blob::Leg`]); the point of contact
//!    stays.
//! 2. **Root on the ground.** The root moves as fast as predicted. Predicted legs are means of many steps, which are shorter
//!    than steps; held feet lengthen them. In a stream's first frames, and where a held foot is out of reach, the root moves
//!    with its feet.
//! 3. **Root height.** The root follows the mean height of all standing feet, slowly (a critically damped spring). The hips
//!    drop where a leg would be stretched beyond its length; the legs do the rest.
//! 4. **Leaving feet.** Votes to stand end a few frames late. A foot whose heel is up and whose prediction moves faster than
//!    any standing foot is leaving: it follows the prediction, its offset is eased out, and it is no contact. If it
//!    were held on, it would be 10 cm behind when it swings.
//! 5. **Foot-up.** The offset is eased out by a smoothstep. A foot that comes down meanwhile is held where it then is.
//!    A foot that is held further than `release_m` from its prediction does not slide there but **steps**: it is lifted
//!    a little, does not count as standing meanwhile, and is held again when it has come down. So does a foot that
//!    stands in the prediction too, but elsewhere, as after a change of style: one foot at a time.
//! 6. **Floor.** A foot more than 1 cm below the floor is lifted, in the air or held; one that was lifted far comes down as
//!    fast as it steps. A body more than 40 cm below is elsewhere, and is left there. Where the speed limit then holds
//!    joints back, the root is raised instead: legs already turn as fast as they may.
//! 7. Each leg reaches its target by [`crate::body::two_bone_ik`].
//!
//! The lock changes the output alone; the prediction that is fed back does not change.
//! Source: Xia 2015, section 6; Kovar, Schreiner and Gleicher 2002 ("Footskate cleanup"), in a causal form.
//! Cost: 9,100 to 11,500 instructions a frame on a Cortex-M4F, 12,300 at most.

mod foot;
mod root;

pub(crate) use foot::lowest;
pub use foot::{Tuning, held_fraction};

use self::{
    foot::{DEEPEST_M, Foot, Phase, Slide, depth_correction, heights_over_floor, lower_of, reach},
    root::{RootShift, Standing},
};
use crate::{
    blob::{Database, layout::MAX_JOINTS},
    body::{pose::Pose, two_bone_ik::Chain},
    math::{
        clamp, maximum, minimum,
        vector::{add, norm, subtract},
    },
};

/// Greatest speed with which the floor under a foot follows the height that the caller sets, m/s.
const FLOOR_SPEED: f32 = 0.8;
/// Predicted height over the floor above which a foot does not stand, whatever the votes, metres.
const MAX_STANDING_M: f32 = 0.06;

/// The locks of both feet, and their state between frames.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Lock {
    feet: [Foot; 2],
    root: RootShift,
    /// Height of the floor under each foot as the caller has set it, metres.
    target_floor: [f32; 2],
    /// Height that the feet are held to, metres. It follows `target_floor`.
    floor: [f32; 2],
}

impl Lock {
    /// No foot held, the floor at height 0.
    pub const fn new() -> Self {
        Self { feet: [Foot::FREE; 2], root: RootShift::NONE, target_floor: [0.0; 2], floor: [0.0; 2] }
    }

    /// Forgets the stream, and keeps the floor.
    pub fn reset(&mut self) {
        *self = Self { target_floor: self.target_floor, floor: self.target_floor, ..Self::new() };
    }

    /// Heights of the floor under the left and the right foot, metres.
    pub fn set_floor(&mut self, heights: [f32; 2]) {
        self.target_floor = heights;
    }

    /// Which feet are held.
    pub fn held(&self) -> [bool; 2] {
        self.feet.map(|f| f.is_held())
    }

    /// Distance of each foot from its prediction, metres.
    #[inline(never)]
    pub fn offsets(&self) -> [f32; 2] {
        self.feet.map(|f| norm(f.offset))
    }

    /// Whether the lock would still change a pose though no foot stands.
    pub fn is_engaged(&self) -> bool {
        let moved = |foot: &Foot| foot.is_held() || foot.offset != [0.0; 3];
        self.feet.iter().any(moved) || self.root.is_engaged()
    }

    /// Holds the standing feet of `pose`; `step_s` is the time since the last pose, seconds. Feet that are clearly in
    /// the air or stepping are removed from `contacts`. Does nothing if the database names no legs.
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
        for (floor, target) in self.floor.iter_mut().zip(self.target_floor) {
            *floor += clamp(target - *floor, -FLOOR_SPEED * step_s, FLOOR_SPEED * step_s);
        }
        for ((stands, &floor), (leg, chain)) in
            contacts.iter_mut().zip(&self.floor).zip(legs.iter().zip(&chains))
        {
            // The height with the root's lift, or as predicted if that is lower: a wrong lift has to end.
            let over = lower_of(heights_over_floor(leg, chain, floor));
            let least = over + minimum(self.root.lift, 0.0);
            *stands = *stands && least < MAX_STANDING_M && over > -DEEPEST_M;
        }
        let stands = contacts.map(|stands| stands && tuning.on);
        let standing = [
            Standing { leg: left, chain: &chains[0], floor_m: self.floor[0], stands: stands[0] },
            Standing { leg: right, chain: &chains[1], floor_m: self.floor[1], stands: stands[1] },
        ];
        self.root.update_lift(standing, step_s, tuning.on);
        let mut slid = Slide::default();
        let feet = self.feet.iter_mut().zip(self.floor.iter().zip(stands));
        for ((foot, (&floor, stands)), (leg, chain)) in feet.zip(legs.iter().zip(&chains)) {
            let over = heights_over_floor(leg, chain, floor - self.root.lift);
            foot.roll(leg, chain);
            slid.add(foot.advance(chain, over, stands, step_s, tuning, self.root.hip_drop));
        }
        // One foot at a time.
        if self.feet.iter().all(|foot| foot.phase != Phase::Step) {
            let hip_drop = self.root.hip_drop;
            let _ = self.feet.iter_mut().any(|foot| foot.follow(hip_drop));
        }
        for (stands, foot) in contacts.iter_mut().zip(&self.feet) {
            *stands = *stands && foot.phase != Phase::Step && !foot.is_leaving;
        }
        let way = self.root.follow_feet(slid, step_s);
        self.root.move_on_ground(&mut self.feet, way, &mut pose.position);
        if self.root.drop_hips(&self.feet, &chains, step_s) {
            let way = self.root.way_into_reach(&self.feet, &chains, step_s);
            self.root.move_on_ground(&mut self.feet, way, &mut pose.position);
        }
        let feet = self.feet.iter().zip(&self.floor);
        for ((leg, chain), (foot, &floor)) in legs.iter().zip(&chains).zip(feet) {
            // The target of the ankle, before the root moves up or down.
            let mut target = add(chain.ankle, foot.offset);
            if foot.is_held() {
                // A held foot does not drop with the root.
                target[1] -= self.root.hip_drop;
            } else if tuning.on {
                let over = heights_over_floor(leg, chain, floor - self.root.lift);
                target[1] += depth_correction(over, foot.offset[1] + self.root.hip_drop);
            }
            // A leg that needs no change keeps its bits.
            if norm(subtract(target, chain.ankle)) > 1e-6 {
                chain.place(leg, target, reach(chain), pose);
            }
        }
        pose.position[1] += self.root.lift + self.root.hip_drop;
    }

    /// Raises the root where a foot of the finished `pose` is further below the floor than a foot may sink: joints that the
    /// speed limit holds back do not reach the pose that the lock has made. `limited` are these joints, a bit each.
    #[inline(never)]
    pub fn raise<const J: usize>(&self, database: &Database<'_>, limited: u64, pose: &mut Pose<J>) {
        let Some(legs) = database.legs() else { return };
        let mut rise = 0.0;
        for (leg, &floor) in legs.iter().zip(&self.floor) {
            // How the toes bend does not move the foot.
            if !is_moved(database, leg.ankle, limited) {
                continue;
            }
            let over = heights_over_floor(leg, &Chain::of(database, leg, pose), floor);
            let need = depth_correction(over, 0.0);
            rise = maximum(need, rise);
        }
        pose.position[1] += rise;
    }
}

/// Whether a joint, or one that carries it, is among `limited`, a bit each.
fn is_moved(database: &Database<'_>, joint: usize, limited: u64) -> bool {
    let mut at = Some(joint);
    // Parents come before their children, so that this ends.
    for _ in 0..MAX_JOINTS {
        let Some(joint) = at else { break };
        if limited >> (joint % MAX_JOINTS) & 1 != 0 {
            return true;
        }
        at = database.joint(joint).parent;
    }
    false
}

impl Default for Lock {
    fn default() -> Self {
        Self::new()
    }
}
