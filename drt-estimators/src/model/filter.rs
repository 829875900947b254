//! Reconstruction filters: the weight that each point of the image plane has in a pixel.

mod row;
mod sampling;
mod signed;
#[cfg(test)]
mod tests;

use core::ops::Range;

use drt_math::{Real, fm};
use thiserror::Error;

pub(crate) use crate::model::filter::row::FilterRow;
pub use crate::model::filter::sampling::FilterSample;
use crate::model::filter::sampling::HalfProfile;

/// Shape of a filter along one axis. Lengths are in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum FilterKind {
    /// Constant on [-radius, radius).
    Box {
        /// Half width.
        radius: f64,
    },
    /// Falls linearly to zero at the radius.
    Tent {
        /// Half width.
        radius: f64,
    },
    /// A Gaussian lowered by its value at the radius, so that it ends without a jump.
    Gaussian {
        /// Half width, from 0.001 to 30 standard deviations.
        radius: f64,
        /// Standard deviation before the cut.
        std_dev: f64,
    },
    /// The cubic splines of Mitchell and Netravali (1988, equation 8) on [-2, 2]. They sharpen: parts are negative.
    Mitchell {
        /// Their parameter B, below 3.
        b: f64,
        /// Their parameter C.
        c: f64,
    },
    /// A sinc, windowed by the middle of a wider one: `sinc(x) sinc(x / lobes)` with `sinc(x) = sin(pi x) / (pi x)`.
    /// Every other lobe is negative.
    Lanczos {
        /// Half width, and the number of lobes to a side.
        lobes: u32,
    },
}

/// How far beside a jump of a filter an image point still counts as lying on it, in pixels: far more than rounding, far
/// less than anything that an image shows.
pub(crate) const ON_BORDER: f64 = 1e-8;

/// How near to a border the ends of an edge are that is seen along it, in pixels: files have coordinates of single precision, or of six digits.
pub(crate) const ALONG_BORDER: f64 = 1e-4;

impl FilterKind {
    /// Mitsuba's `box`: every point counts towards the pixel it lies in.
    pub const BOX: Self = Self::Box { radius: 0.5 };
    /// Mitsuba's default `tent`.
    pub const TENT: Self = Self::Tent { radius: 1.0 };
    /// Mitsuba's default `gaussian`.
    pub const GAUSSIAN: Self = Self::gaussian(0.5);
    /// Mitsuba's default `mitchell`.
    pub const MITCHELL: Self = Self::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 };
    /// Mitsuba's `catmullrom`.
    pub const CATMULL_ROM: Self = Self::Mitchell { b: 0.0, c: 0.5 };
    /// Mitsuba's default `lanczos`.
    pub const LANCZOS: Self = Self::Lanczos { lobes: 3 };

    /// Mitsuba's `gaussian` of another standard deviation, cut at four of them.
    #[must_use]
    pub const fn gaussian(std_dev: f64) -> Self {
        Self::Gaussian { radius: 4.0 * std_dev, std_dev }
    }
}

impl Default for FilterKind {
    fn default() -> Self {
        Self::GAUSSIAN
    }
}

/// A filter that cannot be used.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum FilterError {
    /// A length that is not a positive number.
    #[error("the reconstruction filter's {what} is {value}; it must be positive and finite")]
    NotPositive {
        /// Which length.
        what: &'static str,
        /// Its value in pixels.
        value: f64,
    },
    /// A support that is too wide: every sample would have to be added to too many pixels.
    #[error("the reconstruction filter reaches {radius} pixels far; at most 256")]
    TooWide {
        /// Radius in pixels.
        radius: f64,
    },
    /// A Gaussian that is cut so near or so far that its shape, or a finite number, is lost.
    #[error(
        "the gaussian filter's radius {radius} must be between 0.001 and 30 standard deviations \
         ({std_dev}); 4 are usual"
    )]
    Cut {
        /// Radius in pixels.
        radius: f64,
        /// Standard deviation in pixels.
        std_dev: f64,
    },
    /// Splines that are not positive at the centre.
    #[error(
        "the mitchell filter's parameters are B = {b}, C = {c}; B must be below 3 and both finite"
    )]
    Spline {
        /// The parameter B.
        b: f64,
        /// The parameter C.
        c: f64,
    },
}

/// A separable filter P(x, y) = p(x) p(y) with unit integral over the plane, in pixel units.
///
/// Where P is negative, image points are drawn in proportion to |P| + |P'| / 8 along each axis: P alone would leave the
/// slope of the filter unbounded where it crosses zero.
///
/// Offsets are image point minus pixel centre. P is per square pixel; to integrate over the image
/// plane at unit distance it is divided by the squared pixel size there, as
/// [`Projection::importance`](crate::model::sensor::Projection::importance) does.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "FilterKind", into = "FilterKind"))]
pub struct Filter {
    kind: FilterKind,
    radius: f64,
    /// Makes the integral of `shape` one.
    scale: f64,
    /// The factor p of one axis at the centre.
    peak: f64,
    /// What the ratio of a Gaussian's neighbours changes by from pixel to pixel.
    decay: f64,
    /// A density close to p, with an inverse in closed form.
    half: HalfProfile,
}

impl Filter {
    /// Segments that stand for half a Gaussian when sampling: the density is within 2·10⁻³ of a
    /// filter cut at four standard deviations in its inner half.
    const GAUSSIAN_SEGMENTS: usize = 64;
    /// The same, of a pixel of a filter with negative parts.
    const SEGMENTS_OF_A_LOBE: usize = 64;
    /// What the slope counts for, in pixels, in the density of a filter with negative parts.
    const SLOPE_IN_DENSITY: f64 = 0.125;
    /// Largest radius in pixels: each sample touches every pixel within it.
    pub const MAX_RADIUS: f64 = 256.0;

    /// Normalises a filter and prepares to sample it.
    ///
    /// # Errors
    /// When a length is not positive and finite, the radius exceeds [`MAX_RADIUS`](Self::MAX_RADIUS), or a
    /// Gaussian's two lengths do not go together.
    pub fn new(kind: FilterKind) -> Result<Self, FilterError> {
        let positive = |what, value: f64| {
            if value > 0.0 && value.is_finite() {
                Ok(value)
            } else {
                Err(FilterError::NotPositive { what, value })
            }
        };
        let still = |radius, scale, segments| (radius, scale, 1.0, segments);
        let (radius, scale, decay, segments) = match kind {
            FilterKind::Box { radius } => still(positive("radius", radius)?, 0.5 / radius, 1),
            FilterKind::Tent { radius } => still(positive("radius", radius)?, 1.0 / radius, 1),
            FilterKind::Gaussian { radius, std_dev } => {
                positive("radius", radius)?;
                positive("standard deviation", std_dev)?;
                if !(1e-3..=30.0).contains(&(radius / std_dev)) {
                    return Err(FilterError::Cut { radius, std_dev });
                }
                let integral = 2.0 * radius * gaussian_mean(radius / std_dev);
                let decay = fm::exp(-1.0 / (std_dev * std_dev));
                (radius, 1.0 / integral, decay, Self::GAUSSIAN_SEGMENTS)
            }
            // Shifted by whole pixels they add up to one everywhere.
            FilterKind::Mitchell { b, c } if b < 3.0 && b.is_finite() && c.is_finite() => {
                still(2.0, 1.0, 2 * Self::SEGMENTS_OF_A_LOBE)
            }
            FilterKind::Mitchell { b, c } => return Err(FilterError::Spline { b, c }),
            FilterKind::Lanczos { lobes } => {
                let radius = positive("number of lobes", f64::from(lobes))?;
                if radius > Self::MAX_RADIUS {
                    return Err(FilterError::TooWide { radius });
                }
                still(
                    radius,
                    signed::lanczos_scale(lobes),
                    lobes as usize * Self::SEGMENTS_OF_A_LOBE,
                )
            }
        };
        if radius > Self::MAX_RADIUS {
            return Err(FilterError::TooWide { radius });
        }
        let half = HalfProfile::new(segments, |t| match kind.signed(radius * t) {
            Some((value, slope)) => Real::abs(value) + Self::SLOPE_IN_DENSITY * Real::abs(slope),
            None => shape(kind, radius * t),
        });
        let peak = scale * shape(kind, 0.0);
        Ok(Self { kind, radius, scale, peak, decay, half })
    }

    /// The shape from which the filter was made.
    #[must_use]
    pub fn kind(&self) -> FilterKind {
        self.kind
    }

    /// Half width of the square support, in pixels.
    #[must_use]
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// The pixels of a row of `n` whose supports hold the coordinate `at`, or have it on their border.
    pub(crate) fn reached(&self, at: f64, n: u32) -> Range<u32> {
        // Centres i + 1/2 not farther than the radius. Casts saturate, and are no calls as rounding is on many machines.
        let radius = self.radius + if self.is_continuous() { 0.0 } else { ON_BORDER };
        let [first, last] = [at - radius - 0.5, at + radius - 0.5];
        let start = first as u32;
        let start = start.saturating_add(u32::from(f64::from(start) < first));
        let end = if last >= 0.0 { (last as u32).saturating_add(1) } else { 0 };
        start..end.min(n)
    }

    /// False when the filter jumps at the edge of its support, so that the material form needs an
    /// integral along every pixel's border (`theory` §1).
    #[must_use]
    pub fn is_continuous(&self) -> bool {
        !matches!(self.kind, FilterKind::Box { .. })
    }

    /// True when the borders of all pixels are those of their neighbours.
    pub(crate) fn tiles(&self) -> bool {
        self.kind == FilterKind::BOX
    }

    /// Whether what has this image coordinate is seen along a border between two pixels of a filter that [tiles](Self::tiles).
    pub(crate) fn is_border(at: f64) -> bool {
        let beside = at - fm::floor(at);
        f64::min(beside, 1.0 - beside) < ALONG_BORDER
    }

    /// P at an offset from the pixel's centre, per square pixel.
    #[inline]
    #[must_use]
    pub fn eval(&self, dx: f64, dy: f64) -> f64 {
        self.axis(dx) * self.axis(dy)
    }

    /// Gradient of P with respect to the offset; at a kink, the mean of both sides.
    #[inline]
    #[must_use]
    pub fn gradient(&self, dx: f64, dy: f64) -> [f64; 2] {
        let [(x, sx), (y, sy)] = [dx, dy].map(|o| self.axis_with_slope(o));
        [sx * y, x * sy]
    }

    /// A function of the offset that is 1 at the pixel's centre and falls to 0 where the support ends,
    /// however the filter does, and its gradient. Its product with P has a slope that P bounds.
    #[must_use]
    pub(crate) fn window(&self, offset: [f64; 2]) -> (f64, [f64; 2]) {
        let [(x, dx), (y, dy)] = offset.map(|o| self.window_along(o));
        (x * y, [dx * y, x * dy])
    }

    /// The factor of one axis, and its slope.
    pub(crate) fn window_along(&self, o: f64) -> (f64, f64) {
        let (height, slope, steepness) = match self.kind {
            FilterKind::Box { .. } | FilterKind::Mitchell { .. } | FilterKind::Lanczos { .. } => {
                let s = o / self.radius;
                (f64::max(1.0 - s * s, 0.0), -2.0 * s / self.radius, 2)
            }
            FilterKind::Tent { .. } | FilterKind::Gaussian { .. } => {
                let (height, slope) = self.axis_with_slope(o);
                (height / self.peak, slope / self.peak, 6)
            }
        };
        let rest = Real::powi(1.0 - height, steepness - 1);
        (1.0 - rest * (1.0 - height), f64::from(steepness) * rest * slope)
    }

    /// The factor p of one axis, per pixel.
    #[inline]
    #[must_use]
    pub fn axis(&self, x: f64) -> f64 {
        self.axis_with_slope(x).0
    }

    /// The factor p of one axis, and its derivative; at a kink, the mean of both sides.
    #[inline]
    pub(crate) fn axis_with_slope(&self, x: f64) -> (f64, f64) {
        match self.kind.signed(x) {
            // Outside, and where x is no number, nothing is left of it.
            Some((value, slope)) if Real::abs(x) < self.radius => {
                (self.scale * value, self.scale * slope)
            }
            Some(_) => (0.0, 0.0),
            None => self.with_slope(x, shape(self.kind, x)),
        }
    }

    /// The same, of an offset where the unnormalised profile is known.
    #[inline]
    fn with_slope(&self, x: f64, shape: f64) -> (f64, f64) {
        // Half open, so that box filters of neighbouring pixels tile the plane.
        let inside = -self.radius <= x && x < self.radius;
        if !inside {
            return (0.0, 0.0);
        }
        let slope = match self.kind {
            _ if x == 0.0 => 0.0,
            FilterKind::Box { .. } | FilterKind::Mitchell { .. } | FilterKind::Lanczos { .. } => {
                0.0
            }
            FilterKind::Tent { radius } => -self.scale / (if x < 0.0 { -radius } else { radius }),
            FilterKind::Gaussian { std_dev, .. } => {
                -x * (1.0 / (std_dev * std_dev)) * self.scale * (1.0 + shape)
            }
        };
        (self.scale * shape, slope)
    }
}

impl TryFrom<FilterKind> for Filter {
    type Error = FilterError;
    fn try_from(kind: FilterKind) -> Result<Self, FilterError> {
        Self::new(kind)
    }
}

impl From<Filter> for FilterKind {
    fn from(filter: Filter) -> Self {
        filter.kind
    }
}

/// The unnormalised profile inside the support.
///
/// A Gaussian is in units of its value at the radius, which keeps the difference to that value
/// free of cancellation.
#[inline]
fn shape(kind: FilterKind, x: f64) -> f64 {
    match kind {
        FilterKind::Box { .. } => 1.0,
        FilterKind::Mitchell { .. } | FilterKind::Lanczos { .. } => {
            kind.signed(x).map_or(0.0, |(value, _)| value)
        }
        FilterKind::Tent { radius } => 1.0 - Real::abs(x) / radius,
        FilterKind::Gaussian { radius, std_dev } => {
            fm::exp_m1(0.5 * (radius - x) * (radius + x) / (std_dev * std_dev))
        }
    }
}

/// The offset at which the profile has fallen to `level` times its peak.
fn shape_inverse(kind: FilterKind, level: f64) -> f64 {
    match kind {
        FilterKind::Box { radius } => radius,
        // Not asked for: their slopes are in their densities.
        FilterKind::Mitchell { .. } | FilterKind::Lanczos { .. } => 0.0,
        FilterKind::Tent { radius } => radius * (1.0 - level),
        FilterKind::Gaussian { radius, std_dev } => {
            let v = 2.0 * std_dev * std_dev;
            let peak = shape(kind, 0.0);
            fm::sqrt(f64::max(radius * radius - v * fm::ln_1p(level * peak), 0.0))
        }
    }
}

/// Mean over the support of the Gaussian's `shape`, cut at `k` standard deviations:
/// the sum over n >= 1 of k^2n / (3·5·…·(2n + 1)).
///
/// That is the series of the error function (Abramowitz & Stegun 7.1.6) with its first term
/// taken away by the lowering; all terms are positive.
fn gaussian_mean(k: f64) -> f64 {
    let (mut term, mut sum, mut odd) = (1.0, 0.0, 3.0);
    loop {
        term *= k * k / odd;
        let next = sum + term;
        if next == sum && odd > k * k {
            return sum;
        }
        sum = next;
        odd += 2.0;
    }
}
