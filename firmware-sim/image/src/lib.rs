//! What the boards share.
#![no_std]

pub mod counter;
pub mod flash;
pub mod stack;
pub mod stages;
pub mod uart;
