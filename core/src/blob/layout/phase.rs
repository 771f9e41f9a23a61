//! Byte ranges of the section of phase tables.
//!
//! ```text
//! header     16 bytes
//! whitening  f32: for each joint group in order, a square matrix over its features, row by row
//! dofs       [D] each 12 bytes
//! classes    [classes] each 48 bytes, in the order of the section of classes
//! tables     of each class, one after the other, each on a multiple of 4:
//!            norms    [P] u32      squared length of each feature knot, square steps
//!            features [P][F] i8    feature knots
//!            input    [N][D] i8    mean of the class
//!            output   [N][D] i8    mean output in the class's style, of inputs in the action's other styles
//!            slopes   [S][D][2] i8 change with speed and with yaw rate
//!            spread   [D] u8       standard deviation from the mean
//!            contacts [24][2] u8   likelihood that the left and the right foot stand in the output, in 1/255
//! ```
//!
//! Knot k of a cyclic class lies at phase `k / count`, of any other at `k / (count - 1)`.

use core::ops::Range;

/// Length of the header.
pub const HEADER: usize = 16;
/// Whitened units of one step of a feature knot, f32.
pub const STEP: Range<usize> = 0..4;
/// Steps of a dof for one step of its slope with speed (a metre a second) and with yaw rate (a radian a second), f32.
pub const SLOPE_STEPS: Range<usize> = 4..12;
/// Zero.
pub const RESERVED: Range<usize> = 12..16;

/// Most feature knots of a class.
pub const MAX_FEATURE_KNOTS: usize = 128;
/// Most dof knots, and most slope knots.
pub const MAX_DOF_KNOTS: usize = 64;
/// Phases at which contacts are stored.
pub const CONTACTS: usize = 24;
/// One step of the likelihood that a foot stands.
pub const CONTACT_STEP: f32 = 1.0 / 255.0;

/// Byte ranges of a dof.
pub mod dof_scale {
    use super::Range;
    /// Length of a dof.
    pub const LENGTH: usize = 12;
    /// Value of code 0, f32.
    pub const CENTRE: Range<usize> = 0..4;
    /// One step of a code, f32.
    pub const STEP: Range<usize> = 4..8;
    /// Codes for one unit of the dof: 1 over the step, f32.
    pub const INVERSE: Range<usize> = 8..12;
}

/// Byte ranges of a class.
pub mod tables {
    use super::Range;
    /// Length of a class.
    pub const LENGTH: usize = 48;
    /// Where its tables are, bytes from the start of the section, u32.
    pub const OFFSET: Range<usize> = 0..4;
    /// Feature knots P, u16.
    pub const FEATURE_KNOTS: Range<usize> = 4..6;
    /// Dof knots N, u16.
    pub const DOF_KNOTS: Range<usize> = 6..8;
    /// Slope knots S, u16.
    pub const SLOPE_KNOTS: Range<usize> = 8..10;
    /// 1 where the end of a cycle is the start of the next, else 0.
    pub const CYCLIC: usize = 10;
    /// Zero.
    pub const RESERVED: Range<usize> = 11..12;
    /// Part of the input's departure from its mean that the output keeps, f32.
    pub const GAIN: Range<usize> = 12..16;
    /// Squared distance that 99% of the class's own frames are within, whitened, f32.
    pub const FAR: Range<usize> = 16..20;
    /// Mean forward speed, m/s, and yaw rate, rad/s, of the class, f32.
    pub const DRIFT: Range<usize> = 20..28;
    /// Seconds of the first and the second half of a cycle, f32.
    pub const SECONDS: Range<usize> = 28..36;
    /// The same of the outputs, f32.
    pub const OUTPUT_SECONDS: Range<usize> = 36..44;
    /// Zero.
    pub const END: Range<usize> = 44..48;
}

/// Where the parts of a class's tables begin, bytes from their start, and where they end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Parts {
    /// Feature knots.
    pub features: usize,
    /// Input table.
    pub input: usize,
    /// Output table.
    pub output: usize,
    /// Slopes.
    pub slopes: usize,
    /// Spreads.
    pub spread: usize,
    /// Contacts.
    pub contacts: usize,
    /// End, a multiple of 4.
    pub end: usize,
}

impl Parts {
    /// The parts of tables with these numbers of knots, features and dofs.
    pub const fn of(
        feature_knots: usize,
        dof_knots: usize,
        slope_knots: usize,
        features: usize,
        dofs: usize,
    ) -> Self {
        let at = 4 * feature_knots;
        let input = at + feature_knots * features;
        let output = input + dof_knots * dofs;
        let slopes = output + dof_knots * dofs;
        let spread = slopes + 2 * slope_knots * dofs;
        let contacts = spread + dofs;
        let end = (contacts + 2 * CONTACTS).next_multiple_of(4);
        Self { features: at, input, output, slopes, spread, contacts, end }
    }
}
