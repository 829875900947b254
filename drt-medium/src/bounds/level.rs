//! Ranges of a field over equal cells.

use alloc::vec::Vec;

use crate::bounds::march::Cells;
use crate::bounds::range::Range;
use crate::grid::unflatten;

/// A range for each cell, in as little memory as it takes: rays look at many of them.
#[derive(Clone, PartialEq)]
pub(super) struct Level {
    cells: Cells,
    channels: usize,
    /// Least value, largest magnitude and mean, channel by channel.
    numbers: Vec<[f64; 3]>,
}

impl Level {
    pub(super) fn new(cells: Cells, channels: usize, of: impl Fn([usize; 3]) -> Range) -> Self {
        let size = cells.size();
        let count: usize = size.iter().product();
        let mut numbers = Vec::new();
        numbers.reserve_exact(count * channels);
        for n in 0..count {
            numbers.extend(stored(&of(unflatten(size, n))).take(channels));
        }
        Self { cells, channels, numbers }
    }

    pub(super) fn cells(&self) -> &Cells {
        &self.cells
    }

    /// The range of the cell with a number, x fastest.
    #[inline(always)]
    pub(super) fn range(&self, cell: usize) -> Range {
        match self.channels {
            1 => Range::by_channel([self.numbers[cell]; 3]),
            _ => Range::by_channel([0, 1, 2].map(|c| self.numbers[3 * cell + c])),
        }
    }

    pub(super) fn range_at(&self, cell: [usize; 3]) -> Range {
        self.range(self.number(cell))
    }

    pub(super) fn set(&mut self, cell: [usize; 3], range: &Range) {
        let at = self.number(cell) * self.channels;
        let numbers = &mut self.numbers[at..at + self.channels];
        numbers.iter_mut().zip(stored(range)).for_each(|(number, new)| *number = new);
    }

    pub(super) fn ranges(&self) -> impl Iterator<Item = Range> + '_ {
        (0..self.numbers.len() / self.channels).map(|cell| self.range(cell))
    }

    fn number(&self, [x, y, z]: [usize; 3]) -> usize {
        let [nx, ny, _] = self.cells.size();
        (z * ny + y) * nx + x
    }
}

fn stored(range: &Range) -> impl Iterator<Item = [f64; 3]> + use<> {
    let [min, max, mean] = [range.min, range.max, range.mean].map(|c| c.to_array());
    (0..3).map(move |c| [min[c], max[c], mean[c]])
}
