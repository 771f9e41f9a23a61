//! Which footplants a moved motion has, and what holds them: the offsets of the feet and the shifts of the root.
//!
//! Contacts are often those of another motion: of a clip before its style was changed, or of its neighbors. What became a run
//! has no plants of a walk. So that no plant pulls the body out of its course:
//!
//! 1. A plant is dropped where the foot travels far at a speed at which no foot stands (`FAST`, `FAR`), or is high
//!    over the floor (`HIGH`).
//! 2. The root moves within reach of the plants, but no faster than `ROOT_SPEED` besides its own motion, and no more than
//!    `LOWER` down.
//! 3. A plant that is then out of reach is let go: it begins later or ends earlier. Kovar et al. 2002 lengthen the leg by
//!    a little instead, which the rotations of a clip cannot say.
//!
//! Speeds and heights are in lengths of the leg.

use std::ops::Range;

use gestus_core::{blob::Leg, body::two_bone_ik::Chain};
use gestus_motion::statistics::{smooth, sorted};
use nalgebra::Vector3;

/// Greatest extension of a leg, relative to its length.
pub(super) const STRETCH: f64 = 0.995;

/// Iterations of moving the root within reach of every leg.
const REACH_ROUNDS: usize = 8;

/// Median speed on the ground above which a foot does not stand, lengths of the leg a second: 0.9 m/s. A contact of a
/// clip is slower than 0.7 m/s ([`crate::registration::contact`]); feet of a walk in the style of another slide at up to 0.6.
const FAST: f64 = 1.1;
/// How far a plant that is fast has to travel to be dropped, lengths of the leg: legs make up for 10 cm to either side.
const FAR: f64 = 0.25;
/// Median height over the floor above which a foot does not stand, lengths of the leg: 10 cm.
const HIGH: f64 = 0.12;
/// Greatest speed of the root besides its own motion, lengths of the leg a second: 0.6 m/s.
const ROOT_SPEED: f64 = 0.75;
/// How far the root goes down at most, lengths of the leg: 6 cm.
const LOWER: f64 = 0.075;
/// How far a plant may be out of reach, lengths of the leg: 1 cm.
const MISSED: f64 = 0.012;
/// Shortest plant that is left of one that is let go, seconds: as short as contacts are.
const SHORTEST_S: f64 = 0.05;
/// Rounds of letting plants go; each moves the root less.
const RELEASES: usize = 4;

pub(super) type Offsets = Vec<[Option<Vector3<f64>>; 2]>;

/// Footplants of a motion, and how many of them its moved feet do not have.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Footplants {
    /// All of them.
    pub all: usize,
    /// Of which no frame is left.
    pub dropped: usize,
    /// Of which some frames are left.
    pub shortened: usize,
}

impl Footplants {
    /// Counts the plants of the contacts `before`, and what `after` has of them.
    pub fn count(before: &[[bool; 2]], after: &[[bool; 2]]) -> Self {
        let mut plants = Self::default();
        for side in [0, 1] {
            for run in runs(before, side) {
                let left = after[run.clone()].iter().filter(|stands| stands[side]).count();
                plants.all += 1;
                plants.dropped += usize::from(left == 0);
                plants.shortened += usize::from(left > 0 && left < run.len());
            }
        }
        plants
    }

    /// What is to be said of plants that were let go.
    pub fn doubt(&self) -> Option<String> {
        let Self { all, dropped, shortened } = self;
        (dropped + shortened > 0).then(|| {
            format!(
                "of {all} footplants of the clip, {dropped} are not held, and {shortened} for a part of their time: in this \
                 style their feet move on, or are out of reach, and may slide; give a reference that does what the clip does"
            )
        })
    }
}

/// How the plants of a motion are held.
pub(super) struct Held {
    /// Which foot stands. Shape `[frames]`.
    pub stands: Vec<[bool; 2]>,
    /// From each standing foot to where it is held.
    pub offsets: Offsets,
    /// What the root takes of the offsets.
    pub shifts: Vec<Vector3<f64>>,
}

impl Held {
    /// Plants as contacts have them, less those that the feet of these legs do not have. `window` is a number of frames.
    pub fn of(
        chains: &[[Chain; 2]],
        legs: &[Leg; 2],
        stands: &[[bool; 2]],
        window: usize,
        rate_hz: f64,
    ) -> Self {
        let mut stands = stands.to_vec();
        drop_moving(chains, legs, &mut stands, rate_hz);
        let shortest = (SHORTEST_S * rate_hz).ceil() as usize;
        let mut round = 0;
        loop {
            let mut offsets = places(chains, legs, &stands);
            let shifts = root_shifts(chains, &offsets, window, rate_hz);
            round += 1;
            if !let_go(chains, &offsets, &shifts, shortest, &mut stands) || round == RELEASES {
                for (offsets, stands) in offsets.iter_mut().zip(&stands) {
                    for (offset, stands) in offsets.iter_mut().zip(stands) {
                        *offset = offset.filter(|_| *stands);
                    }
                }
                return Self { stands, offsets, shifts };
            }
        }
    }
}

/// Runs of frames in which a foot stands.
fn runs(stands: &[[bool; 2]], side: usize) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut start = 0;
    while start < stands.len() {
        let end = (start..stands.len()).find(|&t| !stands[t][side]).unwrap_or(stands.len());
        if end > start {
            runs.push(start..end);
        }
        start = end + 1;
    }
    runs
}

/// Length of the legs, metres.
fn leg_m(chains: &[[Chain; 2]]) -> f64 {
    chains.first().map_or(0.0, |[left, right]| 0.5 * f64::from(left.length() + right.length()))
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let values = sorted(values);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// Drops the plants in which the foot travels on, or is in the air.
fn drop_moving(chains: &[[Chain; 2]], legs: &[Leg; 2], stands: &mut [[bool; 2]], rate_hz: f64) {
    let leg_m = leg_m(chains);
    for (side, leg) in legs.iter().enumerate() {
        for run in runs(stands, side) {
            let moved = |t: usize| {
                let moved = slid(&chains[t][side], leg, &chains[t - 1][side]);
                Vector3::new(moved.x, 0.0, moved.z)
            };
            let inner = run.start + 1..run.end;
            let travel = inner.clone().map(moved).sum::<Vector3<f64>>().norm();
            let fast = median(inner.map(|t| moved(t).norm() * rate_hz)) > FAST * leg_m;
            let height = |t: usize| over(&chains[t][side], leg).into_iter().fold(f64::INFINITY, f64::min);
            let high = median(run.clone().map(height)) > HIGH * leg_m;
            if high || fast && travel > FAR * leg_m {
                stands[run].iter_mut().for_each(|stands| stands[side] = false);
            }
        }
    }
}

/// Lets go of plants where they are out of reach: from there to their nearer end. Whether any was let go.
fn let_go(
    chains: &[[Chain; 2]],
    offsets: &Offsets,
    shifts: &[Vector3<f64>],
    shortest: usize,
    stands: &mut [[bool; 2]],
) -> bool {
    let missed = MISSED * leg_m(chains);
    let mut any = false;
    for side in [0, 1] {
        for run in runs(stands, side) {
            let out_of_reach = |t: usize| {
                let (chain, Some(offset)) = (&chains[t][side], offsets[t][side]) else { return false };
                let own = vector(chain.ankle) - vector(chain.hip);
                let reach = own.norm().max(STRETCH * f64::from(chain.length()));
                (own + offset - shifts[t]).norm() > reach + missed
            };
            let middle = (run.start + run.end) / 2;
            let start = (run.start..middle).rev().find(|&t| out_of_reach(t)).map_or(run.start, |t| t + 1);
            let end = (middle..run.end).find(|&t| out_of_reach(t)).unwrap_or(run.end);
            let kept = if end - start < shortest.min(run.len()) { start..start } else { start..end };
            for t in run.filter(|t| !kept.contains(t)) {
                stands[t][side] = false;
                any = true;
            }
        }
    }
    any
}

pub(super) fn vector(v: [f32; 3]) -> Vector3<f64> {
    Vector3::from(v.map(f64::from))
}

/// Heights of ankle and toes above their standing heights, metres.
pub(super) fn over(chain: &Chain, leg: &Leg) -> [f64; 2] {
    let height = |place: [f32; 3], i: usize| f64::from(place[1]) - f64::from(leg.heights[i]);
    [height(chain.ankle, 0), if leg.toe.is_some() { height(chain.toe, 1) } else { f64::INFINITY }]
}

/// How far the point that a foot stands on has moved since the frame before: the joint that carries the foot, the lower
/// of ankle and toes, less what the foot's roll moves it by.
pub(super) fn slid(at: &Chain, leg: &Leg, before: &Chain) -> Vector3<f64> {
    let [ankle, toe] = over(at, leg);
    let (moved, roll) = if toe <= ankle {
        (vector(at.toe) - vector(before.toe), leg.rolls[1])
    } else {
        (vector(at.ankle) - vector(before.ankle), leg.rolls[0])
    };
    let (up, now) = (before.up_in_foot(), at.up_in_foot());
    moved - vector(at.rolled([up[0] - now[0], up[1] - now[1], up[2] - now[2]], roll))
}

/// Offsets that take each standing foot to its plant's place: what carries it does not move on the ground, the offset
/// goes on where the weight goes from heel to toes, and the foot is as far ahead of where it was as it is behind in the
/// mean of the plant.
fn places(chains: &[[Chain; 2]], legs: &[Leg; 2], stands: &[[bool; 2]]) -> Offsets {
    let mut offsets: Offsets = vec![[None; 2]; chains.len()];
    for (side, leg) in legs.iter().enumerate() {
        for run in runs(stands, side) {
            let mut offset = Vector3::zeros();
            let mut plant = Vec::with_capacity(run.len());
            for t in run.clone() {
                if t > run.start {
                    offset -= slid(&chains[t][side], leg, &chains[t - 1][side]);
                }
                let [ankle, toe] = over(&chains[t][side], leg);
                plant.push(Vector3::new(offset.x, -ankle.min(toe), offset.z));
            }
            let mean = plant.iter().sum::<Vector3<f64>>() / plant.len() as f64;
            for (slot, offset) in offsets[run].iter_mut().zip(plant) {
                slot[side] = Some(offset - Vector3::new(mean.x, 0.0, mean.z));
            }
        }
    }
    offsets
}

/// What the root takes: the mean of the standing feet's offsets, in between what lies between, smoothed, and so that
/// every leg reaches as far as the root may go.
fn root_shifts(chains: &[[Chain; 2]], plants: &Offsets, window: usize, rate_hz: f64) -> Vec<Vector3<f64>> {
    let lowest = -LOWER * leg_m(chains);
    let common: Vec<Option<Vector3<f64>>> = plants
        .iter()
        .map(|p| {
            let standing: Vec<Vector3<f64>> = p.iter().flatten().copied().collect();
            (!standing.is_empty()).then(|| standing.iter().sum::<Vector3<f64>>() / standing.len() as f64)
        })
        .collect();
    let mut shifts = smooth(&between(&common), window as f64 / 3.0);
    let bound = |shifts: &mut Vec<Vector3<f64>>| shifts.iter_mut().for_each(|s| s.y = s.y.max(lowest));
    bound(&mut shifts);
    // Again and again: what one leg asks for may take the other one out of reach, and what is smoothed falls short. The
    // little that is left in the end is not smoothed.
    for round in 0..REACH_ROUNDS {
        for (shift, (chains, plants)) in shifts.iter_mut().zip(chains.iter().zip(plants)) {
            for (chain, plant) in chains.iter().zip(plants) {
                let Some(plant) = plant else { continue };
                let leg = vector(chain.ankle) + plant - vector(chain.hip) - *shift;
                let (length, most) = (leg.norm(), STRETCH * f64::from(chain.length()));
                if length > most {
                    *shift += leg * (1.0 - most / length);
                }
            }
        }
        bound(&mut shifts);
        if round + 1 < REACH_ROUNDS {
            shifts = smooth(&shifts, (window / 2) as f64 / 3.0);
        }
    }
    slowed(&shifts, ROOT_SPEED * leg_m(chains) / rate_hz)
}

/// Shifts that move by no more than `step` from a frame to the next: followed from the front and from the end. Each is
/// late at its own end; their mean is not.
fn slowed(shifts: &[Vector3<f64>], step: f64) -> Vec<Vector3<f64>> {
    let ahead = followed(shifts.iter(), step);
    let back = followed(shifts.iter().rev(), step);
    ahead.iter().zip(back.iter().rev()).map(|(a, b)| 0.5 * (a + b)).collect()
}

fn followed<'a>(goals: impl Iterator<Item = &'a Vector3<f64>>, step: f64) -> Vec<Vector3<f64>> {
    let mut at: Option<Vector3<f64>> = None;
    goals
        .map(|goal| {
            let here = match at.map(|here| (here, goal - here)) {
                Some((here, way)) if way.norm() > step => here + way * (step / way.norm()),
                // To the bit.
                _ => *goal,
            };
            at = Some(here);
            here
        })
        .collect()
}

/// Fills gaps by linear interpolation, constant at both ends.
fn between(values: &[Option<Vector3<f64>>]) -> Vec<Vector3<f64>> {
    let known: Vec<(usize, Vector3<f64>)> =
        values.iter().enumerate().filter_map(|(t, v)| v.map(|v| (t, v))).collect();
    (0..values.len())
        .map(|t| {
            let after = known.partition_point(|k| k.0 < t);
            match (after.checked_sub(1).map(|i| known[i]), known.get(after)) {
                (_, Some(&(at, v))) if at == t => v,
                (Some((a, v)), Some(&(b, w))) => v.lerp(&w, (t - a) as f64 / (b - a) as f64),
                (Some((_, v)), None) | (None, Some(&(_, v))) => v,
                (None, None) => Vector3::zeros(),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_filled() {
        let v = |x: f64| Some(Vector3::new(x, 0.0, 0.0));
        let values = [None, v(1.0), None, None, None, v(5.0), None];
        let filled: Vec<f64> = between(&values).iter().map(|v| v.x).collect();
        assert_eq!(filled, [1.0, 1.0, 2.0, 3.0, 4.0, 5.0, 5.0]);
        assert!(between(&[None, None]).iter().all(|v| *v == Vector3::zeros()));
    }

    #[test]
    fn a_leap_of_the_root_is_spread_about_its_middle() {
        let leap: Vec<_> = (0..20).map(|t| Vector3::new(0.0, if t < 10 { 0.0 } else { 1.0 }, 0.0)).collect();
        let slow = slowed(&leap, 0.2);
        assert!(slow.windows(2).all(|pair| (pair[1] - pair[0]).norm() < 0.2 + 1e-9), "{slow:?}");
        assert!((slow[9].y + slow[10].y - 1.0).abs() < 1e-9, "{slow:?}");
        assert_eq!((slow[0], slow[19]), (leap[0], leap[19]));
        assert_eq!(slowed(&leap, 1.5), leap);
    }

    #[test]
    fn plants_are_counted_by_what_is_left_of_them() {
        let stands = |text: &str| text.chars().map(|c| [c == 'x', false]).collect::<Vec<_>>();
        let found = Footplants::count(&stands("xx.xxx.xx"), &stands("xx.xx...."));
        assert_eq!(found, Footplants { all: 3, dropped: 1, shortened: 1 });
        assert!(
            found
                .doubt()
                .unwrap()
                .starts_with("of 3 footplants of the clip, 1 are not held, and 1 for a part")
        );
        assert_eq!(Footplants { all: 3, ..Footplants::default() }.doubt(), None);
    }
}
