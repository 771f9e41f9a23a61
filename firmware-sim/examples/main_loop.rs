//! The main loop of a board, as `docs/PORTING.md` explains it: tasks as in RTIC, peripherals by the traits of
//! embedded-hal, and the timer's period as the deadline. On a board `Shared` and `Local` are RTIC's resources and the
//! functions its tasks; here mock hardware calls them.
//!
//! `cargo run --example main_loop` runs three seconds. In the second one, other work takes most of the processor's
//! time.

use core::convert::Infallible;

use embedded_hal::{
    digital::{self, OutputPin},
    pwm::{self, SetDutyCycle},
};
use gestus_core::{
    Config, Database, Degraded, Pose, Report, Safety, Stylizer, config::Timing, output::visit_cap::VisitCap,
};
use gestus_database::stream::to_pose;
use gestus_tests::motion;

/// Capacity: joints.
pub const J: usize = 22;
/// Capacity: neighbors a class.
pub const K: usize = 40;
/// Capacity: classes.
pub const C: usize = 28;

/// A free-running timer. embedded-hal has no trait for one; with a HAL's timer or the DWT it takes one line.
pub trait Clock {
    /// Microseconds; wraps around.
    fn now_us(&mut self) -> u32;

    /// Called after a step, to advance the mock's time. A real timer ignores it.
    fn stepped(&mut self, _report: &Report) {}
}

/// What the tasks share.
#[derive(Default)]
pub struct Shared {
    /// The newest pose from the tracker and its number, until the loop takes it.
    pub mailbox: Option<(Pose<J>, u32)>,
}

/// What the tick owns.
pub struct Local<'db, T, S, L> {
    /// The stylizer, in static memory.
    pub stylizer: Stylizer<'db, J, K, C>,
    /// The last output. It is kept between ticks.
    pub output: Pose<J>,
    /// Adapts the cap on visits to the time that steps take.
    pub cap: VisitCap,
    /// The timer.
    pub clock: T,
    /// A servo: the left knee's.
    pub knee: S,
    /// A lamp that is on while searches reach the cap on visits.
    pub lamp: L,
}

/// The stylizer's configuration. One pose is played at each tick, so every time step is the tick's (with
/// `Timing::Free`, the default, each pose has its own). If the input fails the body holds still, and later continues
/// without a jump. Twice the default's neighbors leave the cap on visits something to take away.
pub const fn config() -> Config {
    Config::new().k(16).pool(28).timing(Timing::Sync).safety(Safety::Hold)
}

/// Receives a pose from the radio, with the tracker's frame number. A newer pose replaces an older one.
pub fn receive(shared: &mut Shared, pose: Pose<J>, number: u32) {
    shared.mailbox = Some((pose, number));
}

/// The timer's interrupt, at the database's rate: puts out one pose, whether an input has come or not. Returns the
/// step's report.
pub fn tick<T: Clock, S: SetDutyCycle, L: OutputPin>(
    shared: &mut Shared,
    local: &mut Local<'_, T, S, L>,
) -> Report {
    let start = local.clock.now_us();
    let arrived = shared.mailbox.take();
    let input = arrived.as_ref().map(|(pose, number)| (pose, *number));
    let report = local.stylizer.tick(input, &mut local.output);
    local.clock.stepped(&report);
    // Before the first pose there is no target: the servos stay where they are.
    if local.stylizer.last_output().is_some() {
        drive(&local.output, &mut local.knee);
    }
    // An error of the lamp is ignored: it is no reason to stop.
    let _ =
        if report.degraded.contains(Degraded::VISITS) { local.lamp.set_high() } else { local.lamp.set_low() };
    // The time of a tick without a pose is not that of a step.
    if input.is_some() {
        let took = local.clock.now_us().wrapping_sub(start);
        let visits = local.cap.after(took);
        // Can't fail: `VisitCap` returns values in range.
        let _ = local.stylizer.set_visits(visits);
    }
    report
}

/// Sends the knee's angle to its servo, whose range is half a turn.
fn drive(output: &Pose<J>, knee: &mut impl SetDutyCycle) {
    const KNEE: usize = 14;
    let [x, _, _, w] = output.rotations[KNEE];
    let share = 2.0 * x.atan2(w).abs() / core::f32::consts::PI;
    let duty = (share.clamp(0.0, 1.0) * f32::from(knee.max_duty_cycle())) as u16;
    let _ = knee.set_duty_cycle(duty);
}

/// A mock processor that takes 2 ms for a step and 48 µs for each visit, times `slower`.
pub struct MockClock {
    now_us: u32,
    /// By what factor other work slows a step down.
    pub slower: f32,
}

impl Clock for MockClock {
    fn now_us(&mut self) -> u32 {
        self.now_us
    }

    fn stepped(&mut self, report: &Report) {
        let took = (2_000 + 48 * report.visits) as f32 * self.slower;
        self.now_us = self.now_us.wrapping_add(took as u32);
    }
}

/// A mock servo that stores its duty cycle.
pub struct MockServo(pub u16);

impl pwm::ErrorType for MockServo {
    type Error = Infallible;
}

impl SetDutyCycle for MockServo {
    fn max_duty_cycle(&self) -> u16 {
        20_000
    }
    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        self.0 = duty;
        Ok(())
    }
}

/// A mock lamp that stores its state.
pub struct MockLamp(pub bool);

impl digital::ErrorType for MockLamp {
    type Error = Infallible;
}

impl OutputPin for MockLamp {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0 = false;
        Ok(())
    }
    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0 = true;
        Ok(())
    }
}

/// The figures of one second.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Second {
    /// Frames over the deadline.
    pub late: u32,
    /// Frames over the deadline in its second half.
    pub late_at_last: u32,
    /// Frames whose search reached the cap.
    pub capped: u32,
    /// The cap at the end of the second.
    pub visits: u16,
}

/// The board after power-on. With `fixed` the cap does not change.
fn board(fixed: bool) -> Local<'static, MockClock, MockServo, MockLamp> {
    let database = Database::open(motion::large()).expect("the generated blob opens");
    let budget_us = if fixed { u32::MAX } else { (1e6 / database.rate_hz()) as u32 };
    let mut stylizer = Stylizer::new(database, config()).expect("the database fits");
    stylizer.set_style(&[(1, 1.0)]).expect("it has more styles than one");
    Local {
        stylizer,
        output: Pose::IDENTITY,
        cap: VisitCap::new(budget_us, config().visits).expect("both are in range"),
        clock: MockClock { now_us: u32::MAX - 5, slower: 1.0 },
        knee: MockServo(7_000),
        lamp: MockLamp(false),
    }
}

/// Plays one second for each factor, by which steps take longer in it.
pub fn play(slower: &[f32], fixed: bool) -> Vec<Second> {
    let (mut shared, mut local) = (Shared::default(), board(fixed));
    let rate_hz = local.stylizer.database().rate_hz();
    let budget_us = (1e6 / rate_hz) as u32;
    let frames = rate_hz as usize;
    // Numbers of frames may wrap.
    let mut numbers = (0..).map(|i: u32| i.wrapping_sub(5));
    let clip = motion::unseen(0, 0, frames * slower.len());
    let mut seconds = Vec::new();
    for (poses, &slower) in clip.frames.chunks(frames).zip(slower) {
        local.clock.slower = slower;
        let mut second = Second { late: 0, late_at_last: 0, capped: 0, visits: 0 };
        for (i, frame) in poses.iter().enumerate() {
            receive(&mut shared, to_pose(frame), numbers.next().unwrap_or_default());
            let start = local.clock.now_us();
            let report = tick(&mut shared, &mut local);
            if local.clock.now_us().wrapping_sub(start) > budget_us {
                second.late += 1;
                second.late_at_last += u32::from(i >= frames / 2);
            }
            assert_eq!(local.lamp.0, report.degraded.contains(Degraded::VISITS));
            second.capped += u32::from(local.lamp.0);
            assert!(local.knee.0 <= local.knee.max_duty_cycle());
        }
        second.visits = local.cap.visits();
        seconds.push(second);
    }
    seconds
}

fn main() {
    let slower = [0.5, 4.0, 0.5, 0.5, 0.5, 0.5, 0.5];
    for (name, fixed) in [("fixed cap", true), ("cap adapted to the deadline", false)] {
        println!("{name}:");
        for (second, slower) in play(&slower, fixed).iter().zip(slower) {
            println!(
                "  steps take {slower} times as long: {} frames late, {} capped, cap {}",
                second.late, second.capped, second.visits
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missed_deadlines_lower_the_cap_and_it_recovers() {
        let slower = [0.5, 4.0, 0.5, 0.5, 0.5, 0.5, 0.5];
        let [fixed, governed] = [true, false].map(|fixed| play(&slower, fixed));
        // With a fixed cap, frames are late throughout the second second.
        assert!(fixed[1].late >= 25 && fixed[1].late_at_last >= 10, "{fixed:?}");
        // With an adapted cap a few frames are late, and then one at most: where the input changes, more classes are
        // searched than in the frames that the cap was adapted to.
        assert!((1..=5).contains(&governed[1].late) && governed[1].late_at_last <= 1, "{governed:?}");
        assert!(governed[1].visits < 160 && governed[1].capped > 15, "{governed:?}");
        // Nothing is late afterwards, and the cap returns to its full value.
        assert!(governed[2..].iter().all(|s| s.late == 0), "{governed:?}");
        assert_eq!(governed.last().map(|s| (s.visits, s.capped)), Some((256, 0)), "{governed:?}");
    }

    /// Plays a walk of which only some frames arrive. Returns the distance of each tick, metres, and each step's
    /// report.
    fn walked(comes: impl Fn(u32) -> bool) -> (Vec<f32>, Vec<Report>) {
        let (mut shared, mut local) = (Shared::default(), board(true));
        let (mut ways, mut reports) = (vec![], vec![]);
        for (number, frame) in (0..).zip(&motion::unseen(0, 0, 90).frames) {
            if comes(number) {
                receive(&mut shared, to_pose(frame), number);
            }
            let [x, _, z] = local.output.position;
            reports.push(tick(&mut shared, &mut local));
            let [to_x, _, to_z] = local.output.position;
            ways.push((to_x - x).hypot(to_z - z));
        }
        (ways, reports)
    }

    /// The loop once stepped the last pose again if none had come: the body stopped for a tick, and then moved at twice
    /// its speed.
    #[test]
    fn where_a_pose_does_not_come_the_body_is_held_and_goes_on_at_its_speed() {
        let (whole, _) = walked(|_| true);
        let (ways, reports) = walked(|number| number < 40 || number % 10 != 0);
        let fastest = |ways: &[f32]| ways.iter().skip(30).copied().fold(0.0, f32::max);
        assert!(fastest(&ways) < 1.25 * fastest(&whole), "{} of {}", fastest(&ways), fastest(&whole));
        for (number, (report, way)) in reports.iter().zip(&ways).enumerate() {
            let missing = number >= 40 && number % 10 == 0;
            assert_eq!(report.degraded.contains(Degraded::STALE), missing, "tick {number}");
            assert!(!missing || *way == 0.0, "tick {number}: {way} m");
        }
    }

    /// Every time step is the tick's length, so that the limit of joint speeds applies to what is played.
    #[test]
    fn every_pose_is_a_tick_long() {
        let (_, reports) = walked(|_| true);
        let tick_s = 1.0 / Database::open(motion::large()).expect("the generated blob opens").rate_hz();
        assert!(reports.iter().all(|report| report.step_s == tick_s));
        // The style's pace differs from the input's, so this does not hold by chance.
        assert!(reports.iter().any(|report| (report.predicted_step_s - tick_s).abs() > 0.01 * tick_s));
    }

    /// The mailbox once started with a pose that was never sent, and the knee moved to it.
    #[test]
    fn servos_stay_where_they_are_until_the_first_pose() {
        let (mut shared, mut local) = (Shared::default(), board(true));
        for _ in 0..10 {
            let report = tick(&mut shared, &mut local);
            assert!(report.degraded.contains(Degraded::STALE));
            assert_eq!(local.knee.0, 7_000);
        }
        receive(&mut shared, to_pose(&motion::unseen(0, 0, 1).frames[0]), 0);
        let report = tick(&mut shared, &mut local);
        assert!(!report.degraded.contains(Degraded::STALE) && local.knee.0 != 7_000);
    }
}
