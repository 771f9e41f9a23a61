//! Faults of a stream of poses: frames that are lost, repeated, late or corrupted.
//!
//! The core steps the frames that arrive, in the order of their arrival, as on a board that receives poses from a radio
//! or a tracker without retransmission. (The [`link`](crate::link) does retransmit, and loses nothing.)

use std::str::FromStr;

use gestus_database::{
    list::{self, ListError},
    stream::Streamed,
};
use gestus_motion::clip::{Clip, Frame, Skeleton, joint_distance};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use crate::link::noise::PROBABILITY;

/// Error below which a stream has recovered, metres: mean distance of the joints.
pub const RECOVERED_M: f64 = 0.01;

/// The probability of each fault in a frame. Parsed from `drop=0.01,repeat=0.02,delay=0.05:3,corrupt=0.01,seed=7`; the
/// parts may come in any order and default to 0, and one has to be a fault:
///
/// | part | effect on a frame |
/// |---|---|
/// | `drop=P` | it is lost |
/// | `repeat=P` | it arrives twice, and is stepped twice |
/// | `delay=P:N` | it arrives after the next frames, 1 to N of them |
/// | `corrupt=P` | one bit of one of its numbers is flipped |
/// | `seed=N` | seed of the random numbers |
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Faults {
    /// Probability that a frame is lost.
    pub drop: f64,
    /// Probability that a frame arrives twice.
    pub repeat: f64,
    /// Probability that a frame is late.
    pub delay: f64,
    /// Longest delay of a late frame, frames.
    pub delay_frames: u32,
    /// Probability that a bit is flipped.
    pub corrupt: f64,
    /// Seed of the random numbers.
    pub seed: u64,
}

impl FromStr for Faults {
    type Err = ListError;

    fn from_str(text: &str) -> Result<Self, ListError> {
        let mut faults = Self::default();
        for item in list::items(text) {
            match item.name {
                "drop" => faults.drop = item.number(0.0..=1.0, PROBABILITY)?,
                "repeat" => faults.repeat = item.number(0.0..=1.0, PROBABILITY)?,
                "corrupt" => faults.corrupt = item.number(0.0..=1.0, PROBABILITY)?,
                "delay" => {
                    let (p, frames) = item.pair("PROBABILITY:FRAMES, as in delay=0.05:3")?;
                    faults.delay = item.parse(p, 0.0..=1.0, PROBABILITY)?;
                    faults.delay_frames =
                        item.parse(frames, 1..=1000, "a number of frames from 1 to 1000")?;
                }
                "seed" => faults.seed = item.number(.., "a whole number")?,
                _ => return Err(item.unknown("drop, repeat, delay, corrupt and seed")),
            }
        }
        list::check_faults(text, "drop, repeat, delay and corrupt")?;
        Ok(faults)
    }
}

/// A frame that arrives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Arrival {
    /// Number of the frame in the clip.
    pub frame: usize,
    /// The flipped bit, if any: the index of the number in the pose, and of the bit in it.
    pub flipped: Option<(usize, u32)>,
}

/// The frames of a clip that arrive, in order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Arrivals {
    /// The frames that arrive.
    pub all: Vec<Arrival>,
    /// Frames of the clip.
    pub sent: usize,
    /// How many of these were lost.
    pub dropped: usize,
    /// How many arrived twice.
    pub repeated: usize,
    /// How many arrived late.
    pub delayed: usize,
    /// How many arrived with a flipped bit.
    pub corrupted: usize,
}

impl Faults {
    /// Draws the faults of a stream of that many frames and joints.
    pub fn arrivals(&self, frames: usize, joints: usize) -> Arrivals {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let occurs = |p: f64, rng: &mut ChaCha8Rng| p > 0.0 && rng.random_bool(p);
        let mut arrivals =
            Arrivals { all: Vec::new(), sent: frames, dropped: 0, repeated: 0, delayed: 0, corrupted: 0 };
        // Frames with their arrival time: a late frame follows those that were sent until then.
        let mut timed = Vec::new();
        for frame in 0..frames {
            if occurs(self.drop, &mut rng) {
                arrivals.dropped += 1;
                continue;
            }
            let mut time = frame;
            if occurs(self.delay, &mut rng) {
                arrivals.delayed += 1;
                time += rng.random_range(1..=self.delay_frames) as usize;
            }
            let mut flipped = None;
            if occurs(self.corrupt, &mut rng) {
                arrivals.corrupted += 1;
                flipped = Some((rng.random_range(0..3 + 4 * joints), rng.random_range(0..32)));
            }
            timed.push((time, time > frame, Arrival { frame, flipped }));
            if occurs(self.repeat, &mut rng) {
                arrivals.repeated += 1;
                timed.push((time, time > frame, Arrival { frame, flipped }));
            }
        }
        timed.sort_by_key(|&(time, late, arrival)| (time, late, arrival.frame));
        arrivals.all = timed.into_iter().map(|(_, _, arrival)| arrival).collect();
        arrivals
    }
}

impl Arrivals {
    /// The clip as it arrives.
    pub fn clip(&self, clip: &Clip) -> Clip {
        let frames = self.all.iter().map(|a| match a.flipped {
            Some((value, bit)) => flipped(&clip.frames[a.frame], value, bit),
            None => clip.frames[a.frame].clone(),
        });
        Clip { frames: frames.collect(), ..clip.clone() }
    }

    /// The frames as they arrive, but without flipped bits: for the joints that the core does not see.
    pub fn uncorrupted(&self, clip: &Clip) -> Clip {
        Clip { frames: self.all.iter().map(|a| clip.frames[a.frame].clone()).collect(), ..clip.clone() }
    }
}

/// Flips one bit of one number of a frame, in the core's `f32`.
fn flipped(frame: &Frame, value: usize, bit: u32) -> Frame {
    let mut frame = frame.clone();
    let flip = |v: f64| f64::from(f32::from_bits((v as f32).to_bits() ^ 1 << bit));
    if value < 3 {
        frame.root[value] = flip(frame.root[value]);
    } else if let Some(rotation) = frame.rotations.get_mut((value - 3) / 4) {
        let mut q: Quaternion<f64> = *rotation.quaternion();
        q.coords[(value - 3) % 4] = flip(q.coords[(value - 3) % 4]);
        // The result may not be a rotation: detecting that is the core's task.
        *rotation = UnitQuaternion::new_unchecked(q);
    }
    frame
}

/// How a disturbed stream compares with the undisturbed one.
#[derive(Debug, Clone, PartialEq)]
pub struct Disturbance {
    /// Mean distance of the joints between the two streams, both roots moved to the origin of the ground, metres, a
    /// step.
    pub error_m: Vec<f64>,
    /// Distance on the ground between the roots of the last outputs, metres.
    pub drift_m: f64,
    /// Lengths of the runs of consecutive steps with an error over [`RECOVERED_M`].
    pub runs: Vec<usize>,
    /// True if the last run lasts to the end of the stream.
    pub unrecovered: bool,
}

impl Disturbance {
    /// Compares each output with the undisturbed output of the same frame.
    pub fn new(
        skeleton: &Skeleton,
        undisturbed: &Streamed,
        disturbed: &Streamed,
        arrivals: &Arrivals,
    ) -> Self {
        let pairs = || {
            arrivals
                .all
                .iter()
                .zip(&disturbed.steps)
                .map(|(a, s)| (&undisturbed.steps[a.frame].frame, &s.frame))
        };
        let error_m: Vec<f64> = pairs()
            .map(|(a, b)| {
                let (a, b) = (centred(a, skeleton), centred(b, skeleton));
                joint_distance(&a, &b)
            })
            .collect();
        let drift_m =
            pairs().next_back().map_or(0.0, |(a, b)| f64::hypot(a.root.x - b.root.x, a.root.z - b.root.z));
        let mut runs = Vec::new();
        let mut length = 0;
        for &error in &error_m {
            if error > RECOVERED_M {
                length += 1;
            } else if length > 0 {
                runs.push(std::mem::take(&mut length));
            }
        }
        if length > 0 {
            runs.push(length);
        }
        Self { error_m, drift_m, runs, unrecovered: length > 0 }
    }

    /// The figures as JSON.
    pub fn json(&self, arrivals: &Arrivals) -> Value {
        let count = self.error_m.len().max(1) as f64;
        let cm = |m: f64| m * 100.0;
        json!({
            "frames_sent": arrivals.sent,
            "frames_delivered": arrivals.all.len(),
            "frames_dropped": arrivals.dropped,
            "frames_repeated": arrivals.repeated,
            "frames_delayed": arrivals.delayed,
            "frames_corrupted": arrivals.corrupted,
            "error_mean_cm": cm(self.error_m.iter().sum::<f64>() / count),
            "error_worst_cm": cm(self.error_m.iter().copied().fold(0.0, f64::max)),
            "drift_end_cm": cm(self.drift_m),
            "times_off_by_1_cm": self.runs.len(),
            "frames_until_back_mean": self.runs.iter().sum::<usize>() as f64 / self.runs.len().max(1) as f64,
            "frames_until_back_max": self.runs.iter().max().unwrap_or(&0),
            "back_at_the_end": !self.unrecovered,
        })
    }
}

fn centred(frame: &Frame, skeleton: &Skeleton) -> Vec<Vector3<f64>> {
    let mut frame = frame.clone();
    (frame.root.x, frame.root.z) = (0.0, 0.0);
    frame.positions(skeleton)
}

/// The figures as text.
pub fn summary(figures: &Value) -> String {
    let number = |key: &str| figures[key].as_f64().unwrap_or(0.0);
    format!(
        "{} frames sent, {} delivered: {} dropped, {} repeated, {} late, {} corrupted\n\
         error against the undisturbed stream: {:.2} cm on average, {:.2} cm at most; {} times over 1 cm, for {:.1} \
         frames on average and {} at most{}; position at the end {:.1} cm off",
        figures["frames_sent"],
        figures["frames_delivered"],
        figures["frames_dropped"],
        figures["frames_repeated"],
        figures["frames_delayed"],
        figures["frames_corrupted"],
        number("error_mean_cm"),
        number("error_worst_cm"),
        figures["times_off_by_1_cm"],
        number("frames_until_back_mean"),
        figures["frames_until_back_max"],
        if figures["back_at_the_end"] == json!(true) { "" } else { " (not recovered at the end)" },
        number("drift_end_cm")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_specification_is_read_and_wrong_ones_are_explained() {
        let faults: Faults =
            "drop=0.01, repeat=0.02,delay=0.05:3,corrupt=0.01,seed=7".parse().expect("it is right");
        let expected =
            Faults { drop: 0.01, repeat: 0.02, delay: 0.05, delay_frames: 3, corrupt: 0.01, seed: 7 };
        assert_eq!(faults, expected);
        for text in ["drop", "delay=0.1"] {
            assert!(matches!(text.parse::<Faults>(), Err(ListError::Missing { item, .. }) if item == text));
        }
        for (text, bad) in [("drop=2", "2"), ("repeat=x", "x"), ("delay=0.1:0", "0"), ("seed=-1", "-1")] {
            let error = text.parse::<Faults>().expect_err(text);
            assert!(
                matches!(error, ListError::Value { name, value, .. } if text.starts_with(&format!("{name}=")) && value == bad)
            );
        }
        for text in ["", "seed=7"] {
            assert!(matches!(text.parse::<Faults>(), Err(ListError::Nothing { list, .. }) if list == text));
        }
        assert!(matches!("dorp=0.1".parse::<Faults>(), Err(ListError::Name { name, .. }) if name == "dorp"));
    }

    #[test]
    fn each_fault_does_what_it_says() {
        let run = |text: &str| text.parse::<Faults>().expect("it is right").arrivals(1000, 21);
        let frames = |a: &Arrivals| a.all.iter().map(|a| a.frame).collect::<Vec<_>>();
        let plain: Vec<usize> = (0..1000).collect();
        assert_eq!(frames(&run("drop=0,seed=1")), plain);
        let dropped = run("drop=0.1,seed=1");
        assert_eq!(dropped.all.len(), 1000 - dropped.dropped);
        assert!((60..140).contains(&dropped.dropped) && frames(&dropped).is_sorted());
        let repeated = run("repeat=0.1,seed=1");
        assert_eq!(repeated.all.len(), 1000 + repeated.repeated);
        let twice = repeated.all.windows(2).filter(|w| w[0] == w[1]).count();
        assert!(twice == repeated.repeated && frames(&repeated).is_sorted());
        let delayed = run("delay=0.1:3,seed=1");
        let mut order = frames(&delayed);
        assert!(!order.is_sorted());
        // A frame delayed by n follows the next n frames, or fewer if those are late too.
        assert!(order.iter().enumerate().all(|(at, &frame)| at.abs_diff(frame) <= 3));
        order.sort_unstable();
        assert_eq!(order, plain);
        let corrupted = run("corrupt=0.1,seed=1");
        assert_eq!(corrupted.all.iter().filter(|a| a.flipped.is_some()).count(), corrupted.corrupted);
        assert!((60..140).contains(&corrupted.corrupted) && frames(&corrupted) == plain);
        assert!(corrupted.all.iter().flat_map(|a| a.flipped).all(|(value, bit)| value < 87 && bit < 32));
        assert_eq!(run("drop=0.1,delay=0.1:2,seed=5"), run("drop=0.1,delay=0.1:2,seed=5"));
        assert_ne!(run("drop=0.1,seed=5"), run("drop=0.1,seed=6"));
    }

    #[test]
    fn a_flipped_bit_is_one_bit_of_what_the_core_takes() {
        let frame = Frame {
            root: Vector3::new(0.1, 0.9, -2.0),
            rotations: vec![UnitQuaternion::from_euler_angles(0.3, -0.2, 1.0); 4],
        };
        let numbers = |frame: &Frame| {
            let pose = gestus_database::stream::to_pose::<4>(frame);
            let all = pose.position.into_iter().chain(pose.rotations.as_flattened().iter().copied());
            all.map(f32::to_bits).collect::<Vec<_>>()
        };
        let before = numbers(&frame);
        for value in 0..19 {
            for bit in [0, 22, 23, 30, 31] {
                let after = numbers(&flipped(&frame, value, bit));
                for (at, (a, b)) in before.iter().zip(&after).enumerate() {
                    // A signalling NaN may become a quiet one.
                    let nan = f32::from_bits(*b).is_nan();
                    assert!(nan || a ^ b == if at == value { 1 << bit } else { 0 }, "{value} {bit} {at}");
                }
            }
        }
    }
}
