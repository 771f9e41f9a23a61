//! Whether the input is of the database's kind. Where it is not, the output is the input.
//!
//! Two measures are held against what the builder found in clips of the nearest class that were left out
//! ([`Familiar`](crate::blob::Familiar)): the distance to the class's frames, and the root's smoothed speed. Linear models
//! and statistics have the distance from their mean instead, in their own variances, and a limit for it.
//!
//! ```text
//! r  = d² / far                                      smoothed over [`SMOOTHED_S`]; of the nearest class, or of a model
//! e  = max(v / (v_max + 0.1 m/s), v_min / v)         smoothed over [`SMOOTHED_S`]; 0 in place, below 0.2 m/s
//! p* = clamp(max(2 (r / R - 1), (e - 1.6) / 0.25), 0, 1)         R: Config::trust
//! ```
//!
//! p, the part of the input that is passed on, goes to p* within [`CHANGE_S`]: the strength of every joint group is
//! multiplied by 1 - p. The first [`LEAD_S`] of a stream and after a leap are not measured, since the search's window is
//! not full yet.

use crate::{
    blob::Database,
    math::{clamp, sqrt},
};

/// Time constant of both measures, seconds.
pub const SMOOTHED_S: f32 = 0.5;
/// Seconds of a stream that are not measured.
pub const LEAD_S: f32 = 0.2;
/// Seconds of a stream that have to be measured before it is judged.
const JUDGED_S: f32 = 0.3;
/// Time in which the output goes over to the input or back, seconds.
pub const CHANGE_S: f32 = 0.25;
/// Slower than this a body is in place, and its speed says nothing, m/s.
const IN_PLACE: f32 = 0.2;
/// What is added to a class's greatest speed, m/s.
const FASTER: f32 = 0.1;
/// Speeds beyond a class's by this factor begin to be passed on, and by so much more are passed on whole.
const BEYOND: f32 = 1.6;
const WIDTH: f32 = 0.25;

/// How familiar the input is.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Trust {
    /// Smoothed distance, over that of the class.
    ratio: f32,
    /// Smoothed speed of the root over the ground, m/s.
    speed: f32,
    /// Seconds of the stream that were measured, up to [`SMOOTHED_S`]; below 0 before.
    age_s: f32,
    /// Least and greatest speed of all classes: read once a stream, by methods that know no class.
    speeds: Option<[f32; 2]>,
}

impl Trust {
    /// Before the first frame.
    pub const fn new() -> Self {
        Self { ratio: 0.0, speed: 0.0, age_s: -LEAD_S, speeds: None }
    }

    /// The input has leapt, or frames are missing: those before say nothing of those that follow.
    pub fn begin_again(&mut self) {
        *self = Self { speeds: self.speeds, ..Self::new() };
    }

    /// Takes a frame of `seconds`: the nearest class, where the method knows one; the frame's squared distance over that of
    /// the class, 0 where the method has none; and the root's velocity over the ground, m/s. `most` is
    /// [`Config::trust`](crate::Config::trust). Moves `passed`, the part of the input that is passed on, 0 to 1.
    #[inline(never)]
    pub fn see(
        &mut self,
        database: &Database<'_>,
        (class, ratio): (Option<usize>, f32),
        velocity: [f32; 2],
        (most, seconds): (f32, f32),
        passed: &mut f32,
    ) {
        self.age_s = clamp(self.age_s + seconds, -LEAD_S, SMOOTHED_S);
        if self.age_s <= 0.0 {
            return;
        }
        // A plain mean at first. Of something endless the smoothed ratio would never come back.
        let taken = clamp(seconds / self.age_s, 0.0, 1.0);
        self.ratio += taken * (clamp(ratio, 0.0, 4.0 * most) - self.ratio);
        let speed = sqrt(velocity[0] * velocity[0] + velocity[1] * velocity[1]);
        // A body that stops is in place at once.
        let taken = if speed < IN_PLACE { 1.0 } else { taken };
        self.speed += taken * (clamp(speed, 0.0, 20.0) - self.speed);
        let target =
            if self.age_s < JUDGED_S || most <= 0.0 { 0.0 } else { self.target(database, class, most) };
        let change = seconds / CHANGE_S;
        *passed += clamp(target - *passed, -change, change);
    }

    fn target(&mut self, database: &Database<'_>, class: Option<usize>, most: f32) -> f32 {
        let speeds = match class {
            Some(class) => database.familiar(class).map(|familiar| familiar.speeds),
            None => {
                self.speeds = self.speeds.or_else(|| all_speeds(database));
                self.speeds
            }
        };
        let by_distance = 2.0 * (self.ratio / most - 1.0);
        let by_speed = speeds.map_or(0.0, |speeds| (self.beyond(speeds) - BEYOND) / WIDTH);
        clamp(if by_distance > by_speed { by_distance } else { by_speed }, 0.0, 1.0)
    }

    /// How many times faster or slower than a class the input is; 0 in place.
    fn beyond(&self, [slowest, fastest]: [f32; 2]) -> f32 {
        let fast = self.speed / (fastest + FASTER);
        if self.speed < IN_PLACE {
            0.0
        } else if fast < 1.0 {
            slowest / self.speed
        } else {
            fast
        }
    }
}

/// Least and greatest speed of all classes.
#[cold]
#[inline(never)]
fn all_speeds(database: &Database<'_>) -> Option<[f32; 2]> {
    let classes = (0..database.counts().classes).filter_map(|class| database.familiar(class));
    classes.map(|familiar| familiar.speeds).reduce(|[a, b], [slowest, fastest]| {
        [if slowest < a { slowest } else { a }, if fastest > b { fastest } else { b }]
    })
}
