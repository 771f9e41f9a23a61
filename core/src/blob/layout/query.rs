//! Places in the query section, by the header's counts.
//!
//! ```text
//! unit        f32                       metres for one unit of length: a power of two
//! scales      [features] f32            metres for one step of a stored i8
//! steps       [features] f32            metres for one step of a component's sum
//! mean cloud  [window][joints][3] i16   units of length, oldest frame first, ground centroid at the origin, facing +Z
//! weights     [joints] u8               of the alignment; 0 for joints that it leaves out
//! groups      [features] u8             joint group of each feature; zeros behind them to a multiple of 4
//! components  [features][window][joints of the group][3] i16, at most 2^14
//! ```

/// Where the unit of length is.
pub const UNIT: usize = 0;
/// Where the feature scales start.
pub const SCALES: usize = 4;
/// Largest number of a component.
pub const MAX_COMPONENT: u16 = 1 << 14;
/// Most that the alignment weights of all joints sum up to over a window.
pub const MAX_WEIGHT_SUM: usize = u16::MAX as usize;

/// Where the steps of the components' sums start.
pub const fn steps(features: usize) -> usize {
    SCALES + 4 * features
}

/// Where the mean cloud starts.
pub const fn mean(features: usize) -> usize {
    steps(features) + 4 * features
}

/// Where the alignment weights start.
pub const fn weights(window: usize, joints: usize, features: usize) -> usize {
    mean(features) + 6 * window * joints
}

/// Where the feature groups start.
pub const fn groups(window: usize, joints: usize, features: usize) -> usize {
    weights(window, joints, features) + joints
}

/// Where the components start.
pub const fn components(window: usize, joints: usize, features: usize) -> usize {
    (groups(window, joints, features) + features).next_multiple_of(4)
}
