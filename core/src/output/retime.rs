//! From poses in the output style's own time to exactly one pose a tick.
//!
//! A step reports how long its pose takes in the output style ([`crate::methods::mixture::step_time`]). A servo bus or a
//! display needs one pose a tick at its own rate for as long as there is input. A [`Retimer`] converts the one into the
//! other. It keeps the last few poses and a playhead among them. The playhead moves at the predicted speed while its
//! lag behind the input (negative: a lead) stays within bounds, and the lag decays to 0:
//!
//! ```text
//! r = Δ / w                                input frames that pass in the style, for one of the input's
//! speed = 1 + g (r - 1) + lag / τ          g = 1 - s(|lag| / bound) where r leads outwards, else 1; τ = 2 s
//! ```
//!
//! s is a smoothstep from half of the bound to the bound. The playhead never moves back. A tick between two poses is
//! interpolated: positions linearly, rotations spherically. Without bounds ([`Bounds::SYNC`]) a retimer resamples one
//! rate to another at any ratio from 1/4 to 4, before or after a stylizer.
//!
//! **Latency.** No pose can be shown before it has arrived. The allowed lead therefore delays the whole stream
//! ([`Retimer::latency_s`]), as does the part of an input frame by which ticks lie between inputs.
//!
//! **Clocks.** Rates are counted in integers, so nothing drifts over a long stream. A sensor, however, has a clock of
//! its own and loses frames, so the count and the arriving input diverge. Where the input was late in two watched
//! stretches in a row (half a second each), the missing time counts as lost: the count is corrected by the smaller
//! lateness, and the playhead stays at its pose. Where more input arrives than ticks consume, the count is corrected by
//! the smaller surplus, and the playhead catches up.
//!
//! Nothing is allocated, and there is no clock: the caller pushes poses and takes ticks. Cost: about 650 instructions a
//! joint and tick; ticks that fall on poses need no interpolation.
//!
//! This part is ours: the output of the papers keeps its own timeline.

use crate::{
    ConfigError,
    body::pose::Pose,
    error::saturating_u16,
    math::{clamp, maximum, minimum, quaternion, smoothstep},
};

/// Time constant with which the lag decays, seconds.
const RETURN_S: f32 = 2.0;
/// Slowest and fastest speed of a style relative to its input.
const SPEEDS: [f32; 2] = [0.25, 4.0];
/// Greatest speed with which the playhead catches up.
const CATCH_UP: f32 = 3.0;
/// Least speed of the playhead while it waits for input that is later than expected.
const HOLD_BACK: f32 = 0.5;
/// Least number of ticks in a stretch over which lateness is watched. Stretches last half a second otherwise.
const MIN_WATCH_TICKS: u32 = 8;
/// Surplus that is not corrected, input frames. A caller without a clock takes its ticks up to two frames late.
const MAX_SURPLUS_FRAMES: i64 = 2;

/// How far the output may deviate from the input in time.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Bounds {
    /// Greatest lead, seconds: how much earlier than its time a pose may be shown. It delays the stream.
    pub lead_s: f32,
    /// Greatest lag, seconds: how much later than its time a pose may be shown.
    pub lag_s: f32,
}

impl Bounds {
    /// No lead and no lag: every pose at its input's time.
    pub const SYNC: Self = Self { lead_s: 0.0, lag_s: 0.0 };
}

/// The result of a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use = "the tick says how far the output is from the input, and whether it had to wait"]
pub struct Tick {
    /// How far the output is behind the input, seconds; negative if it is ahead. The latency is not included.
    pub lag_s: f32,
    /// Speed of the output relative to the input; 1 is the same.
    pub speed: f32,
    /// True where there was no newer pose to move to: the input is late, or has not begun.
    pub waited: bool,
}

/// Takes poses at the input's rate and returns poses at the output's, for up to `J` joints, with memory for `N` poses.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Retimer<const J: usize, const N: usize> {
    poses: [Pose<J>; N],
    /// Step of each pose, in input frames.
    steps: [f32; N],
    /// Index of the newest pose in the ring.
    newest: usize,
    count: usize,
    input_millihz: u32,
    output_millihz: u32,
    bounds: Bounds,
    /// Latency in input frames.
    delay: f32,
    /// Greatest distance of a tick behind the newest pose, in units of `phase`.
    max_offset: i64,
    /// Time of the next tick minus that of the newest pose, in units of which `output_millihz` make one input frame.
    phase: i64,
    /// How far the playhead is behind the input, input frames.
    lag: f32,
    started: bool,
    /// Greatest lateness of the input in this stretch and in the one before, in units of `phase`.
    max_lateness: [i64; 2],
    /// Ticks left in this stretch.
    watch_ticks_left: u32,
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
        // How far ticks may lie behind the newest pose.
        let steps_between = output_millihz - common_divisor(input_millihz, output_millihz);
        let max_offset = steps_between as f32 / output_millihz as f32;
        // Whole input frames, so that ticks that fall on inputs need no interpolation.
        let lead = bounds.lead_s * rate_hz;
        let whole = lead as u32 as f32;
        let delay = if lead > whole + 1e-4 { whole + 1.0 } else { whole } + max_offset;
        let most_behind = delay + bounds.lag_s * rate_hz + input_millihz as f32 / output_millihz as f32;
        // The pose at or before the playhead, and the newest.
        let need = most_behind as usize + 3;
        if need > N {
            return Err(ConfigError::Poses { need: saturating_u16(need), have: saturating_u16(N) });
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
            max_offset: i64::from(steps_between),
            phase: 0,
            lag: 0.0,
            started: false,
            max_lateness: NO_LATENESS,
            watch_ticks_left: watch_ticks(output_millihz),
        })
    }

    /// Forgets the stream.
    pub fn reset(&mut self) {
        (self.count, self.phase, self.lag, self.started) = (0, 0, 0.0, false);
        (self.max_lateness, self.watch_ticks_left) = (NO_LATENESS, watch_ticks(self.output_millihz));
    }

    /// Delay of the stream, seconds: the allowed lead, and the part of an input frame by which ticks lie between inputs.
    pub fn latency_s(&self) -> f32 {
        self.delay / self.rate_hz()
    }

    /// How far the output is behind the input, seconds; negative if it is ahead.
    pub fn lag_s(&self) -> f32 {
        self.lag / self.rate_hz()
    }

    /// Adds the next pose, and its duration in the output style ([`crate::Report::step_s`]).
    pub fn push(&mut self, pose: &Pose<J>, step_s: f32) {
        let frames = step_s * self.rate_hz();
        self.newest = if self.newest + 1 < N { self.newest + 1 } else { 0 };
        if let (Some(slot), Some(step)) = (self.poses.get_mut(self.newest), self.steps.get_mut(self.newest)) {
            *slot = *pose;
            // The input's own duration where `step_s` is NaN or out of range.
            let sane = (0.0..1e6).contains(&frames);
            *step = if sane { clamp(frames, 1.0 / SPEEDS[1], 1.0 / SPEEDS[0]) } else { 1.0 };
        }
        self.count = if self.count < N { self.count + 1 } else { N };
        if self.started {
            self.phase = self.phase.saturating_sub(i64::from(self.output_millihz));
        }
        self.started = true;
    }

    /// True where the next tick is due, that is, not later than the newest pose. A caller without a clock takes ticks while
    /// they are due, after each push.
    pub fn is_due(&self) -> bool {
        self.started && self.phase <= 0
    }

    /// Takes a tick: writes exactly one pose, whatever has arrived. Before the first pose `output` is not changed.
    pub fn tick(&mut self, output: &mut Pose<J>) -> Tick {
        if !self.started {
            return Tick { lag_s: 0.0, speed: 0.0, waited: true };
        }
        let passed = self.input_millihz as f32 / self.output_millihz as f32;
        // The first tick shows the first pose. At most N frames are pending either way.
        let most = i64::from(self.output_millihz).saturating_mul(N as i64);
        self.phase = self.phase.clamp(-most, most);
        self.correct_drift();
        let now = self.phase as f32 / self.output_millihz as f32 - self.delay;
        let oldest = self.count.saturating_sub(1) as f32;

        let before = self.lag;
        let rate = self.rate_hz();
        // Where the playhead was, from the newest pose back.
        let behind = before + passed - now;
        // A playhead before the oldest pose holds that pose.
        let speed = if behind > oldest + 1e-3 { 1.0 } else { self.speed(behind, passed) };
        let (least, greatest) = (-self.bounds.lead_s * rate, self.bounds.lag_s * rate);
        // After a wait the lag may exceed its bound. The playhead catches up instead of jumping.
        let caught_up = before - passed * (CATCH_UP - 1.0);
        let greatest = maximum(caught_up, greatest);
        // The same for a lead that exceeds its bound, where the input turned out to be later.
        let held_back = before + passed * (1.0 - HOLD_BACK);
        let least = minimum(held_back, least);
        let lag = clamp(before + passed * (1.0 - speed), least, greatest);
        // The playhead never moves back, and never past the newest pose.
        let lag = minimum(before + passed, lag);
        let waited = lag < now - 1e-3;
        self.lag = maximum(now, lag);

        self.interpolate_at(clamp(self.lag - now, 0.0, oldest), output);
        self.phase = self.phase.saturating_add(i64::from(self.input_millihz));
        Tick { lag_s: self.lag / rate, speed: 1.0 - (self.lag - before) / passed, waited }
    }

    /// Corrects the count where the input was late, or early, in two stretches of ticks. The playhead stays at its pose.
    fn correct_drift(&mut self) {
        let frame = i64::from(self.output_millihz);
        let [now, before] = self.max_lateness;
        let now = now.max(self.phase.saturating_sub(self.max_offset));
        self.watch_ticks_left = self.watch_ticks_left.saturating_sub(1);
        if self.watch_ticks_left > 0 {
            self.max_lateness = [now, before];
            return;
        }
        let (least, most) = (now.min(before), now.max(before));
        let by = if least > 0 {
            least
        } else if most < -MAX_SURPLUS_FRAMES * frame {
            most
        } else {
            0
        };
        self.phase = self.phase.saturating_sub(by);
        self.lag -= by as f32 / frame as f32;
        self.max_lateness = [i64::MIN, now.saturating_sub(by)];
        self.watch_ticks_left = watch_ticks(self.output_millihz);
    }

    fn rate_hz(&self) -> f32 {
        self.input_millihz as f32 / 1000.0
    }

    /// Speed of the playhead over the next `passed` input frames. It is `behind` input frames before the newest pose.
    fn speed(&self, behind: f32, passed: f32) -> f32 {
        // The mean duration of the poses that will pass. The cast saturates at 0.
        let whole = (behind - 1e-5) as usize;
        let (mut sum, mut count) = (0.0, 0.0);
        // As many as pass in an input frame at the greatest speed, and one more. The mean of a longer tick is of no more.
        for ahead in 0..=SPEEDS[1] as usize {
            // The pose `back` places before the newest.
            let Some(back) = whole.checked_sub(ahead) else { break };
            sum += self.at(back).1;
            count += 1.0;
            if count >= passed {
                break;
            }
        }
        let predicted = if sum > 0.0 { count / sum } else { 1.0 };
        let excess = predicted - 1.0;
        let rate = self.rate_hz();
        // Moving faster than the input uses up the lead.
        let (bound, used) = if excess > 0.0 {
            (self.bounds.lead_s * rate, -self.lag)
        } else {
            (self.bounds.lag_s * rate, self.lag)
        };
        let share = if bound > 1e-6 { clamp(2.0 * used / bound - 1.0, 0.0, 1.0) } else { 1.0 };
        let free = 1.0 - smoothstep(share);
        let back = self.lag / (RETURN_S * rate);
        clamp(1.0 + free * excess + back, 0.0, SPEEDS[1])
    }

    /// The pose that lies `back` places before the newest, and its duration in input frames.
    fn at(&self, back: usize) -> (&Pose<J>, f32) {
        let place =
            if back <= self.newest { self.newest - back } else { (self.newest + N).saturating_sub(back) };
        match (self.poses.get(place), self.steps.get(place)) {
            (Some(pose), Some(&step)) => (pose, step),
            _ => (&Pose::IDENTITY, 1.0),
        }
    }

    /// Writes the pose at `behind` input frames before the newest.
    fn interpolate_at(&self, behind: f32, output: &mut Pose<J>) {
        let whole = behind as usize;
        let fraction = behind - whole as f32;
        let later = self.at(whole).0;
        // Distances below rounding errors count as 0.
        if fraction < 1e-5 {
            *output = *later;
            return;
        }
        *output = interpolate(self.at(whole + 1).0, later, 1.0 - fraction);
    }
}

/// Interpolates between two poses: positions linearly, rotations spherically along the shorter arc; `t` is 0 to 1.
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

/// Lateness before the first stretch. The second number is in time, so that nothing is corrected before two stretches.
const NO_LATENESS: [i64; 2] = [i64::MIN, 0];

/// Number of ticks in a stretch.
fn watch_ticks(output_millihz: u32) -> u32 {
    (output_millihz / 2000).max(MIN_WATCH_TICKS)
}

/// Greatest common divisor of two numbers that are not 0.
fn common_divisor(mut a: u32, mut b: u32) -> u32 {
    // Euclid's algorithm: at most 47 rounds for 32 bits.
    while b != 0 {
        (a, b) = (b, a.checked_rem(b).unwrap_or(0));
    }
    a
}
