//! Pairs of directions between which light moves as a lobe turns.
//!
//! With the slope t of microfacets over the roughness α, and e = |t|², their density per area of slopes is P(e)/α²
//! (see [`RoughnessPartner`](super::RoughnessPartner)). When the surface turns, or the directions do, or the index of refraction
//! changes, a scattering answers by the change of t. Let h = wo + η wi, with η = 1 in reflections, and τ = α t, so that
//! H = h / (h·n) = n + τ. Then α² e = H² - 1, and
//!
//! ```text
//! d ln P = κ H·dH = κ [ (τ - τ² n)·dh / (h·n) - (1 + τ²) τ·dn ],      dh = dwo + η dwi + wi dη,
//!
//! κ = (2/α²) d ln P / de = -2/α² for Beckmann,  -4/(α² (1 + e)) for GGX.
//! ```
//!
//! This is of the size of 1/α, and but for what stays bounded as α falls it is odd in τ: what one side of the lobe loses
//! the other one gains. The *opposite* w' of a direction w is that of the microfacets with the slope -t. With b = d ln P at
//! w, b' at w', and the values f and f', as for [counterparts](super::RoughnessPartner)
//!
//! ```text
//! ∫ b f L dw = ∫ s [b f L + r b' f' L'] dw,      r = (dw'/dm') / (dw/dm),      s = p / (p + r p'),
//! ```
//!
//! where directions are drawn with the density p, in which b and b' nearly cancel. Where dwi depends on what the light comes from, b is of that. When all vectors turn
//! alike, b and b' vanish.

use drt_math::Vec3;

use crate::model::surface::facet::Facet;
use crate::model::surface::microfacet::Distribution;

/// The direction on the other side of a lobe.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DirectionPartner {
    /// Unit, away from the surface.
    pub(crate) w: Vec3,
    /// r: what the value there is multiplied by.
    pub(crate) ratio: f64,
    /// b and b'.
    pub(crate) turns: [Turn; 2],
}

/// The part of the logarithmic derivative of a scattering function that is due to the density of microfacets.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Turn {
    /// Its gradient by the direction `wo`.
    pub(crate) wo: Vec3,
    /// Its gradient by the direction `wi`.
    pub(crate) wi: Vec3,
    /// Its gradient by the shading normal.
    pub(crate) n: Vec3,
    /// Its derivative by the index of refraction.
    pub(crate) eta: f64,
}

impl DirectionPartner {
    /// The partner in a scattering at a surface with the normal `n`; `by_eta` is the rate of its index by that of the material.
    pub(super) fn new(facet: &Facet, n: Vec3, by_eta: f64) -> Option<Self> {
        let slope = facet.slope()?;
        let other_m = facet.tilted(-slope);
        let (_, angle) = facet.leave(facet.m)?;
        let (w, other_angle) = facet.leave(other_m)?;
        let ratio = other_angle / angle;
        let side = if facet.n == n { 1.0 } else { -1.0 };
        let turns = [(slope, facet.wi), (-slope, w)]
            .map(|(slope, wi)| Turn::new(facet, slope, wi, [side, by_eta]));
        let finite = |t: &Turn| t.wo.is_finite() && t.n.is_finite() && t.eta.is_finite();
        let found = ratio > 0.0 && ratio.is_finite() && turns.iter().all(finite);
        found.then_some(Self { w, ratio, turns })
    }
}

impl Turn {
    fn new(facet: &Facet, slope: Vec3, wi: Vec3, [side, by_eta]: [f64; 2]) -> Self {
        let (alpha, e) = (facet.alpha, slope.length_squared());
        let steep = match facet.distribution {
            Distribution::Beckmann => -2.0,
            Distribution::Ggx => -4.0 / (1.0 + e),
        };
        let (tau, kappa) = (slope * alpha, steep / (alpha * alpha));
        let tau2 = tau.length_squared();
        let eta = facet.index.unwrap_or(1.0);
        let height = (facet.wo + wi * eta).dot(facet.n);
        let by_h = (tau - facet.n * tau2) * (kappa / height);
        let n = tau * (-side * kappa * (1.0 + tau2));
        Self { wo: by_h, wi: by_h * eta, n, eta: by_eta * by_h.dot(wi) }
    }
}
