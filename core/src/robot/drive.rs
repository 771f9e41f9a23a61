//! The robot's state: where each hinge is, and where it is going.

use super::{
    Robot,
    layout::MAX_LIMB_HINGES,
    limits::Motion,
    reach::{Link, reach},
};
use crate::{
    ConfigError,
    blob::layout::MAX_JOINTS,
    body::pose::Pose,
    error::saturating_u16,
    math::{
        abs, clamp, maximum,
        quaternion::{self, IDENTITY, Quaternion, Vector, about},
        vector::{add, subtract},
    },
};

/// Largest angle that is accepted as a reading of a servo, radians.
const MAX_ANGLE_RAD: f32 = 100.0;

/// The report of a tick.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use = "it says whether the pose was valid and how far the robot lags"]
pub struct Driven {
    /// The pose was invalid (NaN, or rotations that are not unit quaternions), so the last targets were kept.
    pub held: bool,
    /// Number of hinges whose target is at an end of their range.
    pub at_limit: u16,
    /// Largest distance between a hinge and its target, radians.
    pub lag: f32,
    /// Largest distance between a hand or foot, at the target angles, and where it should be, metres.
    pub missing_m: f32,
}

/// Drives up to `H` hinges: owns all the RAM, 16 bytes a hinge.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Drive<'r, const H: usize> {
    robot: Robot<'r>,
    motions: [Motion; H],
    targets: [f32; H],
}

/// Orientation and position of a link relative to the base.
type Place = (Quaternion, Vector);

impl<'r, const H: usize> Drive<'r, H> {
    /// A robot at rest at the given angles, which are those that its servos report, radians. A hinge without an angle,
    /// or with NaN or more than 100 rad, starts at the angle in its range that is nearest to zero.
    ///
    /// Check with [`Robot::fits`] first that the robot was made for the poses' database.
    ///
    /// # Errors
    /// [`ConfigError::Hinges`] if the robot has more than `H`.
    pub fn new(robot: Robot<'r>, angles: &[f32]) -> Result<Self, ConfigError> {
        let count = robot.hinges();
        if count > H {
            return Err(ConfigError::Hinges { need: saturating_u16(count), have: saturating_u16(H) });
        }
        let mut this = Self { robot, motions: [Motion::default(); H], targets: [0.0; H] };
        for (h, (motion, target)) in this.motions.iter_mut().zip(&mut this.targets).enumerate().take(count) {
            let limits = robot.limits(h);
            let given = angles.get(h).copied().filter(|a| abs(*a) <= MAX_ANGLE_RAD);
            motion.position = given.unwrap_or(clamp(0.0, limits.low, limits.high));
            *target = motion.position;
        }
        Ok(this)
    }

    /// The robot.
    pub fn robot(&self) -> Robot<'r> {
        self.robot
    }

    /// The hinges' motions after the last tick. Shape `[hinges]`.
    pub fn motions(&self) -> &[Motion] {
        self.motions.get(..self.robot.hinges()).unwrap_or(&self.motions)
    }

    /// The hinges' target angles, within their ranges, radians. Shape `[hinges]`.
    pub fn targets(&self) -> &[f32] {
        self.targets.get(..self.robot.hinges()).unwrap_or(&self.targets)
    }

    /// The pulse of a hinge's servo, microseconds; 0 if there is no such hinge.
    pub fn pulse(&self, hinge: usize) -> u16 {
        match self.motions.get(hinge) {
            Some(motion) if hinge < self.robot.hinges() => self.robot.servo(hinge).pulse(motion.position),
            _ => 0,
        }
    }

    /// One tick towards a pose, within all limits. The first tick starts from where the robot is.
    pub fn step<const J: usize>(&mut self, pose: &Pose<J>) -> Driven {
        let mut driven = Driven::default();
        let mut goals = self.targets;
        if pose.is_valid(self.robot.joints().min(J)) {
            driven.missing_m = self.angles(pose, &mut goals);
        } else {
            driven.held = true;
        }
        let tick = self.robot.tick_s();
        let each = self.motions.iter_mut().zip(&mut self.targets).zip(goals);
        for (h, ((motion, target), goal)) in each.enumerate().take(self.robot.hinges()) {
            let limits = self.robot.limits(h);
            let goal = if goal.is_finite() { clamp(goal, limits.low, limits.high) } else { *target };
            *motion = limits.tick(*motion, goal, *target, tick);
            *target = goal;
            let lag = abs(goal - motion.position);
            driven.lag = maximum(lag, driven.lag);
            driven.at_limit += u16::from(goal <= limits.low || goal >= limits.high);
        }
        driven
    }

    /// The hinges' angles for a pose, within their ranges. Returns the largest distance that a limb's end is off, metres.
    fn angles<const J: usize>(&self, pose: &Pose<J>, angles: &mut [f32; H]) -> f32 {
        let robot = &self.robot;
        // The body.
        let mut turns = [IDENTITY; MAX_JOINTS];
        let mut places = [[0.0; 3]; MAX_JOINTS];
        let slots = MAX_JOINTS.min(J).min(robot.joints());
        for (j, &rotation) in pose.rotations.iter().enumerate().take(slots) {
            let (parent, offset) = robot.joint(j);
            let before = parent.and_then(|p| Some((*turns.get(p)?, *places.get(p)?)));
            let (turn, place) = match before {
                Some((turn, place)) => {
                    (quaternion::multiply(turn, rotation), add(place, quaternion::rotate(turn, offset)))
                }
                None => (rotation, [0.0; 3]),
            };
            if let (Some(t), Some(p)) = (turns.get_mut(j), places.get_mut(j)) {
                (*t, *p) = (turn, place);
            }
        }
        let root = turns.first().copied().unwrap_or(IDENTITY);
        let to_base = quaternion::conjugate(quaternion::multiply(root, robot.base()));

        // The robot, from the base outwards.
        let mut links: [Place; H] = [(IDENTITY, [0.0; 3]); H];
        let mut driven = [false; H];
        let mut missing = 0.0;
        let mut next = 0;
        for g in 0..robot.groups() {
            let group = robot.group(g);
            let range = group.first..group.first + group.hinges.count;
            // A group may hang on hinges that no group drives, which stay where they are.
            self.place(next..range.start, angles, &mut links);
            next = range.end;
            let parent = robot.hinge(group.first).parent;
            let before = parent.and_then(|p| links.get(p).copied()).unwrap_or((IDENTITY, [0.0; 3]));
            let joint = turns.get(group.joint).copied().unwrap_or(IDENTITY);
            let wanted = quaternion::multiply(to_base, quaternion::multiply(joint, group.turn));
            let relative = quaternion::multiply(quaternion::conjugate(before.0), wanted);
            let turn = quaternion::multiply(relative, quaternion::conjugate(group.zero));
            let at = |h: usize| self.targets.get(group.first + h).copied().unwrap_or(0.0);
            let found = group.hinges.solve(turn, [at(0), at(1), at(2)]);
            if let (Some(slots), Some(driven)) =
                (angles.get_mut(range.clone()), driven.get_mut(range.clone()))
            {
                slots.iter_mut().zip(found).for_each(|(slot, q)| *slot = q);
                driven.fill(true);
            }
            self.place(range, angles, &mut links);
            if let Some(limb) = group.limb.and_then(|l| robot.limb(l)) {
                let [from, to] = limb.joints.map(|j| places.get(j).copied().unwrap_or([0.0; 3]));
                let way = quaternion::rotate(to_base, subtract(to, from));
                let goal = way.map(|v| v * limb.scale);
                let left = self.reach(limb, goal, &driven, angles, &mut links);
                missing = maximum(left, missing);
            }
        }
        missing
    }

    /// Forward kinematics of some hinges.
    fn place(&self, range: core::ops::Range<usize>, angles: &[f32; H], links: &mut [Place; H]) {
        for h in range {
            let hinge = self.robot.hinge(h);
            let before = hinge.parent.and_then(|p| links.get(p).copied()).unwrap_or((IDENTITY, [0.0; 3]));
            let place = add(before.1, quaternion::rotate(before.0, hinge.offset));
            let turn = quaternion::multiply(before.0, hinge.turn);
            let angle = angles.get(h).copied().unwrap_or(0.0);
            if let Some(slot) = links.get_mut(h) {
                *slot = (quaternion::multiply(turn, about(hinge.axis, angle)), place);
            }
        }
    }

    /// Corrects the angles of a limb's driven hinges so that its end comes to `goal`, metres from its first joint in the
    /// base's frame. Returns the distance that is left, metres.
    fn reach(
        &self,
        limb: super::Limb,
        goal: Vector,
        driven: &[bool; H],
        angles: &mut [f32; H],
        links: &mut [Place; H],
    ) -> f32 {
        let [first, last] = limb.hinges;
        let none =
            Link { offset: [0.0; 3], turn: IDENTITY, axis: [1.0, 0.0, 0.0], range: (0.0, 0.0), angle: 0.0 };
        let mut chain = [none; MAX_LIMB_HINGES];
        for (slot, h) in chain.iter_mut().zip(first..=last) {
            let hinge = self.robot.hinge(h);
            let limits = self.robot.limits(h);
            let angle = angles.get(h).copied().unwrap_or(0.0);
            let driven = driven.get(h).is_some_and(|&d| d);
            let range = if driven { (limits.low, limits.high) } else { (angle, angle) };
            *slot = Link { offset: hinge.offset, turn: hinge.turn, axis: hinge.axis, range, angle };
        }
        let parent = self.robot.hinge(first).parent;
        let before = parent.and_then(|p| links.get(p).copied()).map_or(IDENTITY, |l| l.0);
        let count = (last + 1).saturating_sub(first);
        let Some(used) = chain.get_mut(..count) else { return 0.0 };
        let missing = reach(used, before, limb.tip, goal);
        for (link, h) in used.iter().zip(first..=last) {
            if let Some(slot) = angles.get_mut(h) {
                *slot = link.angle;
            }
        }
        self.place(first..last + 1, angles, links);
        missing
    }
}
