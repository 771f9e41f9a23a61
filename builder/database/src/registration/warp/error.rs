//! Errors of time warping.

use thiserror::Error;

/// Motions that can't be warped onto each other.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum WarpError {
    /// A motion without frames.
    #[error("a motion without frames can't be warped")]
    Empty,
    /// Rows of different length.
    #[error(
        "frames have {have} dofs where {need} are needed: both motions need the same dofs in every frame"
    )]
    Dofs {
        /// Dofs of the first frame of the first motion.
        need: usize,
        /// Dofs found.
        have: usize,
    },
    /// NaN or infinity.
    #[error("frame {frame} has a dof that is not finite")]
    NotFinite {
        /// The frame, from 0.
        frame: usize,
    },
    /// Lengths that the slope limit does not allow.
    #[error("{from} frames can't be warped onto {to} with slopes of 1/{slope} to {slope}")]
    Lengths {
        /// Frames of the first.
        from: usize,
        /// Frames of the second.
        to: usize,
        /// The slope limit.
        slope: usize,
    },
}
