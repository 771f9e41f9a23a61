//! Decides whether the input is of a kind that the database knows. Where it is not, the input is passed through.
//!
//! Two measures are compared with limits that the builder found on held-out clips of the nearest class
//! ([`TrustLimits`](crate::blob::TrustLimits)): the distance to the class's frames, and the smoothed speed of the root.
//! Linear models and statistics have no frames. They use the distance from their mean in their own variances, with a
//! fixed limit.
//!
//! ```text
//! r  = d² / far                                      smoothed over [`SMOOTHED_S`]; of the nearest class, or of a model
//! e  = max(v / (v_max + 0.1 m/s), v_min / v)         smoothed over [`SMOOTHED_S`]; 0 in place, below 0.2 m/s
//!                                                    backwards: v < 0, and -v is compared with max(-v_min, 0) and -v_max
//! p* = clamp(max(2 (r / R - 1), (e - 1.6) / 0.25), 0, 1)         R: Config::trust
//! ```
//!
//! A walk backwards has the poses of a walk, so the distance alone does not tell it from one.
//!
//! p is the part of the input that is passed through. It approaches p* within [`CHANGE_S`]; the strength of every joint
//! group is multiplied by 1 - p. The first [`LEAD_S`] of a stream, and of what follows a leap, are left out of both means,
//! because the search window is not full yet. Until 0.3 s more were measured, only the distance to a class counts, against
//! 2.5 R and from the third frame, when the window shows that the body moves: held-out clips begin at up to 1.6 R, other
//! actions at 3 to 11 R.

use crate::{
    blob::Database,
    math::{clamp, maximum, minimum, sqrt},
};

/// Time constant of both measures, seconds.
pub const SMOOTHED_S: f32 = 0.5;
/// Time at the start of a stream that is not measured, seconds.
pub const LEAD_S: f32 = 0.2;
/// Time that has to be measured before the limit R holds, seconds.
const MIN_OBSERVED_S: f32 = 0.3;
/// Limit of the distance before that, over R.
const EARLY_LIMIT: f32 = 2.5;
/// First frames of a stream that are not judged at all.
const UNKNOWN_FRAMES: f32 = 2.0;
/// Time in which the output changes to the input or back, seconds.
pub const CHANGE_S: f32 = 0.25;
/// Speed below which a body counts as in place, and its speed is not judged, m/s.
const IN_PLACE_SPEED: f32 = 0.2;
/// Margin that is added to the greatest speed of a class, m/s.
const SPEED_MARGIN: f32 = 0.1;
/// Ratio of the input's speed to a class's at which the input begins to be passed through.
const SPEED_RATIO_START: f32 = 1.6;
/// Further increase of the ratio after which the input is passed through entirely.
const SPEED_RATIO_WIDTH: f32 = 0.25;

/// The smoothed measures of the input.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Trust {
    /// Smoothed squared distance over the class's limit.
    ratio: f32,
    /// Smoothed speed of the root over the ground, m/s; negative backwards.
    speed: f32,
    /// Time that was measured, seconds, at most [`SMOOTHED_S`]; negative during [`LEAD_S`].
    age_s: f32,
    /// Least and greatest speed of all classes, m/s, negative backwards. Read once a stream, for methods that report no
    /// class; [`UNREAD`] until then.
    speeds: [f32; 2],
}

/// How near a frame's input is to the database.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Judged {
    /// The nearest class, if the method reports one.
    pub class: Option<usize>,
    /// The frame's squared distance over the class's limit; 0 if the method has none.
    pub ratio: f32,
}

/// No range of speeds: the least is above the greatest. Smaller than an `Option`.
const UNREAD: [f32; 2] = [f32::INFINITY, f32::NEG_INFINITY];

impl Trust {
    /// Before the first frame.
    pub const fn new() -> Self {
        Self { ratio: 0.0, speed: 0.0, age_s: -LEAD_S, speeds: UNREAD }
    }

    /// Restarts the measures after a leap or missing frames.
    pub fn restart(&mut self) {
        *self = Self { speeds: self.speeds, ..Self::new() };
    }

    /// Measures a frame of length `seconds`, and updates `passed`, the part of the input that is passed through, 0 to 1.
    ///
    /// `velocity` is that of the root over the ground, forward and left, m/s, and `max_ratio`
    /// [`Config::trust`](crate::Config::trust).
    #[inline(never)]
    pub fn update(
        &mut self,
        database: &Database<'_>,
        Judged { class, ratio }: Judged,
        velocity: [f32; 2],
        max_ratio: f32,
        seconds: f32,
        passed: &mut f32,
    ) {
        self.age_s = clamp(self.age_s + seconds, -LEAD_S, SMOOTHED_S);
        // Bounded, since the mean would never recover from infinity.
        let ratio = clamp(ratio, 0.0, 4.0 * max_ratio);
        let ratio = if self.age_s > 0.0 { self.smooth(ratio, velocity, seconds) } else { ratio };
        // Half a frame keeps rounding out of it.
        let is_judged = self.age_s + LEAD_S > (UNKNOWN_FRAMES + 0.5) * seconds;
        let target = if max_ratio <= 0.0 {
            0.0
        } else if !is_judged {
            *passed
        } else if self.age_s >= MIN_OBSERVED_S {
            self.target(database, class, max_ratio)
        } else if class.is_some() {
            clamp(by_distance(ratio, EARLY_LIMIT * max_ratio), 0.0, 1.0)
        } else {
            0.0
        };
        let change = seconds / CHANGE_S;
        *passed += clamp(target - *passed, -change, change);
    }

    /// Adds a frame to the means. Returns that of the ratio.
    fn smooth(&mut self, ratio: f32, velocity: [f32; 2], seconds: f32) -> f32 {
        // A plain mean at first.
        let gain = clamp(seconds / self.age_s, 0.0, 1.0);
        self.ratio += gain * (ratio - self.ratio);
        let speed = clamp(sqrt(velocity[0] * velocity[0] + velocity[1] * velocity[1]), 0.0, 20.0);
        // A body that stops counts as in place at once.
        let gain = if speed < IN_PLACE_SPEED { 1.0 } else { gain };
        self.speed += gain * (if velocity[0] < 0.0 { -speed } else { speed } - self.speed);
        self.ratio
    }

    fn target(&mut self, database: &Database<'_>, class: Option<usize>, max_ratio: f32) -> f32 {
        let speeds = match class {
            Some(class) => database.trust_limits(class).map(|limits| limits.speeds),
            None => {
                if self.speeds == UNREAD {
                    self.speeds = all_speeds(database);
                }
                Some(self.speeds).filter(|&speeds| speeds != UNREAD)
            }
        };
        let by_distance = by_distance(self.ratio, max_ratio);
        let by_speed =
            speeds.map_or(0.0, |speeds| (self.speed_ratio(speeds) - SPEED_RATIO_START) / SPEED_RATIO_WIDTH);
        clamp(maximum(by_distance, by_speed), 0.0, 1.0)
    }

    /// How many times faster or slower than a class the input is, 1 or more outside its range; 0 in place.
    fn speed_ratio(&self, [slowest, fastest]: [f32; 2]) -> f32 {
        let (speed, slowest, fastest) =
            if self.speed < 0.0 { (-self.speed, -fastest, -slowest) } else { (self.speed, slowest, fastest) };
        // Below 0 the class never goes this way.
        let most = maximum(fastest, 0.0);
        let fast = speed / (most + SPEED_MARGIN);
        if speed < IN_PLACE_SPEED {
            0.0
        } else if fast < 1.0 {
            slowest / speed
        } else {
            fast
        }
    }
}

/// Part of the input that is passed through because of its distance, not bounded.
fn by_distance(ratio: f32, limit: f32) -> f32 {
    2.0 * (ratio / limit - 1.0)
}

/// Least and greatest speed of all classes; [`UNREAD`] where the blob does not store them.
#[cold]
#[inline(never)]
fn all_speeds(database: &Database<'_>) -> [f32; 2] {
    let classes = (0..database.counts().classes).filter_map(|class| database.trust_limits(class));
    classes
        .map(|limits| limits.speeds)
        .fold(UNREAD, |[a, b], [slowest, fastest]| [minimum(slowest, a), maximum(fastest, b)])
}
