//! What a stylizer can be told when it is made.

use gestus_core::{Config, link::parameter};

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

/// Parameters of the method by number, the same as on the link (docs/LINK.md). Every value is a `float`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GestusParameter {
    /// Neighbors a class, 1 to what the profile takes. Default 16.
    K = 0,
    /// Weight λ of the ridge. Default 0.1 on raw variables.
    Lambda = 1,
    /// Raw or normalised variables. 0 raw, 1 normalised.
    Ridge = 2,
    /// Kernel width δ of the mixing proportions (eq. 4).
    Delta = 3,
    /// Weight of classes that may be dropped, 0 to 1. Default 0.01.
    Prune = 4,
    /// Most classes of a frame, 1 to 8. Default 8.
    Classes = 5,
    /// Half width κ of the interval of trust, in standard deviations (eq. 6).
    Kappa = 6,
    /// How much ρ of what lies outside the interval is kept in the output, 0 to 1 (eq. 7).
    Rho = 7,
    /// Most distances computed in a class a frame, 64 to 448.
    Visits = 8,
    /// Frames that the search keeps in sight, up to 64; at least k.
    Pool = 9,
    /// A mean squared distance this many times the last frame's makes a class be searched anew. At least 1.
    Jump = 10,
    /// Policy for the output's time. A number of `GestusTiming`.
    Timing = 11,
    /// Width of the timing kernel, in mean squared distances of the neighbors.
    TimingWidth = 12,
    /// Where the output's heading comes from. 0 the input's, 1 predicted.
    Yaw = 13,
    /// How far kc a linear model is trusted, in standard deviations of its inputs (paper 001, eq. 8). Default 5: of
    /// some sixty dofs one is always two or three deviations out, and a blend that comes and goes is seen.
    Confidence = 14,
    /// How sharply kp a linear model gives way to the input beyond (paper 001, eq. 8).
    Preference = 15,
    /// Half-life of the input's running statistics in statistical transfer, seconds; 0 (the default): those stored
    /// in the blob.
    Halflife = 16,
    /// The method of translation. A number of `GestusMethod`.
    Method = 17,
    /// Whether feet that stand are held where they stand. Default true. 0 no, 1 yes.
    Contacts = 18,
    /// What is put out where the input fails. 0 follow, 1 hold, 2 rest.
    Safety = 19,
    /// A foot that is held further than this from where the prediction has it steps there, metres, 0.01 to 1.
    Release = 20,
    /// How long a foot that goes up or steps takes back to where the prediction has it at least, seconds, 0.01 to 2.
    Ease = 21,
    /// How many times λ the coefficient of `y[t-1]` is penalised with, 1e-3 to 1e6. Default 1 (paper 000). More
    /// lets the regression forget its last answer sooner at a small λ.
    Feedback = 22,
    /// How many times the input's fastest joint of the last seconds a joint of the output may turn, 1 to 100; 0: as
    /// fast as it does. Default 1.2.
    SpeedLimit = 23,
    /// Half width κy of the interval about its neighbors' mean that an answer is put out from, in standard deviations of
    /// the dof over the database, 0 to 1e6. Default 2; the paper has no such interval.
    OutputKappa = 24,
}

impl GestusConfig {
    pub(crate) fn of(profile: GestusProfile) -> Self {
        let (k, _, visits, _) = Config::new().search_limits();
        let neighbors = u32::from(k.min(profile.neighbors()));
        Self {
            neighbors,
            visits: visits.into(),
            classes: 8,
            timing: GestusTiming::Free as u32,
            method: GestusMethod::Mixture as u32,
        }
    }

    /// The core's configuration; what does not fit its types is out of its range.
    pub(crate) fn read(self) -> Answer<Config> {
        let fields = [
            (parameter::K, self.neighbors),
            (parameter::VISITS, self.visits),
            (parameter::CLASSES, self.classes),
            (parameter::TIMING, self.timing),
            (parameter::METHOD, self.method),
        ];
        // A number that an f32 does not hold is out of every range.
        let set = |config, (number, value): (u16, u32)| parameter::set(config, number, value as f32);
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

#[cfg(test)]
mod tests {
    use gestus_core::link::parameter::NAMES;

    use super::*;

    #[test]
    fn parameters_have_the_numbers_that_they_have_on_a_link() {
        use GestusParameter as P;
        let here = [
            (P::K, "k"),
            (P::Lambda, "lambda"),
            (P::Ridge, "ridge"),
            (P::Delta, "delta"),
            (P::Prune, "prune"),
            (P::Classes, "classes"),
            (P::Kappa, "kappa"),
            (P::Rho, "rho"),
            (P::Visits, "visits"),
            (P::Pool, "pool"),
            (P::Jump, "jump"),
            (P::Timing, "timing"),
            (P::TimingWidth, "timing_width"),
            (P::Yaw, "yaw"),
            (P::Confidence, "confidence"),
            (P::Preference, "preference"),
            (P::Halflife, "halflife_s"),
            (P::Method, "method"),
            (P::Contacts, "contacts"),
            (P::Safety, "safety"),
            (P::Release, "release_m"),
            (P::Ease, "ease_s"),
            (P::Feedback, "feedback"),
            (P::SpeedLimit, "speed_limit"),
            (P::OutputKappa, "output_kappa"),
        ];
        assert_eq!(here.map(|(parameter, name)| (parameter as u16, name)), *NAMES);
    }
}
