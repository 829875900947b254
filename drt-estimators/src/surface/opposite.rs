//! Pairs of directions between which light moves as a lobe turns.
//!
//! With the slope t of microfacets over the roughness α, and e = |t|², their density per area of slopes is P(e)/α²
//! (see [`Counterpart`](super::Counterpart)). When the surface turns, or the directions do, or the index of refraction
//! changes, a scattering answers by the change of t. Let h = wo + η wi, with η = 1 in reflections, and τ = α t, so that
//! H = h / (h·n) = n + τ. Then α² e = H² - 1, and
//!
//! ```text
//! α² de = 2 H·dH = 2 [ (τ - τ² n)·dh / (h·n) - (1 + τ²) τ·dn ],      dh = dwo + η dwi + wi dη.
//! ```
//!
//! What is odd in τ is of the size of 1/α, and what one side of the lobe loses the other one gains. The *opposite* w' of a
//! direction w is that of the microfacets with the slope -t. With functions of the pair in place of what differs little
//! on its two sides, a bar over means of both,
//!
//! ```text
//! d ln P = κ [ τ·(dwo + η dwi) ‾1/(h·n)‾ + τ·‾wi/(h·n)‾ dη - (1 + τ²) τ·dn ] + rest,      κ = (2/α²) d ln P / de,
//! ```
//!
//! where the bracket changes its sign from w to w', and the rest does not grow as α falls. So the bracket, b, may be told by
//! pairs: as for [counterparts](super::Counterpart),
//!
//! ```text
//! ∫ b f L dw = ∫ s b [f L - r f' L'] dw,      r = (dw'/dm') / (dw/dm),      s = (m·wo) / (m·wo + m'·wo),
//! ```
//!
//! and with L(w) times dwi(w) in place of L where wi turns.

use drt_math::Vec3;

use super::facet::Facet;
use super::microfacet::Distribution;

/// The direction on the other side of a lobe.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Opposite {
    /// Unit, away from the surface.
    pub(crate) w: Vec3,
    /// r: what the value there is multiplied by.
    pub(crate) ratio: f64,
    /// s.
    pub(crate) share: f64,
    pub(crate) odd: Odd,
}

/// b, of the given direction: a part of the logarithmic derivative of the scattering function.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Odd {
    /// By the direction `wo`.
    pub(crate) wo: Vec3,
    /// By the direction `wi`.
    pub(crate) wi: Vec3,
    /// By the shading normal.
    pub(crate) n: Vec3,
    /// By the index of refraction.
    pub(crate) eta: f64,
}

impl Opposite {
    /// Of a scattering at a surface with the normal `n`; `by_eta` is the rate of its index by that of the material.
    pub(super) fn new(facet: &Facet, n: Vec3, by_eta: f64) -> Option<Self> {
        let slope = facet.slope()?;
        let other_m = facet.tilted(-slope);
        let (_, angle) = facet.leave(facet.m)?;
        let (w, other_angle) = facet.leave(other_m)?;
        let [here, there] = [facet.m, other_m].map(|m| m.dot(facet.wo));
        let ratio = other_angle / angle;
        let eta = facet.index.unwrap_or(1.0);
        let per_height = |wi: Vec3| 1.0 / (facet.wo + wi * eta).dot(facet.n);
        let [own, other] = [facet.wi, w].map(per_height);
        let (alpha, e) = (facet.alpha, slope.length_squared());
        let steep = match facet.distribution {
            Distribution::Beckmann => -1.0,
            Distribution::Ggx => -2.0 / (1.0 + e),
        };
        let tau = slope * alpha;
        let pull = tau * (2.0 / (alpha * alpha) * steep);
        let wo = pull * (0.5 * (own + other));
        let side = if facet.n == n { 1.0 } else { -1.0 };
        let odd = Odd {
            wo,
            wi: wo * eta,
            n: pull * (-side * (1.0 + tau.length_squared())),
            eta: by_eta * pull.dot(facet.wi * own + w * other) * 0.5,
        };
        let share = here / (here + there);
        let found = ratio > 0.0 && ratio.is_finite() && share.is_finite() && wo.is_finite();
        found.then_some(Self { w, ratio, share, odd })
    }
}
