//! The blob's bytes: rows of packed frames, sections put together, cut, and taken apart again.

pub mod assemble;
pub mod cut;
pub mod export;
pub mod rows;
