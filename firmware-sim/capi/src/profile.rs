//! Profiles: sets of capacities. A stylizer's size is fixed at compile time, and so are the profiles.

use gestus_core::{
    ConfigError, Database, Effort, Pose, Report, Stylizer, config::parameters, math::quaternion::Quaternion,
};

use crate::{
    handle::Cell,
    status::{GestusStatus, StatusResult},
};

/// Capacities of a stylizer. Arguments named `profile` take one of these numbers.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GestusProfile {
    /// Up to 22 joints, 40 neighbors a class and 28 classes.
    Standard = 0,
    /// Up to 12 joints, 16 neighbors a class and 8 classes: for toys, and boards with little memory.
    Small = 1,
    /// Up to 64 joints, 64 neighbors a class and 256 classes, which fits any database: for hosts, games and browsers.
    /// Requires a library that was built with `--features large`.
    Large = 2,
}

/// Bytes that are enough for a stylizer of the profile `GESTUS_PROFILE_STANDARD` on every target, to declare static
/// memory. `gestus_stylizer_size` returns the exact number.
pub const GESTUS_STANDARD_BYTES: usize = 32768;
/// The same for `GESTUS_PROFILE_SMALL`.
pub const GESTUS_SMALL_BYTES: usize = 16384;
/// The same for `GESTUS_PROFILE_LARGE`.
pub const GESTUS_LARGE_BYTES: usize = 131072;

/// Joints, neighbors a class and classes of each profile.
pub(crate) const STANDARD: [usize; 3] = [22, 40, 28];
pub(crate) const SMALL: [usize; 3] = [12, 16, 8];
pub(crate) const LARGE: [usize; 3] = [64, 64, 256];

/// Stylizer of the standard profile.
pub(crate) type Standard = Stylizer<'static, { STANDARD[0] }, { STANDARD[1] }, { STANDARD[2] }>;
/// Stylizer of the small profile.
pub(crate) type Small = Stylizer<'static, { SMALL[0] }, { SMALL[1] }, { SMALL[2] }>;
/// Stylizer of the large profile.
pub(crate) type Large = Stylizer<'static, { LARGE[0] }, { LARGE[1] }, { LARGE[2] }>;

const _: () = {
    assert!(size_of::<Cell<Large>>() <= GESTUS_LARGE_BYTES);
    assert!(size_of::<Cell<Standard>>() <= GESTUS_STANDARD_BYTES);
    assert!(size_of::<Cell<Small>>() <= GESTUS_SMALL_BYTES);
};

impl GestusProfile {
    /// The profile of that number, if this library has it.
    pub(crate) fn of(number: u32) -> StatusResult<Self> {
        match number {
            0 if cfg!(feature = "standard") => Ok(Self::Standard),
            1 if cfg!(feature = "small") => Ok(Self::Small),
            2 if cfg!(feature = "large") => Ok(Self::Large),
            _ => Err(GestusStatus::Profile),
        }
    }

    /// The profile of an object's kind.
    pub(crate) fn of_kind(kind: u32) -> StatusResult<Self> {
        Self::of(kind).map_err(|_| GestusStatus::Handle)
    }

    /// Bytes and alignment of a stylizer.
    pub(crate) fn layout(self) -> (usize, usize) {
        match self {
            Self::Standard => (size_of::<Cell<Standard>>(), align_of::<Cell<Standard>>()),
            Self::Small => (size_of::<Cell<Small>>(), align_of::<Cell<Small>>()),
            Self::Large => (size_of::<Cell<Large>>(), align_of::<Cell<Large>>()),
        }
    }

    /// Capacity for neighbors a class.
    pub(crate) fn neighbors(self) -> u16 {
        let [_, neighbors, _] = match self {
            Self::Standard => STANDARD,
            Self::Small => SMALL,
            Self::Large => LARGE,
        };
        neighbors as u16
    }
}

/// A stylizer of any capacity.
pub(crate) trait AnyStylizer {
    fn database(&self) -> &Database<'static>;
    fn set_style(&mut self, weights: &[(u16, f32)]) -> Result<(), ConfigError>;
    fn set_group_style(&mut self, group: u16, weights: &[(u16, f32)]) -> Result<(), ConfigError>;
    fn set_action(&mut self, action: Option<u16>) -> Result<(), ConfigError>;
    fn set_input_style(&mut self, style: Option<u16>) -> Result<(), ConfigError>;
    fn set_labels(&mut self, action: Option<u16>, style: Option<u16>) -> Result<(), ConfigError>;
    fn set_mask(&mut self, group: u16, searched: bool) -> Result<(), ConfigError>;
    fn set_strength(&mut self, group: u16, strength: f32) -> Result<(), ConfigError>;
    fn set_effort(&mut self, target: Effort) -> Result<(), ConfigError>;
    fn set_visits(&mut self, visits: u16) -> Result<(), ConfigError>;
    /// The value of a parameter by its number; `None` for an unknown number.
    fn parameter(&self, number: u16) -> Option<f32>;
    fn set_parameter(&mut self, number: u16, value: f32) -> Result<(), ConfigError>;
    fn reset(&mut self);
    /// Steps in place: `position` and `rotations` are the input's before and the output's after.
    fn step(&mut self, position: &mut [f32; 3], rotations: &mut [Quaternion]) -> Report;
}

impl<const J: usize, const K: usize, const C: usize> AnyStylizer for Stylizer<'static, J, K, C> {
    fn database(&self) -> &Database<'static> {
        self.database()
    }

    fn set_style(&mut self, weights: &[(u16, f32)]) -> Result<(), ConfigError> {
        self.set_style(weights)
    }

    fn set_group_style(&mut self, group: u16, weights: &[(u16, f32)]) -> Result<(), ConfigError> {
        self.set_group_style(group, weights)
    }

    fn set_action(&mut self, action: Option<u16>) -> Result<(), ConfigError> {
        self.set_action(action)
    }

    fn set_input_style(&mut self, style: Option<u16>) -> Result<(), ConfigError> {
        self.set_input_style(style)
    }

    fn set_labels(&mut self, action: Option<u16>, style: Option<u16>) -> Result<(), ConfigError> {
        self.set_labels(action, style)
    }

    fn set_mask(&mut self, group: u16, searched: bool) -> Result<(), ConfigError> {
        self.set_mask(group, searched)
    }

    fn set_strength(&mut self, group: u16, strength: f32) -> Result<(), ConfigError> {
        self.set_strength(group, strength)
    }

    fn set_effort(&mut self, target: Effort) -> Result<(), ConfigError> {
        self.set_effort(target).map(|_| ())
    }

    fn set_visits(&mut self, visits: u16) -> Result<(), ConfigError> {
        self.set_visits(visits)
    }

    fn parameter(&self, number: u16) -> Option<f32> {
        parameters::value(self.config(), number)
    }

    fn set_parameter(&mut self, number: u16, value: f32) -> Result<(), ConfigError> {
        self.set_config(parameters::set(*self.config(), number, value)?)
    }

    fn reset(&mut self) {
        self.reset();
    }

    fn step(&mut self, position: &mut [f32; 3], rotations: &mut [Quaternion]) -> Report {
        let mut input = Pose::<J> { position: *position, ..Pose::IDENTITY };
        for (slot, &rotation) in input.rotations.iter_mut().zip(rotations.iter()) {
            *slot = rotation;
        }
        let mut output = Pose::IDENTITY;
        let report = self.step(&input, &mut output);
        *position = output.position;
        for (slot, rotation) in rotations.iter_mut().zip(output.rotations) {
            *slot = rotation;
        }
        report
    }
}
