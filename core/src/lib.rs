//! Motion style transfer that runs on a microcontroller: one pose in, the same pose in another style out.
//!
//! No heap, no operating system, no panic, the same bits on every target. A [`Database`] is a blob that the
//! builder made, read in place from flash; a [`Stylizer`] owns all the RAM and turns poses, one at a time.
//!
//! One frame walks through the modules in this order:
//!
//! 1. [`body::pose`] turns the [`Pose`] into degrees of freedom;
//! 2. [`search::query`] turns the last few poses into a search feature;
//! 3. [`search::graph`] finds the nearest frames in every class (an action in a style);
//! 4. [`methods::weights`] weighs the classes;
//! 5. `methods::mixture::examples` unpacks the neighbors and their counterparts in the output style ([`blob`]);
//! 6. [`methods::mixture::regression`] fits a local autoregressive model for each dof and evaluates it once;
//!    [`methods::mixture::ridge`] solves it;
//! 7. [`methods::mixture::step_time`] predicts how long the step takes, [`methods::mixture::contact_votes`] which foot
//!    stands;
//! 8. [`body::pose`] turns the result back into a [`Pose`];
//! 9. [`output::foot_lock`] holds the feet that stand ([`body::two_bone_ik`]), and [`output::speed_limit`] keeps joints
//!    from turning faster than the input has shown; the [`Report`] says what happened.
//!
//! Each [`Method`] is a feature of the crate: what firmware leaves out takes neither flash nor RAM. The feature `soft-float`
//! makes a frame on processors without an FPU a quarter to a third cheaper, with the same bits.
//!
//! [`stylizer`] calls them in this order. Steps 2 to 7 are the mixture's ([`Method::Mar`]); in their place may stand a
//! linear model ([`methods::linear`]) or a table of statistics, which need no frames: see [`Method`]. Between frames the
//! style may be set by name and weight, or by an Effort ([`stylizer::effort_dial`]).
//!
//! Beside that walk, [`retarget`] and [`robot`] lead to other bodies and to servos, [`output::retime`] to a steady tick,
//! [`output::visit_cap`] limits what a frame may cost by how long the last ones took, and [`link`] carries poses to a
//! board and back over a line that loses bytes.
//!
//! The method is that of Xia, Wang, Chai and Hodgins, "Realtime Style Transfer for Unlabeled Heterogeneous Human
//! Motion", SIGGRAPH 2015 (Xia 2015 in the comments).
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
// What only the methods need that are left out.
#![cfg_attr(
    not(all(feature = "mar", feature = "lti", feature = "statistic", feature = "phase")),
    allow(dead_code, unused_imports)
)]

// Named, so that the linker finds its routines.
#[cfg(feature = "soft-float")]
use gestus_float as _;

pub mod blob;
pub mod body;
pub mod config;
pub mod digest;
mod error;
pub mod link;
pub mod math;
pub mod methods;
pub mod observe;
pub mod output;
pub mod report;
pub mod retarget;
pub mod robot;
pub mod search;
pub mod stylizer;

pub use blob::Database;
pub use body::pose::Pose;
pub use config::{Config, Method, Safety};
pub use digest::Digest;
pub use error::{BlobError, ConfigError};
pub use observe::{Observer, Stage};
pub use report::{Degraded, Report};
pub use stylizer::{
    BLEND_BACK_S, Fit, Stylizer,
    effort_dial::Effort,
    step_many,
    style_mix::{MAX_OWN, STRENGTH_S},
};
