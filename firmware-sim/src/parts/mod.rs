//! Real parts, without emulating them: what fits, and how many frames a second it would give, by arithmetic.
//!
//! [`table`] has the parts, [`cost`] says how many instructions a step takes by what it has counted, [`prices`] at
//! what price a unit, [`worst`] how many units there can be, [`state`] what the stylizer takes of RAM, and [`estimate`]
//! puts it all together.

pub mod cost;
pub mod estimate;
pub mod prices;
pub mod state;
pub mod table;
pub mod worst;

pub use estimate::{Estimate, Stream};
pub use table::{PARTS, Part};
