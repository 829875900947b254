//! Where a surface sends light, in a few numbers.
//!
//! Choosing among many directions in proportion to a BSDF needs its value for each, and for cones of
//! them at once. [`Lobes`] are enough there: diffuse light, and a lobe around each direction that an even
//! surface would send light to, with the solid angle π w² and the light s.
//!
//! The solid angle of a lobe of reflections is that of the microfacets, π α² of slopes, by the Jacobian of
//! Walter et al. 2007 (eq. 14) for facets along the normal: with the cosine o,
//!
//! ```text
//! w² = 4 o α².
//! ```
//!
//! Refractions are bent about the facets that are seen, which at grazing angles face the viewer. With the tangent
//! part t of the direction and l² = α² |t|² + o², they are on average along
//!
//! ```text
//! m ∝ α² t + n (l + o) / 2:
//! ```
//!
//! stretched to a hemisphere, visible normals are halfway between the direction v and a cap of the sphere
//! above -v·n (Dupuy & Benyoub 2023), which has its mean at (1 - v·n) / 2. There they have some density p
//! (Heitz 2014, eq. 16) where for n it would be 1 / (π α²), so that by Walter's eq. 17, with the cosines o and i of both
//! directions to m,
//!
//! ```text
//! w² = (o - η i)² / (η² i π p).
//! ```
//!
//! Of the light that is let through, half is what n and half what m lets through. Towards grazing angles, where lobes
//! are wide in one direction only, cosines count as α at least.

use core::f64::consts::FRAC_1_PI;

use drt_geom::edges::{Lobe, Lobes};
use drt_math::{Vec3, fm};

use crate::model::surface::microfacet::{Distribution, LEAST_ALPHA, mirrored};

/// A sketch of which the two highest lobes stay; the others count as light from all around.
pub(super) fn two_highest(even: f64, mut all: [Lobe; 4]) -> Lobes {
    all.sort_unstable_by(|a, b| b.height.total_cmp(&a.height));
    let [a, b, c, d] = all;
    Lobes { even: even + c.height + d.height, lobes: [a, b] }
}

/// The larger one of two roughnesses.
pub(super) fn widest([u, v]: [f64; 2]) -> f64 {
    f64::max(u, v)
}

/// Sheen, over π.
pub(super) const SHEEN: f64 = 0.1;

/// A lobe of so much light about the mirror image of a direction.
pub(super) fn reflection(wo: Vec3, n: Vec3, alpha: f64, share: f64) -> Lobe {
    let cos = n.dot(wo).max(alpha);
    Lobe::new(mirrored(wo, n), 4.0 * alpha * alpha * cos, share)
}

/// The facet that stands for all that a direction sees.
pub(super) struct SeenFacet {
    normal: Vec3,
    /// Cosine of the angle between the direction and the normal.
    pub(super) cos: f64,
    /// The solid angle of visible normals about it: 1 over their density there.
    normals: f64,
    alpha: f64,
}

impl SeenFacet {
    pub(super) fn new(wo: Vec3, n: Vec3, distribution: Distribution, alpha: f64) -> Self {
        let alpha = alpha.max(LEAST_ALPHA);
        let cos = n.dot(wo).clamp(1e-6, 1.0);
        let tangent = wo - n * cos;
        let stretched = fm::sqrt(alpha * alpha * (1.0 - cos * cos) + cos * cos);
        let normal = (tangent * (alpha * alpha) + n * (0.5 * (stretched + cos))).normalize();
        let cos_m = normal.dot(wo).clamp(1e-6, 1.0);
        let density = distribution.visible(n.dot(normal), cos, alpha) * cos_m;
        Self { normal, cos: cos_m, normals: 1.0 / density, alpha }
    }

    pub(super) fn refraction(&self, wo: Vec3, eta: f64, share: f64) -> Lobe {
        // Beyond the critical angle this goes along the facet.
        let cos_t = fm::sqrt((1.0 - (1.0 - self.cos * self.cos) / (eta * eta)).max(0.0));
        let axis = (self.normal * (self.cos / eta - cos_t) - wo * eta.recip()).normalize();
        let slope = (self.cos - eta * cos_t) / eta;
        Lobe::new(axis, FRAC_1_PI * self.normals * slope * slope / cos_t.max(self.alpha), share)
    }
}
