//! Tables of text.

use std::fmt;

use serde_json::{Map, Value};

/// Rows under heads, each column as wide as its widest entry.
pub(super) struct Table<const N: usize> {
    heads: [&'static str; N],
    rows: Vec<[String; N]>,
}

impl<const N: usize> Table<N> {
    pub(super) fn new(
        heads: [&'static str; N],
        rows: impl IntoIterator<Item = [String; N]>,
    ) -> Self {
        Self { heads, rows: rows.into_iter().collect() }
    }

    /// The rows under their heads, with numbers for what reads as one, and without empty entries.
    pub(super) fn json(&self) -> Value {
        let value = |cell: &String| match cell.parse::<u64>() {
            Ok(number) => number.into(),
            Err(_) => cell.parse::<f64>().map_or_else(|_| cell.as_str().into(), Value::from),
        };
        let row = |row: &[String; N]| {
            let entries = self.heads.iter().zip(row).filter(|(_, cell)| !cell.is_empty());
            let entries = entries
                .map(|(head, cell)| (head.replace(" | ", "_").replace(' ', "_"), value(cell)));
            Value::Object(entries.collect::<Map<_, _>>())
        };
        self.rows.iter().map(row).collect()
    }
}

impl<const N: usize> fmt::Display for Table<N> {
    /// Nothing at all without rows.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.rows.is_empty() {
            return Ok(());
        }
        let widths: [usize; N] = std::array::from_fn(|c| {
            let cells = self.rows.iter().map(|row| row[c].chars().count());
            cells.fold(self.heads[c].chars().count(), usize::max)
        });
        let heads = self.heads.map(String::from);
        for row in std::iter::once(&heads).chain(&self.rows) {
            let line: String = row
                .iter()
                .enumerate()
                .map(|(c, cell)| format!("{cell:w$}  ", w = widths[c]))
                .collect();
            writeln!(f, "{}", line.trim_end())?;
        }
        writeln!(f)
    }
}
