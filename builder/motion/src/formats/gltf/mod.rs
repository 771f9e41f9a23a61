//! glTF 2.0 (`.glb`, `.gltf`), the exchange format of games: the motion of its skeletons, as rigs and animations.
//!
//! A glTF file holds a hierarchy of nodes, and animations: curves over time of the translation and rotation of nodes. Its
//! axes are ours (right-handed, Y up) and its lengths are metres. Every animation becomes a clip of its own:
//!
//! 1. `document` and `data`: the file's motion; the buffers (inside the file, beside it or in data URIs) and the numbers
//!    in them. Everything is checked before use.
//!    `packed`: views that meshoptimizer packed.
//! 2. `tree`: the nodes of the body: the joints of the skin that the animation moves, or without a skin the nodes that
//!    it moves, with all nodes between them.
//! 3. `curve`: steps, lines and cubic splines, evaluated at any time (glTF 2.0, section 3.11 and appendix C).
//! 4. `motion`: poses at a fixed rate. Transforms of nodes above the body are applied to its first joint; scales are applied
//!    to the lengths of the bones, and what hangs on a mirrored node is read as it looks.
//! 5. `rest`: the body at rest, of a file with or without an animation.
//!
//! The result is an [`Animation`](crate::animation::Animation). `write` puts a clip back into the file: its animation is
//! replaced, all else stays. It can also be written as BVH on the same joints.
//!
//! glTF has no frame rate. Keys at 20 to 240 Hz give the clip's rate; with fewer keys, which exporters reduce, it is
//! 60 Hz.

mod container;
mod curve;
mod data;
mod document;
mod error;
mod file;
mod joined;
mod motion;
mod packed;
mod rest;
mod toy;
mod tree;
mod unpacked;
mod write;

pub use error::{GltfError, GltfErrorKind};
pub use file::{Gltf, read, read_one};
pub use motion::parse;
pub use rest::rest;
pub use toy::toy;
pub use unpacked::unpacked;
