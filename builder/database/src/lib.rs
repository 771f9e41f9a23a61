//! Gestus database: from annotated motion capture to one flat blob that `gestus-core` reads in place.
//!
//! A clip walks through the rooms in this order:
//!
//! 1. [`data_folder`] reads it and says which action and style it is; [`synth`] generates clips instead;
//! 2. [`registration`] gives it contacts and a canonical timeline;
//! 3. [`pairing`] finds its counterparts in the other styles;
//! 4. [`search`] makes its frames searchable;
//! 5. [`blob`] packs the rows and puts the sections together, all of which [`build`](mod@build) drives.
//!
//! Beside the frames, a blob holds [`models`] and [`effort`]. [`retarget`] and [`robot`] write sections for other
//! bodies. [`stream`] runs the core over a clip, and [`command_line`] has what the commands `gestus` and `gestus-sim`
//! share.

pub mod blob;
pub mod build;
pub mod command_line;
pub mod data_folder;
pub mod effort;
pub mod list;
pub mod models;
pub mod pairing;
pub mod registration;
pub mod retarget;
pub mod robot;
pub mod search;
pub mod stream;
pub mod synth;
