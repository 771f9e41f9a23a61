//! Progress without a terminal.

use std::{
    fmt, io,
    sync::Mutex,
    time::{Duration, Instant},
};

use indicatif::TermLike;

/// Time between two lines.
const BETWEEN: Duration = Duration::from_secs(5);

/// A file or a pipe: takes whole lines, and cannot go back.
pub(super) struct Plain<F> {
    write: F,
    last: Mutex<Instant>,
}

impl<F> fmt::Debug for Plain<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Plain")
    }
}

impl<F: Fn(&str)> Plain<F> {
    /// `write` takes each line.
    pub fn new(write: F) -> Self {
        Self { write, last: Mutex::new(Instant::now()) }
    }

    /// Writes a line, if the last one was some time ago.
    fn line(&self, text: &str, now: Instant) {
        let text = text.trim();
        let Ok(mut last) = self.last.lock() else { return };
        if !text.is_empty() && now.duration_since(*last) >= BETWEEN {
            *last = now;
            (self.write)(text);
        }
    }
}

impl<F: Fn(&str) + Send + Sync> TermLike for Plain<F> {
    fn width(&self) -> u16 {
        120
    }

    fn move_cursor_up(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn move_cursor_down(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn move_cursor_right(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn move_cursor_left(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn write_line(&self, text: &str) -> io::Result<()> {
        self.line(text, Instant::now());
        Ok(())
    }

    fn write_str(&self, text: &str) -> io::Result<()> {
        self.line(text, Instant::now());
        Ok(())
    }

    fn clear_line(&self) -> io::Result<()> {
        Ok(())
    }

    fn flush(&self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_comes_now_and_then() {
        let written = Mutex::new(Vec::new());
        let plain = Plain::new(|line: &str| written.lock().unwrap().push(line.to_owned()));
        let start = Instant::now();
        for second in 0..30 {
            plain.line(&format!("work: {second} of 30"), start + Duration::from_secs(second));
            plain.line("  ", start + Duration::from_secs(second));
        }
        let written = written.lock().unwrap();
        assert!((4..=6).contains(&written.len()), "{written:?}");
        assert!(written[0].starts_with("work: ") && written.iter().all(|l| !l.contains('\u{1b}')));
    }
}
