//! Places in a text.

use std::path::Path;

use crate::error::Place;

/// The beginnings of the lines of a text, so that the line of any place in it is found in the time of a search.
pub(crate) struct Lines(Vec<usize>);

impl Lines {
    /// The lines of a text.
    pub(crate) fn of(text: &str) -> Self {
        let ends = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
        Self(std::iter::once(0).chain(ends.map(|(i, _)| i + 1)).collect())
    }

    /// The number of the line, from 1, in which a byte of the text stands.
    pub(crate) fn line(&self, offset: usize) -> u32 {
        self.0.partition_point(|start| *start <= offset) as u32
    }

    /// The line and column of a byte of the text, which is that of a file.
    pub(crate) fn place(&self, path: &Path, text: &str, offset: usize) -> Place {
        let line = self.line(offset);
        let start = self.0.get(line as usize - 1).copied().unwrap_or(0);
        let before = text.get(start..offset).unwrap_or("");
        let column = before.chars().count() as u32 + 1;
        Place { file: path.into(), line: Some(line), column: Some(column) }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::Lines;

    #[test]
    fn each_byte_is_in_its_line() {
        let text = "a\n\nbc\r\nd";
        let lines = Lines::of(text);
        for offset in 0..text.len() {
            let line = text[..offset].matches('\n').count() as u32 + 1;
            assert_eq!(lines.line(offset), line, "{offset}");
            let column = text[..offset].rsplit('\n').next().unwrap().len() as u32 + 1;
            let place = lines.place(Path::new("f"), text, offset);
            assert_eq!((place.line, place.column), (Some(line), Some(column)), "{offset}");
        }
        assert_eq!(Lines::of("").line(0), 1);
    }
}
