//! A robot's motion as files: angles, a ROS trajectory, MuJoCo's `qpos`, servo pulses.
//!
//! One row a tick. The base is where the motion has it at the tick's beginning; angles are those that the hinges, which are
//! told that pose, reach by its end, which is the row's time. The world has X ahead, Y left and Z up.

use std::path::Path;

use gestus_core::robot::limits::Motion;
use gestus_motion::{
    files,
    formats::{npy::write_npy, urdf::Robot},
};
use serde_json::{Value, json};
use thiserror::Error;

use crate::robot::play::{Played, Tick};

/// Columns of the base and the feet, behind those of the hinges.
const BASE: [&str; 9] = [
    "base_x_m",
    "base_y_m",
    "base_z_m",
    "base_qw",
    "base_qx",
    "base_qy",
    "base_qz",
    "left_contact",
    "right_contact",
];

/// A `qpos` that can't be written.
#[derive(Debug, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum QposError {
    #[error(
        "joint `{joint}` is neither fixed nor a hinge, and MuJoCo gives it more than one number, which --qpos does not write: \
         give --csv"
    )]
    Joint { joint: String },
    #[error("{file}: `qpos` is written as .npy or .csv")]
    Ending { file: String },
    #[error("{file} can't be written: {error}")]
    Write { file: String, error: std::io::Error },
}

/// The form of a file with `qpos`, by its ending; true for `.npy`, false for `.csv`.
///
/// # Errors
/// [`QposError::Ending`] for another one.
pub fn is_npy(path: &Path) -> Result<bool, QposError> {
    match path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).as_deref() {
        Some("npy") => Ok(true),
        Some("csv") => Ok(false),
        _ => Err(QposError::Ending { file: path.display().to_string() }),
    }
}

/// Refuses a robot that has no `qpos`.
///
/// # Errors
/// [`QposError::Joint`] for a robot with a ball or another joint of several numbers.
pub fn check_qpos(robot: &Robot) -> Result<(), QposError> {
    match robot.held.iter().find(|held| !held.single) {
        Some(held) => Err(QposError::Joint { joint: held.name.clone() }),
        None => Ok(()),
    }
}

/// Where a joint's angle comes from.
enum Joint {
    /// The hinge of that number.
    Hinge(usize),
    /// The joint is held at that angle, radians.
    Held(f64),
}

/// A name as a column: commas, quotes and line ends become `_`.
fn column(name: &str) -> String {
    name.chars().map(|c| if c == ',' || c == '"' || c.is_control() { '_' } else { c }).collect()
}

/// The base: position in metres, then the quaternion with w first.
fn base(tick: &Tick) -> [f64; 7] {
    let (at, turn) = (tick.base.translation.vector, tick.base.rotation);
    [at.x, at.y, at.z, turn.w, turn.i, turn.j, turn.k]
}

impl Played {
    /// Time of a tick's end, seconds from the start.
    fn time_s(&self, tick: usize) -> f64 {
        (tick + 1) as f64 / self.tick_hz
    }

    /// Angles as CSV: time in seconds, one column a hinge in radians, then the base and the feet that stand, 0 or 1.
    pub fn csv(&self) -> String {
        self.table(&BASE, |tick| {
            let angles = tick.motions.iter().map(|m| m.position.to_string());
            let base = base(tick).map(|v| format!("{v:.6}"));
            let feet =
                [0, 1].map(|foot| tick.contacts.map_or(String::new(), |c| u8::from(c[foot]).to_string()));
            angles.chain(base).chain(feet).collect()
        })
    }

    /// Pulses as CSV: time in seconds, one column a hinge, microseconds.
    pub fn servo_csv(&self) -> String {
        self.table(&[], |t| t.pulses.iter().map(ToString::to_string).collect())
    }

    fn table(&self, more: &[&str], row: impl Fn(&Tick) -> Vec<String>) -> String {
        let names = self.names.iter().map(|n| column(n)).chain(more.iter().map(|&n| n.to_owned()));
        let head = std::iter::once("time_s".to_owned()).chain(names).collect();
        let ticks = self.ticks.iter().enumerate().map(|(i, tick)| {
            let mut row = row(tick);
            row.insert(0, format!("{:.6}", self.time_s(i)));
            row
        });
        lines(std::iter::once(head).chain(ticks))
    }

    /// In the shape of ROS's `trajectory_msgs/JointTrajectory`. Beside it, `base` is the base in the shape of
    /// `trajectory_msgs/MultiDOFJointTrajectory`, and `contacts` tells which feet stand, one pair a point.
    ///
    /// Controllers refuse a trajectory that ends in motion, so the points go on until the hinges rest ([`Played::stop`]),
    /// and the last one has no velocity. A loop ends as it begins.
    pub fn trajectory(&self) -> Value {
        let since = |tick: usize| {
            let nanoseconds = (self.time_s(tick) * 1e9).round() as u64;
            json!({ "sec": nanoseconds / 1_000_000_000, "nanosec": nanoseconds % 1_000_000_000 })
        };
        let ticks = || self.ticks.iter().chain(&self.stop).enumerate();
        let end = self.ticks.len() + self.stop.len();
        let points = ticks().map(|(i, tick)| {
            let of = |value: fn(&Motion) -> f32| tick.motions.iter().map(value).collect::<Vec<f32>>();
            let rests = i + 1 == end && tick.rests();
            let rate =
                |value: fn(&Motion) -> f32| if rests { vec![0.0; tick.motions.len()] } else { of(value) };
            json!({
                "positions": of(|m| m.position),
                "velocities": rate(|m| m.velocity),
                "accelerations": rate(|m| m.acceleration),
                "effort": [],
                "time_from_start": since(i),
            })
        });
        let places = ticks().map(|(i, tick)| {
            let [x, y, z, qw, qx, qy, qz] = base(tick);
            json!({
                "transforms": [{
                    "translation": { "x": x, "y": y, "z": z },
                    "rotation": { "x": qx, "y": qy, "z": qz, "w": qw },
                }],
                "velocities": [],
                "accelerations": [],
                "time_from_start": since(i),
            })
        });
        let stamp = json!({ "sec": 0, "nanosec": 0 });
        json!({
            "header": { "stamp": stamp, "frame_id": "" },
            "joint_names": self.names,
            "points": points.collect::<Vec<_>>(),
            "base": {
                "header": { "stamp": stamp, "frame_id": "world" },
                "joint_names": [self.base],
                "points": places.collect::<Vec<_>>(),
            },
            "contacts": {
                "names": ["left_foot", "right_foot"],
                "points": ticks().map(|(_, tick)| tick.contacts).collect::<Vec<_>>(),
            },
        })
    }

    /// MuJoCo's `qpos` of each tick, for the robot's URDF with a free joint at its base: position in metres, quaternion
    /// with w first, then one number a joint, depth first, also those that are held. Shape `[ticks, 7 + joints]`,
    /// with the names of the columns.
    ///
    /// # Errors
    /// [`QposError::Joint`] for a robot with a ball or another joint of several numbers.
    pub fn qpos(&self, robot: &Robot) -> Result<(Vec<String>, Vec<Vec<f64>>), QposError> {
        check_qpos(robot)?;
        let mut order: Vec<(&str, Joint)> = Vec::new();
        let mut held = robot.held.iter().peekable();
        for h in 0..=self.names.len() {
            while let Some(rest) = held.next_if(|held| held.before <= h) {
                order.push((&rest.name, Joint::Held(rest.angle)));
            }
            order.extend(self.names.get(h).map(|name| (name.as_str(), Joint::Hinge(h))));
        }
        let root =
            ["root_x", "root_y", "root_z", "root_qw", "root_qx", "root_qy", "root_qz"].map(str::to_owned);
        let names = root.into_iter().chain(order.iter().map(|(name, _)| column(name))).collect();
        let rows = self.ticks.iter().map(|tick| {
            let angle = |joint: &Joint| match *joint {
                Joint::Hinge(number) => f64::from(tick.motions[number].position),
                Joint::Held(angle) => angle,
            };
            base(tick).into_iter().chain(order.iter().map(|(_, joint)| angle(joint))).collect()
        });
        Ok((names, rows.collect()))
    }

    /// Writes [`qpos`](Self::qpos): as an array for numpy, or as CSV with a line of names.
    ///
    /// # Errors
    /// [`QposError`].
    pub fn write_qpos(&self, robot: &Robot, path: &Path) -> Result<(), QposError> {
        let npy = is_npy(path)?;
        let (names, rows) = self.qpos(robot)?;
        let written = if npy {
            write_npy(path, &[rows.len(), names.len()], &rows.concat())
        } else {
            let rows = rows.iter().map(|row| row.iter().map(|v| format!("{v:.9}")).collect());
            files::write(path, lines(std::iter::once(names).chain(rows)))
        };
        written.map_err(|error| QposError::Write { file: path.display().to_string(), error })
    }
}

fn lines(records: impl Iterator<Item = Vec<String>>) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for record in records {
        writer.write_record(record).expect("rows are of one length, and a Vec takes all of them");
    }
    let bytes = writer.into_inner().expect("a Vec takes all of it");
    String::from_utf8(bytes).expect("it was made of strings")
}
