/// A density of distances that reaches every part of a stretch whatever the medium there: uniform
/// on a finite one, `s / (s + t)²` on an infinite one.
///
/// The heavy tail bounds the weight of any integrand that falls off like an inverse square, which
/// all light does.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    length: f64,
    scale: f64,
}

impl Reach {
    /// On (0, length); `scale` is the median distance when the length is infinite.
    #[inline]
    pub(crate) fn new(length: f64, scale: f64) -> Self {
        Self { length, scale }
    }

    #[inline]
    pub(crate) fn sample(&self, u: f64) -> f64 {
        if self.length.is_finite() { u * self.length } else { self.scale * u / (1.0 - u) }
    }

    #[inline]
    pub(crate) fn pdf(&self, t: f64) -> f64 {
        if self.length.is_finite() {
            1.0 / self.length
        } else {
            let r = self.scale + t;
            self.scale / r / r
        }
    }
}
