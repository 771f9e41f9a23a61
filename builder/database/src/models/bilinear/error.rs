//! Why there is no model, or no cycle of it.

use thiserror::Error;

use crate::registration::warp::WarpError;

/// A corpus without the cycles for a bilinear model.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum BilinearError {
    /// A style without cycles of the action.
    #[error("{style} has {have} cycles of {action}, and needs {need}: slow, medium and fast ones")]
    Cycles {
        /// The action.
        action: String,
        /// The style.
        style: String,
        /// Cycles found.
        have: usize,
        /// Cycles needed.
        need: usize,
    },
    /// A speed that is too far from those of the data.
    #[error(
        "a speed of {speed_m_s:.2} m/s; {slowest:.2} to {fastest:.2} m/s can be made of the data in this style"
    )]
    Speed {
        /// The speed that was asked for, metres a second.
        speed_m_s: f64,
        /// The slowest possible one.
        slowest: f64,
        /// The fastest possible one.
        fastest: f64,
    },
    /// A cycle that is too long or too short to be warped.
    #[error(
        "a cycle of {style} lasts {frames} frames, and the one of the input style (--from) {base}: one can be at most {slope} \
         times as long as the other; check the files' frame times, or leave the style out (--styles)"
    )]
    Lengths {
        /// Its style.
        style: String,
        /// Its frames.
        frames: usize,
        /// Frames of the cycle that it is warped onto.
        base: usize,
        /// How many times as long one can be as the other.
        slope: usize,
    },
    /// A cycle that can't be warped for another reason.
    #[error("a cycle of {style} can't be warped")]
    Warp {
        /// Its style.
        style: String,
        /// Why.
        source: WarpError,
    },
}
