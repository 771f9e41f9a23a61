//! Shared by the commands `gestus` and `gestus-sim`: options of a stylizer, checks of output files, progress, wasm modules.
//!
//! Without the feature `command-line`, as in a wasm module, there is only a progress that shows nothing.

#[cfg(feature = "command-line")]
pub mod blob;
#[cfg(feature = "command-line")]
pub mod lenient;
#[cfg(feature = "command-line")]
pub mod options;
#[cfg(feature = "command-line")]
pub mod outputs;
#[cfg(feature = "command-line")]
pub mod parameters;
#[cfg(feature = "command-line")]
mod plain;
pub mod progress;
#[cfg(feature = "command-line")]
pub mod resolve;
#[cfg(feature = "command-line")]
pub mod stylizer_args;
#[cfg(feature = "command-line")]
pub mod wasm;
