//! Faults of a stream of poses: frames that are missing, come twice, come late or come damaged.
//!
//! The core steps what arrives, in the order in which it arrives, as a firmware does that takes poses from a radio or
//! a tracker without asking for them again. (A [`link`](crate::link) asks again, and delivers a whole stream.)

use std::str::FromStr;

use gestus_database::{
    list::{self, ListError},
    stream::Streamed,
};
use gestus_motion::clip::{Clip, Frame, Skeleton};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use crate::link::noise::PROBABILITY;

/// Error below which a stream is back, metres: mean distance of the joints.
pub const BACK_M: f64 = 0.01;

/// Faults and how likely each is, a frame. Written as `drop=0.01,repeat=0.02,delay=0.05:3,corrupt=0.01,seed=7`;
/// parts in any order, those left out are 0:
///
/// | part | what happens to a frame |
/// |---|---|
/// | `drop=P` | it does not arrive |
/// | `repeat=P` | it arrives twice, and is stepped twice |
/// | `delay=P:N` | it arrives one to N frames later, behind those |
/// | `corrupt=P` | one bit of one of its numbers is another |
/// | `seed=N` | what the dice start from |
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Faults {
    /// A frame does not arrive.
    pub drop: f64,
    /// A frame arrives twice.
    pub repeat: f64,
    /// A frame arrives late.
    pub delay: f64,
    /// By how many frames at most.
    pub delay_frames: u32,
    /// A bit is another.
    pub corrupt: f64,
    /// What the dice start from.
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
        Ok(faults)
    }
}

/// A frame that arrives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Arrival {
    /// Which frame of the clip.
    pub frame: usize,
    /// The bit that is another: the number of the pose's value, and of its bit.
    pub flipped: Option<(usize, u32)>,
}

/// What arrives of a clip, in order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Arrivals {
    /// The frames.
    pub all: Vec<Arrival>,
    /// Frames of the clip.
    pub sent: usize,
    /// Of these, how many did not arrive.
    pub dropped: usize,
    /// How many arrived twice.
    pub repeated: usize,
    /// How many arrived late.
    pub delayed: usize,
    /// How many arrived with another bit.
    pub corrupted: usize,
}

impl Faults {
    /// What arrives of so many frames with so many joints.
    pub fn arrivals(&self, frames: usize, joints: usize) -> Arrivals {
        let mut dice = ChaCha8Rng::seed_from_u64(self.seed);
        let hits = |p: f64, dice: &mut ChaCha8Rng| p > 0.0 && dice.random_bool(p);
        let mut arrivals =
            Arrivals { all: Vec::new(), sent: frames, dropped: 0, repeated: 0, delayed: 0, corrupted: 0 };
        // Frames with the time of their arrival: behind the frames that were sent until then.
        let mut timed = Vec::new();
        for frame in 0..frames {
            if hits(self.drop, &mut dice) {
                arrivals.dropped += 1;
                continue;
            }
            let mut time = frame;
            if hits(self.delay, &mut dice) {
                arrivals.delayed += 1;
                time += dice.random_range(1..=self.delay_frames) as usize;
            }
            let mut flipped = None;
            if hits(self.corrupt, &mut dice) {
                arrivals.corrupted += 1;
                flipped = Some((dice.random_range(0..3 + 4 * joints), dice.random_range(0..32)));
            }
            timed.push((time, time > frame, Arrival { frame, flipped }));
            if hits(self.repeat, &mut dice) {
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

    /// The clip as it arrives, undamaged: what joints do that the core does not see.
    pub fn order(&self, clip: &Clip) -> Clip {
        Clip { frames: self.all.iter().map(|a| clip.frames[a.frame].clone()).collect(), ..clip.clone() }
    }
}

/// A frame with one bit of one of its numbers, as the core takes them, changed.
fn flipped(frame: &Frame, value: usize, bit: u32) -> Frame {
    let mut frame = frame.clone();
    let flip = |v: f64| f64::from(f32::from_bits((v as f32).to_bits() ^ 1 << bit));
    if value < 3 {
        frame.root[value] = flip(frame.root[value]);
    } else if let Some(rotation) = frame.rotations.get_mut((value - 3) / 4) {
        let mut q: Quaternion<f64> = *rotation.quaternion();
        q.coords[(value - 3) % 4] = flip(q.coords[(value - 3) % 4]);
        // It may be no rotation any more: that is for the core to notice.
        *rotation = UnitQuaternion::new_unchecked(q);
    }
    frame
}

/// How a disturbed stream compares with the undisturbed one.
#[derive(Debug, Clone, PartialEq)]
pub struct Disturbance {
    /// Mean distance of the joints from where they would be, the bodies stood on one place, metres: of each step.
    pub error_m: Vec<f64>,
    /// Where the last output stands, from where it would, metres on the ground.
    pub drift_m: f64,
    /// Lengths of the runs of steps that are off by more than [`BACK_M`].
    pub runs: Vec<usize>,
    /// The last run goes on to the end of the stream.
    pub open: bool,
}

impl Disturbance {
    /// Compares, arrival by arrival, with the undisturbed output of the same frame.
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
                a.iter().zip(&b).map(|(a, b)| (a - b).norm()).sum::<f64>() / a.len().max(1) as f64
            })
            .collect();
        let drift_m =
            pairs().next_back().map_or(0.0, |(a, b)| f64::hypot(a.root.x - b.root.x, a.root.z - b.root.z));
        let mut runs = Vec::new();
        let mut length = 0;
        for &error in &error_m {
            if error > BACK_M {
                length += 1;
            } else if length > 0 {
                runs.push(std::mem::take(&mut length));
            }
        }
        if length > 0 {
            runs.push(length);
        }
        Self { error_m, drift_m, runs, open: length > 0 }
    }

    /// The figures.
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
            "back_at_the_end": !self.open,
        })
    }
}

fn centred(frame: &Frame, skeleton: &Skeleton) -> Vec<Vector3<f64>> {
    let mut frame = frame.clone();
    (frame.root.x, frame.root.z) = (0.0, 0.0);
    frame.positions(skeleton)
}

/// The figures in words.
pub fn words(figures: &Value) -> String {
    let number = |key: &str| figures[key].as_f64().unwrap_or(0.0);
    format!(
        "{} frames sent, {} delivered: {} dropped, {} repeated, {} late, {} corrupted\n\
         against the undisturbed stream: {:.2} cm off on average, {:.2} at worst; {} times off by more than 1 cm, back \
         within it after {:.1} frames on average and {} at most{}; at the end {:.1} cm from its place",
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
        if figures["back_at_the_end"] == json!(true) { "" } else { " (still off at the end)" },
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
            assert!(matches!(error, ListError::Value { item, value, .. } if item == text && value == bad));
        }
        assert!(matches!("dorp=0.1".parse::<Faults>(), Err(ListError::Name { name, .. }) if name == "dorp"));
    }

    #[test]
    fn each_fault_does_what_it_says() {
        let run = |text: &str| text.parse::<Faults>().expect("it is right").arrivals(1000, 21);
        let frames = |a: &Arrivals| a.all.iter().map(|a| a.frame).collect::<Vec<_>>();
        let plain: Vec<usize> = (0..1000).collect();
        assert_eq!(frames(&run("seed=1")), plain);
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
        // A frame that is n late stands behind the n that were sent meanwhile, or fewer where those are late too.
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
                    // Signalling NaN may come back as quiet ones.
                    let nan = f32::from_bits(*b).is_nan();
                    assert!(nan || a ^ b == if at == value { 1 << bit } else { 0 }, "{value} {bit} {at}");
                }
            }
        }
    }
}
