//! What a run has been through, and the tables that tell of it.

use std::fmt::Write as _;
use std::path::Path;

use crate::CliError;
use crate::error::Place;
use crate::files::checksum;
use crate::files::input_file::read_text;

/// The name of the table of values.
pub(super) const PARAMETERS: &str = "params.csv";
/// The name of the table of losses.
pub(super) const LOSSES: &str = "loss.csv";

/// Values before the first step and after each one, and the loss where it was seen.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct History {
    pub(super) values: Vec<Vec<f64>>,
    pub(super) losses: Vec<f64>,
}

impl History {
    /// `iteration,NAME1,NAME2,…`: numbers in the shortest form that is read back to the same bits.
    pub(super) fn parameters<'a>(&self, names: impl Iterator<Item = &'a str>) -> String {
        let mut text = String::from("iteration");
        for name in names {
            text += ",";
            text += name;
        }
        text += "\n";
        for (i, row) in self.values.iter().enumerate() {
            // Writing to a string cannot fail.
            let _ = write!(text, "{i}");
            for value in row {
                let _ = write!(text, ",{value:?}");
            }
            text += "\n";
        }
        text
    }

    /// `iteration,loss`, in the same form.
    pub(super) fn losses(&self) -> String {
        let mut text = String::from("iteration,loss\n");
        for (i, loss) in self.losses.iter().enumerate() {
            let _ = writeln!(text, "{i},{loss:?}");
        }
        text
    }

    /// The first so many values and losses.
    pub(super) fn start(&self, [values, losses]: [usize; 2]) -> Self {
        let of_losses = &self.losses[..losses.min(self.losses.len())];
        Self {
            values: self.values.iter().take(values).cloned().collect(),
            losses: of_losses.to_vec(),
        }
    }

    /// Checksums of the tables as they are after `steps` steps.
    pub(super) fn sums<'a>(&self, steps: usize, names: impl Iterator<Item = &'a str>) -> [u32; 2] {
        let cut = self.start([steps + 1, steps]);
        [checksum::of_text(&cut.parameters(names)), checksum::of_text(&cut.losses())]
    }

    /// Refuses tables that are not those of a checkpoint.
    pub(super) fn check<'a>(
        &self,
        folder: &Path,
        steps: usize,
        names: impl Iterator<Item = &'a str>,
        expected: [u32; 2],
    ) -> Result<(), CliError> {
        let found = self.sums(steps, names);
        let differs = [PARAMETERS, LOSSES].into_iter().zip(found.iter().zip(&expected));
        match differs.into_iter().find(|(_, (a, b))| a != b) {
            None => Ok(()),
            Some((name, _)) => Err(CliError::input(
                &Place::file(&folder.join(name)),
                "its numbers are not those of the checkpoint beside it; --restart begins anew",
            )),
        }
    }

    /// Reads the tables of a folder as they were after `steps` steps; what was written later is left
    /// out.
    pub(super) fn read(folder: &Path, steps: usize, parameters: usize) -> Result<Self, CliError> {
        let values = read_table(&folder.join(PARAMETERS), steps + 1, parameters)?;
        let losses = read_table(&folder.join(LOSSES), steps, 1)?;
        Ok(Self { values, losses: losses.into_iter().flatten().collect() })
    }
}

/// The first `rows` rows of a table without its first column.
fn read_table(path: &Path, rows: usize, columns: usize) -> Result<Vec<Vec<f64>>, CliError> {
    let text = read_text(path, None)?;
    let row = |(i, line): (usize, &str)| {
        let mut cells = line.split(',');
        let first = cells.next()?.parse::<usize>().ok()?;
        let numbers: Vec<f64> = cells.map(|c| c.parse().ok()).collect::<Option<_>>()?;
        (first == i && numbers.len() == columns).then_some(numbers)
    };
    let mut table = Vec::new();
    for (i, line) in text.lines().skip(1).take(rows).enumerate() {
        let place = Place { line: Some(i as u32 + 2), ..Place::file(path) };
        table.push(row((i, line)).ok_or_else(|| {
            CliError::input(&place, format!("expected iteration {i} and {columns} numbers"))
        })?);
    }
    if table.len() < rows {
        let message = format!("it has {} rows, fewer than the checkpoint's {rows}", table.len());
        return Err(CliError::input(&Place::file(path), message));
    }
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Folder;

    #[test]
    fn tables_come_back_to_the_bit() {
        let folder = Folder::new();
        let awkward = [0.1 + 0.2, -0.0, 5e-324, f64::MAX, 1.0 / 3.0, 1e-7];
        let history = History {
            values: awkward.iter().map(|v| vec![*v, -v]).collect(),
            losses: awkward.to_vec(),
        };
        folder.file(PARAMETERS, history.parameters(["a", "é b"].into_iter()));
        folder.file(LOSSES, history.losses());
        let read = History::read(folder.path(), 5, 2).unwrap();
        let bits = |h: &History| -> Vec<u64> {
            h.values.iter().flatten().chain(&h.losses).map(|v| v.to_bits()).collect()
        };
        let cut = History { losses: history.losses[..5].to_vec(), ..history.clone() };
        assert_eq!(bits(&read), bits(&cut));
        assert!(History::read(folder.path(), 7, 2).is_err());
        assert!(History::read(folder.path(), 3, 1).is_err());
    }
}
