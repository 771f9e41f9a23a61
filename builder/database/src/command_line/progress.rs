//! Progress of work that takes longer than a second: a bar on a terminal, and a line now and then where there is none.
//! Without the feature `command-line` it is not shown.

#[cfg(feature = "command-line")]
use std::io::{self, IsTerminal};

#[cfg(feature = "command-line")]
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

#[cfg(feature = "command-line")]
use super::plain::Plain;

/// A bar on standard error; plain lines if that is not a terminal.
#[cfg(feature = "command-line")]
pub fn bar(steps: usize, what: &str) -> ProgressBar {
    let steps = steps as u64;
    let (bar, template) = if io::stderr().is_terminal() {
        (ProgressBar::new(steps), "{msg} [{bar:30}] {pos}/{len}, {eta} left")
    } else {
        let plain = Plain::new(|line: &str| super::outputs::note(line));
        let target = ProgressDrawTarget::term_like_with_hz(Box::new(plain), 1);
        (ProgressBar::with_draw_target(Some(steps), target), "{msg}: {pos} of {len}, {eta} left")
    };
    if let Ok(style) = ProgressStyle::with_template(template) {
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
