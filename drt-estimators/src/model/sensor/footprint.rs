use crate::model::filter::{Filter, FilterRow};

/// A pixel reached by an image point, and how much the point counts there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelWeight {
    /// Column and row.
    pub pixel: [u32; 2],
    /// The filter P there, per square pixel.
    pub weight: f64,
    /// Gradient of the weight with respect to the image point, in pixels.
    pub gradient: [f64; 2],
}

/// The pixels on the film whose filters reach an image point, row by row.
///
/// Weights are those of the normalised filter, whichever part of it lies on the film: an estimate
/// is the mean of contributions over samples, never divided by a sum of weights.
#[derive(Clone, Debug)]
pub struct Footprint<'a> {
    columns: [u32; 2],
    rows: [u32; 2],
    next: [u32; 2],
    /// Of the first column on, of the next one on, and of the rows after the present one.
    first: FilterRow<'a>,
    across: FilterRow<'a>,
    down: FilterRow<'a>,
    /// The factor of the present row, and its derivative.
    of_row: (f64, f64),
}

impl<'a> Footprint<'a> {
    pub(super) fn new(filter: &'a Filter, film: [u32; 2], point: [f64; 2]) -> Self {
        let [columns, rows] = [0, 1].map(|k| {
            let reached = filter.reached(point[k], film[k]);
            [reached.start, reached.end]
        });
        // An empty range of columns leaves nothing in any row.
        let rows = if columns[0] < columns[1] { rows } else { [0, 0] };
        let next = [columns[0], rows[0]];
        let [first, mut down] = [0, 1].map(|k| filter.row(point[k], next[k]));
        let of_row = down.next().unwrap_or_default();
        Self { columns, rows, next, first, across: first, down, of_row }
    }
}

impl Iterator for Footprint<'_> {
    type Item = PixelWeight;

    fn next(&mut self) -> Option<PixelWeight> {
        let [column, row] = self.next;
        if row >= self.rows[1] {
            return None;
        }
        let ((x, sx), (y, sy)) = (self.across.next()?, self.of_row);
        if column + 1 < self.columns[1] {
            self.next[0] += 1;
        } else {
            self.next = [self.columns[0], row + 1];
            self.across = self.first;
            self.of_row = self.down.next()?;
        }
        Some(PixelWeight { pixel: [column, row], weight: x * y, gradient: [sx * y, x * sy] })
    }
}
