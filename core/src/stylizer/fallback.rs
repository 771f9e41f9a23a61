//! The output where the input is late, out of order, not a pose, or leaps.
//!
//! A loop that drives servos needs a pose each tick, whatever comes in. The caller chooses what that pose is ([`Safety`]);
//! the report says which fault occurred. After a fault the output is **blended back**: over [`BLEND_BACK_S`] each pose is
//! moved a growing part of the way from the last output to the one that is due, so that nothing jumps. On the ground the
//! body continues from where it stopped.
//!
//! | fault | flag | detected by |
//! |---|---|---|
//! | no input has arrived | [`Degraded::STALE`] | [`Stylizer::tick`] without an input |
//! | the input is older than the last one, or the same again | [`Degraded::ORDER`] | the number given with the input |
//! | not a pose: NaN, a rotation without length, a position out of range | [`Degraded::INPUT`] | the pose |
//! | faster than any body | [`Degraded::LEAP`] | joints over 40 rad/s, root over 15 m/s or 3 m/s from its last speed, heading over 20 rad/s |
//!
//! Poses that are out of order, but in order among themselves, are those of a counter that has started anew, or whose last
//! number was wrong: after eight of them the stream goes on with their numbers.
//!
//! Under [`Safety::Follow`] a leap is taken up at once, but for its speed over the ground. The search's window begins anew.
//!
//! A leap that lasts longer than [`PATIENCE`] frames is not a glitch: the body is in another place. The stream then
//! continues there, without the speed that the leap would imply.

use super::Stylizer;
use crate::{
    Degraded, Pose, Report,
    blob::layout::dof,
    body::{pose::Anchor, two_bone_ik::Chain},
    config::Safety,
    math::{abs, clamp, exp, quaternion},
    output::{
        foot_lock::lowest,
        retime::interpolate,
        speed_limit::{maps, turned},
    },
};

/// Duration of the blend back to the stream after a fault, seconds.
pub const BLEND_BACK_S: f32 = 0.3;
/// Frames for which a leap counts as a glitch.
pub const PATIENCE: u8 = 5;
/// Time constant of the way to rest, seconds; highest speed of the root on its way to the floor, m/s.
const REST_S: f32 = 0.4;
const SETTLE_SPEED: f32 = 0.3;
/// A foot at rest stands where it is at most this high, metres.
const ON_FLOOR_M: f32 = 0.01;
/// Faster than any body: joints and heading, rad/s, root, m/s.
const JOINT_SPEED: f32 = 40.0;
const HEADING_SPEED: f32 = 20.0;
const ROOT_SPEED: f32 = 15.0;
/// Change of the root's speed from one frame to the next, m/s: jumps and kicks of real bodies reach 1.
const ROOT_CHANGE: f32 = 3.0;
/// Part of its velocity that a body is taken to keep in a frame that leaps.
const KEPT_SPEED: f32 = 0.9;

/// Angle by which the joint of a dof has turned, radians. Compares rotations: exponential maps flip at half a turn.
#[cold]
#[inline(never)]
fn joint_turned(x: &[f32], x_prev: &[f32], d: usize) -> f32 {
    let map = d.wrapping_sub(dof::TILT) / 3;
    maps(x_prev).get(map).zip(maps(x).get(map)).map_or(0.0, |(before, now)| turned(before, now))
}

impl<const J: usize, const K: usize, const C: usize> Stylizer<'_, J, K, C> {
    /// [`step`](Self::step) for a loop: one tick, with the input that has arrived since the last tick and its number (any
    /// count that grows by one a frame and may wrap), or without an input. Always gives a pose, by the policy [`Safety`];
    /// the report says what was wrong. Before the first valid input `output` is left as it is, and
    /// [`last_output`](Self::last_output) is `None`.
    pub fn tick(&mut self, input: Option<(&Pose<J>, u32)>, output: &mut Pose<J>) -> Report {
        let Some((pose, number)) = input else { return self.fallback_output(Degraded::STALE, output) };
        let Some(gap) = self.faults.gap(number) else { return self.fallback_output(Degraded::ORDER, output) };
        // After a glitch the last accepted input is further back.
        let before = self.faults.gap;
        self.faults.gap = if self.faults.leaps > 0 { before.saturating_add(gap) } else { gap };
        let report = self.step_observed(pose, output, &mut ());
        if report.degraded.contains(Degraded::INPUT) {
            self.faults.gap = before;
        } else {
            self.faults.number = Some(number);
        }
        if self.faults.leaps == 0 {
            self.faults.gap = 1;
        }
        report
    }

    /// True where no body could have moved from `signals.x_prev` to `signals.x`.
    // Not inlined: its caller's frame is the deepest.
    #[inline(never)]
    pub(super) fn leaps(&self) -> bool {
        let (x, x_prev) = (self.signals.x.as_flattened(), self.signals.x_prev.as_flattened());
        // Rates of the root are over one frame, however many lie between.
        let frames = self.faults.frames();
        let seconds = frames / self.database.rate_hz();
        let most = JOINT_SPEED * seconds;
        let turns = |d: usize, change: f32| change > most && joint_turned(x, x_prev, d) > most;
        let changes = x.iter().zip(x_prev).map(|(&now, &before)| abs(now - before));
        let changes = changes.enumerate().take(self.database.counts().dofs);
        // Of the joints the largest first, without branches: almost no frame leaps.
        let joints = changes.clone().skip(dof::JOINTS);
        let largest = joints.clone().fold(0.0, |most, (_, change)| if change > most { change } else { most });
        let of = |x: &[f32], d: usize| x.get(d).copied().unwrap_or(0.0);
        let at = |d: usize| abs(of(x, d));
        // A body keeps its speed, be it that of the last frame or, after a leap, the one that it is taken to have.
        let jerks = |d: usize, last: f32| {
            let known = [last, of(x_prev, d)];
            known.iter().all(|known| abs(of(x, d) - frames * known) > ROOT_CHANGE * frames * frames)
        };
        at(dof::FORWARD) > ROOT_SPEED * frames
            || at(dof::LEFT) > ROOT_SPEED * frames
            || self.faults.speed.is_some_and(|[f, l]| jerks(dof::FORWARD, f) || jerks(dof::LEFT, l))
            || at(dof::YAW) > HEADING_SPEED * frames
            || changes.take(dof::FORWARD).any(|(d, change)| match d {
                dof::HEIGHT => change > ROOT_SPEED * seconds,
                _ => turns(d, change),
            })
            || (largest > most && joints.clone().any(|(d, change)| turns(d, change)))
    }

    /// Whether a leap still counts as a glitch; counts it.
    pub(super) fn is_glitch(&mut self) -> bool {
        if self.faults.leaps >= PATIENCE {
            return false;
        }
        self.faults.leaps += 1;
        true
    }

    /// Accepts the input. Its velocities are divided by the number of frames since the last accepted one. In a leap they
    /// are those of the frame before, a little less, under every policy: no body moved that fast, and what is predicted
    /// from such a speed would stay for seconds.
    pub(super) fn accept(&mut self, leapt: bool) {
        let frames = self.faults.frames();
        let speed = |d: usize| self.signals.x.as_flattened().get(d).copied().unwrap_or(0.0) / frames;
        self.faults.speed = self.last.map(|_| [speed(dof::FORWARD), speed(dof::LEFT)]);
        if leapt || frames > 1.0 {
            let (now, before) = (self.signals.x.as_flattened_mut(), self.signals.x_prev.as_flattened());
            for d in [dof::FORWARD, dof::LEFT, dof::YAW] {
                if let (Some(speed), Some(before)) = (now.get_mut(d), before.get(d)) {
                    *speed = if leapt { KEPT_SPEED * before } else { *speed / frames };
                }
            }
        }
        if leapt {
            // No motion led there.
            self.engine.forget_window();
            if self.config.safety != Safety::Follow {
                self.faults.blend_back_s = BLEND_BACK_S;
                self.signals.x_prev = self.signals.x;
            }
        }
        self.faults.leaps = 0;
    }

    /// Stores which feet the output stands on.
    pub(super) fn set_standing(&mut self, feet: [bool; 2]) {
        self.faults.stands = u8::from(feet[0]) | u8::from(feet[1]) << 1;
    }

    /// The feet that the last output stands on.
    pub(super) fn standing(&self) -> [bool; 2] {
        [1, 2].map(|foot| self.faults.stands & foot != 0)
    }

    /// The output of a frame without a usable input.
    #[inline(never)]
    pub(super) fn fallback_output(&mut self, fault: Degraded, output: &mut Pose<J>) -> Report {
        let step_s = 1.0 / self.database.rate_hz();
        let mut report = Report { step_s, predicted_step_s: step_s, ..Report::default() };
        report.degraded.set(fault, true);
        // There is no last output: the pose that the caller holds is nearer to what it drives than any made up here.
        let Some(last) = self.last else { return report };
        *output = last;
        if self.config.safety == Safety::Rest {
            // Held feet move to rest with the body.
            let part = 1.0 - exp(-step_s / REST_S);
            *output = interpolate(&last, &self.at_rest(&last), part);
            self.stand(step_s, output);
            self.last = Some(*output);
        } else {
            (report.held, report.held_m) = (self.lock.held(), self.lock.offsets());
        }
        report.contacts = self.standing();
        if self.config.safety != Safety::Follow {
            self.faults.blend_back_s = BLEND_BACK_S;
        }
        report
    }

    /// After a fault: replaces the output by a pose between the last output and the due one.
    #[inline(never)]
    pub(super) fn blend_back(&mut self, step_s: f32, output: &mut Pose<J>) {
        let left = self.faults.blend_back_s;
        if left <= 0.0 {
            return;
        }
        if let Some(last) = self.last {
            // Equal parts of a straight way: the whole is left at first, nothing at the end.
            let part = clamp(step_s / left, 0.0, 1.0);
            let [x, _, z] = output.position;
            *output = interpolate(&last, output, part);
            // On the ground the body continues from where it stopped: it has no distance to catch up with.
            (output.position[0], output.position[2]) = (x, z);
        }
        self.faults.blend_back_s = left - step_s;
    }

    /// The mean pose where `pose` stands, facing as it does.
    fn at_rest(&self, pose: &Pose<J>) -> Pose<J> {
        let mut rest = *pose;
        let root = pose.rotations.first().copied().unwrap_or(quaternion::IDENTITY);
        let anchor = Anchor::of(&self.database, pose.position, root, self.output_anchor);
        for (j, rotation) in rest.rotations.iter_mut().enumerate().take(self.database.counts().joints) {
            *rotation = self.database.joint(j).mean;
            if j == 0 {
                *rotation = quaternion::multiply(quaternion::about_y(anchor.heading), *rotation);
            }
        }
        rest
    }

    /// Moves the lower foot to the floor, slowly, and stores which feet stand there.
    fn stand(&mut self, step_s: f32, pose: &mut Pose<J>) {
        let Some(legs) = self.database.legs() else { return };
        let [left, right] = legs.map(|leg| lowest(&leg, &Chain::of(&self.database, &leg, pose)));
        let over = if left < right { left } else { right };
        let down = clamp(over, -SETTLE_SPEED * step_s, SETTLE_SPEED * step_s);
        pose.position[1] -= down;
        self.set_standing([left - down < ON_FLOOR_M, right - down < ON_FLOOR_M]);
    }
}
