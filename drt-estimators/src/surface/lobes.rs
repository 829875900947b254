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
//! The solid angle of a lobe is that of the microfacets, π α² of slopes, by the Jacobians of Walter et al.
//! 2007 (eqs. 14, 17) for facets along the normal: with the cosines o and i of both directions,
//!
//! ```text
//! w² = 4 o α²  of reflections,    w² = α² (o - η i)² / (η² i)  of refractions.
//! ```
//!
//! Towards grazing angles, where lobes are wide in one direction only, cosines count as α at least.

use core::f64::consts::{FRAC_1_PI, PI};
use core::ops::{Add, Div, Mul};

use drt_math::{Vec3, fm};

use super::fresnel::{conductor_reflected, dielectric_reflected};
use super::{Bsdf, Phong, RoughConductor, RoughDielectric};

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
    let lobe = Lobe::new(mirrored(wo, n), reflected_width2(cos, b.alpha), share);
    Lobes::glossy(0.0, [lobe, Lobe::default()])
}

fn dielectric(b: &RoughDielectric, wo: Vec3, n: Vec3) -> Lobes {
    let front = n.dot(wo) >= 0.0;
    let (n, eta) = if front { (n, b.eta) } else { (-n, b.eta.recip()) };
    let cos = n.dot(wo).clamp(1e-6, 1.0);
    let fresnel = dielectric_reflected(cos, eta);
    let reflected = b.specular_reflectance.mean() * fresnel;
    let reflection = Lobe::new(mirrored(wo, n), reflected_width2(cos, b.alpha), reflected);
    // Beyond the critical angle this goes along the surface, and has no share.
    let cos_t = fm::sqrt((1.0 - (1.0 - cos * cos) / (eta * eta)).max(0.0));
    let axis = (n * (cos / eta - cos_t) - wo * eta.recip()).normalize();
    let refracted = b.specular_transmittance.mean() * (1.0 - fresnel) / (eta * eta);
    let slope = b.alpha * (cos - eta * cos_t) / eta;
    let refraction = Lobe::new(axis, slope * slope / cos_t.max(b.alpha), refracted);
    Lobes::glossy(0.0, [reflection, refraction])
}

fn reflected_width2(cos: f64, alpha: f64) -> f64 {
    4.0 * alpha * alpha * f64::max(cos, alpha)
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
