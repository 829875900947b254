//! Pairs of directions between which light moves as a surface gets rougher.
//!
//! The density of microfacet normals m, per area of their slopes, is D cos⁴ = P(t) / α² with t = slope / α. At fixed
//! directions m is fixed, and a scattering answers to α mainly by that density (masking, the other part, does where
//! it is grazed):
//!
//! ```text
//! a = ∂ ln (D cos⁴) / ∂α = (2/α) (e - 1) for Beckmann,  (2/α) (e - 1)/(e + 1) for GGX,    e = |t|².
//! ```
//!
//! Slopes below α lose what those above gain. With p(e) the density of e, exp(-e) or 1/(1 + e)², what is lost within e is
//!
//! ```text
//! M(e) = -∫ a p de from 0 = (2/α) e exp(-e)    or    (2/α) e/(1 + e)²,
//! ```
//!
//! which rises up to e = 1 and falls back to 0, as nothing is lost in all. The *counterpart* e' > 1 of e < 1 is where
//! the gain since 1 is the loss up to e, M(1) - M(e') = M(e), in the same azimuth: |a| p de = |a'| p' de'.
//!
//! A value times the solid angle of directions, f(w) dw, is P(t) K(t) dt with a K that varies slowly. So
//!
//! ```text
//! ∫ a f L dw = ∫ a P K L dt = ∫ s a P [K L - K' L'] dt,    K'/K = r f'/f,    r = (P / P') (dw'/dt') / (dw/dt),
//! ```
//!
//! for any shares s + s' = 1 that a slope and its counterpart have in their difference. Those of the balance heuristic,
//! where directions are drawn with the density p, are
//!
//! ```text
//! s = v / (v + v'),    v = p (dw/dt) / (P |a|),    v'/v = r (p'/|a'|) / (p/|a|),
//! ```
//!
//! so that neither direction counts for more than it is drawn. Where both are drawn alike, by the same p (dw/dt) / P, s |a|
//! stays below 0.53 · 2/α. Without pairs a L stands for all of it, with a standard deviation of 2/α times L even if L is
//! the same everywhere.

use drt_math::{Real, Vec3, fm};

use crate::model::surface::facet::Facet;
use crate::model::surface::microfacet::Distribution;

/// The direction that goes along with another one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RoughnessPartner {
    /// Unit, away from the surface.
    pub(crate) w: Vec3,
    /// r: what the value there is multiplied by.
    pub(crate) ratio: f64,
    /// a and a': what the value of the given direction and of this one changes by, through the density of normals,
    /// relative to itself.
    pub(crate) slopes: [f64; 2],
}

/// A microfacet's slope.
#[derive(Clone, Copy, Debug)]
struct Steepness {
    /// e.
    e: f64,
    /// a α / 2.
    slope: f64,
    /// -ln P, but for a constant.
    rarity: f64,
}

impl RoughnessPartner {
    pub(super) fn new(facet: &Facet) -> Option<Self> {
        let Facet { distribution, alpha, n, m, .. } = *facet;
        let slope = facet.slope()?;
        let own = distribution.steepness(slope.length_squared());
        // No azimuth, or no light; `NaN` is neither.
        let sloping = own.e > 0.0;
        if !sloping {
            return None;
        }
        let other = distribution.steepness(distribution.roughness_partner(own.e)?);
        let other_m = facet.tilted(slope * fm::sqrt(other.e / own.e));
        let (_, angle) = facet.leave(m)?;
        let (w, other_angle) = facet.leave(other_m)?;
        // Solid angle of normals by area of slopes.
        let (cos, other_cos) = (n.dot(m), n.dot(other_m));
        let cosines = other_cos / cos;
        let cubed = cosines * cosines * cosines;
        let ratio = fm::exp(other.rarity - own.rarity) * cubed * other_angle / angle;
        let slopes = [own, other].map(|s| s.slope * 2.0 / alpha);
        let found = ratio > 0.0 && ratio.is_finite();
        found.then_some(Self { w, ratio, slopes })
    }
}

impl Distribution {
    #[inline]
    fn steepness(self, e: f64) -> Steepness {
        match self {
            Self::Beckmann => Steepness { e, slope: e - 1.0, rarity: e },
            Self::Ggx => {
                Steepness { e, slope: (e - 1.0) / (e + 1.0), rarity: 2.0 * fm::ln(1.0 + e) }
            }
        }
    }

    /// e' of an e, and e of an e'; none where it is so far off that nothing is left there.
    #[inline]
    fn roughness_partner(self, e: f64) -> Option<f64> {
        match self {
            Self::Beckmann => beckmann(e),
            Self::Ggx => Some(ggx(e)),
        }
    }
}

/// Farthest e and z; D has long been below all that matters.
const FARTHEST: f64 = 100.0;

/// The other root of x exp(-x) = exp(-1) - e exp(-e) than the one on the side of e.
#[inline]
fn beckmann(e: f64) -> Option<f64> {
    // With x = 1 + d it is d - ln(1 + d) = z = -ln(1 - e exp(1 - e)), without cancellation on either side.
    let d = 1.0 - e;
    let g = d + if Real::abs(d) < 0.5 { fm::ln_1p(-d) } else { fm::ln(e) };
    let z = if g < -0.7 { -fm::ln_1p(-fm::exp(g)) } else { -fm::ln(-fm::exp_m1(g)) };
    let within = z < FARTHEST && e < FARTHEST;
    if !within {
        return None;
    }
    let s = fm::sqrt(2.0 * z);
    let mut x = if e < 1.0 {
        1.0 + s + z * (2.0 / 3.0)
    } else if s < 1.5 {
        1.0 - s + z * (2.0 / 3.0) - s * z * (1.0 / 18.0)
    } else {
        let c = fm::exp(-1.0 - z);
        c * (1.0 + c)
    };
    for _ in 0..NEWTON {
        let step = (x - 1.0 - fm::ln(x) - z) * x / (x - 1.0);
        if !step.is_finite() {
            break;
        }
        x -= step;
        if step.abs() <= 1e-13 * x {
            break;
        }
    }
    (x > 0.0).then_some(x)
}

/// Steps of Newton's method, which needs three or four.
const NEWTON: u32 = 8;

/// The other root of x / (1 + x)² = 1/4 - e / (1 + e)² than the one on the side of e.
#[inline]
fn ggx(e: f64) -> f64 {
    let q = (1.0 - e) / (1.0 + e);
    // c = q²/4 on the right; sqrt(1 - 4c) is the root below.
    let (twice, root) = (0.5 * q * q, 2.0 * fm::sqrt(e) / (1.0 + e));
    let larger = 1.0 - twice + root;
    if e < 1.0 { larger / twice } else { twice / larger }
}
