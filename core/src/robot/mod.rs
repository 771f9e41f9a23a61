//! Poses of the database as motion of a robot with hinges: angles within the hinges' limits, and servo pulses.
//!
//! One tick walks through the modules in this order ([`Drive::step`]):
//!
//! 1. forward kinematics of the pose gives each joint's orientation relative to the hips, the target of the link behind
//!    its hinges;
//! 2. [`hinges`] splits it into the angles of up to three hinges, group by group from the base outwards, relative to
//!    the orientation that the hinges before have reached;
//! 3. [`reach`] corrects arms and legs, so that hands and feet are where the body's are, scaled to the robot;
//! 4. [`limits`] moves each hinge towards its angle within position, velocity, acceleration and jerk;
//! 5. [`servo`] turns angles into pulses.
//!
//! [`Follower::step_robot`] does a step of the stylizer and the ticks behind it in one call.
//!
//! The tables are a file of their own that the builder makes from a URDF ([`layout`], `docs/FORMAT.md`). The base is
//! free: this module does not decide where the robot stands, or keep it from falling.

mod drive;
mod follow;
pub mod hinges;
pub mod layout;
pub mod limits;
pub mod reach;
pub mod servo;
mod validate;

pub use drive::{Drive, Driven};
pub use follow::{Follower, MAX_TICKS, RobotStep};

use crate::{
    ConfigError, Database,
    blob::read::Record,
    error::saturating_u16,
    math::quaternion::{Quaternion, Vector},
};
use hinges::Hinges;
use layout::{group, header, hinge, joint, limb};
use limits::Limits;
use servo::Servo;

/// A checked robot. Cheap to copy.
#[derive(Clone, Copy)]
pub struct Robot<'r> {
    bytes: &'r [u8],
    joints: &'r [u8],
    hinges: &'r [u8],
    groups: &'r [u8],
    limbs: &'r [u8],
}

/// A hinge: its position, orientation and axis.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Hinge {
    /// The hinge before it in the chain; `None`: it is mounted on the base.
    pub parent: Option<usize>,
    /// Position in the frame behind the parent, metres.
    pub offset: Vector,
    /// Rotation from the frame behind the parent to the hinge's own, at angle zero.
    pub turn: Quaternion,
    /// Axis in its own frame, unit vector.
    pub axis: Vector,
}

/// The hinges that take the place of one joint.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Group {
    /// First hinge.
    pub first: usize,
    /// Joint of the database.
    pub joint: usize,
    /// Limb that is corrected by [`reach`] once this group is set.
    pub limb: Option<usize>,
    /// Rotation from the joint's frame to that of the link behind the hinges.
    pub turn: Quaternion,
    /// Rotation from the frame before the hinges to that behind them, at angle zero.
    pub zero: Quaternion,
    /// Axes, ranges and the direction to be pointed.
    pub hinges: Hinges,
}

/// An arm or leg.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Limb {
    /// Where it begins and ends in the database's skeleton.
    pub joints: [usize; 2],
    /// First and last hinge.
    pub hinges: [usize; 2],
    /// Length of the robot's limb divided by that of the body's.
    pub scale: f32,
    /// Its end, in the frame behind the last hinge, metres.
    pub tip: Vector,
}

/// What it is, not the bytes.
impl core::fmt::Debug for Robot<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Robot")
            .field("identity", &self.identity())
            .field("hinges", &self.hinges())
            .finish_non_exhaustive()
    }
}

/// What it is, not the bytes.
#[cfg(feature = "defmt")]
impl defmt::Format for Robot<'_> {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "Robot {} of {} hinges", self.identity(), self.hinges());
    }
}

impl<'r> Robot<'r> {
    /// Number of hinges.
    pub fn hinges(&self) -> usize {
        self.hinges.len() / hinge::LENGTH
    }

    /// Identifies the robot's tables: their CRC-32C.
    pub fn identity(&self) -> u32 {
        Record(self.bytes).u32(header::CRC)
    }

    /// Number of groups.
    pub fn groups(&self) -> usize {
        self.groups.len() / group::LENGTH
    }

    /// Joints of the database's skeleton.
    pub fn joints(&self) -> usize {
        self.joints.len() / joint::LENGTH
    }

    /// Time between two ticks, seconds.
    pub fn tick_s(&self) -> f32 {
        Record(self.bytes).f32(header::TICK)
    }

    /// Rotation from the database's root to the robot's base.
    pub fn base(&self) -> Quaternion {
        Record(self.bytes).floats(header::BASE)
    }

    /// Checks that the robot was made for this database, and has at most `capacity` hinges.
    ///
    /// # Errors
    /// [`ConfigError::Hinges`] or [`ConfigError::OtherDatabase`].
    pub fn fits(&self, database: &Database<'_>, capacity: usize) -> Result<(), ConfigError> {
        if self.hinges() > capacity {
            return Err(ConfigError::Hinges {
                need: saturating_u16(self.hinges()),
                have: saturating_u16(capacity),
            });
        }
        let known = Record(self.bytes).u32(header::SKELETON);
        if self.joints() != database.counts().joints || known != database.skeleton_fingerprint() {
            return Err(ConfigError::OtherDatabase);
        }
        Ok(())
    }

    /// Parent and offset of a joint of the database's skeleton.
    fn joint(&self, index: usize) -> (Option<usize>, Vector) {
        let bytes = Record::of(self.joints, index, joint::LENGTH);
        let parent = bytes.u8(joint::PARENT);
        ((parent != u8::MAX).then_some(usize::from(parent)), bytes.floats(joint::OFFSET))
    }

    /// Hinge `index`.
    pub fn hinge(&self, index: usize) -> Hinge {
        let bytes = Record::of(self.hinges, index, hinge::LENGTH);
        let parent = bytes.u8(hinge::PARENT);
        Hinge {
            parent: (parent != layout::BASE).then_some(usize::from(parent)),
            offset: bytes.floats(hinge::OFFSET),
            turn: bytes.floats(hinge::TURN),
            axis: bytes.floats(hinge::AXIS),
        }
    }

    /// Limits of hinge `index`.
    pub fn limits(&self, index: usize) -> Limits {
        let bytes = Record::of(self.hinges, index, hinge::LENGTH);
        let [low, high, velocity, acceleration, jerk] = bytes.floats(hinge::LIMITS);
        Limits { low, high, velocity, acceleration, jerk }
    }

    /// Servo of hinge `index`.
    pub fn servo(&self, index: usize) -> Servo {
        let bytes = Record::of(self.hinges, index, hinge::LENGTH);
        let [centre_us, gain_us, zero, least_us, greatest_us] = bytes.floats(hinge::SERVO);
        Servo { centre_us, gain_us, zero, least_us, greatest_us }
    }

    /// Group `index`.
    pub fn group(&self, index: usize) -> Group {
        let bytes = Record::of(self.groups, index, group::LENGTH);
        let axis = |i: usize| -> Vector { bytes.floats(group::AXES.start + 12 * i..group::AXES.end) };
        let first = usize::from(bytes.u8(group::FIRST));
        let zero: Quaternion = bytes.floats(group::ZERO);
        let range = |i: usize| {
            let limits = self.limits(first + i);
            (limits.low, limits.high)
        };
        Group {
            first,
            joint: usize::from(bytes.u8(group::JOINT)),
            limb: usize::from(bytes.u8(group::LIMB)).checked_sub(1),
            turn: bytes.floats(group::TURN),
            zero,
            hinges: Hinges {
                count: usize::from(bytes.u8(group::COUNT)),
                axes: [axis(0), axis(1), axis(2)],
                pointed: crate::math::quaternion::rotate(zero, bytes.floats(group::POINTED)),
                ranges: [range(0), range(1), range(2)],
            },
        }
    }

    /// Number of limbs.
    pub fn limbs(&self) -> usize {
        self.limbs.len() / limb::LENGTH
    }

    /// Limb `index`, if there is one.
    pub fn limb(&self, index: usize) -> Option<Limb> {
        let bytes = Record::of(self.limbs, index, limb::LENGTH);
        let pair = |at: usize| [usize::from(bytes.u8(at)), usize::from(bytes.u8(at + 1))];
        (index < self.limbs()).then(|| Limb {
            joints: pair(limb::JOINTS.start),
            hinges: pair(limb::HINGES.start),
            scale: bytes.f32(limb::SCALE),
            tip: bytes.floats(limb::TIP),
        })
    }
}
