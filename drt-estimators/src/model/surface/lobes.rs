//! Where a surface sends light, in a few numbers.
//!
//! Choosing among many directions in proportion to a BSDF needs its value for each, and for cones of
//! them at once. A sketch is enough there: diffuse light, and a lobe around each direction that an even
//! surface would send light to,
//!
//! ```text
//! f(d) ≈ e |n·d| + Σ s w² / (π (w² + c²)²),    c² = 2 (1 - a·d),
//! ```
//!
//! with the axis a, the solid angle π w² and the light s of a lobe. This is the distribution of Trowbridge
//! and Reitz over the directions about a, has integral s for a narrow lobe, and is spread over a cone of
//! the mean squared angle σ² by taking w² + σ² for w²: no exponential, and never zero.
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

use core::f64::consts::{FRAC_1_PI, PI};
use core::ops::{Add, Div, Mul};

use drt_math::{Vec3, fm};

use crate::model::surface::fresnel::{conductor_reflected, dielectric_reflected};
use crate::model::surface::microfacet::{Distribution, LEAST_ALPHA};
use crate::model::surface::{Bsdf, Phong, RoughConductor, RoughDielectric};

/// The part of a lobe's light that may be anywhere: the sketch is of its middle.
const ANYWHERE: f64 = 0.1;

/// A sketch of a scattering function with one direction given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lobes {
    /// The value towards the normal, apart from lobes; in volumes, that in all directions.
    pub(crate) even: f64,
    pub(crate) lobes: [Lobe; 2],
}

/// Light around a direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Lobe {
    /// Unit.
    pub(crate) axis: Vec3,
    /// w².
    pub(crate) width2: f64,
    /// s / π.
    pub(crate) height: f64,
}

impl Lobe {
    /// Of the light `share` around `axis`, with w² = `width2`.
    pub(crate) fn new(axis: Vec3, width2: f64, share: f64) -> Self {
        Self { axis, width2: width2.max(f64::MIN_POSITIVE), height: share * FRAC_1_PI }
    }

    /// The light of a lobe of that height and w² (or w² + σ²) where a direction is off its axis by a
    /// vector of the squared length `off2`.
    #[inline(always)]
    pub(crate) fn value<T>(height: T, width2: T, off2: T) -> T
    where
        T: Copy + Add<Output = T> + Mul<Output = T> + Div<Output = T>,
    {
        let off = width2 + off2;
        height * width2 / (off * off)
    }
}

impl Lobes {
    /// The same in all directions, but for the cosine.
    pub(crate) fn even(value: f64) -> Self {
        Self { even: value, lobes: [Lobe::default(); 2] }
    }

    /// With lobes, and a part of their light anywhere.
    fn glossy(even: f64, lobes: [Lobe; 2]) -> Self {
        let light: f64 = lobes.iter().map(|l| l.height).sum();
        Self { even: even + ANYWHERE * light, lobes }
    }
}

impl Bsdf {
    /// The sketch of the light that leaves to `wo`, by where it comes from.
    pub(crate) fn lobes(&self, wo: Vec3, n: Vec3) -> Lobes {
        let (bsdf, n) = self.facing(wo, n);
        match bsdf {
            Self::Diffuse(b) => Lobes::even(b.reflectance.mean() * FRAC_1_PI),
            Self::Phong(b) => phong(b, wo, n),
            Self::RoughConductor(b) => conductor(b, wo, n),
            Self::RoughDielectric(b) => dielectric(b, wo, n),
            Self::Null | Self::TwoSided(_) => Lobes::even(0.0),
        }
    }
}

fn phong(b: &Phong, wo: Vec3, n: Vec3) -> Lobes {
    let cos = n.dot(wo).max(0.0);
    // As high in the middle as (exponent + 2) / (2 π).
    let width2 = 2.0 / (b.exponent + 2.0);
    let lobe = Lobe::new(mirrored(wo, n), width2, b.specular_reflectance.mean() * cos);
    Lobes::glossy(b.reflectance.mean() * FRAC_1_PI, [lobe, Lobe::default()])
}

fn conductor(b: &RoughConductor, wo: Vec3, n: Vec3) -> Lobes {
    let cos = n.dot(wo).clamp(1e-6, 1.0);
    let fresnel = conductor_reflected(cos, b.eta.mean(), b.k.mean());
    let share = b.specular_reflectance.mean() * fresnel;
    Lobes::glossy(0.0, [reflection(wo, n, b.alpha, share), Lobe::default()])
}

fn dielectric(b: &RoughDielectric, wo: Vec3, n: Vec3) -> Lobes {
    let (n, eta) = if n.dot(wo) >= 0.0 { (n, b.eta) } else { (-n, b.eta.recip()) };
    let facet = Facet::seen_from(wo, n, b.distribution, b.alpha);
    let cosines = [facet.cos, n.dot(wo).clamp(1e-6, 1.0)];
    let fresnel = 0.5 * cosines.map(|cos| dielectric_reflected(cos, eta)).iter().sum::<f64>();
    let reflected = b.specular_reflectance.mean() * fresnel;
    let refracted = b.specular_transmittance.mean() * (1.0 - fresnel) / (eta * eta);
    let lobes = [reflection(wo, n, b.alpha, reflected), facet.refraction(wo, eta, refracted)];
    Lobes::glossy(0.0, lobes)
}

fn reflection(wo: Vec3, n: Vec3, alpha: f64, share: f64) -> Lobe {
    let cos = n.dot(wo).max(alpha);
    Lobe::new(mirrored(wo, n), 4.0 * alpha * alpha * cos, share)
}

/// The facet that stands for all that a direction sees.
struct Facet {
    normal: Vec3,
    /// Of the angle between both.
    cos: f64,
    /// The solid angle of visible normals about it: 1 over their density there.
    normals: f64,
    alpha: f64,
}

impl Facet {
    fn seen_from(wo: Vec3, n: Vec3, distribution: Distribution, alpha: f64) -> Self {
        let alpha = alpha.max(LEAST_ALPHA);
        let cos = n.dot(wo).clamp(1e-6, 1.0);
        let tangent = wo - n * cos;
        let stretched = fm::sqrt(alpha * alpha * (1.0 - cos * cos) + cos * cos);
        let normal = (tangent * (alpha * alpha) + n * (0.5 * (stretched + cos))).normalize();
        let cos_m = normal.dot(wo).clamp(1e-6, 1.0);
        let density = distribution.visible(n.dot(normal), cos, alpha) * cos_m;
        Self { normal, cos: cos_m, normals: 1.0 / density, alpha }
    }

    fn refraction(&self, wo: Vec3, eta: f64, share: f64) -> Lobe {
        // Beyond the critical angle this goes along the facet.
        let cos_t = fm::sqrt((1.0 - (1.0 - self.cos * self.cos) / (eta * eta)).max(0.0));
        let axis = (self.normal * (self.cos / eta - cos_t) - wo * eta.recip()).normalize();
        let slope = (self.cos - eta * cos_t) / eta;
        Lobe::new(axis, FRAC_1_PI * self.normals * slope * slope / cos_t.max(self.alpha), share)
    }
}

fn mirrored(w: Vec3, n: Vec3) -> Vec3 {
    n * (2.0 * n.dot(w)) - w
}

impl Lobes {
    /// Of a phase function with the value `across` at a right angle to the given direction, and `peak`
    /// at its maximum, which is along `axis`.
    pub(crate) fn around(axis: Vec3, across: f64, peak: f64) -> Self {
        let rest = f64::max(1.0 - 4.0 * PI * across, 0.0);
        if peak <= across || rest == 0.0 {
            return Self::even(across);
        }
        // s / (π w²) is the height of the peak.
        let width2 = rest * FRAC_1_PI / (peak - across);
        Self { even: across, lobes: [Lobe::new(axis, width2, rest), Lobe::default()] }
    }
}
