//! Log lines for firmware authors: the database and degraded frames. Without the feature `defmt` they cost nothing.

// defmt needs the critical section of this crate.
#[cfg(all(feature = "defmt", target_arch = "arm"))]
use cortex_m as _;
use gestus_core::{BlobError, Report};

/// The database is open.
pub fn opened(_frames: usize, _classes: usize, _instructions: u64) {
    #[cfg(feature = "defmt")]
    defmt::info!("database open: {} frames, {} classes, {} instructions", _frames, _classes, _instructions);
}

/// The database can't be opened.
pub fn refused(_error: BlobError) {
    #[cfg(feature = "defmt")]
    defmt::error!("the database can't be opened: {}", _error);
}

/// The database does not fit the stylizer.
pub fn unfit(_error: gestus_core::ConfigError) {
    #[cfg(feature = "defmt")]
    defmt::error!("the database does not fit this image: {}", _error);
}

/// A step was done.
pub fn step(_report: &Report, _instructions: u32) {
    #[cfg(feature = "defmt")]
    if _report.degraded.is_empty() {
        defmt::trace!("step: {} instructions, {}", _instructions, _report);
    } else {
        defmt::warn!(
            "degraded: {}, {} visits, {} instructions",
            _report.degraded,
            _report.visits,
            _instructions
        );
    }
}
