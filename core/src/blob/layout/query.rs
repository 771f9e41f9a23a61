//! Places in the query section, by the header's counts. All numbers f32 but the groups.
//!
//! ```text
//! mean cloud  [window][joints][3]   metres, oldest frame first, ground centroid at the origin, facing +Z
//! weights     [joints]              of the alignment; 0 for joints that it leaves out
//! scales      [features]            metres for one step of a stored i8
//! groups      [features] u8         joint group of each feature, padded with zeros to a multiple of 4
//! components  [features][window][joints of the group][3]
//! ```

/// Where the alignment weights start.
pub const fn weights(window: usize, joints: usize) -> usize {
    12 * window * joints
}

/// Where the feature scales start.
pub const fn scales(window: usize, joints: usize) -> usize {
    weights(window, joints) + 4 * joints
}

/// Where the feature groups start.
pub const fn groups(window: usize, joints: usize, features: usize) -> usize {
    scales(window, joints) + 4 * features
}

/// Where the components start.
pub const fn components(window: usize, joints: usize, features: usize) -> usize {
    groups(window, joints, features) + features.next_multiple_of(4)
}
