//! Words and lines of a BVH file, with their places.

use super::{Place, Problem};

pub(super) type Fault = (Option<Place>, Problem);

/// A word and where it stands.
#[derive(Debug, Clone, Copy)]
pub(super) struct Word<'a> {
    pub text: &'a str,
    pub place: Place,
}

/// Reads words one after another. Braces are words of their own, also without blanks around them.
pub(super) struct Lexer<'a> {
    text: &'a str,
    at: usize,
    line: usize,
    line_start: usize,
}

impl<'a> Lexer<'a> {
    pub fn new(text: &'a str) -> Self {
        // A byte order mark is no text.
        Self { text: text.strip_prefix('\u{feff}').unwrap_or(text), at: 0, line: 1, line_start: 0 }
    }

    pub fn place(&self) -> Place {
        let column = self.text[self.line_start..self.at].chars().count() + 1;
        Place { line: self.line, column }
    }

    fn skip(&mut self, stop_at_line_end: bool) {
        let bytes = self.text.as_bytes();
        while let Some(&b) = bytes.get(self.at) {
            let line_end = b == b'\n' || (b == b'\r' && bytes.get(self.at + 1) != Some(&b'\n'));
            if line_end {
                if stop_at_line_end {
                    return;
                }
                self.at += 1;
                self.line += 1;
                self.line_start = self.at;
            } else if b.is_ascii_whitespace() || b == 0x0b {
                self.at += 1;
            } else if let Some(c) = self.text[self.at..].chars().next().filter(|c| c.is_whitespace()) {
                self.at += c.len_utf8();
            } else {
                return;
            }
        }
    }

    fn word(&mut self) -> Option<Word<'a>> {
        let rest = &self.text[self.at..];
        let first = rest.chars().next()?;
        if first == '\n' || first == '\r' {
            return None;
        }
        let place = self.place();
        let end = if first == '{' || first == '}' {
            1
        } else {
            rest.find(|c: char| c.is_whitespace() || c == '{' || c == '}' || c == '\u{b}')
                .unwrap_or(rest.len())
        };
        self.at += end;
        Some(Word { text: &rest[..end], place })
    }

    /// The next word, on this line or below; `None` at the end of the file.
    pub fn next(&mut self) -> Option<Word<'a>> {
        self.skip(false);
        self.word()
    }

    /// The next word of this line; `None` at its end.
    pub fn next_on_line(&mut self) -> Option<Word<'a>> {
        self.skip(true);
        self.word()
    }

    /// The rest of this line without blanks around it: names may hold blanks.
    pub fn rest_of_line(&mut self) -> &'a str {
        self.skip(true);
        let rest = &self.text[self.at..];
        let end = rest.find(['\n', '\r', '{', '}']).unwrap_or(rest.len());
        self.at += end;
        rest[..end].trim()
    }

    /// The next word, which has to be `expected`, in any case.
    pub fn expect(&mut self, expected: &str) -> Result<Word<'a>, Fault> {
        let word = self.next();
        match word {
            Some(w) if w.text.eq_ignore_ascii_case(expected) => Ok(w),
            _ => Err(self.unexpected(&format!("`{expected}`"), word)),
        }
    }

    pub fn unexpected(&self, expected: &str, found: Option<Word<'_>>) -> Fault {
        let place = found.map_or_else(|| self.place(), |w| w.place);
        let found = found.map_or("the end of the file".to_owned(), |w| format!("`{}`", shortened(w.text)));
        (Some(place), Problem::Expected { expected: expected.to_owned(), found })
    }

    /// The next word as a finite number.
    pub fn number(&mut self) -> Result<f64, Fault> {
        match self.next() {
            Some(word) => number(word),
            None => Err(self.unexpected("a number", None)),
        }
    }
}

/// A word as a finite number.
pub(super) fn number(word: Word<'_>) -> Result<f64, Fault> {
    match word.text.parse::<f64>() {
        // What only overflows reads as infinite.
        Ok(value) if value.is_finite() && value.abs() < 1e15 => Ok(value),
        parsed => {
            let hint = match parsed {
                Ok(value) if value.is_nan() => ": the motion has a gap there; fill it and export again",
                Ok(_) => ": the number is too large",
                Err(_) if word.text.contains(',') => ": decimals need a point, not a comma",
                Err(_) => "",
            };
            Err((Some(word.place), Problem::Number { found: shortened(word.text), hint }))
        }
    }
}

fn shortened(text: &str) -> String {
    if text.chars().count() <= 40 { text.to_owned() } else { text.chars().take(40).chain(['…']).collect() }
}
