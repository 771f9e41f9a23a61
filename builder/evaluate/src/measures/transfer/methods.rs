//! The variants of the transfer that are compared.

use gestus_database::models::statistic::transfer::Options;

/// A variant, by name.
pub(super) type Variant = (&'static str, fn() -> Options);

/// The variants: ours, which weighs frames by the warp; the paper's, through the warp and back; and with Euler
/// angles, which the paper holds against its own.
pub(super) const METHODS: [Variant; 3] = [
    ("transfer", Options::default),
    ("transfer-literal", || Options { literal: true, ..Options::default() }),
    ("transfer-euler", || Options { euler: true, ..Options::default() }),
];
