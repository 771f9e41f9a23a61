//! Tables and reports of an evaluation.
//!
//! Everything written here is one file that opens without a network, and is the same bytes for the same input:
//! no dates, no random ids, no maps with an order of their own. Names come from users' files, so every writer
//! escapes what it is given.

pub mod html;
pub mod table;
pub mod template;
