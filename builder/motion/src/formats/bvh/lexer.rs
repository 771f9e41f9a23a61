//! Text to tokens, each with its line and column.
//!
//! Words end at white space of any kind (spaces, tabs, form feeds, non-breaking spaces), at a brace or at a colon.
//! Lines end in LF, CR LF or CR. Linear in the text, no allocation.

/// A word, brace or colon, with its position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Token<'t> {
    pub text: &'t str,
    pub line: usize,
    pub column: usize,
}

/// Walks through a text.
#[derive(Debug, Clone)]
pub(super) struct Lexer<'t> {
    text: &'t str,
    at: usize,
    line: usize,
    column: usize,
}

impl<'t> Lexer<'t> {
    pub fn new(text: &'t str) -> Self {
        Lexer { text, at: 0, line: 1, column: 1 }
    }

    /// Position of the next character.
    pub fn place(&self) -> (usize, usize) {
        (self.line, self.column)
    }

    /// Bytes of the whole text.
    pub fn length(&self) -> usize {
        self.text.len()
    }

    /// Bytes that are still to come.
    pub fn left(&self) -> usize {
        self.text.len() - self.at
    }

    fn peek_char(&self) -> Option<char> {
        self.text[self.at..].chars().next()
    }

    fn advance(&mut self, c: char) {
        self.at += c.len_utf8();
        let cr_lf = c == '\r' && self.text[self.at..].starts_with('\n');
        if (c == '\n' || c == '\r') && !cr_lf {
            self.line += 1;
            self.column = 1;
        } else {
            self.column += 1;
        }
    }

    fn skip_space(&mut self) {
        while let Some(c) = self.peek_char() {
            if !is_space(c) {
                break;
            }
            self.advance(c);
        }
    }

    /// The next token, or `None` at the end.
    pub fn next(&mut self) -> Option<Token<'t>> {
        self.skip_space();
        let (line, column) = self.place();
        let start = self.at;
        let first = self.peek_char()?;
        self.advance(first);
        if !is_mark(first) {
            while let Some(c) = self.peek_char() {
                if is_space(c) || is_mark(c) {
                    break;
                }
                self.advance(c);
            }
        }
        Some(Token { text: &self.text[start..self.at], line, column })
    }

    /// The next token without taking it.
    pub fn peek(&self) -> Option<Token<'t>> {
        self.clone().next()
    }

    /// A name: the rest of the line up to a brace, with spaces and colons. `None` if it is empty.
    pub fn name(&mut self) -> Option<Token<'t>> {
        self.skip_space();
        let (line, column) = self.place();
        let start = self.at;
        while let Some(c) = self.peek_char() {
            if matches!(c, '\n' | '\r' | '{' | '}') {
                break;
            }
            self.advance(c);
        }
        let text = self.text[start..self.at].trim_matches(is_space);
        (!text.is_empty()).then_some(Token { text, line, column })
    }
}

fn is_space(c: char) -> bool {
    c.is_whitespace() || c == '\u{feff}' || c == '\0'
}

fn is_mark(c: char) -> bool {
    matches!(c, '{' | '}' | ':')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_line_ends_count_once() {
        for text in ["a\nb\nc", "a\r\nb\r\nc", "a\rb\rc"] {
            let mut lexer = Lexer::new(text);
            let lines: Vec<usize> = std::iter::from_fn(|| lexer.next()).map(|t| t.line).collect();
            assert_eq!(lines, [1, 2, 3], "{text:?}");
        }
    }

    #[test]
    fn names_keep_spaces_and_colons() {
        let mut lexer = Lexer::new(" mixamorig:Left Foot \t{");
        let name = lexer.name().unwrap();
        assert_eq!((name.text, name.column), ("mixamorig:Left Foot", 2));
        assert_eq!(lexer.next().unwrap().text, "{");
        assert_eq!(lexer.name(), None);
    }

    #[test]
    fn marks_need_no_space() {
        let mut lexer = Lexer::new("Frames:20{}");
        let words: Vec<&str> = std::iter::from_fn(|| lexer.next()).map(|t| t.text).collect();
        assert_eq!(words, ["Frames", ":", "20", "{", "}"]);
    }
}
