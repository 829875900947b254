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
use drt_math::{Rgb, Vec3, fm};

use crate::model::surface::fresnel::{conductor_reflected, dielectric_reflected};
use crate::model::surface::microfacet::{Distribution, LEAST_ALPHA};
use crate::model::surface::principled::stretched;
use crate::model::surface::{
    Anisotropic, At, Bsdf, Measured, Phong, Plastic, Principled, PrincipledThin, RoughConductor,
    RoughDielectric, Ward,
};

impl Bsdf {
    /// The sketch of the light that leaves to `wo`, by where it comes from.
    pub(crate) fn lobes(&self, at: At<'_>, wo: Vec3, n: Vec3) -> Lobes {
        let (bsdf, n) = self.facing(wo, n);
        match bsdf {
            Self::Diffuse(b) => Lobes::even(b.reflectance.mean() * FRAC_1_PI),
            Self::Phong(b) => phong(b, wo, n),
            Self::RoughConductor(b) => conductor(b, wo, n),
            Self::RoughDielectric(b) => dielectric(b, wo, n),
            Self::Plastic(b) => plastic(b, wo, n),
            Self::Textured(b) => b.at(at).lobes(None, wo, n),
            Self::Blend(b) => b.lobes(at, wo, n),
            Self::Coated(b) => b.lobes(at, wo, n),
            Self::Anisotropic(b) => uneven(b, wo, n),
            Self::Principled(b) => principled(b, wo, n),
            Self::PrincipledThin(b) => thin(b, wo, n),
            Self::Measured(b) => measured(b, wo, n),
            Self::RoughDiffuse(b) => Lobes::even(b.reflectance.mean() * FRAC_1_PI),
            Self::Ward(b) => ward(b, wo, n),
            // Nothing is differentiated at all others.
            _ => Lobes::even(0.0),
        }
    }
}

/// A sketch of which the two highest lobes stay; the others count as light from all around.
pub(super) fn two_highest(even: f64, mut all: [Lobe; 4]) -> Lobes {
    all.sort_unstable_by(|a, b| b.height.total_cmp(&a.height));
    let [a, b, c, d] = all;
    Lobes { even: even + c.height + d.height, lobes: [a, b] }
}

fn phong(b: &Phong, wo: Vec3, n: Vec3) -> Lobes {
    let cos = n.dot(wo).max(0.0);
    // As high in the middle as (exponent + 2) / (2 π).
    let width2 = 2.0 / (b.exponent + 2.0);
    let lobe = Lobe::new(mirrored(wo, n), width2, b.specular_reflectance.mean() * cos);
    Lobes::glossy(b.reflectance.mean() * FRAC_1_PI, [lobe, Lobe::default()])
}

fn ward(b: &Ward, wo: Vec3, n: Vec3) -> Lobes {
    let lobe = reflection(wo, n, widest(b.alpha), b.specular_reflectance.mean());
    Lobes::glossy(b.reflectance.mean() * FRAC_1_PI, [lobe, Lobe::default()])
}

fn conductor(b: &RoughConductor, wo: Vec3, n: Vec3) -> Lobes {
    let cos = n.dot(wo).clamp(1e-6, 1.0);
    let fresnel = conductor_reflected(cos, b.eta.mean(), b.k.mean());
    let share = b.specular_reflectance.mean() * fresnel;
    Lobes::glossy(0.0, [reflection(wo, n, b.alpha, share), Lobe::default()])
}

fn plastic(b: &Plastic, wo: Vec3, n: Vec3) -> Lobes {
    let through = b.coating.let_through(n.dot(wo).clamp(1e-6, 1.0));
    let even = b.reflectance.mean() * through * FRAC_1_PI;
    match b.coating.facets() {
        Some((_, alpha)) => {
            let share = b.specular_reflectance.mean() * (1.0 - through);
            Lobes::glossy(even, [reflection(wo, n, alpha, share), Lobe::default()])
        }
        None => Lobes::even(even),
    }
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

/// As wide all around as where it is widest.
fn uneven(b: &Anisotropic, wo: Vec3, n: Vec3) -> Lobes {
    let alpha = widest(b.alpha);
    match &b.base {
        Bsdf::RoughConductor(b) => conductor(&RoughConductor { alpha, ..*b }, wo, n),
        Bsdf::RoughDielectric(b) => dielectric(&RoughDielectric { alpha, ..*b }, wo, n),
        b => b.lobes(None, wo, n),
    }
}

fn widest([u, v]: [f64; 2]) -> f64 {
    f64::max(u, v)
}

/// Sheen, over π.
const SHEEN: f64 = 0.1;

fn principled(b: &Principled, wo: Vec3, n: Vec3) -> Lobes {
    let (colour, dielectric_part) = (b.base_color.mean(), 1.0 - b.metallic);
    let glass = RoughDielectric {
        distribution: Distribution::Ggx,
        alpha: widest(stretched(b.roughness, b.anisotropic).alpha),
        eta: b.eta,
        specular_transmittance: Rgb::splat(colour * dielectric_part * b.spec_trans),
        ..RoughDielectric::default()
    };
    let Lobes { lobes: [mut reflected, refracted], .. } = dielectric(&glass, wo, n);
    reflected.height += (colour * b.metallic + 0.01 * b.clearcoat) * FRAC_1_PI;
    let diffuse = colour * (1.0 - b.spec_trans) * FRAC_1_PI + b.sheen * SHEEN;
    Lobes::glossy(diffuse * dielectric_part, [reflected, refracted])
}

fn thin(b: &PrincipledThin, wo: Vec3, n: Vec3) -> Lobes {
    let n = if n.dot(wo) >= 0.0 { n } else { -n };
    let colour = b.base_color.mean();
    let once = dielectric_reflected(n.dot(wo).clamp(1e-6, 1.0), b.eta);
    // From both sides of the sheet.
    let reflected = 2.0 * once / (1.0 + once);
    let [mirror, through] =
        [(b.reflecting(), reflected), (b.blurring(), (1.0 - reflected) * colour)]
            .map(|(facets, share)| reflection(wo, n, widest(facets.alpha), b.spec_trans * share));
    let through = Lobe { axis: -wo, ..through };
    let diffuse = (1.0 - b.spec_trans) * colour * FRAC_1_PI + b.sheen * SHEEN;
    Lobes::glossy(diffuse, [mirror, through])
}

/// The part of measured light that is all around.
const AROUND: f64 = 0.3;

fn measured(b: &Measured, wo: Vec3, n: Vec3) -> Lobes {
    let albedo = b.albedo(n.dot(wo));
    let lobe = reflection(wo, n, b.alpha(), (1.0 - AROUND) * albedo);
    Lobes::glossy(AROUND * albedo * FRAC_1_PI, [lobe, Lobe::default()])
}

pub(super) fn reflection(wo: Vec3, n: Vec3, alpha: f64, share: f64) -> Lobe {
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
