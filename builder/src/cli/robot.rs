//! The robot of `gestus translate`.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use gestus_core::Database;
use gestus_database::{
    robot::{
        Machine, RobotMap,
        play::{play_round, play_standing},
        write::{check_qpos, is_npy},
    },
    stream::{Streamed, input::Input},
};
use gestus_motion::formats::urdf;
use serde_json::Value;

use super::{figures::add, open};

/// How far a robot's loop may be open without a word, degrees.
const CLOSED_DEG: f64 = 1.0;

/// A robot that follows the output.
#[derive(clap::Args, Clone)]
pub struct RobotArgs {
    /// A robot, a URDF file: the output also becomes its joint angles
    #[arg(long, value_name = "FILE.urdf")]
    pub robot: Option<PathBuf>,
    /// What the robot's joint names don't say, and its servos, as TOML
    #[arg(long, requires = "robot", value_name = "FILE.toml")]
    pub robot_map: Option<PathBuf>,
    /// CSV file for the robot's joint angles, radians, its base, and which feet stand
    #[arg(long, requires = "robot")]
    csv: Option<PathBuf>,
    /// JSON file for the joint angles as a ROS JointTrajectory, with the base and which feet stand
    #[arg(long, requires = "robot", value_name = "OUT.json")]
    trajectory: Option<PathBuf>,
    /// File for MuJoCo's `qpos`, .npy or .csv: the base as a free joint, then the hinges
    #[arg(long, requires = "robot", value_name = "OUT.npy")]
    qpos: Option<PathBuf>,
    /// CSV file for the servos' pulses, microseconds
    #[arg(long, requires = "robot", value_name = "OUT.csv")]
    servo: Option<PathBuf>,
    /// File for the robot's tables, which a board needs to drive it
    #[arg(long, requires = "robot", value_name = "OUT.gestus")]
    robot_section: Option<PathBuf>,
}

impl RobotArgs {
    /// Refuses a robot without an output for it, and a folder in its place.
    pub fn check(&self, json: bool) -> Result<()> {
        if self.robot.is_some() && !json && self.outputs().iter().all(|(_, path)| path.is_none()) {
            bail!(
                "--robot has no output: give --csv, --trajectory, --qpos, --servo or --robot-section, or --json for its \
                 figures"
            );
        }
        for (option, path) in [("--robot", &self.robot), ("--robot-map", &self.robot_map)] {
            if let Some(folder) = path.as_ref().filter(|path| path.is_dir()) {
                bail!("{option} {}: this is a folder: give a file", folder.display());
            }
        }
        self.qpos.as_deref().map_or(Ok(true), is_npy)?;
        Ok(())
    }

    /// The robot's outputs, by option.
    pub fn outputs(&self) -> [(&'static str, Option<&PathBuf>); 5] {
        [
            ("--csv", self.csv.as_ref()),
            ("--trajectory", self.trajectory.as_ref()),
            ("--qpos", self.qpos.as_ref()),
            ("--servo", self.servo.as_ref()),
            ("--robot-section", self.robot_section.as_ref()),
        ]
    }

    /// Reads the robot, makes it ready for the database, and says what is doubtful.
    pub fn machine(&self, database: &Database<'_>) -> Result<Option<Machine>> {
        let Some(path) = &self.robot else { return Ok(None) };
        let map = self.robot_map.as_deref().map(RobotMap::read).transpose()?.unwrap_or_default();
        let (robot, name) = (urdf::Robot::read(path)?, || path.display().to_string());
        if self.qpos.is_some() {
            check_qpos(&robot).with_context(name)?;
        }
        let mut machine = Machine::new(database, robot, &map).with_context(name)?;
        // Angles are asked for: doubts about servos would be noise.
        if self.servo.is_none() {
            machine.servo_doubts.clear();
        }
        machine.doubts.append(&mut machine.servo_doubts);
        for doubt in &machine.doubts {
            super::note(format_args!("{}: doubt: {doubt}", path.display()));
        }
        Ok(Some(machine))
    }

    /// Drives the robot and writes its outputs; returns its figures.
    pub fn run(&self, machine: &Machine, input: &Input, streamed: &Streamed) -> Result<Value> {
        let contacts = streamed.contacts(machine.tick_hz);
        let played = if input.round().is_some() {
            play_round(machine, &input.body(streamed, input.mapped.rate_hz), &contacts)
        } else {
            play_standing(machine, &input.body(streamed, machine.tick_hz), &contacts)
        };
        let mut doubts = played.doubts();
        if input.round().is_some() && played.gap_deg() > CLOSED_DEG {
            doubts.push(format!(
                "its loop does not close: a hinge ends {:.1} degrees from where it begins, since its limits are too low for \
                 the motion",
                played.gap_deg()
            ));
        }
        for doubt in &doubts {
            super::note(format_args!("{}: doubt: {doubt}", machine.robot.name));
        }
        let write = |path: &Option<PathBuf>, bytes: &dyn Fn() -> Result<Vec<u8>>| -> Result<()> {
            let Some(path) = path else { return Ok(()) };
            open::write(path, bytes()?)
        };
        write(&self.csv, &|| Ok(played.csv().into_bytes()))?;
        write(&self.trajectory, &|| Ok(serde_json::to_vec(&played.trajectory())?))?;
        if let Some(path) = &self.qpos {
            played.write_qpos(&machine.robot, path)?;
        }
        write(&self.servo, &|| Ok(played.servo_csv().into_bytes()))?;
        write(&self.robot_section, &|| Ok(machine.bytes().to_vec()))?;
        let mut figures = machine.json();
        if let Some(all) = figures["doubts"].as_array_mut() {
            all.extend(doubts.into_iter().map(Value::from));
        }
        add(&mut figures, played.figures(machine));
        Ok(figures)
    }
}
