//! What a stylizer can be told when it is made. Every value has a default that was measured; see
//! `docs/PERFORMANCE.md` and `gestus evaluate ablation`.

use crate::{
    ConfigError, Database,
    methods::mixture::{regression::Ridge, weights::MAX_KEPT},
    search::graph::{MAX_VISITS, POOL},
};

/// Where the output's heading comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Yaw {
    /// The input's: the output turns where and when the input does.
    #[default]
    Input,
    /// The predicted rate, integrated. It drifts: some 40 degrees in a turn of 110.
    Predicted,
}

/// Policy for the output's time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Timing {
    /// Poses carry their predicted time stamps: the output runs on its own timeline. For files.
    #[default]
    Free,
    /// One pose in, one pose out, played at the input's rate. The root still covers the ground of the predicted
    /// step, so that feet stay where the pose has them. For robots.
    Sync,
}

/// What is put out where the input fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Safety {
    /// The output takes on the input's posture at once, leaps included, and is moved on the ground as the model would move
    /// it: by ρ of a leap. Where there is no input the last output is held.
    #[default]
    Follow,
    /// The last output is held; the way back is eased.
    Hold,
    /// The output is eased to rest, the database's mean pose on the floor; the way back is eased.
    Rest,
}

impl Safety {
    /// Every policy, in the order of the protocol's numbers.
    pub const ALL: [Self; 3] = [Self::Follow, Self::Hold, Self::Rest];
}

/// The method of translation, chosen when a stylizer is made. The blob has to hold what it needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Method {
    /// The mixture of local autoregressive models over the database's frames (paper 000).
    #[default]
    Mar,
    /// Linear time-invariant models (paper 001).
    Lti,
    /// Transfer of means and spreads (paper 002).
    Statistic,
}

impl Method {
    /// All, by the numbers that they go by on a link.
    pub const ALL: [Self; 3] = [Self::Mar, Self::Lti, Self::Statistic];

    /// Whether a database holds what the method needs.
    #[inline]
    pub fn is_held_by(self, database: &Database<'_>) -> bool {
        match self {
            Self::Mar => database.counts().frames > 0,
            Self::Lti => database.linear_from().is_some(),
            Self::Statistic => database.statistic_from().is_some(),
        }
    }

    /// The first method that a database holds what is needed for: for firmware that takes any blob.
    #[inline]
    pub fn of(database: &Database<'_>) -> Self {
        Self::ALL.into_iter().find(|m| m.is_held_by(database)).unwrap_or_default()
    }
}

/// Parameters of the method. Build one by chaining: `Config::new().k(32).lambda(0.2)`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    pub(crate) k: u16,
    pub(crate) lambda: f32,
    pub(crate) ridge: Ridge,
    pub(crate) feedback: f32,
    pub(crate) output_kappa: f32,
    pub(crate) delta: f32,
    pub(crate) prune: f32,
    pub(crate) classes: u8,
    pub(crate) kappa: f32,
    pub(crate) rho: f32,
    pub(crate) visits: u16,
    pub(crate) pool: u8,
    pub(crate) jump: f32,
    pub(crate) timing: Timing,
    pub(crate) timing_width: f32,
    pub(crate) yaw: Yaw,
    pub(crate) contacts: bool,
    pub(crate) safety: Safety,
    pub(crate) release_m: f32,
    pub(crate) ease_s: f32,
    pub(crate) speed_limit: f32,
    pub(crate) method: Method,
    pub(crate) confidence: f32,
    pub(crate) preference: f32,
    pub(crate) halflife_s: f32,
}

macro_rules! settings {
    ($($(#[$doc:meta])* $name:ident: $type:ty;)*) => {
        impl Config {
            $(
                $(#[$doc])*
                #[must_use]
                pub const fn $name(mut self, value: $type) -> Self {
                    self.$name = value;
                    self
                }
            )*
        }
    };
}

settings! {
    /// Neighbors a class, 1 to the stylizer's `K`. Default 16: nearer to the truth than the paper's 40, and cheaper.
    k: u16;
    /// Weight λ of the ridge. Default 0.1 on raw variables.
    lambda: f32;
    /// Raw or normalised variables.
    ridge: Ridge;
    /// How many times λ the coefficient of `y[t-1]` is penalised with, 1e-3 to 1e6. Default 1 (paper 000). More lets
    /// the regression forget its last answer sooner at a small λ.
    feedback: f32;
    /// Half width κy of the interval about its neighbors' mean that an answer is put out from, in standard deviations of the
    /// dof over the database ([`crate::methods::mixture::regression`]), 0 to 1e6. Default 2; the paper has no such interval.
    output_kappa: f32;
    /// Kernel width δ of the mixing proportions (eq. 4).
    delta: f32;
    /// Weight of classes that may be dropped, 0 to 1. Default 0.01.
    prune: f32;
    /// Most classes of a frame, 1 to 8. Default 8.
    classes: u8;
    /// Half width κ of the interval of trust, in standard deviations (eq. 6).
    kappa: f32;
    /// How much ρ of what lies outside the interval is kept in the output, 0 to 1 (eq. 7).
    rho: f32;
    /// Most distances computed in a class a frame, 64 to 448. Default 256.
    visits: u16;
    /// Frames that the search keeps in sight, up to 64; at least k.
    pool: u8;
    /// A mean squared distance this many times the last frame's makes a class be searched anew. At least 1.
    jump: f32;
    /// Policy for the output's time.
    timing: Timing;
    /// Width of the timing kernel, in mean squared distances of the neighbors.
    timing_width: f32;
    /// Where the output's heading comes from.
    yaw: Yaw;
    /// What is put out where the input fails.
    safety: Safety;
    /// Whether feet that stand are held where they stand. Default true.
    contacts: bool;
    /// A foot that is held further than this from where the prediction has it steps there, metres, 0.01 to 1.
    release_m: f32;
    /// How long a foot that goes up or steps takes back to where the prediction has it at least, seconds, 0.01 to 2.
    ease_s: f32;
    /// How many times the input's fastest joint of the last seconds a joint of the output may turn ([`crate::output::speed_limit`]), 1
    /// to 100; 0: as fast as it does. Default 1.2.
    speed_limit: f32;
    /// The method of translation.
    method: Method;
    /// How far kc a linear model is trusted, in standard deviations of its inputs (paper 001, eq. 8). Default 5: of
    /// some sixty dofs one is always two or three deviations out, and a blend that comes and goes is seen.
    confidence: f32;
    /// How sharply kp a linear model gives way to the input beyond (paper 001, eq. 8).
    preference: f32;
    /// Half-life of the input's running statistics in statistical transfer, seconds; 0 (the default): those stored
    /// in the blob.
    halflife_s: f32;
}

impl Config {
    /// The shipped defaults.
    pub const fn new() -> Self {
        Self {
            k: 16,
            lambda: 0.1,
            ridge: Ridge::Raw,
            feedback: 1.0,
            output_kappa: 2.0,
            delta: 0.2,
            prune: 0.01,
            classes: MAX_KEPT as u8,
            kappa: 0.25,
            rho: 0.5,
            visits: 256,
            pool: 40,
            jump: 4.0,
            timing: Timing::Free,
            timing_width: 0.5,
            yaw: Yaw::Input,
            contacts: true,
            safety: Safety::Follow,
            release_m: 0.2,
            ease_s: 0.2,
            speed_limit: 1.2,
            method: Method::Mar,
            confidence: 5.0,
            preference: 8.0,
            halflife_s: 0.0,
        }
    }

    /// The constants of paper 000, where it states them (K 40, δ 0.7, ρ 0.7), and κ 2; every class that has any weight.
    pub const fn paper() -> Self {
        Self::new().k(40).delta(0.7).prune(0.001).kappa(2.0).rho(0.7).output_kappa(1e6)
    }

    /// The ridge on normalised variables, for pairs that were recorded or made as pairs. A small λ, so that what the
    /// neighbors say about slopes is believed, and a feedback's penalty that forgets an error within a second all the
    /// same; K 40, of which slopes take more than means do. Beyond the paper.
    pub const fn normalised() -> Self {
        Self::new().k(40).ridge(Ridge::Normalised).lambda(0.1).feedback(30.0).kappa(4.0).rho(0.7)
    }

    /// λ and the mode of the ridge.
    pub const fn ridge_lambda(&self) -> (Ridge, f32) {
        (self.ridge, self.lambda)
    }

    /// How many times λ the coefficient of `y[t-1]` is penalised with.
    pub const fn feedback_penalty(&self) -> f32 {
        self.feedback
    }

    /// κy.
    pub const fn output_interval(&self) -> f32 {
        self.output_kappa
    }

    /// κ and ρ.
    pub const fn bias(&self) -> (f32, f32) {
        (self.kappa, self.rho)
    }

    /// k and δ.
    pub const fn neighborhood(&self) -> (u16, f32) {
        (self.k, self.delta)
    }

    /// k, pool, visits and jump: what limits a search.
    pub const fn search_limits(&self) -> (u16, u8, u16, f32) {
        (self.k, self.pool, self.visits, self.jump)
    }

    /// Most classes of a frame.
    pub const fn classes_kept(&self) -> u8 {
        self.classes
    }

    /// The method of translation.
    pub const fn method_chosen(&self) -> Method {
        self.method
    }

    /// The timing policy.
    pub const fn timing_policy(&self) -> Timing {
        self.timing
    }

    #[inline]
    pub(crate) fn check(&self, neighbors: usize) -> Result<(), ConfigError> {
        if !(1..=neighbors.min(POOL)).contains(&usize::from(self.k)) {
            let have = u16::try_from(neighbors.min(POOL)).unwrap_or(u16::MAX);
            return Err(ConfigError::Neighbors { need: self.k, have });
        }
        let fits = (1e-9..=1e6).contains(&self.lambda)
            && (1e-3..=1e6).contains(&self.feedback)
            && (0.0..=1e6).contains(&self.output_kappa)
            && (1e-3..=1e3).contains(&self.delta)
            && (0.0..1.0).contains(&self.prune)
            && (1..=MAX_KEPT).contains(&usize::from(self.classes))
            && (0.0..=1e6).contains(&self.kappa)
            && (0.0..=1.0).contains(&self.rho)
            && (64..=MAX_VISITS).contains(&self.visits)
            && (1..=POOL).contains(&usize::from(self.pool))
            && (1.0..=1e9).contains(&self.jump)
            && (1e-3..=1e3).contains(&self.timing_width)
            && (0.01..=1.0).contains(&self.release_m)
            && (0.01..=2.0).contains(&self.ease_s)
            && (self.speed_limit == 0.0 || (1.0..=100.0).contains(&self.speed_limit))
            && (1e-3..=1e6).contains(&self.confidence)
            && (1e-3..=1e3).contains(&self.preference)
            && (0.0..=1e6).contains(&self.halflife_s);
        if fits { Ok(()) } else { Err(ConfigError::Parameter) }
    }
}

impl Default for Config {
    fn default() -> Self {
        Self::new()
    }
}
