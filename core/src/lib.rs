//! Motion style transfer that runs on a microcontroller: one pose in, the same pose in another style out.
//!
//! No heap, no operating system, no panic, and the same bits on every target. A [`Database`] is a blob from the
//! builder, read in place from flash. A [`Stylizer`] owns all the RAM, and takes one pose after the other.
//!
//! # One frame
//! [`stylizer`] calls the other modules in this order:
//!
//! 1. [`body::pose`] converts the [`Pose`] to degrees of freedom.
//! 2. [`search::query`] turns the last few poses into a search feature.
//! 3. [`search::graph`] finds the nearest frames in every class (an action in a style).
//! 4. [`methods::weights`] computes the proportions of the classes.
//! 5. `methods::mixture::examples` unpacks the neighbors and their counterparts in the output style ([`blob`]).
//! 6. [`methods::mixture::regression`] fits a local autoregressive model for each dof and evaluates it once;
//!    [`methods::mixture::ridge`] solves the normal equations.
//! 7. [`methods::mixture::step_time`] predicts the duration of the step, [`methods::mixture::contact_votes`] which feet
//!    stand.
//! 8. [`body::pose`] converts the result back to a [`Pose`].
//! 9. [`output::foot_lock`] holds standing feet ([`body::two_bone_ik`]), and [`output::speed_limit`] bounds the speed of the
//!    joints by that of the input. The [`Report`] says what happened.
//!
//! Steps 2 to 7 are those of the default method, the mixture ([`Method::Mar`]). The other methods replace them: phase
//! tables (`methods::phase`), linear models ([`methods::linear`]) and statistics of joints (`methods::statistics`),
//! which need no frames. See [`Method`]. Each method is a feature of the crate; firmware without it saves its flash and
//! RAM.
//!
//! # Beside the frame
//! - Between frames, the style is set by number and weight, or by an Effort ([`stylizer::effort_dial`]).
//! - [`retarget`] serves other bodies, and [`robot`] servos.
//! - [`output::retime`] gives a steady tick, and [`output::visit_cap`] limits the cost of a frame by how long the last
//!   ones took.
//! - [`link`] carries poses to a board and back over a line that loses bytes.
//! - The feature `soft-float` saves a third of a frame's instructions on Armv6-M and 5% on RV32IMC, with the same bits.
//!
//! # Conventions
//! Right-handed, Y up; metres, radians, seconds; quaternions `[x, y, z, w]`; little-endian. Shapes are given as `[dofs]` or
//! `[joints]`: a slice with one number each. Dofs of a joint are an exponential map relative to the joint's mean rotation.
//! "Xia 2015" is Xia, Wang, Chai and Hodgins, "Realtime Style Transfer for Unlabeled Heterogeneous Human Motion",
//! SIGGRAPH 2015, whose method the default one is.
//!
//! ```no_run
//! use gestus_core::{Config, Database, Fit, Pose};
//!
//! # fn poses() -> Vec<Pose<22>> { vec![] }
//! # let blob: &[u8] = &[];
//! let database = Database::open(blob).expect("the blob was checked when it was flashed");
//! let proud = database.manifest().ok().and_then(|m| m.styles.find("proud")).unwrap_or(0);
//! // 22 joints, 40 neighbors, 28 classes: 24 KB of RAM, here on the stack.
//! let fit = Fit::<22, 40, 28>::new(database, Config::new()).expect("the database fits");
//! let mut stylizer = fit.stylizer();
//! stylizer.set_style(&[(proud, 1.0)]).expect("the style is in the database");
//! let mut output = Pose::IDENTITY;
//! for input in poses() {
//!     let report = stylizer.step(&input, &mut output);
//!     // ... drive the servos with `output` for `report.step_s` seconds
//! }
//! ```
#![cfg_attr(not(any(test, feature = "std")), no_std)]
#![forbid(unsafe_code)]
// A build without some methods leaves code unused that only they need.
#![cfg_attr(not(feature = "methods"), allow(dead_code, unused_imports))]

// Imported, so that the linker finds its routines.
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
    style_mix::{MAX_GROUP_STYLES, STRENGTH_S},
};
