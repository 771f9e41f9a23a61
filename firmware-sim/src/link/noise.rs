//! Faults of a line, injected at random from a seed.

use std::{fmt::Write as _, str::FromStr, time::Duration};

use gestus_database::list::{self, ListError};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What an error says about the value of most parts.
pub const PROBABILITY: &str = "a probability from 0 to 1, as in drop=0.001";

/// The probability of each fault of a line. Parsed from `lose=0.0001,corrupt=0.0001,seed=7`; the parts may come in any
/// order and default to 0, and one has to be a fault:
///
/// | part | effect | drawn for |
/// |---|---|---|
/// | `lose=P` | the byte is lost | a byte |
/// | `double=P` | the byte arrives twice | a byte |
/// | `corrupt=P` | some of the byte's bits are flipped | a byte |
/// | `drop=P` | the whole frame is lost | a frame |
/// | `repeat=P` | the frame arrives twice | a frame |
/// | `cut=P` | the frame is truncated at a random byte | a frame |
/// | `delay=P:MS` | the frame, and all after it, arrive up to MS milliseconds late | a frame |
/// | `seed=N` | seed of the random numbers | |
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Noise {
    /// Probability that a byte is lost.
    pub lose: f64,
    /// Probability that a byte arrives twice.
    pub double: f64,
    /// Probability that some of a byte's bits are flipped.
    pub corrupt: f64,
    /// Probability that a frame is lost.
    pub drop: f64,
    /// Probability that a frame arrives twice.
    pub repeat: f64,
    /// Probability that a frame is truncated.
    pub cut: f64,
    /// Probability that a frame is late.
    pub delay: f64,
    /// Longest delay of a late frame, milliseconds.
    pub delay_ms: u32,
    /// Seed of the random numbers.
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
        list::check_faults(text, "lose, double, corrupt, drop, repeat, cut and delay")?;
        Ok(noise)
    }
}

/// How many faults were injected into a line.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FaultCounts {
    /// Bytes lost.
    pub lost_bytes: u64,
    /// Bytes that arrived twice.
    pub doubled_bytes: u64,
    /// Bytes with flipped bits.
    pub corrupted_bytes: u64,
    /// Frames lost.
    pub dropped_frames: u64,
    /// Frames that arrived twice.
    pub repeated_frames: u64,
    /// Truncated frames.
    pub cut_frames: u64,
    /// Late frames.
    pub delayed_frames: u64,
}

impl FaultCounts {
    /// All counts, by name.
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

impl std::fmt::Display for FaultCounts {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut text = String::new();
        for (name, count) in self.all().into_iter().filter(|(_, count)| *count > 0) {
            let separator = if text.is_empty() { "" } else { ", " };
            write!(text, "{separator}{count} {}", name.replace('_', " "))?;
        }
        f.write_str(if text.is_empty() { "nothing" } else { &text })
    }
}

/// Injects faults into one direction of a line.
#[derive(Debug, Clone)]
pub struct FaultInjector {
    noise: Noise,
    rng: ChaCha8Rng,
    /// The faults injected so far.
    pub counts: FaultCounts,
}

impl FaultInjector {
    /// An injector of those faults. `direction` makes the two directions of one line differ.
    pub fn new(noise: Noise, direction: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(noise.seed);
        rng.set_stream(direction);
        Self { noise, rng, counts: FaultCounts::default() }
    }

    /// The bytes of a frame that arrive, and their delay.
    pub fn inject(&mut self, frame: &[u8]) -> (Vec<u8>, Duration) {
        let noise = self.noise;
        let mut late = Duration::ZERO;
        if self.occurs(noise.delay) {
            self.counts.delayed_frames += 1;
            late = Duration::from_micros(self.rng.random_range(0..=u64::from(noise.delay_ms) * 1000));
        }
        if self.occurs(noise.drop) {
            self.counts.dropped_frames += 1;
            return (Vec::new(), late);
        }
        let mut bytes = frame.to_vec();
        if self.occurs(noise.repeat) {
            self.counts.repeated_frames += 1;
            bytes.extend_from_slice(frame);
        }
        if self.occurs(noise.cut) && !bytes.is_empty() {
            self.counts.cut_frames += 1;
            bytes.truncate(self.rng.random_range(0..bytes.len()));
        }
        let mut arrived = Vec::with_capacity(bytes.len());
        for mut byte in bytes {
            if self.occurs(noise.lose) {
                self.counts.lost_bytes += 1;
                continue;
            }
            if self.occurs(noise.corrupt) {
                self.counts.corrupted_bytes += 1;
                byte ^= self.rng.random_range(1..=u8::MAX);
            }
            arrived.push(byte);
            if self.occurs(noise.double) {
                self.counts.doubled_bytes += 1;
                arrived.push(byte);
            }
        }
        (arrived, late)
    }

    fn occurs(&mut self, probability: f64) -> bool {
        probability > 0.0 && self.rng.random_bool(probability)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_specification_is_read_and_wrong_ones_are_explained() {
        let noise: Noise = "lose=0.001, delay=0.05:300,seed=7".parse().expect("it is right");
        assert_eq!(noise, Noise { lose: 0.001, delay: 0.05, delay_ms: 300, seed: 7, ..Noise::default() });
        for text in ["", "seed=7"] {
            assert!(matches!(text.parse::<Noise>(), Err(ListError::Nothing { list, .. }) if list == text));
        }
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
            assert!(
                matches!(error, ListError::Value { name, value, .. } if text.starts_with(&format!("{name}=")) && value == bad)
            );
        }
        assert!(matches!("loose=0.1".parse::<Noise>(), Err(ListError::Name { name, .. }) if name == "loose"));
    }

    #[test]
    fn each_fault_does_what_it_says_as_often_as_it_says() {
        let frame: Vec<u8> = (0..100).collect();
        let run = |text: &str| {
            let mut injector = FaultInjector::new(text.parse().expect("it is right"), 0);
            let arrived: Vec<_> = (0..200).map(|_| injector.inject(&frame)).collect();
            (arrived, injector.counts)
        };
        let (arrived, counts) = run("drop=0,seed=3");
        assert!(arrived.iter().all(|(bytes, late)| *bytes == frame && late.is_zero()));
        assert_eq!(counts, FaultCounts::default());
        // Of 20,000 bytes and 200 frames: expected counts give or take six standard deviations.
        let near = |count: u64, trials: f64, p: f64| {
            let spread = 6.0 * (trials * p * (1.0 - p)).sqrt();
            assert!((count as f64 - trials * p).abs() < spread, "{count} of {trials} at {p}");
        };
        let (arrived, counts) = run("lose=0.02,seed=3");
        let missing: usize = arrived.iter().map(|(bytes, _)| 100 - bytes.len()).sum();
        assert_eq!(missing as u64, counts.lost_bytes);
        near(counts.lost_bytes, 2e4, 0.02);
        let (arrived, counts) = run("double=0.02,seed=3");
        assert_eq!(arrived.iter().map(|(b, _)| b.len() - 100).sum::<usize>() as u64, counts.doubled_bytes);
        near(counts.doubled_bytes, 2e4, 0.02);
        let (arrived, counts) = run("corrupt=0.02,seed=3");
        let wrong = |bytes: &Vec<u8>| bytes.iter().zip(&frame).filter(|(a, b)| a != b).count() as u64;
        assert_eq!(arrived.iter().map(|(b, _)| wrong(b)).sum::<u64>(), counts.corrupted_bytes);
        near(counts.corrupted_bytes, 2e4, 0.02);
        let (arrived, counts) = run("drop=0.2,seed=3");
        assert_eq!(arrived.iter().filter(|(b, _)| b.is_empty()).count() as u64, counts.dropped_frames);
        near(counts.dropped_frames, 200.0, 0.2);
        let (arrived, counts) = run("repeat=0.2,seed=3");
        assert_eq!(arrived.iter().filter(|(b, _)| b.len() == 200).count() as u64, counts.repeated_frames);
        near(counts.repeated_frames, 200.0, 0.2);
        let (arrived, counts) = run("cut=0.2,seed=3");
        assert_eq!(arrived.iter().filter(|(b, _)| b.len() < 100).count() as u64, counts.cut_frames);
        near(counts.cut_frames, 200.0, 0.2);
        let (arrived, counts) = run("delay=0.2:50,seed=3");
        let late = arrived.iter().filter(|(_, late)| !late.is_zero()).count() as u64;
        assert!(late <= counts.delayed_frames && late + 2 >= counts.delayed_frames);
        assert!(arrived.iter().all(|(_, late)| *late <= Duration::from_millis(50)));
        near(counts.delayed_frames, 200.0, 0.2);
    }

    #[test]
    fn the_seed_decides_and_the_ways_differ() {
        let noise: Noise = "corrupt=0.1,seed=3".parse().expect("it is right");
        let run = |noise, direction| FaultInjector::new(noise, direction).inject(&[0; 200]);
        assert_eq!(run(noise, 0), run(noise, 0));
        assert_ne!(run(noise, 0), run(noise, 1));
        assert_ne!(run(noise, 0), run(Noise { seed: 4, ..noise }, 0));
    }
}
