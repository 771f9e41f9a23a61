//! Postures as vectors, and the pose that a posture and two feet make.
//!
//! A [`Posture`] says how the trunk and the arms are held and where the hips are over the path, in 29 channels that
//! add up, so that a style, an action and noise are sums. The legs are no part of it: they follow from the hips and
//! the planned feet by two-bone inverse kinematics, knees forwards. With thigh a, shin b and the ankle at distance d
//! from the hip joint, the knee lies `(a² + d² - b²) / 2d` along the way and the rest of the thigh's length in front
//! of it. Cost: a few hundred flops a frame.

use nalgebra::{Matrix3, Rotation3, SVector, UnitQuaternion, Vector3};

use crate::synth::skeleton::{self, BALL, SHIN_M, THIGH_M, joint};
use gestus_motion::{
    body::about_y,
    clip::{Frame, Skeleton},
};

/// Number of channels.
pub const CHANNELS: usize = 29;
/// Channels of the trunk (metres and radians) and of both arms.
pub type Posture = SVector<f64, CHANNELS>;

/// Hips over (+) or below (-) their height with straight legs, metres.
pub const HEIGHT: usize = 0;
/// Hips to the left of the path, metres.
pub const SIDE: usize = 1;
/// Hips ahead of the path, metres.
pub const AHEAD: usize = 2;
/// Pelvis tipped forwards.
pub const TILT: usize = 3;
/// Pelvis turned to the left.
pub const YAW: usize = 4;
/// Pelvis with its left side up.
pub const LIST: usize = 5;
/// Lower spine: bent forwards, turned left, left side up.
pub const SPINE: usize = 6;
/// Upper spine: bent forwards, turned left, left side up.
pub const CHEST: usize = 9;
/// Neck and head together: bent forwards, turned left, left side up.
pub const HEAD: usize = 12;
/// First channel of each arm.
pub const ARMS: [usize; 2] = [15, 22];
/// Of an arm: shoulder up.
pub const RAISE: usize = 0;
/// Of an arm: shoulder forwards.
pub const FORWARD: usize = 1;
/// Of an arm: upper arm forwards from hanging.
pub const SWING: usize = 2;
/// Of an arm: upper arm away from the body.
pub const ABDUCT: usize = 3;
/// Of an arm: turned about its own axis, inwards.
pub const TWIST: usize = 4;
/// Of an arm: elbow bent.
pub const ELBOW: usize = 5;
/// Of an arm: hand bent inwards.
pub const HAND: usize = 6;

/// A posture from single channels.
pub fn posture(channels: &[(usize, f64)]) -> Posture {
    let mut posture = Posture::zeros();
    for &(channel, value) in channels {
        posture[channel] += value;
    }
    posture
}

/// A posture from single channels of an arm, the same on both sides.
pub fn both_arms(channels: &[(usize, f64)]) -> Posture {
    let mut posture = Posture::zeros();
    for (arm, &(channel, value)) in ARMS.iter().flat_map(|&a| channels.iter().map(move |c| (a, c))) {
        posture[arm + channel] += value;
    }
    posture
}

/// A foot in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foot {
    /// Position of the ankle, metres.
    pub ankle: Vector3<f64>,
    /// Heading of the foot, radians.
    pub yaw: f64,
    /// Toes down (+) or up (-), radians.
    pub pitch: f64,
    /// Toes bent up against the foot, radians.
    pub bend: f64,
}

impl Foot {
    /// Orientation in the world.
    pub fn rotation(&self) -> UnitQuaternion<f64> {
        about_y(self.yaw) * about_x(self.pitch)
    }
}

/// Rotation about X; positive takes +Z down.
pub fn about_x(angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle)
}

fn about_z(angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle)
}

/// Turned, bent forwards, left side up: in this order.
fn bent(forwards: f64, left: f64, up: f64) -> UnitQuaternion<f64> {
    about_y(left) * about_x(forwards) * about_z(up)
}

/// Orientation of the hips in the world.
pub fn hips_rotation(posture: &Posture, heading: f64) -> UnitQuaternion<f64> {
    about_y(heading) * bent(posture[TILT], posture[YAW], posture[LIST])
}

/// The pose of a posture with its hips at `root` and its feet as given.
pub fn pose(
    skeleton: &Skeleton,
    posture: &Posture,
    root: Vector3<f64>,
    heading: f64,
    feet: &[Foot; 2],
) -> Frame {
    let mut rotations = vec![UnitQuaternion::identity(); skeleton.joints()];
    let p = posture;
    let hips = hips_rotation(p, heading);
    rotations[joint::HIPS] = hips;
    rotations[joint::SPINE] = bent(p[SPINE], p[SPINE + 1], p[SPINE + 2]);
    rotations[joint::CHEST] = bent(p[CHEST], p[CHEST + 1], p[CHEST + 2]);
    let head = |part: f64| bent(part * p[HEAD], part * p[HEAD + 1], part * p[HEAD + 2]);
    rotations[joint::NECK] = head(0.5);
    rotations[joint::HEAD] = head(0.5);
    for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
        let arm = |channel: usize| p[ARMS[side] + channel];
        let first = joint::SHOULDER[side];
        let hang = std::f64::consts::FRAC_PI_2 - arm(ABDUCT);
        rotations[first] = about_y(-sign * arm(FORWARD)) * about_z(sign * arm(RAISE));
        rotations[first + 1] = about_x(-arm(SWING)) * about_z(-sign * hang) * about_x(arm(TWIST));
        rotations[first + 2] = about_y(-sign * elbow(arm(ELBOW)));
        rotations[first + 3] = about_z(-sign * arm(HAND));
        leg(skeleton, side, root, heading, &feet[side], &mut rotations);
    }
    Frame { root, rotations }
}

/// A sum of elbow angles as an elbow can show it: never below 0, never far above 2.3, smoothly so.
fn elbow(sum: f64) -> f64 {
    let bent = 0.5 * (sum + sum.hypot(0.06));
    if bent < 1.6 { bent } else { 1.6 + 0.7 * ((bent - 1.6) / 0.7).tanh() }
}

/// Sets the rotations of a leg so that its ankle is where the foot is planned.
fn leg(
    skeleton: &Skeleton,
    side: usize,
    root: Vector3<f64>,
    heading: f64,
    foot: &Foot,
    rotations: &mut [UnitQuaternion<f64>],
) {
    let first = joint::UPPER_LEG[side];
    let hip = root + rotations[joint::HIPS] * skeleton.offsets[first];
    let reach = foot.ankle - hip;
    let distance = reach.norm().clamp(0.2, 0.9999 * (THIGH_M + SHIN_M));
    let along = reach.normalize();
    // Knees point between where the body and where the foot faces: the hinge lies across that, so that a leg kicked
    // forwards is no special case.
    let across = about_y(heading + 0.5 * gestus_motion::body::wrap(foot.yaw - heading)) * Vector3::x();
    let hinge = (across - along * across.dot(&along)).normalize();
    let front = along.cross(&hinge);
    let share = (THIGH_M.powi(2) + distance.powi(2) - SHIN_M.powi(2)) / (2.0 * distance);
    let forwards = (THIGH_M.powi(2) - share.powi(2)).max(0.0).sqrt();
    let knee = along * share + front * forwards;
    let bone = |direction: Vector3<f64>| {
        let y = -direction.normalize();
        let basis = Matrix3::from_columns(&[hinge, y, hinge.cross(&y)]);
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(basis))
    };
    let (thigh, shin) = (bone(knee), bone(along * distance - knee));
    rotations[first] = rotations[joint::HIPS].inverse() * thigh;
    rotations[first + 1] = thigh.inverse() * shin;
    rotations[first + 2] = shin.inverse() * foot.rotation();
    rotations[first + 3] = about_x(-foot.bend);
}

/// Position of the toes joint of a foot.
pub fn ball(foot: &Foot) -> Vector3<f64> {
    foot.ankle + foot.rotation() * BALL
}

/// Height of the lowest point of the sole: heel, ball and tip of the toes.
pub fn sole_height(foot: &Foot) -> f64 {
    let rotation = foot.rotation();
    let ball = ball(foot);
    let heel = foot.ankle + rotation * skeleton::HEEL;
    let tip = ball + rotation * about_x(-foot.bend) * skeleton::TIP;
    heel.y.min(ball.y - skeleton::BALL_HEIGHT_M).min(tip.y)
}
