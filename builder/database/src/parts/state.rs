//! RAM that a stylizer and the link take.

use gestus_core::link::buffer_length;

/// Bytes that do not depend on the capacities.
pub const FIXED_BYTES: usize = 2812;
/// Bytes that a joint adds.
pub const JOINT_BYTES: usize = 661;
/// Bytes that a neighbor adds.
pub const NEIGHBOR_BYTES: usize = 102;
/// Bytes that a class adds, besides its neighbors.
pub const CLASS_BYTES: usize = 17;
/// Bytes that a neighbor adds in each class.
pub const ROW_BYTES: usize = 2;

/// Most bytes of `Stylizer<J, K, C>` on a 32-bit target; up to 10 too many if K is even, by how the fields align. An odd K
/// counts as the next even one: each class's row of neighbors is padded.
pub const fn state_bytes(j: usize, k: usize, c: usize) -> usize {
    let k = k.next_multiple_of(2);
    FIXED_BYTES + JOINT_BYTES * j + NEIGHBOR_BYTES * k + CLASS_BYTES * c + ROW_BYTES * k * c
}

/// Bytes of the link's server for poses of that many joints: two buffers and the server's state.
pub const fn link_bytes(j: usize) -> usize {
    2 * buffer_length(j) + 200
}

#[cfg(test)]
mod tests {
    use gestus_core::{Stylizer, link::Server};

    use super::*;

    const PORTING: &str = include_str!("../../../../docs/PORTING.md");

    /// Bytes that pointers and lengths take more on this machine if they are twice as wide: those of the database's
    /// slices, and of a list in each class.
    const WIDER: core::ops::RangeInclusive<usize> = if size_of::<usize>() == 4 { 0..=0 } else { 200..=264 };
    const WIDER_CLASS: usize = size_of::<usize>() - 4;

    macro_rules! sizes {
        ($(($j:literal, $k:literal, $c:literal)),*) => {
            [$((($j, $k, $c), size_of::<Stylizer<'static, $j, $k, $c>>())),*]
        };
    }

    /// Capacities that docs/PORTING.md lists, and some more.
    const SIZES: [((usize, usize, usize), usize); 9] = sizes![
        (22, 40, 28),
        (22, 40, 8),
        (22, 8, 28),
        (22, 40, 70),
        (32, 40, 28),
        (12, 16, 8),
        (12, 16, 4),
        (9, 16, 4),
        (64, 64, 256)
    ];

    #[test]
    fn the_formula_is_size_of() {
        let surplus: Vec<usize> = SIZES
            .iter()
            .map(|&((j, k, c), size)| size.wrapping_sub(state_bytes(j, k, c) + WIDER_CLASS * c))
            .collect();
        assert!(
            surplus.iter().all(|s| WIDER.contains(s)),
            "sizes have changed: measure them for a 32-bit target and correct FIXED_BYTES and the others, and the \
             table in docs/PORTING.md: {SIZES:?} are {surplus:?} more than the formula's"
        );
        // What depends on J, K and C is the same on all machines, up to alignment.
        let (least, most) = (surplus.iter().min(), surplus.iter().max());
        assert!(most.zip(least).is_some_and(|(a, b)| a - b <= 16), "{SIZES:?}: {surplus:?}");
    }

    /// With an odd K they took up to 60 bytes more. These are padded by the same on machines of both widths.
    #[test]
    fn no_stylizer_takes_more_than_the_formula() {
        let odd = sizes![(22, 3, 28), (22, 15, 28), (9, 15, 8), (32, 3, 28), (64, 7, 28)];
        for ((j, k, c), size) in odd {
            let most = state_bytes(j, k, c) + WIDER_CLASS * c + WIDER.end();
            assert!(size <= most, "{j} {k} {c}: {size} of {most}");
        }
    }

    #[test]
    fn a_server_takes_what_is_said() {
        const N: usize = buffer_length(22);
        let size = size_of::<Server<'static, 'static, (), 22, 40, 28, N>>();
        assert!((2 * N..=link_bytes(22)).contains(&size), "{size}");
    }

    #[test]
    fn the_document_has_the_formula_and_the_sizes() {
        let formula = format!(
            "{FIXED_BYTES} + {JOINT_BYTES} J + {NEIGHBOR_BYTES} K + {CLASS_BYTES} C + {ROW_BYTES} K C"
        );
        assert!(PORTING.contains(&formula), "docs/PORTING.md does not say: {formula}");
        for ((j, k, c), _) in &SIZES[..8] {
            let row = format!("| {j} | {k} | {c} | {} |", state_bytes(*j, *k, *c));
            assert!(PORTING.contains(&row), "docs/PORTING.md has no row: {row}");
        }
    }
}
