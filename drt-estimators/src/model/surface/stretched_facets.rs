//! Microfacets whose roughness depends on the direction along the surface.
//!
//! Slopes are stretched by α_u along the tangent and by α_v across it (Heitz 2014, "Understanding the Masking-Shadowing
//! Function in Microfacet-Based BRDFs", section 5). With α² = α_u α_v and h stretched to h' = (h_x α/α_u, h_y α/α_v,
//! h_z), the density of normals is that of even roughness α at h'; masking of a direction w is that of the roughness
//! along it,
//!
//! ```text
//! α(w)² sin² = α_u² w_x² + α_v² w_y².
//! ```
//!
//! All vectors are in the frame of [`Framed`].

use drt_math::{Real, Vec3, fm, vec3};

use crate::model::surface::microfacet::{Distribution, LEAST_COS2};

/// Microfacets in the frame of their surface.
#[derive(Clone, Copy)]
pub(super) struct StretchedFacets<T = f64> {
    pub(super) distribution: Distribution,
    pub(super) alpha: [T; 2],
}

impl<T: Real> StretchedFacets<T> {
    /// `D(h/|h|) / |h|⁴`, as [`Distribution::density`].
    #[inline]
    pub(super) fn density(&self, h: Vec3<T>) -> T {
        let [u, v] = self.alpha;
        let even2 = u * v;
        let (x, y) = (h.x / u, h.y / v);
        let h2 = even2 * (x.squared() + y.squared()) + h.z.squared();
        self.distribution.density(h.z, h2, even2.sqrt())
    }

    /// Smith's masking over the cosine, as [`Distribution::masking`]; of the side that the direction is on.
    #[inline]
    pub(super) fn masking(&self, w: Vec3<T>) -> T {
        self.distribution.masking_by(w.z.abs(), self.spread2(w))
    }

    #[inline]
    fn spread2(&self, w: Vec3<T>) -> T {
        (self.alpha[0] * w.x).squared() + (self.alpha[1] * w.y).squared()
    }

    /// As [`Distribution::facets`].
    #[inline]
    pub(super) fn facets(&self, h: Vec3<T>, [wo, wi]: [Vec3<T>; 2]) -> T {
        let density = self.density(h);
        // Directions in the surface underflow.
        if density.re() == 0.0 || (wo.z * wi.z).re().abs() < LEAST_COS2 {
            return T::zero();
        }
        density * self.masking(wo) * (self.masking(wi) * wi.z.abs())
    }
}

impl StretchedFacets {
    /// `G1(w) D(m) / (|h|⁴ n·w)` with exact masking, as [`Distribution::visible_density`].
    #[inline]
    pub(super) fn visible_density(&self, h: Vec3, w: Vec3) -> f64 {
        let density = self.density(h);
        if density == 0.0 {
            return 0.0;
        }
        density * self.distribution.exact_masking_by(w.z.abs(), fm::sqrt(self.spread2(w)))
    }

    /// As [`Distribution::sample_visible`], of a direction above the surface.
    pub(super) fn sample_visible(&self, from: Vec3, u: [f64; 2]) -> Vec3 {
        let [a, b] = self.alpha;
        let (x, y) = (a * from.x, b * from.y);
        let sin = fm::sqrt(x * x + y * y);
        let stretched = fm::sqrt(sin * sin + from.z * from.z);
        let (cos_phi, sin_phi) =
            if sin > 1e-9 * stretched { (x / sin, y / sin) } else { (1.0, 0.0) };
        let [p, q, up] = self.distribution.sample_stretched(from.z / stretched, sin / stretched, u);
        vec3(a * (p * cos_phi - q * sin_phi), b * (p * sin_phi + q * cos_phi), up).normalize()
    }
}
