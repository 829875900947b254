use crate::model::filter::Filter;

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
    filter: &'a Filter,
    point: [f64; 2],
    columns: [u32; 2],
    rows: [u32; 2],
    next: [u32; 2],
}

impl<'a> Footprint<'a> {
    pub(super) fn new(filter: &'a Filter, film: [u32; 2], point: [f64; 2]) -> Self {
        let [columns, rows] = [0, 1].map(|k| {
            let reached = filter.reached(point[k], film[k]);
            [reached.start, reached.end]
        });
        // An empty range of columns leaves nothing in any row.
        let rows = if columns[0] < columns[1] { rows } else { [0, 0] };
        Self { filter, point, columns, rows, next: [columns[0], rows[0]] }
    }
}

impl Iterator for Footprint<'_> {
    type Item = PixelWeight;

    fn next(&mut self) -> Option<PixelWeight> {
        let [column, row] = self.next;
        if row >= self.rows[1] {
            return None;
        }
        self.next = if column + 1 < self.columns[1] {
            [column + 1, row]
        } else {
            [self.columns[0], row + 1]
        };
        let dx = self.point[0] - (f64::from(column) + 0.5);
        let dy = self.point[1] - (f64::from(row) + 0.5);
        let [(x, sx), (y, sy)] = [dx, dy].map(|o| self.filter.axis_with_slope(o));
        Some(PixelWeight { pixel: [column, row], weight: x * y, gradient: [sx * y, x * sy] })
    }
}
