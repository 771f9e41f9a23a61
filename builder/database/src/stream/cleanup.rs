//! Removes foot skate from a whole clip, using later frames.
//!
//! Kovar, Schreiner and Gleicher 2002, "Footskate cleanup for motion capture editing", as the statistical-transfer
//! paper uses it (section 6):
//!
//! 1. **Positions.** Each footplant, a run of frames in contact, gets one position on the floor for the joint that carries
//!    the foot, the lower of ankle and toes: the one nearest to its positions in these frames. The offset of a foot is the
//!    translation to that position in each frame.
//! 2. **Root.** The root takes the mean offset of the standing feet, interpolated between plants and smoothed over a window,
//!    and moves close enough for every leg to reach, within bounds. What is no plant of these poses, or stays out of reach,
//!    is let go ([`Footplants`]).
//! 3. **Legs.** Each ankle reaches its target by the core's analytic inverse kinematics
//!    ([`gestus_core::body::two_bone_ik`]); the foot keeps its orientation.
//! 4. **Smoothing.** Offsets fade in and out over the window before and after a plant.
//! 5. **Floor.** A foot in the air that is more than 1 cm below the floor is lifted by its leg. The papers do not say.
//!
//! A stream has [`gestus_core::output::foot_lock`] instead, which uses no later frames.

use gestus_core::{
    Database, Pose,
    blob::{Leg, layout::MAX_JOINTS},
    body::two_bone_ik::Chain,
    math::distance,
    math::quaternion,
    output::foot_lock::held_fraction,
};
use nalgebra::Vector3;

use crate::{
    registration::contact::{GAUSSIAN_S, contacts, legs, smoothed},
    retarget::body::{ANKLE, is_over_sole},
    stream::{
        Streamed,
        footplants::{Footplants, Held, STRETCH, over, slid, vector},
        from_pose, to_pose,
    },
};
use gestus_motion::{
    body::Body,
    clip::{Clip, Frame},
    corpus::Corpus,
    landmarks::Landmarks,
    statistics::smoothstep,
};

/// Depth below the floor from which a foot is lifted, metres: that of [`gestus_core::output::foot_lock`]. Its constants are
/// `f32`, and 1 cm in `f32` is other bits in `f64`.
const DEEP_M: f64 = 0.01;
/// Depth from which a foot is not lifted, metres: the body is elsewhere, as for the foot lock.
const ELSEWHERE_M: f64 = 0.4;

/// Height of the toes above their sole, in lengths of the leg.
const TOE: f64 = 0.025;

/// Default window, seconds.
pub const WINDOW_S: f64 = 0.25;

/// The legs of a skeleton: a database's, or a clip's own.
#[derive(Debug, Clone)]
pub struct Limbs {
    legs: [Leg; 2],
    parents: Vec<Option<usize>>,
    offsets: Vec<[f32; 3]>,
    /// From the right to the left hip joint, in the root's frame.
    side: [f32; 3],
}

impl Limbs {
    /// The legs of a database; `None` if it has no section of feet.
    pub fn of_database(database: &Database<'_>) -> Option<Self> {
        let joints: Vec<_> = (0..database.counts().joints).map(|j| database.joint(j)).collect();
        Some(Self {
            legs: database.legs()?,
            parents: joints.iter().map(|j| j.parent).collect(),
            offsets: joints.iter().map(|j| j.offset).collect(),
            side: database.hips_line(),
        })
    }

    /// The legs of a clip's body, and its contacts; sole heights are measured in the clip. `None` if the skeleton has more
    /// joints than a pose of the core, or there are no contacts.
    pub fn of_clip(body: &Body, clip: &Clip) -> Option<(Self, Vec<[bool; 2]>)> {
        Self::of_landmarks(&body.landmarks, body.hips_line, clip)
    }

    /// The same, of those legs; `line` points from the right hip joint to the left one, in the root's frame.
    pub fn of_landmarks(m: &Landmarks, line: Vector3<f64>, clip: &Clip) -> Option<(Self, Vec<[bool; 2]>)> {
        let (skeleton, stands) = (&clip.skeleton, contacts(clip, m));
        if skeleton.joints() > MAX_JOINTS || !stands.iter().flatten().any(|s| *s) {
            return None;
        }
        let mut corpus = Corpus::of_clip(clip);
        corpus.examples[0].contacts.clone_from(&stands);
        let float = |v: &Vector3<f64>| [v.x as f32, v.y as f32, v.z as f32];
        let limbs = Self {
            legs: legs(&[&corpus.examples[0]], m),
            parents: skeleton.parents.clone(),
            offsets: skeleton.offsets.iter().map(float).collect(),
            side: float(&line),
        };
        Some((limbs, stands))
    }

    /// The same legs with standing heights that fit a floor: those of feet that did not stand on it are an adult foot's,
    /// for legs of that length, metres.
    pub fn standing_on(mut self, floor_m: f64, leg_m: f64) -> Self {
        for leg in &mut self.legs {
            for (height, sole) in leg.heights.iter_mut().zip([ANKLE, TOE]) {
                let over = f64::from(*height) - floor_m;
                if !is_over_sole(over, leg_m) {
                    *height = (floor_m + sole * leg_m) as f32;
                }
            }
        }
        self
    }

    /// The legs, left and right.
    pub fn legs(&self) -> &[Leg; 2] {
        &self.legs
    }

    /// A leg of a pose, by forward kinematics: what [`Chain::of`] does for a database.
    fn chain(&self, side: usize, pose: &Pose<MAX_JOINTS>) -> Chain {
        let leg = &self.legs[side];
        let turn = |joint: usize| pose.rotations[joint];
        let (mut parent, mut hip) = (quaternion::IDENTITY, self.offsets[leg.hip]);
        let mut above = self.parents[leg.hip];
        while let Some(joint) = above {
            hip = quaternion::rotate(turn(joint), hip);
            parent = quaternion::multiply(turn(joint), parent);
            above = self.parents[joint];
            hip = plus(hip, if above.is_some() { self.offsets[joint] } else { pose.position });
        }
        let thigh = quaternion::multiply(parent, turn(leg.hip));
        let knee = plus(hip, quaternion::rotate(thigh, self.offsets[leg.knee]));
        let shin = quaternion::multiply(thigh, turn(leg.knee));
        let ankle = plus(knee, quaternion::rotate(shin, self.offsets[leg.ankle]));
        let foot = quaternion::multiply(shin, turn(leg.ankle));
        let toe = leg.toe.map_or(ankle, |toe| plus(ankle, quaternion::rotate(foot, self.offsets[toe])));
        let side = quaternion::rotate(turn(0), self.side);
        Chain { parent, turns: [thigh, shin, foot], hip, knee, ankle, toe, side }
    }
}

fn plus(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|i| a[i] + b[i])
}

/// Cleans a stream's output, whose feet were not held while streaming; contacts are its likelihoods, smoothed by the paper's
/// Gaussian. `window` is how many frames a change is spread over.
/// Without legs in the database everything stays as it is.
pub fn clean_up(database: &Database<'_>, streamed: &mut Streamed, window: usize) {
    let Some(limbs) = Limbs::of_database(database) else { return };
    let likelihoods: Vec<[f64; 2]> =
        streamed.steps.iter().map(|s| s.report.contact_likelihood.map(f64::from)).collect();
    let mut stands = smoothed(&likelihoods, GAUSSIAN_S * f64::from(database.rate_hz()));
    let frames: Vec<Frame> = streamed.steps.iter().map(|s| s.frame.clone()).collect();
    end_in_time(&limbs, &frames, f64::from(database.rate_hz()), &mut stands);
    let cleaned = clean(&limbs, &frames, &stands, window, f64::from(database.rate_hz()));
    for ((step, frame), stands) in streamed.steps.iter_mut().zip(cleaned.frames).zip(cleaned.stands) {
        step.frame = frame;
        step.report.contacts = stands;
    }
}

/// Votes to stand end late: in its second half a footplant ends where the foot slides as one that leaves.
fn end_in_time(limbs: &Limbs, frames: &[Frame], rate_hz: f64, stands: &mut [[bool; 2]]) {
    let poses: Vec<Pose<MAX_JOINTS>> = frames.iter().map(to_pose).collect();
    for (side, leg) in limbs.legs.iter().enumerate() {
        let chains: Vec<Chain> = poses.iter().map(|pose| limbs.chain(side, pose)).collect();
        let leaves = |t: usize| {
            let moved = slid(&chains[t], leg, &chains[t - 1]);
            let speed = moved.x.hypot(moved.z) * rate_hz;
            held_fraction(speed as f32, over(&chains[t], leg).map(|over| over as f32)) < 1.0
        };
        let mut start = 0;
        while start < stands.len() {
            let end = (start..stands.len()).find(|&t| !stands[t][side]).unwrap_or(stands.len());
            let last = ((start + end).div_ceil(2).max(start + 1)..end).find(|&t| leaves(t)).unwrap_or(end);
            for stands in &mut stands[last..end] {
                stands[side] = false;
            }
            start = end + 1;
        }
    }
}

/// Poses without foot skate.
#[derive(Debug, Clone)]
pub struct Cleaned {
    /// The poses.
    pub frames: Vec<Frame>,
    /// Which foot stands in them. Shape `[frames]`.
    pub stands: Vec<[bool; 2]>,
    /// What became of the plants of the contacts.
    pub footplants: Footplants,
}

/// The poses with their feet where they stand: as in the contacts, but for plants that the feet do not have.
pub fn clean(
    limbs: &Limbs,
    frames: &[Frame],
    contacts: &[[bool; 2]],
    window: usize,
    rate_hz: f64,
) -> Cleaned {
    let legs = limbs.legs;
    let mut poses: Vec<Pose<MAX_JOINTS>> = frames.iter().map(to_pose).collect();
    let chains = |poses: &[Pose<MAX_JOINTS>]| -> Vec<[Chain; 2]> {
        poses.iter().map(|p| [0, 1].map(|side| limbs.chain(side, p))).collect()
    };
    let before = chains(&poses);
    let Held { stands, offsets: plants, shifts } = Held::of(&before, &legs, contacts, window, rate_hz);
    for (pose, shift) in poses.iter_mut().zip(&shifts) {
        for (slot, shift) in pose.position.iter_mut().zip(shift.iter()) {
            *slot += *shift as f32;
        }
    }
    // The legs take the part of the offsets that the root does not; it fades out around the plants.
    for side in [0, 1] {
        let own: Vec<Option<Vector3<f64>>> =
            plants.iter().zip(&shifts).map(|(p, s)| p[side].map(|p| p - s)).collect();
        let faded = fade(&own, window);
        for ((pose, before), (offset, shift)) in poses.iter_mut().zip(&before).zip(faded.iter().zip(&shifts))
        {
            let leg = &legs[side];
            let moved = *offset + *shift;
            let ankle = vector(before[side].ankle) + moved;
            let chain = limbs.chain(side, pose);
            let reach =
                (STRETCH * f64::from(chain.length())).max((vector(chain.ankle) - vector(chain.hip)).norm());
            if offset.norm() > 1e-6 {
                chain.place(leg, [ankle.x as f32, ankle.y as f32, ankle.z as f32], reach as f32, pose);
            }
        }
    }
    let footplants = Footplants::count(contacts, &stands);
    Cleaned { frames: lifted(limbs, poses), stands, footplants }
}

/// The poses with their ankles where those of other poses are, as far as legs reach; the feet keep their orientation.
pub fn with_ankles_of(limbs: &Limbs, frames: &[Frame], others: &[Frame]) -> Vec<Frame> {
    let placed = |(frame, other): (&Frame, &Frame)| {
        let mut pose = to_pose::<MAX_JOINTS>(frame);
        let other = to_pose::<MAX_JOINTS>(other);
        for (side, leg) in limbs.legs.iter().enumerate() {
            let chain = limbs.chain(side, &pose);
            let reach = (STRETCH * f64::from(chain.length())) as f32;
            chain.place(leg, limbs.chain(side, &other).ankle, reach, &mut pose);
        }
        from_pose(&pose, limbs.parents.len())
    };
    frames.iter().zip(others).map(placed).collect()
}

/// The poses with no foot further than `DEEP_M` below where it stands: those that are, are lifted by their legs.
pub fn above_floor(limbs: &Limbs, frames: &[Frame]) -> Vec<Frame> {
    lifted(limbs, frames.iter().map(to_pose).collect())
}

fn lifted(limbs: &Limbs, mut poses: Vec<Pose<MAX_JOINTS>>) -> Vec<Frame> {
    poses.iter_mut().for_each(|pose| lift_feet(limbs, pose));
    poses.iter().map(|p| from_pose(p, limbs.parents.len())).collect()
}

/// Lifts the feet of a pose that are further than `DEEP_M` below where they stand, by their legs.
fn lift_feet(limbs: &Limbs, pose: &mut Pose<MAX_JOINTS>) {
    for (side, leg) in limbs.legs.iter().enumerate() {
        let chain = limbs.chain(side, pose);
        let [ankle, toe] = over(&chain, leg);
        let over = ankle.min(toe);
        if (-ELSEWHERE_M..-DEEP_M).contains(&over) {
            let [x, y, z] = chain.ankle;
            let reach = distance(chain.ankle, chain.hip).max(chain.length());
            chain.place(leg, [x, y - (DEEP_M + over) as f32, z], reach, pose);
        }
    }
}

/// Offsets in plants as they are; around them they fade by a smoothstep over the window, nearest plant first.
fn fade(values: &[Option<Vector3<f64>>], window: usize) -> Vec<Vector3<f64>> {
    (0..values.len())
        .map(|t| {
            if let Some(v) = values[t] {
                return v;
            }
            let near = |reach: &dyn Fn(usize) -> Option<usize>| {
                (1..=window).find_map(|d| values.get(reach(d)?).copied().flatten().map(|v| (d, v)))
            };
            let part = |found: Option<(usize, Vector3<f64>)>| {
                found
                    .map_or(Vector3::zeros(), |(d, v)| v * (1.0 - smoothstep(d as f64 / (window + 1) as f64)))
            };
            part(near(&|d| t.checked_sub(d))) + part(near(&|d| Some(t + d)))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        build::{BuildOptions, build},
        stream::{Request, stream},
        synth,
    };

    #[test]
    fn plants_fade() {
        let v = |x: f64| Some(Vector3::new(x, 0.0, 0.0));
        let faded: Vec<f64> = fade(&[v(1.0), None, None, None, None, None], 2).iter().map(|v| v.x).collect();
        assert_eq!(faded[0], 1.0);
        assert!(faded[1] > faded[2] && faded[2] > 0.0 && faded[3] == 0.0, "{faded:?}");
    }

    /// A dip of 17 ms in a likelihood is noise at any rate. The Gaussian was a number of frames, half as long at 60 Hz,
    /// and the dip lifted a foot.
    #[test]
    fn contacts_are_smoothed_over_as_long_at_any_rate() {
        let corpus = synth::corpus(&synth::Options {
            rate_hz: 60.0,
            actions: vec!["walk".into()],
            styles: ["neutral", "old"].map(String::from).to_vec(),
            clips: 1,
            seconds: 3.0,
            ..synth::Options::default()
        })
        .unwrap();
        let built = build(&corpus, &BuildOptions { models: false, ..BuildOptions::default() }).unwrap();
        let database = Database::open(&built.bytes).unwrap();
        let mut streamed = stream(&database, &corpus.examples[0].clip, &Request::style(1), &mut ()).unwrap();
        let dip = streamed.steps.len() / 2;
        let standing = streamed.steps[0].frame.clone();
        for (t, step) in streamed.steps.iter_mut().enumerate() {
            step.frame.clone_from(&standing);
            step.report.contact_likelihood = if t == dip { [0.0, 1.0] } else { [1.0, 0.0] };
        }
        clean_up(&database, &mut streamed, 15);
        assert!(streamed.steps.iter().all(|step| step.report.contacts == [true, false]));
    }

    /// Feet that do not stand were left in the floor, by up to 10 cm.
    #[test]
    fn feet_in_the_air_are_lifted_out_of_the_floor() {
        let clip = synth::performance(3, "walk", "neutral", 30.0, 4.0).unwrap().clip;
        let body = Body::of(&Corpus::of_clip(&clip)).unwrap();
        let (limbs, mut stands) = Limbs::of_clip(&body, &clip).unwrap();
        let mut frames = clip.frames.clone();
        for (t, frame) in frames.iter_mut().enumerate().skip(40).take(20) {
            stands[t] = [false; 2];
            frame.root.y -= 0.08 * (f64::from(t as u32 - 40) / 19.0 * std::f64::consts::PI).sin();
        }
        let lowest = |frames: &[Frame]| {
            let of = |frame: &Frame, side| {
                let [ankle, toe] = over(&limbs.chain(side, &to_pose(frame)), &limbs.legs[side]);
                ankle.min(toe)
            };
            frames.iter().flat_map(|frame| [of(frame, 0), of(frame, 1)]).fold(f64::INFINITY, f64::min)
        };
        assert!(lowest(&frames) < -0.05, "{}", lowest(&frames));
        let cleaned = clean(&limbs, &frames, &stands, 7, 30.0).frames;
        assert!(lowest(&cleaned) > -DEEP_M - 1e-3, "{}", lowest(&cleaned));
        // A body that is elsewhere stays as it is there.
        let far: Vec<Frame> =
            frames.iter().map(|f| Frame { root: f.root - Vector3::y() * 2.0, ..f.clone() }).collect();
        let none = vec![[false; 2]; far.len()];
        for (cleaned, far) in clean(&limbs, &far, &none, 7, 30.0).frames.iter().zip(&far) {
            assert!(cleaned.angle_to(far) < 1e-3);
        }
    }
}
