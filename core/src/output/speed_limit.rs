//! No joint of the output turns faster than the input has shown that a joint can.
//!
//! A livelier style turns joints faster than the input does, most of all the toes at the end of a step; a foot that the
//! lock has released also returns to its prediction. Motors need a bound in terms of the input:
//! [`Config::speed_limit`](crate::Config::speed_limit) times its fastest joint ω,
//!
//! ```text
//! angle(q[t-1], q[t]) <= limit · ω · Δt,     q[t] moved towards q[t-1] along the short way where it would be more
//! ```
//!
//! with Δt the output's own time step. In each frame ω is the angle of the joint whose exponential map changed most. The
//! limit uses the last two frames, and the maximum over the last [`WINDOW_S`] to twice as many seconds of what three frames
//! have in common: one wrong pose, which is two jumps, is forgotten at once, and a long stream forgets. A joint that was
//! held back catches up in the next frames. There is no look-ahead, and a joint below the limit keeps its bits.
//!
//! **Starts.** The first pose fills the search's window, so the first predictions come from frames that stand as the body
//! does and move otherwise; after a leap or a change of settings the posture is another one. For [`SOFT_S`] no joint turns
//! faster than the fastest in the output's own classes ([`Familiar::turning`](crate::blob::Familiar)) either; with another
//! `limit` than the default, than that in proportion. After a leap the window holds both places and looks like other
//! actions: for half a second the action of before is one of those whose speeds are limits.
//!
//! Cost: 1,350 instructions a frame of 21 joints on a Cortex-M4F, two exponential maps more where the input is faster than
//! in all of its window; none where there is no limit.

use crate::{
    blob::layout::dof,
    body::pose::Pose,
    math::{
        abs, acos, clamp,
        quaternion::{Quaternion, Vector, between, exp, slerp},
        sin_cos,
        vector::norm,
    },
};

/// The input's fastest joint is remembered for at least this long, and at most twice as long, seconds.
pub const WINDOW_S: f32 = 2.0;
/// The fastest joint assumed at the start of a stream, rad/s: a walk's turns at 7.8 to 10.
const FIRST: f32 = 7.5;
/// The fastest joint assumed at least, rad/s: a body that stands may start to move.
const LEAST: f32 = 1.0;

/// Seconds after a start, a leap or a change of settings in which the style's own speed is a limit too, and in which that
/// is then eased out, so that what was held back does not jump.
pub const SOFT_S: f32 = 1.0;
const EASED_S: f32 = 0.5;
/// Seconds after a leap or a change of settings in which the input is taken to be of the action that it was of.
const KNOWN_S: f32 = 0.5;

/// The joint of a frame of the input whose exponential map changed most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fastest {
    /// Squared change of the map, square radians.
    pub apart2: f32,
    now: Vector,
    before: Vector,
}

impl Fastest {
    /// Of the dofs of a frame and of the one before; the root's tilt is a joint too.
    #[inline(never)]
    pub fn of(x: &[f32], x_prev: &[f32]) -> Self {
        let mut fastest = Self { apart2: 0.0, now: [0.0; 3], before: [0.0; 3] };
        // Exponential maps among the dofs: the root's tilt and, behind its rates, the joints'.
        for (d, (now, before)) in maps(x).iter().zip(maps(x_prev)).enumerate() {
            let apart = [now[0] - before[0], now[1] - before[1], now[2] - before[2]];
            let apart2 = apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2];
            if apart2 > fastest.apart2 && d != RATES {
                fastest = Self { apart2, now: *now, before: *before };
            }
        }
        fastest
    }
}

/// The input's fastest joint.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Limit {
    /// Of this window and of the one before, rad/s.
    shown: [f32; 2],
    /// Of the last two frames, rad/s; 0 where it was not above what was shown.
    recent: [f32; 2],
    /// Seconds of this window.
    age_s: f32,
    /// Seconds left until the style's own speed is no limit any more.
    soft_s: f32,
    /// The action of the input before the last start, leap or change, then that of the last frame; `None` if not known.
    action: Option<u16>,
}

impl Limit {
    /// The state before the first frame.
    pub const fn new() -> Self {
        Self { shown: [LEAST, FIRST], recent: [0.0; 2], age_s: 0.0, soft_s: SOFT_S + EASED_S, action: None }
    }

    /// Another posture is due: it is taken up softly.
    pub fn soften(&mut self) {
        self.soft_s = SOFT_S + EASED_S;
    }

    /// Part of the way from the input's speed to the style's at which the limit is.
    pub fn softness(&self) -> f32 {
        clamp(self.soft_s / EASED_S, 0.0, 1.0)
    }

    /// The action that the input is known to be of, where the frame looks like one of `action`.
    pub fn known(&mut self, action: Option<u16>) -> Option<u16> {
        if self.soft_s <= SOFT_S + EASED_S - KNOWN_S {
            self.action = action;
        }
        self.action
    }

    /// Time goes on by a frame.
    pub fn pass(&mut self, seconds: f32) {
        self.soft_s = clamp(self.soft_s - seconds, 0.0, SOFT_S + EASED_S);
    }

    /// Measures a frame of the input that lasts for `seconds`. The body's turning, rad/s, counts as its first joint's.
    #[inline(never)]
    pub fn see(&mut self, fastest: &Fastest, turning: f32, seconds: f32) {
        self.age_s += seconds;
        if self.age_s > WINDOW_S {
            (self.shown, self.age_s) = ([LEAST, self.shown[0]], 0.0);
        }
        let shown = self.shown[0];
        let turning = abs(turning);
        let mut speed = if turning > shown { turning } else { 0.0 };
        // Rotations are no further apart than their maps are: most frames show nothing new.
        let most = (if speed > shown { speed } else { shown }) * seconds;
        if fastest.apart2 > most * most {
            let turned = turned(&fastest.before, &fastest.now);
            speed = if turned > most { turned / seconds } else { speed };
        }
        // A wrong pose is two jumps: there and back.
        let [a, b] = self.recent;
        self.recent = [b, speed];
        let least = if a < b { a } else { b };
        let least = if speed < least { speed } else { least };
        if least > shown {
            self.shown[0] = least;
        }
    }

    /// `times` what was shown, rad/s.
    pub fn most(&self, times: f32) -> f32 {
        let all = self.shown.iter().chain(&self.recent);
        times * all.fold(0.0, |most, &speed| if speed > most { speed } else { most })
    }
}

/// Holds each joint of a pose to its speed, rad/s, over the `seconds` since the last pose.
pub fn hold<const J: usize>(
    most: impl Iterator<Item = f32>,
    seconds: f32,
    last: &Pose<J>,
    pose: &mut Pose<J>,
) {
    // Joints of a group are neighbors: most often all are held at once.
    let (mut most, mut start) = (most.peekable(), 0);
    while let Some(speed) = most.next() {
        let mut end = start + 1;
        while most.next_if(|next| *next == speed).is_some() {
            end += 1;
        }
        if let Some((last, now)) = last.rotations.get(start..end).zip(pose.rotations.get_mut(start..end)) {
            hold_all(speed * seconds, last, now);
        }
        start = end;
    }
}

/// Holds rotations to an angle from the last ones, radians.
// Of no capacity: it is compiled with the core, for speed, however its caller is.
#[inline(never)]
fn hold_all(most: f32, last: &[Quaternion], rotations: &mut [Quaternion]) {
    // Half angles, as quaternions have them; a quarter turn of those is as far as there is.
    let most = clamp(0.5 * most, 0.0, core::f32::consts::FRAC_PI_2);
    let cosine = sin_cos(most).1;
    for (q, &last) in rotations.iter_mut().zip(last) {
        let along = abs(q[0] * last[0] + q[1] * last[1] + q[2] * last[2] + q[3] * last[3]);
        if along < cosine {
            *q = slerp(most / acos(along), last, *q);
        }
    }
}

/// Place of the root's rates among the maps.
const RATES: usize = (dof::FORWARD - dof::TILT) / 3;
const _: () = assert!(dof::JOINTS - dof::TILT == 3 * (RATES + 1));

/// The exponential maps among dofs, with the root's rates behind the first.
pub(crate) fn maps(dofs: &[f32]) -> &[Vector] {
    dofs.get(dof::TILT..).unwrap_or(&[]).as_chunks().0
}

/// The angle between the rotations of two exponential maps: the short way, where the maps may be a whole turn apart.
#[inline(never)]
pub(crate) fn turned(before: &Vector, now: &Vector) -> f32 {
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

    fn hold(limit: &Limit, last: &Pose<2>, pose: &mut Pose<2>) {
        super::hold([limit.most(1.2); 2].into_iter(), FRAME, last, pose);
    }

    /// Shows three frames, each of which turns the joint by as much.
    fn show(limit: &mut Limit, now: &[f32], before: &[f32]) {
        for _ in 0..3 {
            limit.see(&Fastest::of(now, before), 0.0, FRAME);
        }
    }

    /// A limit that has seen still frames for so long that nothing is taken for granted.
    fn knowing() -> Limit {
        Limit { shown: [LEAST; 2], ..Limit::new() }
    }

    #[test]
    fn a_joint_turns_at_the_limit_until_it_is_there() {
        let mut limit = knowing();
        // 0.1 rad in a frame: 3 rad/s.
        show(&mut limit, &dofs([0.1, 0.0, 0.0]), &dofs([0.0; 3]));
        let (target, mut at) = (pose([0.0, 0.5, 0.0]), pose([0.0; 3]));
        let mut turned = Vec::new();
        for _ in 0..7 {
            let mut next = target;
            hold(&limit, &at, &mut next);
            turned.push(angle(at.rotations[1], next.rotations[1]));
            at = next;
        }
        for (t, (turned, expected)) in turned.iter().zip([0.12, 0.12, 0.12, 0.12, 0.02, 0.0, 0.0]).enumerate()
        {
            assert!((turned - expected).abs() < 1e-5, "frame {t}: {turned}");
        }
        assert_eq!(at, target);
    }

    #[test]
    fn one_wrong_pose_is_forgotten_at_once() {
        let mut limit = knowing();
        let slow = |t: usize| 0.01 * t as f32;
        let input: Vec<[f32; 10]> =
            (0..20).map(|t| dofs([if t == 10 { 1.5 } else { slow(t) }, 0.0, 0.0])).collect();
        for pair in input.windows(2) {
            limit.see(&Fastest::of(&pair[1], &pair[0]), 0.0, FRAME);
        }
        assert_eq!(limit.shown[0], LEAST);
        // A turn of three frames does.
        for turning in [20.0, -30.0, 40.0] {
            assert_eq!(limit.shown[0], LEAST);
            limit.see(&Fastest::of(&input[0], &input[0]), turning, FRAME);
        }
        assert_eq!(limit.shown[0], 20.0);
    }

    #[test]
    fn what_is_slower_stays_to_the_bit() {
        let mut limit = knowing();
        show(&mut limit, &dofs([0.1, 0.0, 0.0]), &dofs([0.0; 3]));
        for way in [[0.0; 3], [0.05, -0.05, 0.02], [0.0, 0.0, 0.119]] {
            let (mut next, wanted) = (pose(way), pose(way));
            hold(&limit, &pose([0.0; 3]), &mut next);
            assert_eq!(next, wanted, "{way:?}");
            // The other sign is the same rotation.
            next.rotations[1] = next.rotations[1].map(|v| -v);
            let wanted = next;
            hold(&limit, &pose([0.0; 3]), &mut next);
            assert_eq!(next, wanted, "{way:?}");
        }
    }

    #[test]
    fn the_fastest_rotation_counts_not_the_fastest_map() {
        // Far from the mean a map goes further than its rotation turns.
        let (a, b) = ([2.5, 0.0, 0.0], [2.5, 0.3, 0.0]);
        let mut limit = knowing();
        show(&mut limit, &dofs(b), &dofs(a));
        let turned = angle(exp(a), exp(b));
        assert!(turned < 0.25, "{turned}");
        assert!((limit.shown[0] * FRAME - turned).abs() < 1e-5, "{}", limit.shown[0]);
        // On the other side of a whole turn a map is far off, and its rotation near.
        let mut limit = knowing();
        show(&mut limit, &dofs([-3.1, 0.0, 0.0]), &dofs([3.1, 0.0, 0.0]));
        assert!((limit.shown[0] * FRAME - 0.0832).abs() < 1e-3, "{}", limit.shown[0]);
    }

    #[test]
    fn what_was_shown_is_forgotten_after_two_windows() {
        let mut limit = knowing();
        show(&mut limit, &dofs([0.2, 0.0, 0.0]), &dofs([0.0; 3]));
        let still = dofs([0.2, 0.0, 0.0]);
        let shown = |l: &Limit| if l.shown[0] > l.shown[1] { l.shown[0] } else { l.shown[1] };
        let mut known = 0;
        while shown(&limit) > 5.9 {
            limit.see(&Fastest::of(&still, &still), 0.0, FRAME);
            known += 1;
        }
        assert!((60..=122).contains(&known), "{known} frames");
        assert_eq!(shown(&limit), LEAST);
    }

    #[test]
    fn each_joint_has_its_limit_and_what_begins_is_soft_for_a_second() {
        let mut limit = Limit::new();
        for t in 0..100 {
            let mut next = Pose::<3> { rotations: [exp([0.0, 3.0, 0.0]); 3], ..Pose::IDENTITY };
            super::hold([4.0, 4.0, 9.0].into_iter(), FRAME, &Pose::IDENTITY, &mut next);
            for (q, most) in next.rotations.into_iter().zip([4.0, 4.0, 9.0]) {
                assert!((angle(IDENTITY, q) / FRAME - most).abs() < 1e-3);
            }
            let expected = (3.0 - t as f32 / 15.0).clamp(0.0, 1.0);
            assert!((limit.softness() - expected).abs() < 1e-3, "frame {t}: {}", limit.softness());
            limit.pass(FRAME);
        }
        limit.soften();
        assert_eq!(limit.softness(), 1.0);
    }

    #[test]
    fn an_action_is_known_for_half_a_second_after_a_leap() {
        let mut limit = Limit::new();
        let seem = |limit: &mut Limit, action: u16| {
            let known = limit.known(Some(action));
            limit.pass(FRAME);
            known
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
        let mut limit = Limit::new();
        let still = dofs([0.0; 3]);
        let most = |limit: &Limit| {
            let mut next = pose([0.0, 3.0, 0.0]);
            hold(limit, &pose([0.0; 3]), &mut next);
            angle(IDENTITY, next.rotations[1]) / FRAME
        };
        assert!((most(&limit) - 1.2 * FIRST).abs() < 1e-3, "{}", most(&limit));
        for _ in 0..70 {
            limit.see(&Fastest::of(&still, &still), 0.0, FRAME);
        }
        assert!((most(&limit) - 1.2 * LEAST).abs() < 1e-3, "{}", most(&limit));
    }
}
