//! BVH, the text format of motion capture: reading, conversion to a [`Clip`](crate::clip::Clip), and writing. The parser is
//! our own: no maintained crate reports line and column, or keeps a document well enough to write it again.
//!
//! A BVH file has two parts. `HIERARCHY` is a tree of joints, each with an `OFFSET` from its parent and an ordered
//! list of `CHANNELS`; leaves may end in an `End Site`, a length without a rotation. `MOTION` is a table: one line
//! per frame, one number per channel, in the order in which the channels were declared. A joint's local rotation is
//! the product of its rotation channels *in their order*,
//!
//! ```text
//! CHANNELS 3 Zrotation Xrotation Yrotation   =>   R = Rz(a) Rx(b) Ry(c),  degrees
//! ```
//!
//! and a position channel *replaces* that component of the joint's `OFFSET`; it is not added to it. The order
//! differs from file to file, and may differ from joint to joint.
//!
//! A clip goes through the modules in this order:
//!
//! 1. [`Bvh::parse`] (`lexer`, `parse`): bytes to a document that keeps all that is needed to write the file again.
//!    It is iterative, never trusts a count in the file, and reports errors with line and column.
//! 2. `read`: channels to the local poses of an [`Animation`](crate::animation::Animation), which a
//!    [`Binding`](crate::binding::Binding) turns into a clip.
//! 3. `convert`: a clip back onto the document's channels. Static joints above the hips (`joint_Root` of Bandai-Namco)
//!    are folded into the hips on reading and restored on writing.
//! 4. [`Bvh::to_text`] (`write`): the document as text. Numbers are printed shortest-exact, so that reading what
//!    was written gives the same `f64`s.
//!
//! [`capture`](crate::capture) does the first step for files, and for folders of them.
//!
//! ```
//! use gestus_motion::{binding::{Binding, Options}, formats::bvh::Bvh};
//! let text = "HIERARCHY ROOT Hips { OFFSET 0 90 0 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation
//!   Yrotation JOINT Foot { OFFSET 0 -85 0 CHANNELS 3 Zrotation Xrotation Yrotation End Site { OFFSET 0 -5 20 } } }
//!   MOTION
//!   Frames: 1
//!   Frame Time: 0.0333333
//!   0 91 0 0 0 0 10 0 0";
//! let document = Bvh::parse(text.as_bytes(), "step.bvh")?;
//! let binding = Binding::new(&document, &Options::default())?;
//! let clip = binding.to_clip(&document)?;
//! assert!((clip.frames[0].root.y - 0.91).abs() < 1e-12);
//! let written = binding.write(&document, &clip)?;
//! assert_eq!(written.values(), document.values());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod convert;
mod document;
mod error;
mod lexer;
mod numbers;
mod parse;
mod read;
mod write;

pub use convert::AsBvh;
pub(crate) use convert::NOT_IN_NAMES;
pub use document::{Bvh, Channel, Joint};
pub use error::{BvhError, BvhErrorKind};
pub(crate) use numbers::MAX_LENGTH;
pub use parse::{MAX_DEPTH, MAX_JOINTS};
