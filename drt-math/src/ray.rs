use crate::Vec3;

/// A ray or segment: the points `origin + t dir` for `t` in (0, `t_max`).
///
/// `dir` may have any length but zero, and `t` is measured in units of it: with `dir = y - x` and
/// `t_max = 1` the ray is the open segment from x to y. Media need unit directions, so that `t` is a distance.
///
/// ```
/// use drt_math::{Ray, Vec3};
///
/// let ray = Ray::new(Vec3::ZERO, Vec3::Z).until(5.0);
/// assert_eq!(ray.at(2.0), Vec3::Z * 2.0);
/// assert_eq!(Ray::segment(Vec3::X, Vec3::Y).at(1.0), Vec3::Y);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Where it goes.
    pub dir: Vec3,
    /// Where it ends, in units of `dir`; infinite for a ray without end.
    pub t_max: f64,
}

impl Ray {
    /// The ray without end.
    #[inline]
    #[must_use]
    pub fn new(origin: impl Into<Vec3>, dir: impl Into<Vec3>) -> Self {
        Self { origin: origin.into(), dir: dir.into(), t_max: f64::INFINITY }
    }

    /// The open segment between two points.
    #[inline]
    #[must_use]
    pub fn segment(from: impl Into<Vec3>, to: impl Into<Vec3>) -> Self {
        let (from, to) = (from.into(), to.into());
        Self::new(from, to - from).until(1.0)
    }

    /// The ray with another end.
    #[inline]
    #[must_use]
    pub fn until(self, t_max: f64) -> Self {
        Self { t_max, ..self }
    }

    /// The point at parameter `t`.
    #[inline]
    #[must_use]
    pub fn at(&self, t: f64) -> Vec3 {
        self.origin + self.dir * t
    }
}
