//! The motion of one hinge within its limits of position, velocity, acceleration and jerk, computed online: the next
//! tick of the fastest motion to a target that may change at every tick.
//!
//! It consists of two primitives with bounded acceleration and jerk: *stop* brings the velocity to zero as fast as
//! possible, *push* brings it to the limit, towards the target. The position at which a stop that begins now would end
//! (the stop position) is known in closed form, and it moves monotonically during a push. Therefore
//!
//! ```text
//! push while the stop position is short of the target, then stop
//! ```
//!
//! is the time-optimal motion to rest at the target (the seven phases of a third-order profile). A tick finds the time of
//! the switch by false position. A moving target is tracked in its own frame, with its velocity since the last tick.
//!
//! For any targets, velocity, acceleration and jerk are within their limits at every instant, not only at ticks, and a
//! stop that begins now ends within the position limits. The second is an invariant: a tick that would break it is
//! replaced by one towards the target at rest, which keeps it, since the stop position then only moves towards the
//! target. Nothing is clamped afterwards, so that a hinge neither overshoots a limit nor chatters there. NaN as a target
//! is a stop.
//!
//! Sources: Kröger 2011, "Opening the door to new sensor-based robot applications"; Berscheid and Kröger 2021,
//! "Jerk-limited real-time trajectory generation with arbitrary target states" (Ruckig). Cost: at most 20 profiles of one
//! root and three divisions. A whole drive of 16 hinges takes about 152,000 instructions a tick on a Cortex-M4F
//! (`budgets.toml`).

use crate::math::{abs, clamp, maximum, minimum, sqrt};

/// Limits of a hinge. Radians and seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Limits {
    /// Least angle.
    pub low: f32,
    /// Greatest angle.
    pub high: f32,
    /// Greatest velocity, rad/s.
    pub velocity: f32,
    /// Greatest acceleration, rad/s².
    pub acceleration: f32,
    /// Greatest jerk, rad/s³.
    pub jerk: f32,
}

/// Position, velocity and acceleration of a hinge.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Motion {
    /// Angle, radians.
    pub position: f32,
    /// rad/s.
    pub velocity: f32,
    /// rad/s².
    pub acceleration: f32,
}

/// Most iterations that look for the switch within a tick.
const ITERATIONS: usize = 8;
/// Distance from the target at which the search for the switch ends, radians.
const TOLERANCE: f32 = 1e-6;

/// Constant jerk for a time.
#[derive(Clone, Copy)]
struct Phase {
    jerk: f32,
    seconds: f32,
}

impl Limits {
    /// True if every number is in its range, and the least angle below the greatest.
    pub fn is_valid(&self) -> bool {
        let rate = |v: f32| (1e-4..=1e7).contains(&v);
        (-100.0..=100.0).contains(&self.low)
            && (-100.0..=100.0).contains(&self.high)
            && self.low < self.high
            && rate(self.velocity)
            && rate(self.acceleration)
            && rate(self.jerk)
    }

    /// The tick after `now`, `seconds` long, towards `target`; `before` is the target of the tick before.
    pub fn tick(&self, now: Motion, target: f32, before: f32, seconds: f32) -> Motion {
        let rest = self.stop_position(now);
        // A hinge that starts outside its range comes back into it, and no further out.
        let low = if now.position < self.low { minimum(self.low, rest) } else { self.low };
        let high = if now.position > self.high { maximum(self.high, rest) } else { self.high };
        let target = clamp(if target.is_finite() { target } else { rest }, low, high);
        let before = if before.is_finite() { clamp(before, low, high) } else { target };
        let pace = clamp((target - before) / seconds, -0.9 * self.velocity, 0.9 * self.velocity);
        if abs(pace) > 1e-6 {
            let next = self.chase(now, target - pace * seconds, pace, seconds);
            if self.is_safe(next, low, high) {
                return next;
            }
        }
        let next = self.chase(now, target, 0.0, seconds);
        // The bound holds by construction; this takes off what rounding adds.
        Motion {
            position: clamp(next.position, minimum(low, now.position), maximum(high, now.position)),
            ..next
        }
    }

    /// The position at which a stop that begins now ends, radians.
    pub fn stop_position(&self, now: Motion) -> f32 {
        run(now, &self.toward(now, 0.0), f32::INFINITY).position
    }

    /// A tick towards a target that is at `target` now and moves at `pace`.
    fn chase(&self, now: Motion, target: f32, pace: f32, seconds: f32) -> Motion {
        // In the target's frame: it stands at zero.
        let at = Motion { position: now.position - target, velocity: now.velocity - pace, ..now };
        let left = -self.stop_position(at);
        if abs(left) < 1e-7 && abs(at.velocity) < 1e-7 && abs(at.acceleration) < 1e-6 {
            return Motion { position: target + pace * seconds, velocity: pace, acceleration: 0.0 };
        }
        let side = if left < 0.0 { -1.0 } else { 1.0 };
        let push = self.toward(at, side * self.velocity - pace);
        // The distance from the stop position to the target.
        let short = |m: Motion| side * -self.stop_position(m);
        let pushed = run(at, &push, seconds);
        let beyond = short(pushed);
        let next = if beyond >= 0.0 {
            pushed
        } else {
            let after = crossing(seconds, side * left, beyond, |t| short(run(at, &push, t)));
            let switch = run(at, &push, after);
            run(switch, &self.toward(switch, 0.0), seconds - after)
        };
        Motion {
            position: target + next.position + pace * seconds,
            velocity: next.velocity + pace,
            acceleration: next.acceleration,
        }
    }

    /// True if a stop from there stays within the range, and velocity and acceleration are within their limits.
    fn is_safe(&self, m: Motion, low: f32, high: f32) -> bool {
        let rest = self.stop_position(m);
        // If the acceleration brakes more than the stop needs, the motion reverses before it ends: bound the position of
        // the reversal by the time that the acceleration takes to fade.
        let turn = m.position + m.velocity * (abs(m.acceleration) / self.jerk);
        let turns = m.velocity * m.acceleration < 0.0
            && m.acceleration * m.acceleration > 2.0 * self.jerk * abs(m.velocity);
        let inside = |p: f32| (low..=high).contains(&p);
        inside(rest)
            && inside(m.position)
            && (!turns || inside(turn))
            && abs(m.velocity) <= self.velocity
            && abs(m.acceleration) <= self.acceleration * 1.0001
    }

    /// The fastest change to a velocity: jerk, constant acceleration, jerk back to zero acceleration.
    fn toward(&self, from: Motion, velocity: f32) -> [Phase; 3] {
        let (j, a) = (self.jerk, from.acceleration);
        // The velocity after the acceleration has gone to zero by itself.
        let fading = from.velocity + 0.5 * a * abs(a) / j;
        let side = if velocity < fading { -1.0 } else { 1.0 };
        let (a, change) = (side * a, side * (velocity - from.velocity));
        let peak2 = j * change + 0.5 * a * a;
        let peak = sqrt(peak2);
        let (peak, hold) = if peak > self.acceleration {
            let limit = self.acceleration;
            (limit, (change - (2.0 * limit * limit - a * a) / (2.0 * j)) / limit)
        } else {
            (peak, 0.0)
        };
        let up = (peak - a) / j;
        [
            Phase { jerk: side * j, seconds: maximum(up, 0.0) },
            Phase { jerk: 0.0, seconds: maximum(hold, 0.0) },
            Phase { jerk: -side * j, seconds: maximum(maximum(peak, a), 0.0) / j },
        ]
    }
}

/// The root of a falling function between 0, where it is `first`, and `end`, where it is `last` and negative: the latest
/// time evaluated at which it is not negative. False position with Illinois weights.
fn crossing(end: f32, first: f32, last: f32, value: impl Fn(f32) -> f32) -> f32 {
    let (mut from, mut to) = (0.0, end);
    let (mut above, mut below) = (first, last);
    for _ in 0..ITERATIONS {
        let span = above - below;
        let share = if span > 1e-20 { clamp(above / span, 0.02, 0.98) } else { 0.5 };
        let time = from + share * (to - from);
        let height = value(time);
        if height >= 0.0 {
            (from, above) = (time, height);
            if height < TOLERANCE {
                break;
            }
            below *= 0.5;
        } else {
            (to, below) = (time, height);
            above *= 0.5;
        }
    }
    from
}

/// A motion after some phases, for `seconds` at most; after them it coasts.
fn run(from: Motion, phases: &[Phase; 3], seconds: f32) -> Motion {
    let (mut p, mut v, mut a) = (from.position, from.velocity, from.acceleration);
    let mut left = seconds;
    for phase in phases {
        let t = minimum(phase.seconds, left);
        left -= t;
        p += t * (v + t * (0.5 * a + t * phase.jerk * (1.0 / 6.0)));
        v += t * (a + 0.5 * t * phase.jerk);
        a += t * phase.jerk;
    }
    if left > 0.0 {
        // Rounding may leave some acceleration after the last phase.
        a = 0.0;
        if left.is_finite() {
            p += v * left;
        }
    }
    Motion { position: p, velocity: v, acceleration: a }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits { low: -1.2, high: 0.9, velocity: 3.0, acceleration: 20.0, jerk: 400.0 };
    const TICK: f32 = 0.02;

    /// A small generator of its own: the same targets on every machine.
    struct Noise(u32);

    impl Noise {
        fn next(&mut self) -> f32 {
            self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (self.0 >> 8) as f32 / (1 << 24) as f32
        }
    }

    /// Drives towards targets and holds every tick against the limits.
    fn drive(limits: Limits, start: f32, tick: f32, targets: impl Iterator<Item = f32>) -> Vec<Motion> {
        let mut now = Motion { position: start, ..Motion::default() };
        let mut before = start;
        let mut path = vec![now];
        for (i, target) in targets.enumerate() {
            let next = limits.tick(now, target, before, tick);
            let (v, a, j) = (next.velocity, next.acceleration, (next.acceleration - now.acceleration) / tick);
            let what = format!("tick {i} to {target}: {now:?} {next:?}");
            assert!(
                next.position >= limits.low.min(start) && next.position <= limits.high.max(start),
                "{what}"
            );
            assert!(v.abs() <= limits.velocity * 1.001, "{what}");
            assert!(a.abs() <= limits.acceleration * 1.001, "{what}");
            assert!(j.abs() <= limits.jerk * 1.01, "{what}: jerk {j}");
            let mean = (next.position - now.position) / tick;
            assert!(mean.abs() <= limits.velocity * 1.001, "{what}: {mean} rad/s");
            (now, before) = (next, target);
            path.push(now);
        }
        path
    }

    #[test]
    fn a_step_is_reached_without_overshoot_and_held() {
        let path = drive(LIMITS, 0.0, TICK, std::iter::repeat_n(0.9, 100));
        assert!(path.iter().all(|m| m.position <= 0.9 + 1e-6));
        assert!(path[60..].iter().all(|m| (m.position - 0.9).abs() < 1e-5 && m.velocity.abs() < 1e-3));
        // Distance over speed, and what starting and stopping take: 0.9/3 + 3/20 + 20/400 = 0.5 s.
        let there = path.iter().position(|m| (m.position - 0.9).abs() < 1e-3).unwrap();
        assert!((23..=28).contains(&there), "{there} ticks");
    }

    #[test]
    fn the_limits_hold_whatever_the_targets_are() {
        for seed in 0..200 {
            let mut noise = Noise(seed);
            let limits = Limits {
                low: -0.2 - 2.0 * noise.next(),
                high: 0.2 + 2.0 * noise.next(),
                velocity: 0.5 + 10.0 * noise.next(),
                acceleration: 2.0 + 100.0 * noise.next(),
                jerk: 20.0 + 3000.0 * noise.next(),
            };
            let tick = [0.005, 0.01, 0.02, 1.0 / 30.0][seed as usize % 4];
            let kind = seed % 5;
            let targets = (0..1000).map(|i| match kind {
                0 => 6.0 * noise.next() - 3.0,
                1 => 3.0 * (i as f32 * 0.11).sin(),
                2 => [2.0, -2.0][i / 7 % 2],
                3 => [f32::NAN, f32::INFINITY, 0.3, -1e30, f32::NEG_INFINITY, 1e-30]
                    [(6.0 * noise.next()) as usize % 6],
                _ => {
                    if i % 3 == 0 {
                        0.5 * noise.next()
                    } else {
                        0.2 * (i as f32 * 0.05).cos()
                    }
                }
            });
            let targets: Vec<f32> = targets.collect();
            drive(limits, 0.0, tick, targets.into_iter());
        }
    }

    #[test]
    fn a_slow_target_is_followed_without_lag() {
        let target = |i: usize| 0.5 * (i as f32 * TICK * 2.0).sin();
        let path = drive(LIMITS, 0.0, TICK, (1..400).map(target));
        for (i, m) in path.iter().enumerate().skip(50) {
            assert!((m.position - target(i)).abs() < 2e-3, "tick {i}: {} for {}", m.position, target(i));
        }
    }

    #[test]
    fn at_a_limit_the_hinge_rests() {
        // The target swings far beyond the range: at the limit nothing moves, and nothing trembles.
        let path = drive(LIMITS, 0.0, TICK, (0..600).map(|i| 2.5 * (i as f32 * 0.02).sin()));
        let at_limit: Vec<&Motion> = path.iter().filter(|m| m.position > 0.9 - 1e-5).collect();
        assert!(at_limit.len() > 50, "{}", at_limit.len());
        let still = at_limit.iter().filter(|m| m.velocity.abs() < 1e-2).count();
        assert!(still * 10 > at_limit.len() * 9, "{still} of {}", at_limit.len());
    }

    #[test]
    fn a_hinge_outside_its_range_comes_back_in() {
        let path = drive(LIMITS, 1.4, TICK, std::iter::repeat_n(0.5, 150));
        assert!((path[149].position - 0.5).abs() < 1e-4);
    }

    #[test]
    fn nan_is_a_stop() {
        let mut path = drive(LIMITS, 0.0, TICK, std::iter::repeat_n(0.8, 12));
        let moving = path.pop().unwrap();
        assert!(moving.velocity > 0.5);
        let mut now = moving;
        let rest = LIMITS.stop_position(now);
        for _ in 0..60 {
            now = LIMITS.tick(now, f32::NAN, f32::NAN, TICK);
        }
        assert!((now.position - rest).abs() < 1e-3 && now.velocity.abs() < 1e-4, "{now:?} for {rest}");
    }
}
