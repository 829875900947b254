//! Isotropic microfacets: distributions of normals, masking, and normals as a direction sees them.
//!
//! Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces".

use core::f64::consts::{FRAC_1_PI, PI};

use drt_math::{Frame, Real, Vec3, fm};

use super::visible_slope::{visible_area, visible_slope};

/// Distribution of the normals of microfacets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Distribution {
    /// Gaussian slopes.
    #[default]
    Beckmann,
    /// The long-tailed distribution of Trowbridge & Reitz.
    Ggx,
}

/// Least roughness: below it a surface is a mirror to double precision, which has no density.
pub(super) const LEAST_ALPHA: f64 = 1e-4;

/// From this ratio of cotangent to roughness on, Walter's rational fit of Beckmann's masking is one:
/// the smaller root of `0.396 a² - 1.259 a + 1`.
const UNMASKED: f64 = 1.548_140_7;

impl Distribution {
    /// `D(h/|h|) / |h|⁴` of a half vector `h`, per steradian, from `n·h` and `|h|²`. Even in `h`;
    /// zero where it underflows.
    #[inline]
    pub(super) fn density<T: Real>(self, n_dot_h: T, h2: T, alpha: T) -> T {
        let cos2 = n_dot_h.squared();
        let sin2 = (h2 - cos2).max(T::zero());
        let alpha2 = alpha.squared();
        match self {
            Self::Beckmann => {
                let slope2 = sin2 / (cos2 * alpha2);
                // Refuses NaN as well, where the half vector vanishes.
                if !(slope2.re() < 600.0) {
                    return T::zero();
                }
                (-slope2).exp() * FRAC_1_PI / (alpha2 * cos2.squared())
            }
            Self::Ggx => {
                let d = (sin2 + alpha2 * cos2).squared();
                if d.re() > 0.0 { alpha2 * FRAC_1_PI / d } else { T::zero() }
            }
        }
    }

    /// Smith's masking over the cosine, `G1 / cos`, which stays finite at grazing angles; `cos > 0`.
    ///
    /// Beckmann uses Walter's rational fit (eq. 27, within 0.35 %), as renderers do, here continued
    /// to one without a step.
    #[inline]
    pub(super) fn masking<T: Real>(self, cos: T, alpha: T) -> T {
        let cos2 = cos.squared();
        let spread2 = alpha.squared() * (T::one() - cos2);
        match self {
            Self::Beckmann => {
                if cos2.re() >= UNMASKED * UNMASKED * spread2.re() {
                    return cos.recip();
                }
                let spread = spread2.sqrt();
                let a = cos / spread;
                (a * 2.181 + 3.535) / ((a.squared() * 2.577 + a * 2.276 + 1.0) * spread)
            }
            Self::Ggx => T::from(2.0) / (cos + (cos2 + spread2).sqrt()),
        }
    }

    /// As [`Distribution::masking`] but exact, as the density of visible normals needs it to have
    /// integral one.
    #[inline]
    pub(super) fn exact_masking(self, cos: f64, alpha: f64) -> f64 {
        match self {
            Self::Beckmann => {
                let spread = alpha * fm::sqrt((1.0 - cos * cos).max(0.0));
                let stretched = fm::sqrt(cos * cos + spread * spread);
                1.0 / (visible_area(cos / stretched, spread / stretched) * stretched)
            }
            Self::Ggx => self.masking(cos, alpha),
        }
    }

    /// Draws a microfacet normal `m` as seen from `from` (`n·from > 0`), with density
    /// `G1 D(m) (from·m)⁺ / (n·from)`.
    #[inline]
    pub(super) fn sample_visible(self, from: Vec3, n: Vec3, alpha: f64, u: [f64; 2]) -> Vec3 {
        let cos = n.dot(from);
        let across = from.reject(n);
        let sin = across.length();
        let x = if sin > 1e-9 { across * (1.0 / sin) } else { Frame::from_normal(n).s };
        let y = n.cross(x);
        // Seen from the stretched direction the microfacets have roughness one.
        let stretched = fm::sqrt(cos * cos + alpha * alpha * sin * sin);
        let (cos, sin) = (cos / stretched, alpha * sin / stretched);
        let [p, q, up] = match self {
            Self::Beckmann => [visible_slope(cos, sin, u[0]), visible_slope(1.0, 0.0, u[1]), 1.0],
            Self::Ggx => visible_hemisphere_point(cos, sin, u),
        };
        (x * (alpha * p) + y * (alpha * q) + n * up).normalize()
    }
}

/// A point of the unit hemisphere about z, uniform over its projection along the direction
/// `(sin, 0, cos)`: the GGX normals that direction sees at roughness one (Heitz 2018, "Sampling the
/// GGX Distribution of Visible Normals").
#[inline]
fn visible_hemisphere_point(cos: f64, sin: f64, u: [f64; 2]) -> [f64; 3] {
    let r = fm::sqrt(u[0]);
    let (sin_phi, cos_phi) = fm::sin_cos(2.0 * PI * u[1]);
    let y = r * cos_phi;
    // The projection is half a disk and half an ellipse squeezed by cos.
    let s = 0.5 * (1.0 + cos);
    let v = (1.0 - s) * fm::sqrt((1.0 - y * y).max(0.0)) + s * r * sin_phi;
    let w = fm::sqrt((1.0 - y * y - v * v).max(0.0));
    [w * sin - v * cos, y, (w * cos + v * sin).max(0.0)]
}
