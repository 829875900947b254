use drt_math::fm;

use crate::model::filter::{Filter, FilterKind};

/// The factors p of one axis for neighbouring pixels, from left to right, and their derivatives by the offset. Has no end.
///
/// A Gaussian's g(x) takes no exponential for each: g(x - 1) = g(x) r(x) with r(x) = exp((2x - 1) / 2σ²), and
/// r(x - 1) = r(x) exp(-1/σ²). Rounding adds up to 10⁻¹¹ of a value over the widest filter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FilterRow<'a> {
    filter: &'a Filter,
    /// Of the next pixel.
    offset: f64,
    /// A Gaussian's value there, in units of that at the radius, and the ratio of the one after to it.
    bell: f64,
    ratio: f64,
}

impl Filter {
    /// Of a point at the coordinate `at`, from the pixel `first` on.
    #[inline]
    pub(crate) fn row(&self, at: f64, first: u32) -> FilterRow<'_> {
        let offset = at - (f64::from(first) + 0.5);
        let (bell, ratio) = match self.kind {
            FilterKind::Gaussian { radius, std_dev } => {
                let inv = 0.5 / (std_dev * std_dev);
                (
                    fm::exp((radius - offset) * (radius + offset) * inv),
                    fm::exp((2.0 * offset - 1.0) * inv),
                )
            }
            _ => (0.0, 0.0),
        };
        FilterRow { filter: self, offset, bell, ratio }
    }
}

impl FilterRow<'_> {
    /// The offset of the point from the centre of the next pixel.
    pub(crate) fn offset(&self) -> f64 {
        self.offset
    }
}

impl Iterator for FilterRow<'_> {
    type Item = (f64, f64);

    #[inline]
    fn next(&mut self) -> Option<(f64, f64)> {
        let filter = self.filter;
        let factors = match filter.kind {
            FilterKind::Gaussian { .. } => filter.with_slope(self.offset, self.bell - 1.0),
            _ => filter.axis_with_slope(self.offset),
        };
        self.offset -= 1.0;
        self.bell *= self.ratio;
        self.ratio *= filter.decay;
        Some(factors)
    }
}
