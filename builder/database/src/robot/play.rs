//! Drives a robot through a clip on the database's skeleton, tick by tick.

use gestus_core::{
    blob::layout::MAX_JOINTS,
    robot::{Drive, Driven, layout::MAX_HINGES, limits::Motion},
};
use nalgebra::{Isometry3, UnitQuaternion};
use serde_json::{Value, json};

use crate::robot::{assign::leader, machine::Machine};
use crate::stream;
use gestus_motion::{
    clip::{Clip, Frame, rotation},
    statistics::mean_or_zero,
};

/// Seconds that a robot takes from where it stands to the motion.
const ARRIVAL_S: f64 = 1.0;
/// Seconds from the start in which the error of tracking does not count: the way from where the robot stood.
const SETTLED_S: f64 = 0.5;
/// Most seconds that a robot takes to come to rest in the last pose.
const STOP_S: f64 = 5.0;
/// Velocity, rad/s, and acceleration, rad/s², of hinges at rest.
const AT_REST: f32 = 1e-3;
/// Error of tracking that is told, degrees (rms).
const BEHIND_DEG: f64 = 5.0;
/// Mean distance of hands and feet from their places that is told, centimetres.
const MISSING_CM: f64 = 5.0;

/// One tick.
#[derive(Debug, Clone)]
pub struct Tick {
    /// State of the hinges. Shape `[hinges]`.
    pub motions: Vec<Motion>,
    /// Target angles within the ranges, radians. Shape `[hinges]`.
    pub targets: Vec<f32>,
    /// Pulses, microseconds. Shape `[hinges]`.
    pub pulses: Vec<u16>,
    /// The core's report.
    pub driven: Driven,
    /// The base in the robot's world ([`stand`](super::stand)), metres. Of the two quaternions of its rotation, the one that
    /// is nearer to the tick's before; the first has w >= 0.
    pub base: Isometry3<f64>,
    /// Whether the left and the right foot stand; `None` where nothing tells.
    pub contacts: Option<[bool; 2]>,
}

impl Tick {
    /// Whether all hinges rest.
    pub(super) fn rests(&self) -> bool {
        self.motions.iter().all(|m| m.velocity.abs().max(m.acceleration.abs()) <= AT_REST)
    }
}

/// The result of driving a clip.
#[derive(Debug, Clone)]
pub struct Played {
    /// Names of the hinges.
    pub names: Vec<String>,
    /// Name of the base's link.
    pub base: String,
    /// Ticks a second.
    pub tick_hz: f64,
    /// The ticks; the first is one tick after the start.
    pub ticks: Vec<Tick>,
    /// The ticks after them in which the robot comes to rest in the last pose; none where it rests, and in a loop.
    pub stop: Vec<Tick>,
}

/// Drives a clip. The robot stands at zero (or the nearest to it in range) before the first tick.
pub fn play(machine: &Machine, clip: &Clip) -> Played {
    let clip = clip.resampled(machine.tick_hz);
    play_frames(machine, &clip.frames)
}

/// Drives a clip that is at the robot's ticks. `contacts` are those of the left and right foot, one pair a tick; they are
/// written with the motion.
pub fn play_standing(machine: &Machine, clip: &Clip, contacts: &[[bool; 2]]) -> Played {
    let mut played = play_frames(machine, &clip.frames);
    for (tick, &feet) in played.ticks.iter_mut().zip(contacts) {
        tick.contacts = Some(feet);
    }
    for tick in &mut played.stop {
        tick.contacts = contacts.last().copied();
    }
    played
}

/// Drives a round of a loop, whose last pose is its first again, in a whole number of ticks. Rounds before it bring the
/// robot to where it is in each; the ticks are those of the last round, the first pose again with them. `contacts` as for
/// [`play_standing`].
pub fn play_round(machine: &Machine, round: &Clip, contacts: &[[bool; 2]]) -> Played {
    let period = (round.frames.len() - 1) as f64;
    let count = ((period / round.rate_hz * machine.tick_hz).round() as usize).max(2);
    let before = count * (ARRIVAL_S * machine.tick_hz / count as f64).ceil().max(1.0) as usize;
    let pose = |tick: usize| round.at(tick as f64 * period / count as f64);
    let mut frames: Vec<Frame> = (0..before + count).map(|tick| pose(tick % count)).collect();
    frames.push(pose(count));
    let mut played = play_frames(machine, &frames);
    played.ticks.drain(..before);
    played.stop.clear();
    one_sign(played.ticks.iter_mut());
    let first = contacts.first();
    for (i, tick) in played.ticks.iter_mut().enumerate() {
        tick.contacts = contacts.get(i).or(first).copied();
    }
    played
}

/// Gives the bases' quaternions the signs that [`Tick::base`] names.
fn one_sign<'a>(ticks: impl Iterator<Item = &'a mut Tick>) {
    let mut before = UnitQuaternion::identity();
    for tick in ticks {
        let turn = &mut tick.base.rotation;
        if turn.coords.dot(&before.coords) < 0.0 {
            *turn = UnitQuaternion::new_unchecked(-turn.into_inner());
        }
        before = *turn;
    }
}

/// Drives frames that are one tick apart. Hinges without a motor that follow others move with these.
pub fn play_frames(machine: &Machine, frames: &[Frame]) -> Played {
    let mut drive =
        Drive::<MAX_HINGES>::new(machine.tables(), &[]).expect("as many hinges as a robot can have fit");
    let undriven = &machine.assignment.undriven;
    let followers: Vec<_> =
        undriven.iter().filter_map(|&h| Some((h, leader(&machine.robot, h, undriven)?))).collect();
    let mut tick = |frame: &Frame| {
        let driven = drive.step(&stream::to_pose::<MAX_JOINTS>(frame));
        let (mut motions, mut targets) = (drive.motions().to_vec(), drive.targets().to_vec());
        for (follower, (leader, mimic)) in &followers {
            let (multiplier, offset) = (mimic.multiplier as f32, mimic.offset as f32);
            targets[*follower] = multiplier * targets[*leader] + offset;
            let leader = motions[*leader];
            motions[*follower] = Motion {
                position: multiplier * leader.position + offset,
                velocity: multiplier * leader.velocity,
                acceleration: multiplier * leader.acceleration,
            };
        }
        Tick {
            motions,
            targets,
            pulses: (0..drive.motions().len()).map(|h| drive.pulse(h)).collect(),
            driven,
            base: machine.stand.base(frame),
            contacts: None,
        }
    };
    let mut ticks: Vec<Tick> = frames.iter().map(&mut tick).collect();
    let mut stop: Vec<Tick> = Vec::new();
    if let Some(pose) = frames.last() {
        let most = (STOP_S * machine.tick_hz).ceil() as usize;
        while stop.len() < most && stop.last().or(ticks.last()).is_some_and(|last| !last.rests()) {
            stop.push(tick(pose));
        }
    }
    one_sign(ticks.iter_mut().chain(&mut stop));
    Played {
        ticks,
        stop,
        names: machine.robot.hinges.iter().map(|h| h.name.clone()).collect(),
        base: machine.robot.base.clone(),
        tick_hz: machine.tick_hz,
    }
}

/// Angular errors of hands and feet as seen from shoulder or hip, robot against body, degrees: means over limbs and ticks
/// after the first half second, at the angles that the hinges reached and at their targets.
pub fn end_effectors(machine: &Machine, played: &Played, clip: &Clip) -> (f64, f64) {
    let tables = machine.tables();
    let base = rotation(tables.base());
    let clip = clip.resampled(machine.tick_hz);
    let limbs: Vec<_> = (0..).map_while(|l| tables.limb(l)).collect();
    let first = (0.5 * machine.tick_hz) as usize;
    let (mut sums, mut count) = ([0.0; 2], 0usize);
    for (tick, frame) in played.ticks.iter().zip(&clip.frames).skip(first) {
        let body = frame.positions(&clip.skeleton);
        let to_base = (frame.rotations[0] * base).inverse();
        let reached: Vec<f64> = tick.motions.iter().map(|m| f64::from(m.position)).collect();
        let targets: Vec<f64> = tick.targets.iter().map(|&t| f64::from(t)).collect();
        for (sum, angles) in sums.iter_mut().zip([reached, targets]) {
            let places = machine.robot.places(&angles);
            for limb in &limbs {
                let [from, to] = limb.joints;
                let [a, b] = limb.hinges.map(|h| places[h]);
                let tip = b.transform_point(&limb.tip.map(f64::from).into()).coords;
                let ours = tip - a.translation.vector;
                *sum += ours.angle(&(to_base * (body[to] - body[from]))).to_degrees();
            }
        }
        count += limbs.len();
    }
    let n = count.max(1) as f64;
    (sums[0] / n, sums[1] / n)
}

impl Played {
    /// Largest difference of a hinge's angles in the first and in the last tick, degrees: how far a loop is open.
    pub fn gap_deg(&self) -> f64 {
        let ends = self.ticks.first().zip(self.ticks.last());
        let pairs = ends.into_iter().flat_map(|(first, last)| first.motions.iter().zip(&last.motions));
        pairs.map(|(a, b)| f64::from((a.position - b.position).abs()).to_degrees()).fold(0.0, f64::max)
    }

    /// Error of tracking, degrees: root mean square and maximum over hinges and ticks.
    fn tracking_deg(&self) -> [f64; 2] {
        let first = (SETTLED_S * self.tick_hz).ceil() as usize;
        let errors = || {
            let ticks = self.ticks.iter().skip(first);
            let pairs = ticks.flat_map(|t| t.motions.iter().zip(&t.targets));
            pairs.map(|(m, &target)| (f64::from(m.position) - f64::from(target)).to_degrees())
        };
        [mean_or_zero(errors().map(|e| e * e)).sqrt(), errors().map(f64::abs).fold(0.0, f64::max)]
    }

    /// Mean distance of hands and feet from their places, centimetres.
    fn missing_cm(&self) -> f64 {
        100.0 * mean_or_zero(self.ticks.iter().map(|t| f64::from(t.driven.missing_m)))
    }

    /// What the robot does not do of the motion.
    pub fn doubts(&self) -> Vec<String> {
        let ([rms, most], missing) = (self.tracking_deg(), self.missing_cm());
        let behind = (rms > BEHIND_DEG).then(|| {
            format!(
                "its hinges are {rms:.0} degrees from their targets (rms, {most:.0} at most): their limits of velocity, \
                 acceleration or jerk are too low for the motion"
            )
        });
        let off = (missing > MISSING_CM).then(|| {
            format!(
                "its hands and feet miss their places by {missing:.0} cm on average: the ranges of its hinges do not reach \
                 the poses"
            )
        });
        behind.into_iter().chain(off).collect()
    }

    /// Figures of the motion, compared with the machine's limits.
    pub fn figures(&self, machine: &Machine) -> Value {
        let tables = machine.tables();
        let tick = f64::from(tables.tick_s());
        let mut violations = 0usize;
        let (mut velocity, mut acceleration, mut jerk) = (0.0f64, 0.0f64, 0.0f64);
        for (i, t) in self.ticks.iter().enumerate() {
            for (h, m) in t.motions.iter().enumerate() {
                let limits = tables.limits(h);
                let rest = Motion { position: t.targets[h], ..Motion::default() };
                let before = if i > 0 { self.ticks[i - 1].motions[h] } else { rest };
                let (p, v, a) = (f64::from(m.position), f64::from(m.velocity), f64::from(m.acceleration));
                let moved = (p - f64::from(before.position)) / tick;
                let pushed = (a - f64::from(before.acceleration)) / tick;
                let ratio = |value: f64, limit: f32| value.abs() / f64::from(limit);
                let (rv, ra, rj) = (
                    ratio(v, limits.velocity).max(if i > 0 { ratio(moved, limits.velocity) } else { 0.0 }),
                    ratio(a, limits.acceleration),
                    if i > 0 { ratio(pushed, limits.jerk) } else { 0.0 },
                );
                // What rounding to f32 adds is below these.
                let inside = (f64::from(limits.low) - 1e-6..=f64::from(limits.high) + 1e-6).contains(&p);
                if !inside || rv > 1.001 || ra > 1.001 || rj > 1.01 {
                    violations += 1;
                }
                velocity = velocity.max(rv);
                acceleration = acceleration.max(ra);
                jerk = jerk.max(rj);
            }
        }
        let [rms, most] = self.tracking_deg();
        json!({
            "ticks": self.ticks.len(),
            "tick_hz": self.tick_hz,
            "limit_violations": violations,
            "tracking_rms_deg": rms,
            "tracking_max_deg": most,
            "peak_velocity_ratio": velocity,
            "peak_acceleration_ratio": acceleration,
            "peak_jerk_ratio": jerk,
            "end_effector_missing_cm": self.missing_cm(),
            "at_limit_mean": mean_or_zero(self.ticks.iter().map(|t| f64::from(t.driven.at_limit))),
            "held": self.ticks.iter().filter(|t| t.driven.held).count(),
        })
    }
}
