//! Every model is judged by the same tests, from the same directions: those of [`table`].

mod changes;
mod coated;
mod composed;
mod direction_partners;
mod energy;
mod flags;
mod formulas;
mod framed;
mod gradients;
mod lobes;
mod measured;
mod past;
mod perturbed;
mod roughness_partners;
mod sampling;
mod smooth;
pub(crate) mod table;
mod textured;

use alloc::boxed::Box;
use alloc::vec::Vec;

use drt_math::{Frame, Rgb, Rng, Vec3, vec3, warp};

use crate::model::surface::tests::table::{cases, every_kind};
use crate::model::surface::*;

/// A normal along no axis.
fn normal() -> Vec3 {
    vec3(0.48, -0.6, 0.64)
}

/// The direction at a polar angle in degrees from [`normal`], at some azimuth.
fn tilted(degrees: f64) -> Vec3 {
    let frame = drt_math::Frame::from_normal(normal());
    let (polar, azimuth) = (degrees.to_radians(), 0.7_f64);
    let (sin, cos) = polar.sin_cos();
    frame.to_world(vec3(sin * azimuth.cos(), sin * azimuth.sin(), cos))
}

fn random_direction(rng: &mut Rng) -> Vec3 {
    warp::uniform_sphere(rng.next_2d())
}

fn random_3d(rng: &mut Rng) -> [f64; 3] {
    [rng.next_f64(), rng.next_f64(), rng.next_f64()]
}

fn copper(distribution: Distribution, alpha: f64) -> RoughConductor {
    RoughConductor {
        distribution,
        alpha,
        eta: Rgb::new(0.2, 0.92, 1.1),
        k: Rgb::new(3.91, 2.45, 2.14),
        specular_reflectance: Rgb::new(1.0, 0.9, 0.8),
    }
}

fn glass(distribution: Distribution, alpha: f64, eta: f64) -> RoughDielectric {
    RoughDielectric { distribution, alpha, eta, ..Default::default() }
}

fn rough_plastic(distribution: Distribution, alpha: f64, eta: f64) -> Plastic {
    let coating = Coating::rough(distribution, alpha, eta).expect("a coating");
    Plastic { reflectance: Rgb::new(0.1, 0.27, 0.36), ..Plastic::new(coating) }
}

fn smooth_plastic(eta: f64) -> Plastic {
    let coating = Coating::smooth(eta).expect("a coating");
    Plastic { reflectance: Rgb::new(0.1, 0.27, 0.36), ..Plastic::new(coating) }
}

/// Under a tinted layer, smooth or rough.
fn varnished(bsdf: Bsdf, facets: Option<(Distribution, f64)>) -> Bsdf {
    let coating = match facets {
        None => Coating::smooth(1.5),
        Some((distribution, alpha)) => Coating::rough(distribution, alpha, 1.4),
    };
    Bsdf::Coated(Box::new(Coated {
        specular_reflectance: Rgb::new(0.9, 1.0, 0.8),
        sigma_a: Rgb::new(0.1, 0.2, 0.5),
        thickness: 0.7,
        ..Coated::new(bsdf, coating.expect("a coating"))
    }))
}

fn grooves(alpha: f64, fast: bool) -> RoughDiffuse {
    RoughDiffuse { reflectance: Rgb::new(0.9, 0.6, 0.3), alpha, fast }
}

fn blend(weight: f64, a: Bsdf, b: Bsdf) -> Bsdf {
    Bsdf::Blend(Box::new(Blend { bsdfs: [a, b], weight }))
}

fn anisotropic(base: Bsdf, alpha: [f64; 2]) -> Bsdf {
    Bsdf::Anisotropic(Box::new(Anisotropic { base, alpha }))
}

/// All lobes of an opaque one.
fn opaque() -> Principled {
    Principled {
        base_color: Rgb::new(0.2, 0.8, 0.1),
        metallic: 0.3,
        spec_tint: 0.4,
        sheen: 0.3,
        sheen_tint: 0.5,
        clearcoat: 0.9,
        flatness: 0.4,
        anisotropic: 0.8,
        ..Principled::default()
    }
}

/// A coloured interface.
fn through() -> Principled {
    Principled { base_color: Rgb::new(0.6, 0.8, 0.4), spec_trans: 1.0, ..Principled::default() }
}

fn thin() -> PrincipledThin {
    PrincipledThin {
        base_color: Rgb::new(0.7, 0.5, 0.1),
        anisotropic: 0.6,
        spec_trans: 0.5,
        spec_tint: 0.3,
        sheen: 0.2,
        diff_trans: 0.7,
        roughness: 0.8,
        ..PrincipledThin::default()
    }
}

fn unmixed_plastic(distribution: Distribution, alpha: f64, eta: f64) -> Plastic {
    Plastic::new(Coating::unmixed(distribution, alpha, eta).expect("a coating"))
}

/// Mirror-like surfaces, too sharp for quadrature.
fn sharp_cases() -> Vec<Bsdf> {
    let mut cases = Vec::new();
    for distribution in [Distribution::Beckmann, Distribution::Ggx] {
        for alpha in [1e-3, 1e-2] {
            cases.push(Bsdf::RoughConductor(copper(distribution, alpha)));
            cases.push(Bsdf::RoughDielectric(glass(distribution, alpha, 1.5)));
        }
    }
    cases
}
