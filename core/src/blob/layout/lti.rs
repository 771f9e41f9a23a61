//! Byte ranges of the section of linear time-invariant models.
//!
//! ```text
//! header      16 bytes
//! directory   16 bytes a model
//! models      each: dofs [D][4] f32, step [2] f32, feet [2][1 + states] f32, units
//! unit        8 bytes, then A [n][n], B [n][m], C [p][n], D [p][m], f32, row by row
//! ```

use core::ops::Range;

/// Length of the header.
pub const HEADER: usize = 16;
/// Input style of the models, u16.
pub const FROM: Range<usize> = 0..2;
/// Number of models, u16.
pub const MODELS: Range<usize> = 2..4;
/// Zero.
pub const RESERVED: Range<usize> = 4..16;
/// Length of an entry of the directory. Models lie side by side behind it, in its order.
pub const ENTRY: usize = 16;
/// In an entry: output style, u16.
pub const STYLE: Range<usize> = 0..2;
/// In an entry: action that it was estimated from, u16; [`NONE`](super::NONE): all.
pub const ACTION: Range<usize> = 2..4;
/// In an entry: number of units, u16.
pub const UNITS: Range<usize> = 4..6;
/// In an entry: states of all units together, u16.
pub const STATES: Range<usize> = 6..8;
/// In an entry: where the model starts, from the start of the section, u32.
pub const OFFSET: Range<usize> = 8..12;
/// In an entry: bytes of the model, u32.
pub const BYTES: Range<usize> = 12..16;
/// Length of a dof: mean and standard deviation of the input, then of the output.
pub const DOF: usize = 16;
/// Length of a unit's header.
pub const UNIT: usize = 8;
/// In a unit: states n, u8.
pub const ORDER: usize = 0;
/// In a unit: inputs m, u8, 1 to 4.
pub const INPUTS: usize = 1;
/// In a unit: outputs p, u8, 1 to 4.
pub const OUTPUTS: usize = 2;
/// In a unit: zero.
pub const UNIT_RESERVED: usize = 3;
/// In a unit: first input dof, u16; the others follow it.
pub const FIRST_INPUT: Range<usize> = 4..6;
/// In a unit: first output dof, u16; the others follow it. Dof D is the logarithm of the time warp.
pub const FIRST_OUTPUT: Range<usize> = 6..8;

/// Where the time step's mean and deviation are in a model.
pub const fn step(dofs: usize) -> usize {
    DOF * dofs
}

/// Where the footplants are: for the left, then the right foot, the boundary and the projection of the states.
pub const fn feet(dofs: usize) -> usize {
    step(dofs) + 8
}

/// Where the units are.
pub const fn units(dofs: usize, states: usize) -> usize {
    feet(dofs) + 8 * (1 + states)
}

/// Numbers of a unit with n states, m inputs and p outputs.
pub const fn numbers(n: usize, m: usize, p: usize) -> usize {
    (n + p) * (n + m)
}
