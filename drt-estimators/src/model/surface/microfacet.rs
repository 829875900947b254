//! Isotropic microfacets: distributions of normals, masking, and normals as a direction sees them.
//!
//! Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces".

use core::f64::consts::{FRAC_1_PI, PI};

use drt_math::{Dual, Frame, Real, Vec3, fm};

use crate::model::surface::angles::Angles;
use crate::model::surface::visible_slope::{visible_area, visible_slope};

/// Distribution of the normals of microfacets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Distribution {
    /// Gaussian slopes.
    #[default]
    Beckmann,
    /// The long-tailed distribution of Trowbridge & Reitz.
    Ggx,
}

/// Least roughness: below it a surface is a mirror to double precision, which has no density.
pub(super) const LEAST_ALPHA: f64 = 1e-4;

/// Least squared `n·h`: below it `h` lies in the surface or vanishes, and its powers underflow.
pub(super) const LEAST_COS2: f64 = 1e-40;

/// From this ratio of cotangent to roughness on, Walter's rational fit of Beckmann's masking is one:
/// the smaller root of `0.396 a² - 1.259 a + 1`.
const UNMASKED: f64 = 1.548_140_7;

/// A reflection by microfacets, without its factor of |h|⁴, and its derivatives.
pub(super) struct FacetSlopes {
    pub(super) value: f64,
    pub(super) cos_o: f64,
    pub(super) cos_i: f64,
    pub(super) h2: f64,
    pub(super) alpha: f64,
}

impl Distribution {
    /// `D(m) G1(wo) G1(wi) / (|h|⁴ n·wo)` for the normal `m` along `h = wo + index wi`: the factor
    /// that the values of reflection (`index` 1) and refraction have in common.
    ///
    /// `n·wo > 0`; whether the microfacet shows `wo` and `wi` its front is not looked at.
    #[inline]
    pub(super) fn facets<T: Real>(self, a: &Angles<T>, index: T, alpha: T) -> T {
        let n_dot_h = a.cos_o + index * a.cos_i;
        let h2 = (T::one() - index).squared() + index * a.h2;
        let density = self.density(n_dot_h, h2, alpha);
        if density.re() == 0.0 {
            return T::zero();
        }
        let cos_i = a.cos_i.abs();
        density * self.masking(a.cos_o, alpha) * (self.masking(cos_i, alpha) * cos_i)
    }

    /// [`Distribution::facets`] of a reflection, with duals only as wide as each factor needs.
    #[inline]
    pub(super) fn facet_slopes(self, a: &Angles, alpha: f64) -> Option<FacetSlopes> {
        type Narrow = Dual<f64, 2>;
        type Wide = Dual<f64, 3>;
        let density = self.density(
            Wide::variable(a.cos_o + a.cos_i, 0),
            Wide::variable(a.h2, 1),
            Wide::variable(alpha, 2),
        );
        if density.re == 0.0 {
            return None;
        }
        let narrow_alpha = Narrow::variable(alpha, 1);
        let masking_o = self.masking(Narrow::variable(a.cos_o, 0), narrow_alpha);
        let cos_i = Narrow::variable(a.cos_i, 0).abs();
        let masked_i = self.masking(cos_i, narrow_alpha) * cos_i;

        let [d, o, i] = [density.re, masking_o.re, masked_i.re];
        let [by_n_dot_h, by_h2, by_alpha] = density.eps.map(|slope| slope * o * i);
        Some(FacetSlopes {
            value: d * o * i,
            cos_o: by_n_dot_h + d * i * masking_o.eps[0],
            cos_i: by_n_dot_h + d * o * masked_i.eps[0],
            h2: by_h2,
            alpha: by_alpha + d * (i * masking_o.eps[1] + o * masked_i.eps[1]),
        })
    }

    /// `D(h/|h|) / |h|⁴` of a half vector `h`, per steradian, from `n·h` and `|h|²`. Even in `h`;
    /// zero where it underflows.
    #[inline]
    pub(super) fn density<T: Real>(self, n_dot_h: T, h2: T, alpha: T) -> T {
        let cos2 = n_dot_h.squared();
        let sin2 = (h2 - cos2).max(T::zero());
        let alpha2 = alpha.squared();
        if cos2.re() < LEAST_COS2 {
            return T::zero();
        }
        match self {
            Self::Beckmann => {
                let slope2 = sin2 / (cos2 * alpha2);
                if slope2.re() > 600.0 {
                    return T::zero();
                }
                (-slope2).exp() * FRAC_1_PI / (alpha2 * cos2.squared())
            }
            Self::Ggx => alpha2 * FRAC_1_PI / (sin2 + alpha2 * cos2).squared(),
        }
    }

    /// Density per steradian of a normal among those that a direction sees, without the cosine
    /// between them, from the cosines of both to the surface's normal.
    pub(super) fn visible(self, cos_m: f64, cos_o: f64, alpha: f64) -> f64 {
        self.density(cos_m, 1.0, alpha) * self.masking(cos_o, alpha)
    }

    /// Smith's masking over the cosine, `G1 / cos`, which stays finite at grazing angles; `cos > 0`.
    ///
    /// Beckmann uses Walter's rational fit (eq. 27, within 0.35 %), as renderers do, here continued
    /// to one without a step.
    #[inline]
    pub(super) fn masking<T: Real>(self, cos: T, alpha: T) -> T {
        let cos2 = cos.squared();
        self.masking_by(cos, alpha.squared() * (T::one() - cos2))
    }

    /// As [`Distribution::masking`] with the squared sine times roughness, `spread2`.
    #[inline]
    pub(super) fn masking_by<T: Real>(self, cos: T, spread2: T) -> T {
        let cos2 = cos.squared();
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
                self.exact_masking_by(cos, alpha * fm::sqrt((1.0 - cos * cos).max(0.0)))
            }
            Self::Ggx => self.masking(cos, alpha),
        }
    }

    /// As [`Distribution::exact_masking`] with the sine times roughness, `spread`.
    #[inline]
    pub(super) fn exact_masking_by(self, cos: f64, spread: f64) -> f64 {
        match self {
            Self::Beckmann => {
                let stretched = fm::sqrt(cos * cos + spread * spread);
                1.0 / (visible_area(cos / stretched, spread / stretched) * stretched)
            }
            Self::Ggx => self.masking_by(cos, spread * spread),
        }
    }

    /// `G1(wo) D(m) / (|h|⁴ n·wo)`, Smith's masking being exact: the density of visible normals
    /// but for `m·wo` and the powers of |h|. Conventions of [`Distribution::facets`].
    #[inline]
    pub(super) fn visible_density(self, a: &Angles, index: f64, alpha: f64) -> f64 {
        let contrast = 1.0 - index;
        let h2 = contrast * contrast + index * a.h2;
        let density = self.density(a.cos_o + index * a.cos_i, h2, alpha);
        if density == 0.0 { 0.0 } else { density * self.exact_masking(a.cos_o, alpha) }
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
        let [p, q, up] = self.sample_stretched(cos / stretched, alpha * sin / stretched, u);
        (x * (alpha * p) + y * (alpha * q) + n * up).normalize()
    }

    /// Draws a microfacet normal, of any length, as seen at roughness one from the direction of that cosine and sine: its
    /// parts towards the direction, across it, and along the surface's normal.
    #[inline]
    pub(super) fn sample_stretched(self, cos: f64, sin: f64, u: [f64; 2]) -> [f64; 3] {
        match self {
            Self::Beckmann => [visible_slope(cos, sin, u[0]), visible_slope(1.0, 0.0, u[1]), 1.0],
            Self::Ggx => visible_hemisphere_point(cos, sin, u),
        }
    }
}

/// Where a microfacet with normal `m` reflects what comes from a direction.
#[inline]
pub(super) fn mirrored(from: Vec3, m: Vec3) -> Vec3 {
    m * (2.0 * m.dot(from)) - from
}

/// Where it refracts that, and the cosine there, with the index beyond over that on the side of `from`; `None`
/// where all is reflected.
#[inline]
pub(super) fn refracted(from: Vec3, m: Vec3, eta: f64) -> Option<(Vec3, f64)> {
    let cos = m.dot(from);
    let cos2 = 1.0 - (1.0 - cos * cos) / (eta * eta);
    let cos_t = fm::sqrt(cos2.max(0.0));
    (cos2 >= 0.0).then(|| (m * (cos / eta - cos_t) - from * (1.0 / eta), cos_t))
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
