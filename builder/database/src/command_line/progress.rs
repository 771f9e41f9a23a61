//! Progress bars for work that takes longer than a second.

#[cfg(feature = "command-line")]
use indicatif::{ProgressBar, ProgressStyle};

/// A bar on standard error; hidden if that is not a terminal.
#[cfg(feature = "command-line")]
pub fn bar(steps: usize, what: &str) -> ProgressBar {
    let bar = ProgressBar::new(steps as u64);
    if let Ok(style) = ProgressStyle::with_template("{msg} [{bar:30}] {pos}/{len}, {eta} left") {
        bar.set_style(style.progress_chars("=> "));
    }
    bar.set_message(what.to_owned());
    bar
}

/// A bar that is not shown.
#[cfg(not(feature = "command-line"))]
pub struct Silent;

#[cfg(not(feature = "command-line"))]
impl Silent {
    /// A step is done.
    pub fn inc(&self, _: u64) {}
    /// All is done.
    pub fn finish_and_clear(&self) {}
}

/// A bar that is not shown.
#[cfg(not(feature = "command-line"))]
pub fn bar(_: usize, _: &str) -> Silent {
    Silent
}
