//! From poses on the output style's own time to exactly one pose a tick.
//!
//! A step says how long its pose takes in the output style ([`crate::methods::mixture::step_time`]); a servo bus or a display wants one pose a
//! tick, at its own rate, for as long as there is input. A [`Retimer`] stands between them. It keeps the last few poses
//! and a playhead among them, which moves at the predicted speed while its lag behind the input (a lead, where it is
//! negative) stays within bounds, and is eased back:
//!
//! ```text
//! r = Δ / w                                input frames that pass in the style, for one of the input's
//! speed = 1 + g (r - 1) + lag / τ          g = 1 - s(|lag| / bound) where r leads outwards, else 1; τ = 2 s
//! ```
//!
//! with s a smoothstep from the middle of the bound to its end. The playhead never goes back, and a tick between two
//! poses is interpolated: positions linearly, rotations spherically. Without bounds ([`Bounds::SYNC`]) it is a resampler
//! from one rate to another, any ratio from 1/4 to 4, before a stylizer or behind one.
//!
//! A lead has its price: no pose can be shown before it has come. Whatever lead is allowed is a delay of the whole
//! stream ([`Retimer::latency_s`]), and so is the part of an input frame for which ticks lie between inputs.
//!
//! Rates are counted in integers, so that nothing drifts, however long a stream is. But a sensor has a clock of its own
//! and loses frames, and what is counted then runs away from what comes. Input that has been late in every half second of
//! a whole one is taken for lost: the count is set right by the least of the lateness, and the playhead goes on from where
//! it is. Where there is more input than ticks ask for, it is set right by the least surplus, and caught up with.
//!
//! Nothing is allocated; there is no clock: time is what the caller pushes and takes. Cost: about 300 instructions a
//! joint and tick, of which none where ticks fall on poses.
//!
//! Beyond the papers: their output runs on its own timeline.

use crate::{
    ConfigError,
    body::pose::Pose,
    math::{clamp, quaternion},
};

/// Time constant of the way back to no lag, seconds.
const RETURN_S: f32 = 2.0;
/// Slowest and fastest a style may be against its input.
const SPEEDS: [f32; 2] = [0.25, 4.0];
/// Fastest that missed time is caught up with.
const CATCH_UP: f32 = 3.0;
/// Slowest that time is given back where the input turned out to be later than it was taken for.
const HOLD_BACK: f32 = 0.5;
/// Ticks over which lateness is watched, at least; half a second of them otherwise.
const WATCHED: u32 = 8;
/// Surplus that is let be, input frames: a caller without a clock takes its ticks up to two frames behind the newest.
const SURPLUS: i64 = 2;

/// How far the output may be from the input, seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Bounds {
    /// Most lead: how much earlier than its time a pose may be shown. The stream is delayed by it.
    pub lead_s: f32,
    /// Most lag: how much later.
    pub lag_s: f32,
}

impl Bounds {
    /// No lead and no lag: every pose at its input's time.
    pub const SYNC: Self = Self { lead_s: 0.0, lag_s: 0.0 };
}

/// What a tick showed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use = "the tick says how far the output is from the input, and whether it had to wait"]
pub struct Tick {
    /// How far the output is behind the input, seconds; negative: ahead. The latency counts apart.
    pub lag_s: f32,
    /// Speed of the output against the input's.
    pub speed: f32,
    /// There was no newer pose to move to: input is late, or has not begun.
    pub waited: bool,
}

/// Takes poses at the input's rate and gives poses at the output's. `J` joints; `N` poses of memory.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Retimer<const J: usize, const N: usize> {
    poses: [Pose<J>; N],
    /// Step of each pose, in input frames.
    steps: [f32; N],
    /// Place of the newest pose.
    newest: usize,
    count: usize,
    input_millihz: u32,
    output_millihz: u32,
    bounds: Bounds,
    /// Input frames by which everything is delayed.
    delay: f32,
    /// The part of an input frame for which ticks lie between inputs, in units of `phase`.
    between: i64,
    /// Time of the next tick less that of the newest pose; `output_millihz` is one input frame.
    phase: i64,
    /// Input frames that the playhead is behind.
    lag: f32,
    started: bool,
    /// How late the input is, at the latest: now, and in the stretch of ticks before.
    latest: [i64; 2],
    /// Ticks of the stretch that are left.
    watch: u32,
}

impl<const J: usize, const N: usize> Retimer<J, N> {
    /// A retimer from one rate to another, in thousandths of a hertz.
    ///
    /// # Errors
    /// [`ConfigError::OutOfRange`] for rates that are 0, over 1 MHz, or whose ratio is not in 1/4 to 4, and for bounds
    /// that are negative or over 10 s; [`ConfigError::Poses`] where the bounds need more poses than `N`.
    pub fn new(input_millihz: u32, output_millihz: u32, bounds: Bounds) -> Result<Self, ConfigError> {
        let (input, output) = (u64::from(input_millihz), u64::from(output_millihz));
        let rates = 1..=1_000_000_000;
        let fits = rates.contains(&input_millihz)
            && rates.contains(&output_millihz)
            && output <= 4 * input
            && input <= 4 * output
            && (0.0..=10.0).contains(&bounds.lead_s)
            && (0.0..=10.0).contains(&bounds.lag_s);
        if !fits {
            return Err(ConfigError::OutOfRange);
        }
        let rate_hz = input_millihz as f32 / 1000.0;
        // Ticks lie up to this part of an input frame behind the newest pose.
        let steps_between = output_millihz - common_divisor(input_millihz, output_millihz);
        let between = steps_between as f32 / output_millihz as f32;
        // Whole input frames, so that ticks that fall on inputs need no interpolation.
        let lead = bounds.lead_s * rate_hz;
        let whole = lead as u32 as f32;
        let delay = if lead > whole + 1e-4 { whole + 1.0 } else { whole } + between;
        let most_behind = delay + bounds.lag_s * rate_hz + input_millihz as f32 / output_millihz as f32;
        // The pose at or before the playhead, and the newest.
        let need = most_behind as usize + 3;
        if need > N {
            let short = |value: usize| u16::try_from(value).unwrap_or(u16::MAX);
            return Err(ConfigError::Poses { need: short(need), have: short(N) });
        }
        Ok(Self {
            poses: [Pose::IDENTITY; N],
            steps: [1.0; N],
            newest: 0,
            count: 0,
            input_millihz,
            output_millihz,
            bounds,
            delay,
            between: i64::from(steps_between),
            phase: 0,
            lag: 0.0,
            started: false,
            latest: UNKNOWN,
            watch: watched(output_millihz),
        })
    }

    /// Forgets the stream.
    pub fn reset(&mut self) {
        (self.count, self.phase, self.lag, self.started) = (0, 0, 0.0, false);
        (self.latest, self.watch) = (UNKNOWN, watched(self.output_millihz));
    }

    /// By how much everything is delayed, seconds: the allowed lead, and the part of an input frame for which ticks lie
    /// between inputs.
    pub fn latency_s(&self) -> f32 {
        self.delay / self.rate_hz()
    }

    /// How far the output is behind the input, seconds; negative: ahead.
    pub fn lag_s(&self) -> f32 {
        self.lag / self.rate_hz()
    }

    /// Takes the next pose, and how long it takes in the output style ([`crate::Report::step_s`]).
    pub fn push(&mut self, pose: &Pose<J>, step_s: f32) {
        let frames = step_s * self.rate_hz();
        self.newest = if self.newest + 1 < N { self.newest + 1 } else { 0 };
        if let (Some(slot), Some(step)) = (self.poses.get_mut(self.newest), self.steps.get_mut(self.newest)) {
            *slot = *pose;
            // NaN is in no range: the input's own time.
            let sane = (0.0..1e6).contains(&frames);
            *step = if sane { clamp(frames, 1.0 / SPEEDS[1], 1.0 / SPEEDS[0]) } else { 1.0 };
        }
        self.count = if self.count < N { self.count + 1 } else { N };
        if self.started {
            self.phase = self.phase.saturating_sub(i64::from(self.output_millihz));
        }
        self.started = true;
    }

    /// True where the next tick is due: its time is not after the newest pose's. A caller without a clock of its own
    /// takes ticks while they are due, behind each push.
    pub fn is_due(&self) -> bool {
        self.started && self.phase <= 0
    }

    /// Takes a tick: exactly one pose, whatever has come. Before the first pose the output is left as it is.
    pub fn tick(&mut self, output: &mut Pose<J>) -> Tick {
        if !self.started {
            return Tick { lag_s: 0.0, speed: 0.0, waited: true };
        }
        let passed = self.input_millihz as f32 / self.output_millihz as f32;
        // The first tick shows the first pose. What is pending is at most N frames either way.
        let most = i64::from(self.output_millihz).saturating_mul(N as i64);
        self.phase = self.phase.clamp(-most, most);
        self.set_right();
        let now = self.phase as f32 / self.output_millihz as f32 - self.delay;
        let oldest = self.count.saturating_sub(1) as f32;

        let before = self.lag;
        let rate = self.rate_hz();
        // Where the playhead was, from the newest pose back.
        let behind = before + passed - now;
        // Before the first pose there is nothing to play yet: it is held.
        let speed = if behind > oldest + 1e-3 { 1.0 } else { self.speed(behind, passed) };
        let (least, greatest) = (-self.bounds.lead_s * rate, self.bounds.lag_s * rate);
        // After a wait the lag may be beyond its bound: it is caught up with, not jumped over.
        let caught_up = before - passed * (CATCH_UP - 1.0);
        let greatest = if caught_up > greatest { caught_up } else { greatest };
        // And so the lead, where the input turned out to be later.
        let held_back = before + passed * (1.0 - HOLD_BACK);
        let least = if held_back < least { held_back } else { least };
        let lag = clamp(before + passed * (1.0 - speed), least, greatest);
        // Never back, and never past the newest pose.
        let lag = if lag > before + passed { before + passed } else { lag };
        let waited = lag < now - 1e-3;
        self.lag = if lag < now { now } else { lag };

        self.show(clamp(self.lag - now, 0.0, oldest), output);
        self.phase = self.phase.saturating_add(i64::from(self.input_millihz));
        Tick { lag_s: self.lag / rate, speed: 1.0 - (self.lag - before) / passed, waited }
    }

    /// Sets the count right where the input has been late, or early, for two stretches of ticks. The playhead stays at
    /// the pose where it is.
    fn set_right(&mut self) {
        let frame = i64::from(self.output_millihz);
        let [now, before] = self.latest;
        let now = now.max(self.phase.saturating_sub(self.between));
        self.watch = self.watch.saturating_sub(1);
        if self.watch > 0 {
            self.latest = [now, before];
            return;
        }
        let (least, most) = (now.min(before), now.max(before));
        let by = if least > 0 {
            least
        } else if most < -SURPLUS * frame {
            most
        } else {
            0
        };
        self.phase = self.phase.saturating_sub(by);
        self.lag -= by as f32 / frame as f32;
        self.latest = [i64::MIN, now.saturating_sub(by)];
        self.watch = watched(self.output_millihz);
    }

    fn rate_hz(&self) -> f32 {
        self.input_millihz as f32 / 1000.0
    }

    /// Speed at which the playhead is to move on, `behind` frames before the newest pose, for `passed` input frames.
    fn speed(&self, behind: f32, passed: f32) -> f32 {
        // Steps of the poses that lie ahead, as many as pass: their mean is the style's. The cast saturates at 0.
        let whole = (behind - 1e-5) as usize;
        let (mut sum, mut count) = (0.0, 0.0);
        for ahead in 0..5_usize {
            // The pose `back` places before the newest.
            let Some(back) = whole.checked_sub(ahead) else { break };
            sum += self.at(back).1;
            count += 1.0;
            if count >= passed {
                break;
            }
        }
        let predicted = if sum > 0.0 { count / sum } else { 1.0 };
        let outwards = predicted - 1.0;
        let rate = self.rate_hz();
        // Faster than the input uses up the lead.
        let (bound, used) = if outwards > 0.0 {
            (self.bounds.lead_s * rate, -self.lag)
        } else {
            (self.bounds.lag_s * rate, self.lag)
        };
        let share = if bound > 1e-6 { clamp(2.0 * used / bound - 1.0, 0.0, 1.0) } else { 1.0 };
        let free = 1.0 - share * share * (3.0 - 2.0 * share);
        let back = self.lag / (RETURN_S * rate);
        clamp(1.0 + free * outwards + back, 0.0, SPEEDS[1])
    }

    /// The pose that lies `back` places before the newest, and its step.
    fn at(&self, back: usize) -> (&Pose<J>, f32) {
        let place =
            if back <= self.newest { self.newest - back } else { (self.newest + N).saturating_sub(back) };
        match (self.poses.get(place), self.steps.get(place)) {
            (Some(pose), Some(&step)) => (pose, step),
            _ => (&Pose::IDENTITY, 1.0),
        }
    }

    /// Shows the place `behind` frames before the newest pose.
    fn show(&self, behind: f32, output: &mut Pose<J>) {
        let whole = behind as usize;
        let fraction = behind - whole as f32;
        let later = self.at(whole).0;
        // Rounding leaves a hundred-thousandth of a frame: that is no place between poses.
        if fraction < 1e-5 {
            *output = *later;
            return;
        }
        *output = interpolate(self.at(whole + 1).0, later, 1.0 - fraction);
    }
}

/// The pose between two: positions linearly, rotations spherically along the short way; `t` in 0 to 1.
pub fn interpolate<const J: usize>(a: &Pose<J>, b: &Pose<J>, t: f32) -> Pose<J> {
    let mut pose = *a;
    for (slot, to) in pose.position.iter_mut().zip(b.position) {
        *slot += t * (to - *slot);
    }
    for (slot, &to) in pose.rotations.iter_mut().zip(&b.rotations) {
        *slot = quaternion::slerp(t, *slot, to);
    }
    pose
}

/// Lateness before there was any: in time, so that nothing is set right before two stretches have passed.
const UNKNOWN: [i64; 2] = [i64::MIN, 0];

/// Ticks of a stretch.
fn watched(output_millihz: u32) -> u32 {
    (output_millihz / 2000).max(WATCHED)
}

/// Greatest common divisor of two numbers that are not 0.
fn common_divisor(mut a: u32, mut b: u32) -> u32 {
    // Euclid's algorithm: at most 47 rounds for 32 bits.
    while b != 0 {
        (a, b) = (b, a.checked_rem(b).unwrap_or(0));
    }
    a
}
