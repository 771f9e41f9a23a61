//! What a line does to bytes, by a seeded specification.

use std::{fmt::Write as _, str::FromStr, time::Duration};

use gestus_database::list::{self, ListError};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What the value of most parts is.
pub const PROBABILITY: &str = "a probability from 0 to 1, as in drop=0.001";

/// Faults of a line and how likely each is. Written as `lose=0.001,corrupt=0.001,seed=7`; parts in any order, those
/// left out are 0:
///
/// | part | what | probability of |
/// |---|---|---|
/// | `lose=P` | the byte is missing | a byte |
/// | `double=P` | the byte comes twice | a byte |
/// | `corrupt=P` | the byte has other bits | a byte |
/// | `drop=P` | nothing of the frame arrives | a frame |
/// | `repeat=P` | the frame comes twice | a frame |
/// | `cut=P` | the frame ends at some byte | a frame |
/// | `delay=P:MS` | the frame, and all behind it, comes up to MS milliseconds later | a frame |
/// | `seed=N` | what the dice start from | |
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Noise {
    /// A byte is missing.
    pub lose: f64,
    /// A byte comes twice.
    pub double: f64,
    /// A byte has other bits.
    pub corrupt: f64,
    /// A frame is missing.
    pub drop: f64,
    /// A frame comes twice.
    pub repeat: f64,
    /// A frame ends at some byte.
    pub cut: f64,
    /// A frame comes late.
    pub delay: f64,
    /// By how much at most, milliseconds.
    pub delay_ms: u32,
    /// What the dice start from.
    pub seed: u64,
}

impl FromStr for Noise {
    type Err = ListError;

    fn from_str(text: &str) -> Result<Self, ListError> {
        let mut noise = Self::default();
        for item in list::items(text) {
            let slot = match item.name {
                "lose" => &mut noise.lose,
                "double" => &mut noise.double,
                "corrupt" => &mut noise.corrupt,
                "drop" => &mut noise.drop,
                "repeat" => &mut noise.repeat,
                "cut" => &mut noise.cut,
                "delay" => {
                    let (p, ms) = item.pair("PROBABILITY:MILLISECONDS, as in delay=0.05:300")?;
                    noise.delay_ms = item.parse(ms, .., "a number of milliseconds")?;
                    noise.delay = item.parse(p, 0.0..=1.0, PROBABILITY)?;
                    continue;
                }
                "seed" => {
                    noise.seed = item.number(.., "a whole number")?;
                    continue;
                }
                _ => return Err(item.unknown("lose, double, corrupt, drop, repeat, cut, delay and seed")),
            };
            *slot = item.number(0.0..=1.0, PROBABILITY)?;
        }
        Ok(noise)
    }
}

/// What happened to a line's bytes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Happened {
    /// Bytes missing.
    pub lost_bytes: u64,
    /// Bytes that came twice.
    pub doubled_bytes: u64,
    /// Bytes with other bits.
    pub corrupted_bytes: u64,
    /// Frames missing.
    pub dropped_frames: u64,
    /// Frames that came twice.
    pub repeated_frames: u64,
    /// Frames that ended early.
    pub cut_frames: u64,
    /// Frames that came late.
    pub delayed_frames: u64,
}

impl Happened {
    /// Everything that happened, by name.
    pub fn all(&self) -> [(&'static str, u64); 7] {
        [
            ("lost_bytes", self.lost_bytes),
            ("doubled_bytes", self.doubled_bytes),
            ("corrupted_bytes", self.corrupted_bytes),
            ("dropped_frames", self.dropped_frames),
            ("repeated_frames", self.repeated_frames),
            ("cut_frames", self.cut_frames),
            ("delayed_frames", self.delayed_frames),
        ]
    }
}

impl std::fmt::Display for Happened {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut text = String::new();
        for (name, count) in self.all().into_iter().filter(|(_, count)| *count > 0) {
            let separator = if text.is_empty() { "" } else { ", " };
            write!(text, "{separator}{count} {}", name.replace('_', " "))?;
        }
        f.write_str(if text.is_empty() { "nothing" } else { &text })
    }
}

/// A line's faults, as they happen.
#[derive(Debug, Clone)]
pub struct Disturber {
    noise: Noise,
    dice: ChaCha8Rng,
    /// What happened so far.
    pub happened: Happened,
}

impl Disturber {
    /// The faults of a specification, from their seed on. `way` tells apart the directions of one line.
    pub fn new(noise: Noise, way: u64) -> Self {
        let mut dice = ChaCha8Rng::seed_from_u64(noise.seed);
        dice.set_stream(way);
        Self { noise, dice, happened: Happened::default() }
    }

    /// What arrives of a frame, and how late.
    pub fn disturb(&mut self, frame: &[u8]) -> (Vec<u8>, Duration) {
        let noise = self.noise;
        let mut late = Duration::ZERO;
        if self.hits(noise.delay) {
            self.happened.delayed_frames += 1;
            late = Duration::from_micros(self.dice.random_range(0..=u64::from(noise.delay_ms) * 1000));
        }
        if self.hits(noise.drop) {
            self.happened.dropped_frames += 1;
            return (Vec::new(), late);
        }
        let mut bytes = frame.to_vec();
        if self.hits(noise.repeat) {
            self.happened.repeated_frames += 1;
            bytes.extend_from_slice(frame);
        }
        if self.hits(noise.cut) && !bytes.is_empty() {
            self.happened.cut_frames += 1;
            bytes.truncate(self.dice.random_range(0..bytes.len()));
        }
        let mut arrived = Vec::with_capacity(bytes.len());
        for mut byte in bytes {
            if self.hits(noise.lose) {
                self.happened.lost_bytes += 1;
                continue;
            }
            if self.hits(noise.corrupt) {
                self.happened.corrupted_bytes += 1;
                byte ^= self.dice.random_range(1..=u8::MAX);
            }
            arrived.push(byte);
            if self.hits(noise.double) {
                self.happened.doubled_bytes += 1;
                arrived.push(byte);
            }
        }
        (arrived, late)
    }

    fn hits(&mut self, probability: f64) -> bool {
        probability > 0.0 && self.dice.random_bool(probability)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_specification_is_read_and_wrong_ones_are_explained() {
        let noise: Noise = "lose=0.001, delay=0.05:300,seed=7".parse().expect("it is right");
        assert_eq!(noise, Noise { lose: 0.001, delay: 0.05, delay_ms: 300, seed: 7, ..Noise::default() });
        assert_eq!("".parse::<Noise>().expect("nothing is fine"), Noise::default());
        for text in ["lose", "delay=0.1"] {
            assert!(matches!(text.parse::<Noise>(), Err(ListError::Missing { item, .. }) if item == text));
        }
        for (text, bad) in [
            ("lose=often", "often"),
            ("lose=1.5", "1.5"),
            ("lose=-0.1", "-0.1"),
            ("lose=NaN", "NaN"),
            ("delay=0.1:soon", "soon"),
            ("seed=x", "x"),
        ] {
            let error = text.parse::<Noise>().expect_err(text);
            assert!(matches!(error, ListError::Value { item, value, .. } if item == text && value == bad));
        }
        assert!(matches!("loose=0.1".parse::<Noise>(), Err(ListError::Name { name, .. }) if name == "loose"));
    }

    #[test]
    fn each_fault_does_what_it_says_as_often_as_it_says() {
        let frame: Vec<u8> = (0..100).collect();
        let run = |text: &str| {
            let mut disturber = Disturber::new(text.parse().expect("it is right"), 0);
            let arrived: Vec<_> = (0..200).map(|_| disturber.disturb(&frame)).collect();
            (arrived, disturber.happened)
        };
        let (arrived, happened) = run("seed=3");
        assert!(arrived.iter().all(|(bytes, late)| *bytes == frame && late.is_zero()));
        assert_eq!(happened, Happened::default());
        // Of 20,000 bytes and 200 frames: expected counts give or take six standard deviations.
        let near = |count: u64, trials: f64, p: f64| {
            let spread = 6.0 * (trials * p * (1.0 - p)).sqrt();
            assert!((count as f64 - trials * p).abs() < spread, "{count} of {trials} at {p}");
        };
        let (arrived, happened) = run("lose=0.02,seed=3");
        let missing: usize = arrived.iter().map(|(bytes, _)| 100 - bytes.len()).sum();
        assert_eq!(missing as u64, happened.lost_bytes);
        near(happened.lost_bytes, 2e4, 0.02);
        let (arrived, happened) = run("double=0.02,seed=3");
        assert_eq!(arrived.iter().map(|(b, _)| b.len() - 100).sum::<usize>() as u64, happened.doubled_bytes);
        near(happened.doubled_bytes, 2e4, 0.02);
        let (arrived, happened) = run("corrupt=0.02,seed=3");
        let wrong = |bytes: &Vec<u8>| bytes.iter().zip(&frame).filter(|(a, b)| a != b).count() as u64;
        assert_eq!(arrived.iter().map(|(b, _)| wrong(b)).sum::<u64>(), happened.corrupted_bytes);
        near(happened.corrupted_bytes, 2e4, 0.02);
        let (arrived, happened) = run("drop=0.2,seed=3");
        assert_eq!(arrived.iter().filter(|(b, _)| b.is_empty()).count() as u64, happened.dropped_frames);
        near(happened.dropped_frames, 200.0, 0.2);
        let (arrived, happened) = run("repeat=0.2,seed=3");
        assert_eq!(arrived.iter().filter(|(b, _)| b.len() == 200).count() as u64, happened.repeated_frames);
        near(happened.repeated_frames, 200.0, 0.2);
        let (arrived, happened) = run("cut=0.2,seed=3");
        assert_eq!(arrived.iter().filter(|(b, _)| b.len() < 100).count() as u64, happened.cut_frames);
        near(happened.cut_frames, 200.0, 0.2);
        let (arrived, happened) = run("delay=0.2:50,seed=3");
        let late = arrived.iter().filter(|(_, late)| !late.is_zero()).count() as u64;
        assert!(late <= happened.delayed_frames && late + 2 >= happened.delayed_frames);
        assert!(arrived.iter().all(|(_, late)| *late <= Duration::from_millis(50)));
        near(happened.delayed_frames, 200.0, 0.2);
    }

    #[test]
    fn the_seed_decides_and_the_ways_differ() {
        let noise: Noise = "corrupt=0.1,seed=3".parse().expect("it is right");
        let run = |noise, way| Disturber::new(noise, way).disturb(&[0; 200]);
        assert_eq!(run(noise, 0), run(noise, 0));
        assert_ne!(run(noise, 0), run(noise, 1));
        assert_ne!(run(noise, 0), run(Noise { seed: 4, ..noise }, 0));
    }
}
