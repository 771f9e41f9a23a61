//! The output for input that is late, out of order, not a pose, or leaps.
//!
//! A loop that drives servos needs a pose each tick, whatever arrives. The caller chooses that pose ([`Safety`]); the report
//! names the fault. After a fault the output is **blended back**: over [`BLEND_BACK_S`] it moves from the last output to the
//! current one, so that nothing jumps. On the ground the body continues from where it stopped.
//!
//! | fault | flag | detected by |
//! |---|---|---|
//! | no input has arrived | [`Degraded::STALE`] | [`Stylizer::tick`] without an input |
//! | the input is older than the last one, or the same again | [`Degraded::ORDER`] | the number given with the input |
//! | not a pose: NaN, a rotation without length, a position out of range | [`Degraded::INPUT`] | the pose |
//! | faster than any body | [`Degraded::LEAP`] | joints over 40 rad/s, root over 15 m/s or 3 m/s from its last speed, heading over 20 rad/s |
//!
//! Poses that are out of order, but in order among themselves, come from a counter that has restarted, or whose last number
//! was wrong. After eight of them the stream continues with their numbers.
//!
//! Under [`Safety::Follow`] the output follows a leap at once, except for its speed over the ground. The search window
//! begins anew.
//!
//! A leap that lasts longer than [`MAX_GLITCH_FRAMES`] frames is not a glitch: the body is in another place. The stream then
//! continues there, without the speed that the leap would imply.

use super::Stylizer;
use crate::{
    Degraded, Pose, Report,
    blob::layout::dof,
    body::{pose::Anchor, two_bone_ik::Chain},
    config::Safety,
    math::{abs, clamp, decay, maximum, minimum, quaternion},
    output::{
        foot_lock::lowest,
        retime::interpolate,
        speed_limit::{exponential_maps, rotation_angle},
    },
    report::{pack_feet, unpack_feet},
};

/// Duration of the blend back to the stream after a fault, seconds.
pub const BLEND_BACK_S: f32 = 0.3;
/// Number of frames for which a leap counts as a glitch.
pub const MAX_GLITCH_FRAMES: u8 = 5;
/// Time constant with which the body approaches rest, seconds.
const REST_S: f32 = 0.4;
/// Greatest vertical speed of the root meanwhile, m/s.
const DESCENT_SPEED: f32 = 0.3;
/// Height up to which a foot at rest counts as standing, metres.
const CONTACT_HEIGHT_M: f32 = 0.01;
/// Speed that no joint of a body reaches, rad/s.
const MAX_JOINT_RAD_S: f32 = 40.0;
/// Rate that no heading reaches, rad/s.
const MAX_HEADING_RAD_S: f32 = 20.0;
/// Speed that no root reaches, m/s.
const MAX_ROOT_M_S: f32 = 15.0;
/// Change of the root's speed in a frame that no body reaches, m/s. Jumps and kicks of real bodies reach 1.
const MAX_ROOT_CHANGE_M_S: f32 = 3.0;
/// Part of the last velocity that is assumed in a frame that leaps.
const LEAP_SPEED_KEPT: f32 = 0.9;

/// Angle by which the joint of dof `d` has turned, radians. Compares rotations, because exponential maps flip at half a
/// turn.
#[cold]
#[inline(never)]
fn joint_turned(x: &[f32], x_prev: &[f32], d: usize) -> f32 {
    let map = d.wrapping_sub(dof::TILT) / 3;
    exponential_maps(x_prev)
        .get(map)
        .zip(exponential_maps(x).get(map))
        .map_or(0.0, |(before, now)| rotation_angle(before, now))
}

impl<const J: usize, const K: usize, const C: usize> Stylizer<'_, J, K, C> {
    /// [`step`](Self::step) for a control loop: one tick, with or without an input.
    ///
    /// `input` is the pose that has arrived since the last tick, with its number: any count that grows by one a frame
    /// and may wrap. A tick writes a pose, by the policy [`Safety`], and the report names the fault. Only before the
    /// first valid input `output` is not changed, and [`last_output`](Self::last_output) is `None`.
    pub fn tick(&mut self, input: Option<(&Pose<J>, u32)>, output: &mut Pose<J>) -> Report {
        let Some((pose, number)) = input else { return self.fallback_output(Degraded::STALE, output) };
        let Some(gap) = self.faults.gap(number) else { return self.fallback_output(Degraded::ORDER, output) };
        // After a glitch the last accepted input is longer ago.
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
    // Not inlined: its caller has the deepest stack frame.
    #[inline(never)]
    pub(super) fn is_leap(&self) -> bool {
        let (x, x_prev) = (self.signals.x.as_flattened(), self.signals.x_prev.as_flattened());
        // Rates of the root are measured over one frame, however many have passed.
        let frames = self.faults.frames();
        let seconds = frames / self.database.rate_hz();
        let most = MAX_JOINT_RAD_S * seconds;
        let turns = |d: usize, change: f32| change > most && joint_turned(x, x_prev, d) > most;
        let changes = x.iter().zip(x_prev).map(|(&now, &before)| abs(now - before));
        let changes = changes.enumerate().take(self.database.counts().dofs);
        // First the largest change of all joints, without branches: almost no frame leaps.
        let joints = changes.clone().skip(dof::JOINTS);
        let largest = joints.clone().fold(0.0, |most, (_, change)| maximum(change, most));
        let of = |x: &[f32], d: usize| x.get(d).copied().unwrap_or(0.0);
        let at = |d: usize| abs(of(x, d));
        // A body keeps its speed: that of the last frame or, after a leap, the one assumed for it.
        let jerks = |d: usize, last: f32| {
            let known = [last, of(x_prev, d)];
            known.iter().all(|known| abs(of(x, d) - frames * known) > MAX_ROOT_CHANGE_M_S * frames * frames)
        };
        at(dof::FORWARD) > MAX_ROOT_M_S * frames
            || at(dof::LEFT) > MAX_ROOT_M_S * frames
            || self.faults.speed.is_some_and(|[f, l]| jerks(dof::FORWARD, f) || jerks(dof::LEFT, l))
            || at(dof::YAW) > MAX_HEADING_RAD_S * frames
            || changes.take(dof::FORWARD).any(|(d, change)| match d {
                dof::HEIGHT => change > MAX_ROOT_M_S * seconds,
                _ => turns(d, change),
            })
            || (largest > most && joints.clone().any(|(d, change)| turns(d, change)))
    }

    /// Counts a leap. Returns true as long as it is tolerated as a glitch.
    pub(super) fn tolerate_leap(&mut self) -> bool {
        if self.faults.leaps >= MAX_GLITCH_FRAMES {
            return false;
        }
        self.faults.leaps += 1;
        true
    }

    /// Accepts the input. Its velocities are divided by the number of frames since the last accepted input. In a leap
    /// they are replaced by slightly less than those of the frame before, under every policy: no body moved that fast,
    /// and the effect on the predictions would last for seconds.
    pub(super) fn accept(&mut self, leapt: bool) {
        let frames = self.faults.frames();
        let speed = |d: usize| self.signals.x.as_flattened().get(d).copied().unwrap_or(0.0) / frames;
        self.faults.speed = self.last.map(|_| [speed(dof::FORWARD), speed(dof::LEFT)]);
        if leapt || frames > 1.0 {
            let (now, before) = (self.signals.x.as_flattened_mut(), self.signals.x_prev.as_flattened());
            for d in [dof::FORWARD, dof::LEFT, dof::YAW] {
                if let (Some(speed), Some(before)) = (now.get_mut(d), before.get(d)) {
                    *speed = if leapt { LEAP_SPEED_KEPT * before } else { *speed / frames };
                }
            }
        }
        if leapt {
            // The window holds no motion that led here.
            self.engine.forget_window();
            if self.config.safety != Safety::Follow {
                self.faults.blend_back_s = BLEND_BACK_S;
                self.signals.x_prev = self.signals.x;
            }
        }
        self.faults.leaps = 0;
    }

    /// Stores which feet of the output stand, left and right.
    pub(super) fn set_standing(&mut self, feet: [bool; 2]) {
        self.faults.stands = pack_feet(feet);
    }

    /// Which feet of the last output stand, left and right.
    pub(super) fn standing(&self) -> [bool; 2] {
        unpack_feet(self.faults.stands)
    }

    /// The output of a frame without a usable input.
    #[inline(never)]
    pub(super) fn fallback_output(&mut self, fault: Degraded, output: &mut Pose<J>) -> Report {
        let step_s = 1.0 / self.database.rate_hz();
        let mut report = Report { step_s, predicted_step_s: step_s, ..Report::default() };
        report.degraded.add_if(true, fault);
        // Without a last output the caller's pose is nearer to the state of its robot than any pose made up here.
        let Some(last) = self.last else { return report };
        *output = last;
        if self.config.safety == Safety::Rest {
            // Held feet move to rest with the body.
            let part = 1.0 - decay(step_s, REST_S);
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

    /// After a fault: replaces the output by a pose between the last output and the current one.
    #[inline(never)]
    pub(super) fn blend_back(&mut self, step_s: f32, output: &mut Pose<J>) {
        let left = self.faults.blend_back_s;
        if left <= 0.0 {
            return;
        }
        if let Some(last) = self.last {
            // Equal steps from the last output to the current one.
            let part = clamp(step_s / left, 0.0, 1.0);
            let [x, _, z] = output.position;
            *output = interpolate(&last, output, part);
            // On the ground the body continues from where it stopped, so it has no distance to catch up.
            (output.position[0], output.position[2]) = (x, z);
        }
        self.faults.blend_back_s = left - step_s;
    }

    /// The mean pose at the place and heading of `pose`.
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

    /// Moves the lower foot slowly to the floor, and stores which feet stand.
    fn stand(&mut self, step_s: f32, pose: &mut Pose<J>) {
        let Some(legs) = self.database.legs() else { return };
        let [left, right] = legs.map(|leg| lowest(&leg, &Chain::of(&self.database, &leg, pose)));
        let over = minimum(left, right);
        let down = clamp(over, -DESCENT_SPEED * step_s, DESCENT_SPEED * step_s);
        pose.position[1] -= down;
        self.set_standing([left - down < CONTACT_HEIGHT_M, right - down < CONTACT_HEIGHT_M]);
    }
}
