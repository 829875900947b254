use alloc::string::{String, ToString};

use drt_math::Vec3;

use super::{TetFileError, TetFileErrorKind};

/// The words of a text, past blanks and comments.
pub(super) struct Words<'a> {
    file: &'a str,
    rest: &'a [u8],
    line: usize,
}

impl<'a> Words<'a> {
    pub(super) fn new(bytes: &'a [u8], file: &'a str) -> Self {
        Self { file, rest: bytes, line: 1 }
    }

    /// The error at the last word.
    pub(super) fn fail(&self, kind: TetFileErrorKind) -> TetFileError {
        TetFileError { file: self.file.to_string(), line: self.line, kind }
    }

    /// The next word, if there is one.
    pub(super) fn next(&mut self) -> Option<&'a [u8]> {
        self.skip(true);
        self.word()
    }

    /// The next word on the same line, if there is one.
    pub(super) fn next_in_line(&mut self) -> Option<&'a [u8]> {
        self.skip(false);
        self.word()
    }

    /// Leaves out the rest of the line.
    pub(super) fn end_line(&mut self) {
        while self.next_in_line().is_some() {}
    }

    /// Passes over blanks, comments and perhaps ends of lines.
    fn skip(&mut self, lines: bool) {
        loop {
            match self.rest {
                [b'#', ..] => {
                    let end = self.rest.iter().position(|b| *b == b'\n');
                    self.rest = &self.rest[end.unwrap_or(self.rest.len())..];
                }
                // The last line is the last that has something.
                [b'\n', more @ ..] if lines && !more.is_empty() => {
                    self.line += 1;
                    self.rest = more;
                }
                [b, more @ ..] if *b != b'\n' && b.is_ascii_whitespace() => self.rest = more,
                _ => return,
            }
        }
    }

    fn word(&mut self) -> Option<&'a [u8]> {
        let ends = |b: &u8| b.is_ascii_whitespace() || *b == b'#';
        let end = self.rest.iter().position(ends).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        (!word.is_empty()).then_some(word)
    }

    /// The next word as a number that is not negative.
    pub(super) fn number(&mut self, what: &'static str) -> Result<u64, TetFileErrorKind> {
        self.parsed(what, |_: &u64| true)
    }

    /// The next three words as a point.
    pub(super) fn point(&mut self) -> Result<Vec3, TetFileErrorKind> {
        let mut coordinate = || self.parsed("a finite coordinate", |x: &f64| x.is_finite());
        Ok(Vec3::from([coordinate()?, coordinate()?, coordinate()?]))
    }

    /// The next word as something.
    fn parsed<T: core::str::FromStr>(
        &mut self,
        expected: &'static str,
        valid: impl Fn(&T) -> bool,
    ) -> Result<T, TetFileErrorKind> {
        let word = self.next().ok_or(TetFileErrorKind::Cut(expected))?;
        let value = core::str::from_utf8(word).ok().and_then(|w| w.parse().ok());
        value
            .filter(valid)
            .ok_or_else(|| TetFileErrorKind::Unexpected { expected, found: shown(word) })
    }
}

/// A word of a file as a message shows it.
pub(super) fn shown(word: &[u8]) -> String {
    const LONGEST: usize = 40;
    String::from_utf8_lossy(&word[..word.len().min(LONGEST)]).into_owned()
}
