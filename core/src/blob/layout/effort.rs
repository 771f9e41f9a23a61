//! Places in the effort section.
//!
//! ```text
//! nodes   [3] u16           of the grid along flow, weight and time
//! labels  u8, reserved u8
//! axes    [3][2] f32        least and greatest value of each factor
//! rest    [3] f32           the factors of the even mix of all styles
//! efforts [styles][3] f32   flow, weight and time of each style
//! table   [flow][weight][time][styles] u8   weights of the styles, of sum 255
//! ```

use core::ops::Range;

/// Nodes along each axis, u16, 2 to [`MAX_NODES`].
pub const NODES: Range<usize> = 0..6;
/// Where the labels come from, u8: [`ESTIMATED`] or [`GIVEN`].
pub const LABELS: usize = 6;
/// Zero.
pub const RESERVED: Range<usize> = 7..8;
/// Ends of the axes, f32, low and high of each.
pub const AXES: Range<usize> = 8..32;
/// Effort at rest, 3 f32.
pub const REST: Range<usize> = 32..44;
/// Length of a style's Effort.
pub const STYLE_LENGTH: usize = 12;
/// Most nodes along an axis.
pub const MAX_NODES: usize = 33;
/// The styles' Efforts were estimated from the motion.
pub const ESTIMATED: u8 = 0;
/// The styles' Efforts were given by people.
pub const GIVEN: u8 = 1;
/// What the weights of a node add up to.
pub const WHOLE: u16 = 255;

/// Where the styles' Efforts start.
pub const STYLES: usize = REST.end;

/// Where the table starts.
pub const fn table(styles: usize) -> usize {
    STYLES + styles * STYLE_LENGTH
}
