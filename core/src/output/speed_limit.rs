//! Limits how fast the joints of the output turn.
//!
//! A lively style turns joints faster than the input does, most of all the toes at the end of a step. A foot that the foot
//! lock has released also moves fast on its way back to the prediction. Motors need a bound that follows from the input:
//! [`Config::speed_limit`](crate::Config::speed_limit) times the speed ω of the input's fastest joint.
//!
//! ```text
//! angle(q[t-1], q[t]) <= limit · ω · Δt     Δt: the output's time step
//! ```
//!
//! A rotation `q[t]` that would exceed the bound is moved towards `q[t-1]` along the shorter arc. A joint below the bound
//! keeps its bits. A joint that was held back catches up in the following frames. There is no look-ahead.
//!
//! **A quicker style** turns its joints faster than that: held back, its legs would come late and slide, and its arms would
//! not rise as high. Where the speed S of the fastest joint in the output's classes
//! ([`TrustLimits::turning`](crate::blob::TrustLimits)), scaled by `limit` over its default, is above the limit, it is the
//! limit, up to 5/3 of the input's. Where poses come in less time than the input's, that is relative to the time that
//! the input's motion then takes.
//!
//! **ω** is measured in each frame at the joint whose exponential map changed most. The limit uses the largest of
//! - the last two frames, and
//! - the window of the last [`WINDOW_S`] to twice as many seconds. A speed enters the window only when three frames in a row
//!   have reached it. One wrong pose is two jumps, so it never enters.
//!
//! **Starts.** The first pose fills the whole search window. The first predictions therefore come from frames that have the
//! body's posture but move differently. The same happens after a leap or a change of settings. For [`SOFT_START_S`] the
//! limit is therefore S where that is smaller. After a leap the window holds both places and resembles other actions. For
//! half a second the action from before the leap therefore counts as one of the candidates whose speeds set the limit.
//!
//! Cost: 1,350 instructions a frame of 21 joints on a Cortex-M4F, and two exponential maps more where the input is faster
//! than anything in its window; none where there is no limit.

use crate::{
    blob::layout::{MAX_JOINTS, dof},
    body::pose::Pose,
    math::{
        abs, acos, clamp, maximum, minimum,
        quaternion::{Quaternion, Vector, between, exp, slerp},
        sin_cos,
        vector::norm,
    },
};

/// Length of the window over which the input's fastest joint is remembered, seconds. Speeds are kept for one to two windows.
pub const WINDOW_S: f32 = 2.0;
/// Speed of the fastest joint that is assumed before any input, rad/s. The fastest joint of a walk turns at 7.8 to 10.
const INITIAL_SPEED: f32 = 7.5;
/// Lower bound of the window's speed, rad/s, so that a standing body may start to move.
pub const MIN_SPEED: f32 = 1.0;

/// Time after a start, a leap or a change of settings for which the style's own speed is a limit too, seconds.
pub const SOFT_START_S: f32 = 1.0;
/// Time after that in which the style's limit is eased out, so that joints that were held back do not jump, seconds.
const SOFT_EASE_S: f32 = 0.5;
/// Time after a leap or a change of settings for which the input is assumed to keep its action, seconds.
const KEPT_ACTION_S: f32 = 0.5;

/// The joint of an input frame whose exponential map changed most since the frame before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fastest {
    /// Squared change of the map, square radians.
    pub change2: f32,
    now: Vector,
    before: Vector,
}

impl Fastest {
    /// Compares the dofs of a frame with those of the frame before. The root's tilt counts as joint 0. `each` gets
    /// every joint with the change of its map, and the square of that.
    #[inline]
    pub fn of(x: &[f32], x_prev: &[f32], mut each: impl FnMut(usize, &Vector, f32)) -> Self {
        let mut fastest = Self { change2: 0.0, now: [0.0; 3], before: [0.0; 3] };
        // The maps are the root's tilt, then (after the root's rates) the joints.
        for (map, (now, before)) in exponential_maps(x).iter().zip(exponential_maps(x_prev)).enumerate() {
            if map == RATES {
                continue;
            }
            let change = [now[0] - before[0], now[1] - before[1], now[2] - before[2]];
            let change2 = change[0] * change[0] + change[1] * change[1] + change[2] * change[2];
            if change2 > fastest.change2 {
                fastest = Self { change2, now: *now, before: *before };
            }
            each(map.saturating_sub(1), &change, change2);
        }
        fastest
    }
}

/// The speed of the input's fastest joint over time, and the state of a soft start.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct SpeedLimit {
    /// Largest speed in the current window and in the one before, rad/s.
    window_max: [f32; 2],
    /// Speeds of the last two frames, rad/s; 0 for a frame that was not above the current window's.
    recent: [f32; 2],
    /// Age of the current window, seconds.
    age_s: f32,
    /// Time until the style's speed no longer limits the output, seconds.
    soft_s: f32,
    /// The input's action. It is frozen for [`KEPT_ACTION_S`] after a start, a leap or a change; `None` if not known.
    action: Option<u16>,
}

impl SpeedLimit {
    /// The state before the first frame.
    pub const fn new() -> Self {
        Self {
            window_max: [MIN_SPEED, INITIAL_SPEED],
            recent: [0.0; 2],
            age_s: 0.0,
            soft_s: SOFT_START_S + SOFT_EASE_S,
            action: None,
        }
    }

    /// Begins a soft start: the output is about to take another posture.
    pub fn soften(&mut self) {
        self.soft_s = SOFT_START_S + SOFT_EASE_S;
    }

    /// Weight of the style's speed in the limit: 1 at a soft start, 0 after it.
    pub fn softness(&self) -> f32 {
        clamp(self.soft_s / SOFT_EASE_S, 0.0, 1.0)
    }

    /// The action that the input most likely has, given that the frame's nearest class has `action`.
    pub fn likely_action(&mut self, action: Option<u16>) -> Option<u16> {
        if self.soft_s <= SOFT_START_S + SOFT_EASE_S - KEPT_ACTION_S {
            self.action = action;
        }
        self.action
    }

    /// Advances the soft start by the duration of a frame.
    pub fn advance(&mut self, seconds: f32) {
        self.soft_s = clamp(self.soft_s - seconds, 0.0, SOFT_START_S + SOFT_EASE_S);
    }

    /// Measures an input frame of length `seconds`. `turning`, the heading's rate in rad/s, counts as a joint.
    #[inline(never)]
    pub fn observe(&mut self, fastest: &Fastest, turning: f32, seconds: f32) {
        self.age_s += seconds;
        if self.age_s > WINDOW_S {
            (self.window_max, self.age_s) = ([MIN_SPEED, self.window_max[0]], 0.0);
        }
        let window_max = self.window_max[0];
        let turning = abs(turning);
        let mut speed = if turning > window_max { turning } else { 0.0 };
        // The angle between two rotations is at most the distance of their maps, so most frames need no exact angle.
        let max_angle = maximum(speed, window_max) * seconds;
        if fastest.change2 > max_angle * max_angle {
            let angle = rotation_angle(&fastest.before, &fastest.now);
            speed = if angle > max_angle { angle / seconds } else { speed };
        }
        // A wrong pose causes two jumps, there and back. A speed counts when three frames have it.
        let [a, b] = self.recent;
        self.recent = [b, speed];
        let least = minimum(a, b);
        let least = minimum(speed, least);
        if least > window_max {
            self.window_max[0] = least;
        }
    }

    /// The largest remembered speed, multiplied by `times`, rad/s.
    pub fn max_speed(&self, times: f32) -> f32 {
        let all = self.window_max.iter().chain(&self.recent);
        times * all.fold(0.0, |max_speed, &speed| maximum(speed, max_speed))
    }
}

// A joint has a bit of what is returned.
const _: () = assert!(MAX_JOINTS <= 64);

/// Whether a joint of `pose` has turned by more than `max_angle` since `last`, radians.
pub fn is_faster<const J: usize>(max_angle: f32, last: &Pose<J>, pose: &Pose<J>) -> bool {
    has_turned(max_angle, &last.rotations, &pose.rotations)
}

// Not generic over capacities, so that it is compiled with the core, optimised for speed.
#[inline(never)]
fn has_turned(max_angle: f32, last: &[Quaternion], now: &[Quaternion]) -> bool {
    let (_, cosine) = half_angle(max_angle);
    last.iter().zip(now).any(|(last, now)| along(last, now) < cosine)
}

/// Half of an angle, which for quaternions is at most a quarter turn, and its cosine.
fn half_angle(angle: f32) -> (f32, f32) {
    let half = clamp(0.5 * angle, 0.0, core::f32::consts::FRAC_PI_2);
    (half, sin_cos(half).1)
}

/// Cosine of half the angle between two rotations along the shorter arc.
#[inline]
fn along(last: &Quaternion, now: &Quaternion) -> f32 {
    abs(now[0] * last[0] + now[1] * last[1] + now[2] * last[2] + now[3] * last[3])
}

/// Limits how far each joint of `pose` has turned since `last`. `speeds` has the limit of each joint in rad/s;
/// `seconds` have passed between the two poses. Returns the joints that were held back, a bit each.
pub fn limit_rotations<const J: usize>(
    speeds: impl Iterator<Item = f32>,
    seconds: f32,
    last: &Pose<J>,
    pose: &mut Pose<J>,
) -> u64 {
    // Joints of a group lie side by side and share a limit, so they are handled as one slice.
    let (mut speeds, mut start, mut limited) = (speeds.peekable(), 0, 0);
    while let Some(speed) = speeds.next() {
        let mut end = start + 1;
        while speeds.next_if(|next| *next == speed).is_some() {
            end += 1;
        }
        if let Some((last, now)) = last.rotations.get(start..end).zip(pose.rotations.get_mut(start..end)) {
            limited |= limit_angles(speed * seconds, last, now) << (start % MAX_JOINTS);
        }
        start = end;
    }
    limited
}

/// Limits the angle between each rotation and the last one to `max_angle`, radians. Returns those that were larger, a bit each.
// Not generic over capacities, so that it is compiled with the core, optimised for speed.
#[inline(never)]
fn limit_angles(max_angle: f32, last: &[Quaternion], rotations: &mut [Quaternion]) -> u64 {
    let (max_half_angle, cosine) = half_angle(max_angle);
    let mut limited = 0;
    for (j, (q, &last)) in rotations.iter_mut().zip(last).enumerate().take(MAX_JOINTS) {
        let along = along(&last, q);
        if along < cosine {
            *q = slerp(max_half_angle / acos(along), last, *q);
            limited |= 1 << j;
        }
    }
    limited
}

/// Index at which the root's rates stand among the maps.
const RATES: usize = (dof::FORWARD - dof::TILT) / 3;
const _: () = assert!(dof::JOINTS - dof::TILT == 3 * (RATES + 1));

/// The dofs from the root's tilt on, three at a time: the tilt, the root's rates, then the maps of the joints.
pub(crate) fn exponential_maps(dofs: &[f32]) -> &[Vector] {
    dofs.get(dof::TILT..).unwrap_or(&[]).as_chunks().0
}

/// The angle between the rotations of two exponential maps along the shorter arc, radians. The maps themselves may differ by
/// a whole turn.
#[inline(never)]
pub(crate) fn rotation_angle(before: &Vector, now: &Vector) -> f32 {
    norm(between(exp(*before), exp(*now)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::quaternion::{IDENTITY, angle};

    fn dofs(joint: [f32; 3]) -> [f32; 10] {
        let mut dofs = [0.0; 10];
        dofs[dof::JOINTS..].copy_from_slice(&joint);
        dofs
    }

    fn pose(joint: [f32; 3]) -> Pose<2> {
        Pose { rotations: [IDENTITY, exp(joint)], ..Pose::IDENTITY }
    }

    const FRAME: f32 = 1.0 / 30.0;

    fn limit_rotations(limit: &SpeedLimit, last: &Pose<2>, pose: &mut Pose<2>) {
        let _ = super::limit_rotations([limit.max_speed(1.2); 2].into_iter(), FRAME, last, pose);
    }

    /// Shows three frames, each of which turns the joint by as much.
    fn show(limit: &mut SpeedLimit, now: &[f32], before: &[f32]) {
        for _ in 0..3 {
            limit.observe(&Fastest::of(now, before, |_, _, _| {}), 0.0, FRAME);
        }
    }

    /// A limit after a long time of still input.
    fn after_rest() -> SpeedLimit {
        SpeedLimit { window_max: [MIN_SPEED; 2], ..SpeedLimit::new() }
    }

    #[test]
    fn a_joint_turns_at_the_limit_until_it_is_there() {
        let mut limit = after_rest();
        // 0.1 rad in a frame: 3 rad/s.
        show(&mut limit, &dofs([0.1, 0.0, 0.0]), &dofs([0.0; 3]));
        let (target, mut at) = (pose([0.0, 0.5, 0.0]), pose([0.0; 3]));
        let mut angles = Vec::new();
        for _ in 0..7 {
            let mut next = target;
            limit_rotations(&limit, &at, &mut next);
            angles.push(angle(at.rotations[1], next.rotations[1]));
            at = next;
        }
        for (t, (turned, expected)) in angles.iter().zip([0.12, 0.12, 0.12, 0.12, 0.02, 0.0, 0.0]).enumerate()
        {
            assert!((turned - expected).abs() < 1e-5, "frame {t}: {turned}");
        }
        assert_eq!(at, target);
    }

    #[test]
    fn one_wrong_pose_is_forgotten_at_once() {
        let mut limit = after_rest();
        let slow = |t: usize| 0.01 * t as f32;
        let input: Vec<[f32; 10]> =
            (0..20).map(|t| dofs([if t == 10 { 1.5 } else { slow(t) }, 0.0, 0.0])).collect();
        for pair in input.windows(2) {
            limit.observe(&Fastest::of(&pair[1], &pair[0], |_, _, _| {}), 0.0, FRAME);
        }
        assert_eq!(limit.window_max[0], MIN_SPEED);
        // A turn of three frames does.
        for turning in [20.0, -30.0, 40.0] {
            assert_eq!(limit.window_max[0], MIN_SPEED);
            limit.observe(&Fastest::of(&input[0], &input[0], |_, _, _| {}), turning, FRAME);
        }
        assert_eq!(limit.window_max[0], 20.0);
    }

    #[test]
    fn what_is_slower_stays_to_the_bit() {
        let mut limit = after_rest();
        show(&mut limit, &dofs([0.1, 0.0, 0.0]), &dofs([0.0; 3]));
        for way in [[0.0; 3], [0.05, -0.05, 0.02], [0.0, 0.0, 0.119]] {
            let (mut next, wanted) = (pose(way), pose(way));
            limit_rotations(&limit, &pose([0.0; 3]), &mut next);
            assert_eq!(next, wanted, "{way:?}");
            // The other sign is the same rotation.
            next.rotations[1] = next.rotations[1].map(|v| -v);
            let wanted = next;
            limit_rotations(&limit, &pose([0.0; 3]), &mut next);
            assert_eq!(next, wanted, "{way:?}");
        }
    }

    #[test]
    fn the_fastest_rotation_counts_not_the_fastest_map() {
        // Far from the mean a map goes further than its rotation turns.
        let (a, b) = ([2.5, 0.0, 0.0], [2.5, 0.3, 0.0]);
        let mut limit = after_rest();
        show(&mut limit, &dofs(b), &dofs(a));
        let turned = angle(exp(a), exp(b));
        assert!(turned < 0.25, "{turned}");
        assert!((limit.window_max[0] * FRAME - turned).abs() < 1e-5, "{}", limit.window_max[0]);
        // On the other side of a whole turn a map is far off, and its rotation near.
        let mut limit = after_rest();
        show(&mut limit, &dofs([-3.1, 0.0, 0.0]), &dofs([3.1, 0.0, 0.0]));
        assert!((limit.window_max[0] * FRAME - 0.0832).abs() < 1e-3, "{}", limit.window_max[0]);
    }

    #[test]
    fn what_was_shown_is_forgotten_after_two_windows() {
        let mut limit = after_rest();
        show(&mut limit, &dofs([0.2, 0.0, 0.0]), &dofs([0.0; 3]));
        let still = dofs([0.2, 0.0, 0.0]);
        let longest = |l: &SpeedLimit| {
            if l.window_max[0] > l.window_max[1] { l.window_max[0] } else { l.window_max[1] }
        };
        let mut frames = 0;
        while longest(&limit) > 5.9 {
            limit.observe(&Fastest::of(&still, &still, |_, _, _| {}), 0.0, FRAME);
            frames += 1;
        }
        assert!((60..=122).contains(&frames), "{frames} frames");
        assert_eq!(longest(&limit), MIN_SPEED);
    }

    #[test]
    fn each_joint_has_its_limit_and_what_begins_is_soft_for_a_second() {
        let mut limit = SpeedLimit::new();
        for t in 0..100 {
            let mut next = Pose::<3> { rotations: [exp([0.0, 3.0, 0.0]); 3], ..Pose::IDENTITY };
            let limited =
                super::limit_rotations([4.0, 4.0, 9.0].into_iter(), FRAME, &Pose::IDENTITY, &mut next);
            assert_eq!(limited, 0b111);
            for (q, max_speed) in next.rotations.into_iter().zip([4.0, 4.0, 9.0]) {
                assert!((angle(IDENTITY, q) / FRAME - max_speed).abs() < 1e-3);
            }
            let expected = (3.0 - t as f32 / 15.0).clamp(0.0, 1.0);
            assert!((limit.softness() - expected).abs() < 1e-3, "frame {t}: {}", limit.softness());
            limit.advance(FRAME);
        }
        limit.soften();
        assert_eq!(limit.softness(), 1.0);
    }

    #[test]
    fn an_action_is_known_for_half_a_second_after_a_leap() {
        let mut limit = SpeedLimit::new();
        let seem = |limit: &mut SpeedLimit, action: u16| {
            let likely = limit.likely_action(Some(action));
            limit.advance(FRAME);
            likely
        };
        // What a stream that begins looks like tells nothing yet.
        let begins: Vec<_> = (0..16).map(|_| seem(&mut limit, 1)).collect();
        assert_eq!(begins[..15], [None; 15]);
        assert_eq!([1, 2, 3].map(|action| seem(&mut limit, action)), [1, 2, 3].map(Some));
        limit.soften();
        let leapt: Vec<_> = (0..20).map(|_| seem(&mut limit, 4)).collect();
        assert_eq!(leapt[..15], [Some(3); 15]);
        assert_eq!(leapt[16..], [Some(4); 4]);
    }

    #[test]
    fn a_stream_begins_with_a_walk_taken_for_granted_and_forgets_it() {
        let mut limit = SpeedLimit::new();
        let still = dofs([0.0; 3]);
        let max_speed = |limit: &SpeedLimit| {
            let mut next = pose([0.0, 3.0, 0.0]);
            limit_rotations(limit, &pose([0.0; 3]), &mut next);
            angle(IDENTITY, next.rotations[1]) / FRAME
        };
        assert!((max_speed(&limit) - 1.2 * INITIAL_SPEED).abs() < 1e-3, "{}", max_speed(&limit));
        for _ in 0..70 {
            limit.observe(&Fastest::of(&still, &still, |_, _, _| {}), 0.0, FRAME);
        }
        assert!((max_speed(&limit) - 1.2 * MIN_SPEED).abs() < 1e-3, "{}", max_speed(&limit));
    }
}
