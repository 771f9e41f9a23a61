//! What a stylizer can be told when it is made.

use gestus_core::{Config, Method, config::parameters};

use crate::{
    memory,
    profile::GestusProfile,
    status::{Answer, GestusStatus, status},
};

/// What a stylizer can be told when it is made. Fill it by `gestus_config_default`, then change what is to be
/// different.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GestusConfig {
    /// Neighbors a class, 1 to what the profile takes. Default 16.
    pub neighbors: u32,
    /// Most distances computed in a class a frame, 64 to 448: what bounds the time of a step. Default 256.
    pub visits: u32,
    /// Most classes of a frame, 1 to 8. Default 8.
    pub classes: u32,
    /// Policy for the output's time, a number of `GestusTiming`. Default `GESTUS_TIMING_FREE`.
    pub timing: u32,
    /// The method of translation, a number of `GestusMethod`. Default `GESTUS_METHOD_MIXTURE`, which a database that was cut
    /// to its models does not hold.
    pub method: u32,
}

/// Methods of translation. The database has to hold what the method needs.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GestusMethod {
    /// The mixture of local autoregressive models over the database's frames.
    Mixture = 0,
    /// Linear time-invariant models.
    Linear = 1,
    /// Transfer of means and spreads.
    Statistic = 2,
}

// A method of the core that has no name here does not compile, nor does one by another number.
const _: () = {
    let mut number = 0;
    while number < Method::ALL.len() {
        let name = match Method::ALL[number] {
            Method::Mar => GestusMethod::Mixture,
            Method::Lti => GestusMethod::Linear,
            Method::Statistic => GestusMethod::Statistic,
        };
        assert!(name as usize == number);
        number += 1;
    }
};

// SAFETY: five u32 have no padding and no invalid patterns.
unsafe impl memory::Plain for GestusConfig {}

/// Policies for the output's time.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GestusTiming {
    /// Poses carry their predicted time steps: the output runs on its own timeline.
    Free = 0,
    /// One pose in, one pose out, at the input's rate.
    Sync = 1,
}

impl GestusConfig {
    pub(crate) fn of(profile: GestusProfile) -> Self {
        let Config { k, visits, classes, timing, method, .. } = Config::new();
        let neighbors = u32::from(k.min(profile.neighbors()));
        Self {
            neighbors,
            visits: visits.into(),
            classes: classes.into(),
            timing: timing as u32,
            method: method as u32,
        }
    }

    /// The core's configuration; what does not fit its types is out of its range.
    pub(crate) fn read(self) -> Answer<Config> {
        let fields = [
            (parameters::K, self.neighbors),
            (parameters::VISITS, self.visits),
            (parameters::CLASSES, self.classes),
            (parameters::TIMING, self.timing),
            (parameters::METHOD, self.method),
        ];
        // A number that an f32 does not hold is out of every range.
        let set = |config, (number, value): (u16, u32)| parameters::set(config, number, value as f32);
        Ok(fields.into_iter().try_fold(Config::new(), set)?)
    }
}

/// Fills a configuration with the defaults of a profile.
///
/// Answers `GESTUS_STATUS_PROFILE`, `_NULL`, `_MISALIGNED`.
///
/// # Safety
/// `config` points at memory for a `GestusConfig`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_config_default(profile: u32, config: *mut GestusConfig) -> GestusStatus {
    status(GestusProfile::of(profile).and_then(|profile| {
        // SAFETY: the caller's word.
        unsafe { memory::put(config, &[GestusConfig::of(profile)]) }
    }))
}
