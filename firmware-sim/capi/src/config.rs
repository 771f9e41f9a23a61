//! The configuration of a new stylizer.

use gestus_core::{Config, Method, config::parameters};

use crate::{
    memory,
    profile::GestusProfile,
    status::{GestusStatus, StatusResult, status},
};

/// The configuration of a new stylizer. Fill it with `gestus_config_default`, then change what you need.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GestusConfig {
    /// Neighbors a class, from 1 to the profile's capacity. Default 8.
    pub neighbors: u32,
    /// Most distances computed in a class in a frame, 64 to 448. Bounds the time of a step. Default 256.
    pub visits: u32,
    /// Most classes mixed in a frame, 1 to 8. Default 4.
    pub classes: u32,
    /// Policy for the output's time, a number of `GestusTiming`. Default `GESTUS_TIMING_FREE`.
    pub timing: u32,
    /// Method of translation, a number of `GestusMethod`. Default `GESTUS_METHOD_MIXTURE`, which a database that was
    /// cut to its models does not support.
    pub method: u32,
}

/// Methods of translation. The database has to contain the data that the method needs.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GestusMethod {
    /// The mixture of local autoregressive models over the database's frames.
    Mixture = 0,
    /// Linear time-invariant models (Hsu 2005).
    Linear = 1,
    /// Transfer of means and standard deviations.
    Statistic = 2,
    /// Phase tables: means of each class over its cycle.
    Phase = 3,
}

// Does not compile if a method of the core is missing here, or has another number.
const _: () = {
    let mut number = 0;
    while number < Method::ALL.len() {
        let name = match Method::ALL[number] {
            Method::Mar => GestusMethod::Mixture,
            Method::Lti => GestusMethod::Linear,
            Method::Statistic => GestusMethod::Statistic,
            Method::Phase => GestusMethod::Phase,
        };
        assert!(name as usize == number);
        number += 1;
    }
};

// SAFETY: five u32 have no padding and no invalid bit patterns.
unsafe impl memory::Plain for GestusConfig {}

/// Policies for the output's time.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GestusTiming {
    /// Every output pose has its predicted time step: the output has a timeline of its own.
    Free = 0,
    /// The output has the input's time step: play one pose for each input pose.
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

    /// The core's configuration. Numbers that do not fit its types are out of range.
    pub(crate) fn read(self) -> StatusResult<Config> {
        let fields = [
            (parameters::K, self.neighbors),
            (parameters::VISITS, self.visits),
            (parameters::CLASSES, self.classes),
            (parameters::TIMING, self.timing),
            (parameters::METHOD, self.method),
        ];
        // A number that `f32` can't represent exactly is out of every range.
        let set = |config, (number, value): (u16, u32)| parameters::set(config, number, value as f32);
        Ok(fields.into_iter().try_fold(Config::new(), set)?)
    }
}

/// Fills a configuration with the defaults of a profile.
///
/// Returns `GESTUS_STATUS_PROFILE`, `_NULL`, `_MISALIGNED`.
///
/// # Safety
/// `config` points at memory for a `GestusConfig`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_config_default(profile: u32, config: *mut GestusConfig) -> GestusStatus {
    status(GestusProfile::of(profile).and_then(|profile| {
        // SAFETY: by the caller's contract.
        unsafe { memory::put(config, &[GestusConfig::of(profile)]) }
    }))
}
