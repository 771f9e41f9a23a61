//! The report of a step.

use core::fmt;

use crate::methods::weights::Shares;

/// The ways in which a frame was degraded; a set of flags.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Degraded(u16);

impl Degraded {
    /// The input was not a pose (NaN, a quaternion whose length is not within 1% of 1, a position over 100 km away): the
    /// output follows the safety policy, or is the last one.
    pub const INPUT: Self = Self(1);
    /// A search used up its visits before it was done.
    pub const VISITS: Self = Self(2);
    /// More classes have weight than a frame may use.
    pub const CLASSES: Self = Self(4);
    /// A prediction was not finite or far out of range: the input was passed through in its place.
    pub const PREDICTION: Self = Self(8);
    /// A class that has weight was searched from the start: the input has jumped, or is so far from the data that its
    /// nearest frames change from frame to frame.
    pub const JUMP: Self = Self(16);

    /// No input has arrived; the output follows the safety policy.
    pub const STALE: Self = Self(32);
    /// The input was older than the last one, or the same; the output follows the safety policy.
    pub const ORDER: Self = Self(64);
    /// The input moved faster than any body; the output follows the safety policy.
    pub const LEAP: Self = Self(128);
    /// The input is unlike the database: at least half of it is passed through unchanged
    /// ([`Config::trust`](crate::Config::trust)).
    pub const FAR: Self = Self(256);
    /// The frame before was wrong, and was used: a joint or the heading left by more than 6 rad/s, or the root's height
    /// by more than 3 m/s, and came back by as much in this frame.
    pub const SPIKE: Self = Self(512);

    /// The flags, by name.
    pub const NAMES: [(Self, &'static str); 10] = [
        (Self::INPUT, "input"),
        (Self::VISITS, "visits"),
        (Self::CLASSES, "classes"),
        (Self::PREDICTION, "prediction"),
        (Self::JUMP, "jump"),
        (Self::STALE, "stale"),
        (Self::ORDER, "order"),
        (Self::LEAP, "leap"),
        (Self::FAR, "far"),
        (Self::SPIKE, "spike"),
    ];

    /// True where nothing was degraded.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// True where every flag of `other` is set.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// The flags as bits.
    pub const fn bits(self) -> u16 {
        self.0
    }

    /// Adds the flags of `other` if `value` is true.
    pub(crate) fn add_if(&mut self, value: bool, other: Self) {
        if value {
            self.0 |= other.0;
        }
    }
}

/// The names of the flags, as in `{far, spike}`.
impl fmt::Debug for Degraded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut names = f.debug_set();
        for (flag, name) in Self::NAMES {
            if self.contains(flag) {
                names.entry(&format_args!("{name}"));
            }
        }
        names.finish()
    }
}

/// Left and right foot as bits 0 and 1.
pub(crate) fn pack_feet([left, right]: [bool; 2]) -> u8 {
    u8::from(left) | u8::from(right) << 1
}

/// The feet of [`pack_feet`].
pub(crate) fn unpack_feet(feet: u8) -> [bool; 2] {
    [1, 2].map(|foot| feet & foot != 0)
}

/// What happened in a step.
#[derive(Debug, Clone, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use = "the report says whether the frame was degraded, and how long the output's step is"]
pub struct Report {
    /// The classes used and their proportions, largest first.
    pub classes: Shares,
    /// How far from the data. Mixture: mean squared distance of the nearest class's neighbors, weighted square
    /// metres. Phase tables: smoothed squared distance to the nearest class, whitened. Linear models and statistics: the
    /// largest distance of a dof from its mean, squared, in variances.
    pub distance2: f32,
    /// `distance2` relative to that of input of the database's kind, for which it is about 1 at most. Mixture and
    /// phase tables: relative to held-out frames of the nearest class; 0 where the blob does not store it. Linear
    /// models and statistics: relative to a constant of the method, in variances.
    pub distance_ratio: f32,
    /// Part of the input that is passed through because it is unlike the database, 0 to 1.
    pub passed: f32,
    /// Distances computed.
    pub visits: u32,
    /// Bytes of the blob's features, graph and rows that were read.
    pub bytes_read: u32,
    /// Left and right foot of the output: does it stand?
    pub contacts: [bool; 2],
    /// How likely it is that they stand, 0 to 1, in this frame alone. Mixture: by its neighbors. Phase tables: by
    /// their own contacts. Linear models and statistics: 0 or 1, by a discriminant.
    pub contact_likelihood: [f32; 2],
    /// Left and right foot: is it held where it stands?
    pub held: [bool; 2],
    /// How far each foot is from where the prediction has it, metres.
    pub held_m: [f32; 2],
    /// Time from the last output pose to this one, seconds, under the timing policy.
    pub step_s: f32,
    /// The same as the method predicts it, whatever the policy and the strength of the style.
    pub predicted_step_s: f32,
    /// Each way in which the frame was degraded.
    pub degraded: Degraded,
}
