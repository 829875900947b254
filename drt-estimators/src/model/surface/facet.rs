//! The microfacets of a scattering: which normal they have, and where others would send the light.

use drt_math::Vec3;

use crate::model::surface::microfacet::{Distribution, mirrored, refracted};

/// The microfacets by which light from `wi` leaves along `wo`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    pub(super) distribution: Distribution,
    pub(super) alpha: f64,
    pub(super) wo: Vec3,
    pub(super) wi: Vec3,
    /// The surface's normal on the side of `wo`.
    pub(super) n: Vec3,
    /// Their own, on that side.
    pub(super) m: Vec3,
    /// Where light is refracted, the index beyond over that on the side of `wo`.
    pub(super) index: Option<f64>,
}

impl Facet {
    pub(super) fn new(
        (distribution, alpha): (Distribution, f64),
        [wo, wi, n]: [Vec3; 3],
        index: Option<f64>,
    ) -> Self {
        let h = wo + wi * index.unwrap_or(1.0);
        let m = if n.dot(h) < 0.0 { -h } else { h };
        Self { distribution, alpha, wo, wi, n, m: m.normalize(), index }
    }

    /// The tangent of the angle to the surface's normal, in the direction of the tilt, over the roughness; `None` of
    /// facets that face away.
    pub(super) fn slope(&self) -> Option<Vec3> {
        let cos = self.n.dot(self.m);
        (cos > 0.0).then(|| self.m.reject(self.n) / (cos * self.alpha))
    }

    /// The normal of facets with another slope.
    pub(super) fn tilted(&self, slope: Vec3) -> Vec3 {
        (self.n + slope * self.alpha).normalize()
    }

    /// The direction into which facets with the normal `m` send the light instead, and its solid angle by that of `m`;
    /// `None` where they do not.
    pub(super) fn leave(&self, m: Vec3) -> Option<(Vec3, f64)> {
        let cos = m.dot(self.wo);
        let (w, angle) = match self.index {
            None => (mirrored(self.wo, m), 4.0 * cos),
            Some(eta) => {
                let (w, cos_t) = refracted(self.wo, m, eta)?;
                let h = cos - eta * cos_t;
                (w, h * h / (eta * eta * cos_t))
            }
        };
        let same_side = (self.n.dot(w) > 0.0) == self.index.is_none();
        (cos > 0.0 && angle.is_finite() && same_side).then_some((w, angle))
    }
}
