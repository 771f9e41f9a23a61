//! The main loop of a board, as `docs/PORTING.md` explains it: tasks in the manner of RTIC, peripherals by the traits
//! of embedded-hal, a deadline that is the timer's. On a board `Shared` and `Local` are RTIC's resources and the
//! functions its tasks; here a mock of the hardware calls them.
//!
//! `cargo run --example main_loop` plays three seconds: in the second one something else takes most of the processor.

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

/// Joints, neighbors and classes that this board has room for.
pub const J: usize = 22;
/// Neighbors a class.
pub const K: usize = 40;
/// Classes.
pub const C: usize = 28;

/// A free-running timer. embedded-hal has no trait for one; a HAL's timer or DWT gives this in a line.
pub trait Clock {
    /// Microseconds; wraps around.
    fn now_us(&mut self) -> u32;

    /// A step is done. A timer sees that for itself; the mock has to be told.
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
    /// What was put out last; it outlives the tick, so that it holds the last pose whatever happens.
    pub output: Pose<J>,
    /// The cap on visits, by the time that steps take.
    pub cap: VisitCap,
    /// The timer.
    pub clock: T,
    /// A servo: the left knee's.
    pub knee: S,
    /// A lamp that is lit while frames are degraded.
    pub lamp: L,
}

/// How the stylizer is made: a pose is played at each tick, so it is one of the tick's length (`Timing::Free`, the default,
/// says of each how long it takes); and where the input fails the body holds still, and goes on from there without a jump.
pub const fn config() -> Config {
    Config::new().timing(Timing::Sync).safety(Safety::Hold)
}

/// A pose has come over the radio: the newest one counts. Its number is the tracker's, of frames.
pub fn receive(shared: &mut Shared, pose: Pose<J>, number: u32) {
    shared.mailbox = Some((pose, number));
}

/// The timer's interrupt, at the database's rate: one pose out, whether one has come in or not. Returns what the step said.
pub fn tick<T: Clock, S: SetDutyCycle, L: OutputPin>(
    shared: &mut Shared,
    local: &mut Local<'_, T, S, L>,
) -> Report {
    let start = local.clock.now_us();
    let arrived = shared.mailbox.take();
    let input = arrived.as_ref().map(|(pose, number)| (pose, *number));
    let report = local.stylizer.tick(input, &mut local.output);
    local.clock.stepped(&report);
    // Before the first pose there is nothing to go to: servos stay where they are.
    if local.stylizer.last_output().is_some() {
        drive(&local.output, &mut local.knee);
    }
    // A lamp that is broken is no reason to stop.
    let _ =
        if report.degraded.contains(Degraded::VISITS) { local.lamp.set_high() } else { local.lamp.set_low() };
    // A tick without a pose says nothing of how long a step takes.
    if input.is_some() {
        let took = local.clock.now_us().wrapping_sub(start);
        let visits = local.cap.after(took);
        // Every cap that comes from there is in range.
        let _ = local.stylizer.set_visits(visits);
    }
    report
}

/// The knee's angle to its servo: half a turn is the full range.
fn drive(output: &Pose<J>, knee: &mut impl SetDutyCycle) {
    const KNEE: usize = 14;
    let [x, _, _, w] = output.rotations[KNEE];
    let share = 2.0 * x.atan2(w).abs() / core::f32::consts::PI;
    let duty = (share.clamp(0.0, 1.0) * f32::from(knee.max_duty_cycle())) as u16;
    let _ = knee.set_duty_cycle(duty);
}

/// A processor that takes its time: 4 ms for a step and 20 µs for a visit, and the more the less it has to itself.
pub struct MockClock {
    now_us: u32,
    /// Of the processor, the part that the loop has: a step takes this many times as long.
    pub slower: f32,
}

impl Clock for MockClock {
    fn now_us(&mut self) -> u32 {
        self.now_us
    }

    fn stepped(&mut self, report: &Report) {
        let took = (4_000 + 20 * report.visits) as f32 * self.slower;
        self.now_us = self.now_us.wrapping_add(took as u32);
    }
}

/// A servo that remembers.
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

/// A lamp that remembers.
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

/// What came of a second: frames late, frames that said so, the cap at its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Second {
    /// Frames over the deadline.
    pub late: u32,
    /// Frames over the deadline in its second half.
    pub late_at_last: u32,
    /// Frames whose search was cut short.
    pub capped: u32,
    /// The cap.
    pub visits: u16,
}

/// The board, its knee where it was when the power came on. With `fixed`, the cap stays where it is.
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

/// Plays so many seconds, in each of which the processor is that much slower.
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
    let slower = [1.0, 2.5, 1.0, 1.0, 1.0, 1.0, 1.0];
    for (name, fixed) in [("the cap fixed", true), ("the cap by the deadline", false)] {
        println!("{name}:");
        for (second, slower) in play(&slower, fixed).iter().zip(slower) {
            println!(
                "  steps take {slower} times as long: {} frames late, {} cut short, cap {}",
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
        let slower = [1.0, 2.5, 1.0, 1.0, 1.0, 1.0, 1.0];
        let [fixed, governed] = [true, false].map(|fixed| play(&slower, fixed));
        // Without a cap that gives way, the second second is late from end to end.
        assert!(fixed[1].late >= 25 && fixed[1].late_at_last >= 10, "{fixed:?}");
        // With one, a few frames are late, and then none.
        assert!((1..=5).contains(&governed[1].late) && governed[1].late_at_last == 0, "{governed:?}");
        assert!(governed[1].visits < 160 && governed[1].capped > 15, "{governed:?}");
        // Nothing is late before and after, and the cap comes back whole.
        assert!(governed[2..].iter().all(|s| s.late == 0), "{governed:?}");
        assert_eq!(governed.last().map(|s| (s.visits, s.capped)), Some((256, 0)), "{governed:?}");
    }

    /// What the loop makes of a walk of which some frames do not come: how far the body goes in each tick, metres, and
    /// what each step said.
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

    /// The last pose was stepped again where none had come: a body that stands still for a tick, and then goes at twice its
    /// speed.
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

    /// A pose a tick is one of the tick's length: what the limit of joint speeds goes by is what is played.
    #[test]
    fn every_pose_is_a_tick_long() {
        let (_, reports) = walked(|_| true);
        let tick_s = 1.0 / Database::open(motion::large()).expect("the generated blob opens").rate_hz();
        assert!(reports.iter().all(|report| report.step_s == tick_s));
        // The style has another pace than the input, so that this is no accident.
        assert!(reports.iter().any(|report| (report.predicted_step_s - tick_s).abs() > 0.01 * tick_s));
    }

    /// The mailbox began as a pose that nobody had sent, and the knee was sent to it.
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
