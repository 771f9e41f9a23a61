//! The robot map, in TOML: corrections to the assignment, and data that URDF lacks.
//!
//! ```toml
//! tick_hz = 50                 # how often the robot gets a new target
//! forward = "x"                # where the robot looks with all hinges at zero, in its base's axes
//! up = "z"
//! ankle_m = 0.035              # height of the ankles above the ground when it stands
//! velocity = 5.0               # rad/s, where the URDF says none
//! acceleration = 60.0          # rad/s², for all hinges that say no other
//! jerk = 1200.0                # rad/s³
//! [joints.left_knee]
//! part = "left-lower-leg"      # an empty part: the hinge is not driven
//! jerk = 800.0
//! servo = { centre_us = 1500, us_per_deg = 10.6, zero_deg = 0, direction = -1, least_us = 600, greatest_us = 2400 }
//! ```

use std::{collections::BTreeMap, ops::RangeInclusive, path::Path};

use nalgebra::{UnitQuaternion, Vector3};
use serde::Deserialize;
use thiserror::Error;

use crate::retarget::parts::Part;
use gestus_motion::{
    files::{self, FileError, MAX_SETTINGS_BYTES},
    formats::urdf::MAX_RATE,
};

/// The file's content.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotMap {
    /// Ticks a second; 50 if not given.
    pub tick_hz: Option<f64>,
    forward: Option<String>,
    up: Option<String>,
    /// Height of the ankles above the ground when the robot stands, metres; found in the URDF if not given.
    pub ankle_m: Option<f64>,
    /// rad/s, where the URDF says none.
    pub velocity: Option<f64>,
    /// rad/s², for all hinges that say no other.
    pub acceleration: Option<f64>,
    /// rad/s³, for all hinges that say no other.
    pub jerk: Option<f64>,
    /// By name of the joint.
    #[serde(default)]
    pub joints: BTreeMap<String, JointMap>,
}

/// Ticks a second that a robot takes.
pub(super) const TICKS_HZ: RangeInclusive<f64> = 1.0..=1000.0;

/// Settings of a joint.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointMap {
    part: Option<String>,
    /// rad/s.
    pub velocity: Option<f64>,
    /// rad/s².
    pub acceleration: Option<f64>,
    /// rad/s³.
    pub jerk: Option<f64>,
    /// Its servo.
    pub servo: Option<ServoMap>,
}

/// How a servo is mounted.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ServoMap {
    /// Pulse at `zero_deg`, microseconds.
    pub centre_us: f64,
    /// Microseconds a degree.
    pub us_per_deg: f64,
    /// Angle of the hinge at the centre, degrees; the middle of its range if not given.
    pub zero_deg: Option<f64>,
    /// 1, or -1 where it is mounted the other way round.
    pub direction: i8,
    /// Shortest pulse, microseconds.
    pub least_us: f64,
    /// Longest pulse, microseconds.
    pub greatest_us: f64,
}

impl ServoMap {
    /// The first key that makes no sense, its value, and what is expected.
    fn problem(&self) -> Option<(&'static str, f64, &'static str)> {
        let Self { centre_us, us_per_deg, zero_deg, direction, least_us, greatest_us } = *self;
        let zero_deg = zero_deg.unwrap_or(0.0);
        let pulse = "pulses take 1 to 20000 microseconds";
        let is_pulse = |us: f64| (1.0..=20_000.0).contains(&us);
        let checks = [
            (direction.abs() == 1, "direction", direction.into(), "a servo has 1 or -1"),
            (is_pulse(least_us), "least_us", least_us, pulse),
            (is_pulse(greatest_us), "greatest_us", greatest_us, pulse),
            (least_us < greatest_us, "least_us", least_us, "it is below `greatest_us`"),
            (
                (least_us..=greatest_us).contains(&centre_us),
                "centre_us",
                centre_us,
                "it is from `least_us` to `greatest_us`",
            ),
            (
                (0.02..=1700.0).contains(&us_per_deg.abs()),
                "us_per_deg",
                us_per_deg,
                "a servo takes 0.02 to 1700 microseconds a degree",
            ),
            ((-360.0..=360.0).contains(&zero_deg), "zero_deg", zero_deg, "it is from -360 to 360 degrees"),
        ];
        checks
            .into_iter()
            .find(|(is_right, ..)| !is_right)
            .map(|(_, key, found, expected)| (key, found, expected))
    }
}

impl Default for ServoMap {
    fn default() -> Self {
        // The common hobby servo: 180 degrees between 500 and 2,500 microseconds.
        Self {
            centre_us: 1500.0,
            us_per_deg: 2000.0 / 180.0,
            zero_deg: None,
            direction: 1,
            least_us: 500.0,
            greatest_us: 2500.0,
        }
    }
}

/// A file that can't be used.
#[derive(Debug, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum RobotMapError {
    #[error("{file} can't be read: {error}")]
    Read { file: String, error: FileError },
    #[error("{file}: {error}")]
    Toml { file: String, error: Box<toml::de::Error> },
    #[error("{file}, joint `{joint}`: `{word}` is not a body part; the parts are {parts}")]
    Part { file: String, joint: String, word: String, parts: String },
    #[error("{file}: {key} = {found}: {expected}")]
    Value { file: String, key: String, found: f64, expected: &'static str },
    #[error("{file}: forward and up: two different axes out of x, y, z, -x, -y, -z")]
    Axes { file: String },
}

impl RobotMap {
    /// Reads a file.
    ///
    /// # Errors
    /// [`RobotMapError`] names the file and what is wrong in it.
    pub fn read(path: &Path) -> Result<Self, RobotMapError> {
        let file = path.display().to_string();
        let text = files::read_text(path, MAX_SETTINGS_BYTES)
            .map_err(|error| RobotMapError::Read { file: file.clone(), error })?;
        Self::parse(&text, &file)
    }

    /// Reads a text; `file` is for messages.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(text: &str, file: &str) -> Result<Self, RobotMapError> {
        let map: Self = toml::from_str(text)
            .map_err(|error| RobotMapError::Toml { file: file.to_owned(), error: Box::new(error) })?;
        for (joint, entry) in &map.joints {
            if let Some(word) = entry.part.as_ref().filter(|w| !w.is_empty() && Part::named(w).is_none()) {
                return Err(RobotMapError::Part {
                    file: file.to_owned(),
                    joint: joint.clone(),
                    word: word.clone(),
                    parts: Part::all().iter().map(ToString::to_string).collect::<Vec<_>>().join(", "),
                });
            }
        }
        let fail = |key: String, found: f64, expected| {
            Err(RobotMapError::Value { file: file.to_owned(), key, found, expected })
        };
        let named = |whose: String, [velocity, acceleration, jerk]: [Option<f64>; 3]| {
            [("velocity", velocity), ("acceleration", acceleration), ("jerk", jerk)]
                .map(|(key, rate)| (format!("{whose}{key}"), rate))
        };
        let of_joint = |(name, joint): (&String, &JointMap)| {
            named(format!("joint `{name}`: "), [joint.velocity, joint.acceleration, joint.jerk])
        };
        let rates = named(String::new(), [map.velocity, map.acceleration, map.jerk])
            .into_iter()
            .chain(map.joints.iter().flat_map(of_joint));
        for (key, rate) in rates {
            if let Some(bad) = rate.filter(|v| !(1e-3..=MAX_RATE).contains(v)) {
                return fail(key, bad, "it is between 0.001 and 1,000,000");
            }
        }
        if let Some(bad) = map.tick_hz.filter(|hz| !TICKS_HZ.contains(hz)) {
            return fail("tick_hz".into(), bad, "a robot takes 1 to 1000 ticks a second");
        }
        let servos = map.joints.iter().filter_map(|(joint, entry)| Some((joint, entry.servo?.problem()?)));
        if let Some((joint, (key, found, expected))) = servos.into_iter().next() {
            return fail(format!("joint `{joint}`: {key}"), found, expected);
        }
        if let Some(bad) = map.ankle_m.filter(|m| !(0.0..=2.0).contains(m)) {
            return fail("ankle_m".into(), bad, "ankles are 0 to 2 metres above the ground");
        }
        if map.axes().is_none() {
            return Err(RobotMapError::Axes { file: file.to_owned() });
        }
        Ok(map)
    }

    /// From a body's axes (X left, Y up, Z ahead) to the base's; `None` where the file's words make none.
    pub fn axes(&self) -> Option<UnitQuaternion<f64>> {
        let axis = |word: &Option<String>, other: &str| -> Option<Vector3<f64>> {
            let word = word.as_deref().unwrap_or(other);
            let (sign, name) = word.strip_prefix('-').map_or((1.0, word), |rest| (-1.0, rest));
            let index = ["x", "y", "z"].iter().position(|a| *a == name)?;
            Some(Vector3::from_fn(|i, _| if i == index { sign } else { 0.0 }))
        };
        let (forward, up) = (axis(&self.forward, "x")?, axis(&self.up, "z")?);
        if forward.dot(&up).abs() > 0.5 {
            return None;
        }
        let columns = nalgebra::Matrix3::from_columns(&[up.cross(&forward), up, forward]);
        Some(UnitQuaternion::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(columns)))
    }

    /// The part that the file gives a joint: `None` where it gives none, `Some(None)` for a joint that is not driven.
    pub fn part(&self, joint: &str) -> Option<Option<Part>> {
        let word = self.joints.get(joint)?.part.as_ref()?;
        Some(Part::named(word))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::retarget::parts::Side;

    #[test]
    fn joints_rates_and_servos_are_read() {
        let map = RobotMap::parse(
            "tick_hz = 100\nforward = \"-y\"\n[joints.k]\npart = \"left-lower-leg\"\nservo = { direction = -1, zero_deg = 5 }\n[joints.x]\npart = \"\"\n",
            "m.toml",
        )
        .unwrap();
        assert_eq!(map.tick_hz, Some(100.0));
        assert_eq!(map.part("k"), Some(Some(Part::LowerLeg(Side::Left))));
        assert_eq!((map.part("x"), map.part("y")), (Some(None), None));
        let servo = map.joints["k"].servo.unwrap();
        assert_eq!((servo.direction, servo.zero_deg, servo.centre_us), (-1, Some(5.0), 1500.0));
        let axes = map.axes().unwrap();
        assert!((axes * Vector3::z() + Vector3::y()).norm() < 1e-9);
        assert!((axes * Vector3::y() - Vector3::z()).norm() < 1e-9);
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (text, words) in [
            ("[joints.k]\npart = \"fin\"", vec!["m.toml", "`k`", "fin", "left-foot"]),
            ("forward = \"z\"", vec!["m.toml", "forward"]),
            ("jerk = -1.0", vec!["m.toml", "jerk = -1"]),
            ("tick_hz = 0.5", vec!["m.toml", "tick_hz = 0.5", "1 to 1000"]),
            ("[joints.k]\nservo = { zero_deg = 9000 }", vec!["m.toml", "`k`", "zero_deg = 9000"]),
            ("[joints.k]\nservo = { us_per_deg = 0 }", vec!["m.toml", "`k`", "us_per_deg = 0"]),
            (
                "[joints.k]\nservo = { least_us = 2600 }",
                vec!["m.toml", "`k`", "least_us = 2600", "greatest_us"],
            ),
            ("[joints.k]\nservo = { centre_us = 400 }", vec!["m.toml", "`k`", "centre_us = 400"]),
            ("[joints.k]\nvelocity = 0.0", vec!["m.toml", "joint `k`: velocity = 0"]),
            ("[joints.k]\nservo = { direction = 3 }", vec!["m.toml", "`k`", "1 or -1"]),
            ("speed = 1", vec!["m.toml", "speed"]),
        ] {
            let message = RobotMap::parse(text, "m.toml").unwrap_err().to_string();
            assert!(words.iter().all(|w| message.contains(w)), "{message}");
        }
    }
}
