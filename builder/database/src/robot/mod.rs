//! A robot for a database: a URDF's hinges as the joints of a body, written as tables for `gestus_core::robot`.
//!
//! 1. [`gestus_motion::formats::urdf`] reads the tree of hinges;
//! 2. [`assign`](mod@assign) says which hinge stands for which body part, [`file`](mod@file) overrides it;
//! 3. `links` finds how links lie in the body, [`stand`] how high the robot stands, and [`machine`] encodes the tables;
//! 4. [`mod@play`] drives a clip through the core, tick by tick;
//! 5. [`write`](mod@write) makes files of it: angles, trajectories, MuJoCo's `qpos`, pulses.

pub mod assign;
pub mod file;
mod links;
pub mod machine;
pub mod play;
pub mod stand;
pub mod write;

pub use assign::{Assignment, assign};
pub use file::{RobotMap, RobotMapError};
pub use machine::{Machine, MachineError};
pub use play::{Played, play};
