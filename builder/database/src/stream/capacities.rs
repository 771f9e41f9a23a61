//! The capacities of stylizers on the host.

/// Evaluates an expression with the capacities J, K and C of a stylizer on the host: those of the reference board, if the
/// database's counts and the neighbors `k` fit them, else room for every database.
#[macro_export]
macro_rules! with_capacities {
    ($counts:expr, $k:expr, $J:ident, $K:ident, $C:ident => $run:expr) => {
        if $counts.joints <= 22 && $counts.classes <= 28 && $k <= 40 {
            const $J: usize = 22;
            const $K: usize = 40;
            const $C: usize = 28;
            $run
        } else {
            const $J: usize = ::gestus_core::blob::layout::MAX_JOINTS;
            const $K: usize = $crate::stream::MOST_NEIGHBORS;
            const $C: usize = $crate::stream::MOST_CLASSES;
            $run
        }
    };
}
