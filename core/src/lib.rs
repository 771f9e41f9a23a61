//! Motion style transfer that runs on a microcontroller: one pose in, the same pose in another style out.
//!
//! No heap, no operating system, no panic, the same bits on every target. A [`Database`] is a blob that the
//! builder made, read in place from flash; a [`Stylizer`] owns all the RAM and turns poses, one at a time.
//!
//! One frame walks through the modules in this order:
//!
//! 1. [`pose`] takes the [`Pose`] to degrees of freedom;
//! 2. [`query`] takes the last few poses to a search feature;
//! 3. [`knn`] finds the nearest frames in every class (an action in a style);
//! 4. [`mixture`] weighs the classes;
//! 5. [`examples`] unpacks the neighbors and their counterparts in the output style ([`blob`]);
//! 6. [`regress`] fits a local autoregressive model a dof, solved by [`ridge`], and asks it once;
//! 7. [`timing`] predicts how long the step takes, [`contact`] which foot stands;
//! 8. [`pose`] takes the result back to a [`Pose`]; [`lock`] holds the feet that stand, by [`ik`]; [`limit`] keeps
//!    joints from turning faster than the input has shown; the [`Report`] says what happened.
//!
//! Steps 2 to 7 are the mixture's ([`Method::Mar`]); in their place may stand a linear model ([`lti`]) or a table of
//! statistics, which need no frames: see [`Method`].
//! Between frames the style may be set by name and weight, or by an [`effort`].
//!
//! Beside that walk, [`deadline`] says how much a frame may cost by how long the last ones took, and [`link`] carries
//! poses to a board and back over a line that loses bytes.
//!
//! The method is that of Xia, Wang, Chai and Hodgins, "Realtime Style Transfer for Unlabeled Heterogeneous Human
//! Motion", SIGGRAPH 2015 ("paper 000" in the comments).
//!
//! ```no_run
//! use gestus_core::{Config, Database, Pose, Stylizer};
//!
//! # fn poses() -> Vec<Pose<22>> { vec![] }
//! # let blob: &[u8] = &[];
//! let database = Database::open(blob).expect("the blob was checked when it was flashed");
//! let proud = database.manifest().ok().and_then(|m| m.styles.find("proud")).unwrap_or(0);
//! // 22 joints, 40 neighbors, 28 classes: 24 KB of RAM, here on the stack.
//! let mut stylizer = Stylizer::<22, 40, 28>::new(database, Config::new()).expect("the database fits");
//! stylizer.set_style(&[(proud, 1.0)]).expect("the style is in the database");
//! let mut output = Pose::IDENTITY;
//! for input in poses() {
//!     let report = stylizer.step(&input, &mut output);
//!     // ... drive the servos with `output` for `report.step_s` seconds
//! }
//! ```
#![cfg_attr(not(any(test, feature = "std")), no_std)]
#![forbid(unsafe_code)]

pub mod blob;
pub mod config;
pub mod contact;
pub mod deadline;
pub mod digest;
pub mod effort;
mod error;
pub mod examples;
mod frame;
pub mod ik;
pub mod knn;
pub mod limit;
pub mod link;
pub mod lock;
pub mod lti;
mod mar;
pub mod math;
pub mod mixture;
pub mod observe;
pub mod pose;
pub mod quaternion;
pub mod query;
pub mod regress;
pub mod report;
pub mod retarget;
pub mod retime;
pub mod ridge;
pub mod robot;
mod settings;
pub mod skeleton;
mod sorted;
mod statistic;
mod stylizer;
pub mod timing;
mod vector;

pub use blob::Database;
pub use config::{Config, Method};
pub use digest::Digest;
pub use effort::Effort;
pub use error::{BlobError, ConfigError};
pub use observe::{Observer, Stage};
pub use pose::Pose;
pub use report::{Degraded, Report};
pub use settings::{MAX_OWN, STRENGTH_S};
pub use stylizer::{Fit, MEND_S, Safety, Stylizer};
