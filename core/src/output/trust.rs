//! Whether the input is of the database's kind. Where it is not, the output is the input.
//!
//! Two measures are held against what the builder found in clips of the nearest class that were left out
//! ([`Familiar`](crate::blob::Familiar)): the distance to the class's frames, and the root's smoothed speed.
//!
//! ```text
//! r  = d² / far                                      of the nearest class
//! r' = r' + Δt / τ (r - r')                          τ: [`NEARER_S`] where r < r', [`FARTHER_S`] elsewhere
//! e  = max(v / (v_max + 0.1 m/s), v_min / v)         smoothed over [`SMOOTHED_S`]; 0 in place, below 0.2 m/s
//! p* = clamp(max(5 (r' / R - 1), (e - 1.6) / 0.25), 0, 1)        R: Config::trust
//! ```
//!
//! r' stays near the least of the last second. Motion that the database knows comes near a frame of it in every step,
//! however far it is in between; motion that it lacks never does, and a walk among runs is no further away in the mean
//! than a known turn at its furthest.
//!
//! p, the part of the input that is passed on, goes to p* within [`CHANGE_S`]: the strength of every joint group is
//! multiplied by 1 - p. Of a stream, and after a leap, the first tenth of a second is not measured and the speed not until
//! [`LEAD_S`], since the search's window is not full yet. A body that stands is not measured, and p stays.

use crate::{
    blob::Database,
    math::{clamp, sqrt},
};

/// Time constants of the distance, seconds: of input that comes nearer, and of input that goes away.
const NEARER_S: f32 = 0.1;
const FARTHER_S: f32 = 1.0;
/// Age at which the distance counts, seconds: the window is not full yet, but no longer of one pose.
const DISTANCE_S: f32 = 0.1 - LEAD_S;
/// Distances beyond the limit by this part of it are passed on whole.
const MARGIN: f32 = 0.2;
/// Distances count up to this many limits: of something endless r' would never come back.
const MOST: f32 = 4.0;
/// Time constant of the speed, seconds.
pub const SMOOTHED_S: f32 = 0.5;
/// Seconds of a stream that are not measured.
pub const LEAD_S: f32 = 0.2;
/// Seconds of a stream that have to be measured before its speed is judged.
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
    /// Distance over that of the class, near the least of the last second.
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
        self.see_distance(clamp(ratio, 0.0, MOST * most), seconds);
        self.see_speed(velocity, seconds);
        let target = if most > 0.0 { self.target(database, class, most) } else { 0.0 };
        let change = seconds / CHANGE_S;
        *passed += clamp(target - *passed, -change, change);
    }

    /// Time goes on by a frame, whose distance is in that of the class.
    fn see_distance(&mut self, ratio: f32, seconds: f32) {
        let begins = self.age_s <= DISTANCE_S;
        self.age_s = clamp(self.age_s + seconds, -LEAD_S, SMOOTHED_S);
        if self.age_s > DISTANCE_S {
            let time = if ratio < self.ratio { NEARER_S } else { FARTHER_S };
            let taken = if begins { 1.0 } else { clamp(seconds / time, 0.0, 1.0) };
            self.ratio += taken * (ratio - self.ratio);
        }
    }

    fn see_speed(&mut self, velocity: [f32; 2], seconds: f32) {
        if self.age_s <= 0.0 {
            return;
        }
        // A plain mean at first.
        let taken = clamp(seconds / self.age_s, 0.0, 1.0);
        let speed = sqrt(velocity[0] * velocity[0] + velocity[1] * velocity[1]);
        // A body that stops is in place at once.
        let taken = if speed < IN_PLACE { 1.0 } else { taken };
        self.speed += taken * (clamp(speed, 0.0, 20.0) - self.speed);
    }

    fn target(&mut self, database: &Database<'_>, class: Option<usize>, most: f32) -> f32 {
        let speeds = match class {
            Some(class) => database.familiar(class).map(|familiar| familiar.speeds),
            None => {
                self.speeds = self.speeds.or_else(|| all_speeds(database));
                self.speeds
            }
        };
        let by_distance = (self.ratio / most - 1.0) / MARGIN;
        let by_speed = speeds.map_or(0.0, |speeds| (self.beyond(speeds) - BEYOND) / WIDTH);
        clamp(if by_distance > by_speed { by_distance } else { by_speed }, 0.0, 1.0)
    }

    /// How many times faster or slower than a class the input is; 0 where nothing is known of it.
    fn beyond(&self, [slowest, fastest]: [f32; 2]) -> f32 {
        if self.age_s < JUDGED_S || self.speed < IN_PLACE {
            return 0.0;
        }
        let fast = self.speed / (fastest + FASTER);
        if fast < 1.0 { slowest / self.speed } else { fast }
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

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: f32 = 1.0 / 30.0;

    /// The distance after each frame, in those of the class.
    fn seen(distances: impl IntoIterator<Item = f32>) -> Vec<f32> {
        let mut trust = Trust::new();
        let see = |distance| {
            trust.see_distance(distance, FRAME);
            trust.ratio
        };
        distances.into_iter().map(see).collect()
    }

    #[test]
    fn what_comes_near_in_every_step_counts_as_near() {
        // Two steps a second, a quarter of each near: far in the mean, and no further than what never comes near.
        let step = |t: usize| if t % 15 < 4 { 0.4 } else { 2.0 };
        assert!((0..150).map(step).sum::<f32>() / 150.0 > 1.5);
        assert!(seen((0..150).map(step)).into_iter().skip(9).all(|r| r < 1.0));
        assert!(seen([1.5; 150]).into_iter().skip(3).all(|r| r == 1.5));
    }

    #[test]
    fn a_wrong_frame_does_not_count_for_long() {
        let after = seen((0..90).map(|t| if t == 60 { MOST } else { 0.4 }));
        assert!(after.iter().skip(4).all(|&r| r < 0.6) && after[75] < 0.401, "{after:?}");
        // Nor does one that happens to be near.
        let after = seen((0..150).map(|t| if t == 60 { 0.0 } else { 2.0 }));
        assert!(after.iter().skip(3).all(|&r| r > 1.0 + MARGIN), "{after:?}");
    }

    #[test]
    fn a_stream_begins_with_its_first_distance_that_counts() {
        // The search's window is of one pose, and far from all motion.
        let after = seen([9.0, 9.0, 0.3, 0.3, 0.3]);
        assert_eq!(after, [0.0, 0.0, 0.0, 0.3, 0.3]);
    }
}
