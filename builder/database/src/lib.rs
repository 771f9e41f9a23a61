//! Gestus database: from annotated motion capture to one flat blob that `gestus-core` reads in place.
//!
//! A clip goes through the modules in this order:
//!
//! 1. [`data_folder`] reads and labels it; [`synth`] generates clips instead;
//! 2. [`registration`] gives it contacts and a canonical timeline;
//! 3. [`pairing`] finds its output cycles in the other styles;
//! 4. [`search`] makes its frames searchable;
//! 5. [`blob`] encodes the sections. [`build`](mod@build) runs these steps.
//!
//! Beside the frames, a blob holds [`models`] and [`effort`]. [`retarget`] and [`robot`] write tables for other bodies.
//! [`stream`] runs the core over a clip, [`motion_graph`] makes long streams from clips. [`parts`] estimates what a stream
//! costs on microcontrollers. [`command_line`] and [`list`] are shared by the commands `gestus` and `gestus-sim`.

pub mod blob;
pub mod build;
pub mod command_line;
pub mod data_folder;
pub mod effort;
pub mod list;
pub mod models;
pub mod motion_graph;
pub mod pairing;
pub mod parts;
pub mod registration;
pub mod retarget;
pub mod robot;
pub mod search;
pub mod stream;
pub mod synth;
