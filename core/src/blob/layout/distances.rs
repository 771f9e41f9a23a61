//! Beside the features: what makes distances to them cheap, and classes that are far away cheaper still.
//!
//! ```text
//! falls   [16]        f32   part of a far class's distance that is left after 1, 2, ... 16 frames
//! norms   [frames]    u32   weighted squared length of each captured frame's feature
//! ```

/// Numbers of frames for which the fall of distances is stored.
pub const FALLS: usize = 16;

/// Length of the section.
pub const fn length(frames: usize) -> usize {
    4 * (FALLS + frames)
}
