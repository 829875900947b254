//! Filters with negative parts: their profiles and slopes.

use core::f64::consts::PI;

use drt_math::fm;

use crate::model::filter::FilterKind;

impl FilterKind {
    /// The profile at an offset within the support, before it is normalised, and its derivative; of filters with negative parts.
    #[inline]
    pub(super) fn signed(self, x: f64) -> Option<(f64, f64)> {
        let (at, sign) = if x < 0.0 { (-x, -1.0) } else { (x, 1.0) };
        let (value, slope) = match self {
            Self::Mitchell { b, c } => mitchell(b, c, at),
            Self::Lanczos { lobes } => lanczos(f64::from(lobes), at),
            Self::Box { .. } | Self::Tent { .. } | Self::Gaussian { .. } => return None,
        };
        Some((value, sign * slope))
    }
}

/// Equation 8 of Mitchell and Netravali (1988), at x in [0, 2].
fn mitchell(b: f64, c: f64, x: f64) -> (f64, f64) {
    let [k3, k2, k1, k0] = if x < 1.0 {
        [12.0 - 9.0 * b - 6.0 * c, -18.0 + 12.0 * b + 6.0 * c, 0.0, 6.0 - 2.0 * b]
    } else {
        [-b - 6.0 * c, 6.0 * b + 30.0 * c, -12.0 * b - 48.0 * c, 8.0 * b + 24.0 * c]
    };
    let value = ((k3 * x + k2) * x + k1) * x + k0;
    let slope = (3.0 * k3 * x + 2.0 * k2) * x + k1;
    (value / 6.0, slope / 6.0)
}

fn lanczos(lobes: f64, x: f64) -> (f64, f64) {
    let ((near, near_slope), (wide, wide_slope)) = (sinc(x), sinc(x / lobes));
    (near * wide, near_slope * wide + near * wide_slope / lobes)
}

/// `sin(pi x) / (pi x)` and its derivative.
fn sinc(x: f64) -> (f64, f64) {
    let a = PI * x;
    if a < 1e-2 {
        // Where the difference below would cancel; what is left out is below 10⁻¹⁵.
        let q = a * a;
        let value = 1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0));
        return (value, -PI * a / 3.0 * (1.0 - q / 10.0 * (1.0 - q / 28.0)));
    }
    let (sin, cos) = fm::sin_cos(a);
    (sin / a, PI * (cos - sin / a) / a)
}

/// One over the integral of the profile, by Simpson's rule.
pub(super) fn lanczos_scale(lobes: u32) -> f64 {
    // An error of (pi / 1024)⁴ / 180 of the profile.
    let steps = 1024 * lobes;
    let h = f64::from(lobes) / f64::from(steps);
    let term = |i: u32| {
        let weight = if i == 0 || i == steps { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
        weight * lanczos(f64::from(lobes), f64::from(i) * h).0
    };
    1.5 / (h * (0..=steps).map(term).sum::<f64>())
}
