//! Every model is judged as the same list of cases, from the same directions.

mod changes;
mod coated;
mod composed;
mod direction_partners;
mod energy;
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
mod textured;

use alloc::boxed::Box;
use alloc::vec::Vec;

use drt_math::{Frame, Real, Rgb, Rng, Vec3, vec3, warp};

use crate::model::surface::angles::Angles;
use crate::model::surface::framed::Framed;
use crate::model::surface::*;

/// The value of a BSDF over another scalar, by the generic code of `eval`: `lift` turns the value of
/// a property into one of that scalar (a number's into three equal ones).
pub(crate) fn value_over<T: Real>(
    bsdf: &Bsdf,
    wo: Vec3<T>,
    wi: Vec3<T>,
    n: Vec3<T>,
    lift: &mut dyn FnMut(Property, Rgb) -> Rgb<T>,
) -> Rgb<T> {
    let a = Angles::new(wo, wi, n);
    match bsdf {
        Bsdf::Null | Bsdf::Conductor(_) | Bsdf::Dielectric(_) | Bsdf::ThinDielectric(_) => {
            Rgb::splat(T::zero())
        }
        Bsdf::Plastic(b) => b.value_with(
            &a,
            lift(Property::Reflectance, b.reflectance),
            lift(Property::SpecularReflectance, b.specular_reflectance),
        ),
        Bsdf::Diffuse(b) => {
            Diffuse { reflectance: lift(Property::Reflectance, b.reflectance) }.value(&a)
        }
        Bsdf::Phong(b) => Phong {
            reflectance: lift(Property::Reflectance, b.reflectance),
            specular_reflectance: lift(Property::SpecularReflectance, b.specular_reflectance),
            exponent: lift(Property::Exponent, Rgb::splat(b.exponent)).r,
        }
        .value(&a),
        Bsdf::RoughConductor(b) => RoughConductor {
            distribution: b.distribution,
            alpha: lift(Property::Alpha, Rgb::splat(b.alpha)).r,
            eta: lift(Property::Eta, b.eta),
            k: lift(Property::K, b.k),
            specular_reflectance: lift(Property::SpecularReflectance, b.specular_reflectance),
        }
        .value(&a),
        Bsdf::RoughDielectric(b) => RoughDielectric {
            distribution: b.distribution,
            alpha: lift(Property::Alpha, Rgb::splat(b.alpha)).r,
            eta: lift(Property::Eta, Rgb::splat(b.eta)).r,
            specular_reflectance: lift(Property::SpecularReflectance, b.specular_reflectance),
            specular_transmittance: lift(Property::SpecularTransmittance, b.specular_transmittance),
        }
        .value(&a),
        Bsdf::Textured(b) => value_over(&b.bsdf, wo, wi, n, lift),
        // Without a place, normals are the surface's.
        Bsdf::Perturbed(b) => value_over(&b.bsdf, wo, wi, n, lift),
        Bsdf::Coated(b) => {
            // What lies below, by Snell's law over any scalar; a texture or another layer below has no place here.
            let eta = T::from(b.coating.eta());
            let cosine = |c: T| (T::one() - (T::one() - c.squared()) / eta.squared()).sqrt();
            let below = |w: Vec3<T>, c: T| {
                let inside = if c.re() < 0.0 { -cosine(c) } else { cosine(c) };
                w * eta.recip() + n * (inside - c / eta)
            };
            let (o, i) = (below(wo, a.cos_o), below(wi, a.cos_i));
            // A reflectance of the layer hides that of what is below.
            let mut shown = |property, value: Rgb| match property {
                Property::SpecularReflectance => value.map(T::from),
                _ => lift(property, value),
            };
            let value = value_over(&b.bsdf, o, i, n, &mut shown);
            let [co, ci] = [a.cos_o, a.cos_i].map(T::abs);
            let path = (cosine(co).recip() + cosine(ci).recip()) * b.thickness;
            let sigma_a = lift(Property::SigmaA, b.sigma_a);
            let through = b.coating.let_through(co) * b.coating.let_through(ci) * ci
                / (cosine(ci) * eta.squared());
            let value = value * sigma_a.map(|s| (-(s * path)).exp() * through);
            let specular = lift(Property::SpecularReflectance, b.specular_reflectance);
            let front = if a.cos_o.re() < 0.0 { a.flipped() } else { a };
            match b.coating.reflection(&front) {
                Some(top) if front.in_front() => value + specular * top,
                _ => value,
            }
        }
        Bsdf::Mask(b) => value_over(&b.bsdf, wo, wi, n, lift) * T::from(b.opacity),
        Bsdf::Blend(b) => {
            let weight = lift(Property::Weight, Rgb::splat(b.weight)).r;
            // Their own properties are not properties of the blend.
            let mut constant = |_, value: Rgb| value.map(T::from);
            let [a, b] = b.bsdfs.each_ref().map(|b| value_over(b, wo, wi, n, &mut constant));
            a * (T::one() - weight) + b * weight
        }
        Bsdf::Anisotropic(b) => {
            let frame = Frame::from_normal(n);
            b.value(number_over(lift), frame.to_local(wo), frame.to_local(wi))
        }
        Bsdf::Principled(b) => {
            let frame = Frame::from_normal(n);
            b.value(number_over(lift), frame.to_local(wo), frame.to_local(wi))
        }
        Bsdf::PrincipledThin(b) => {
            let frame = Frame::from_normal(n);
            b.value(number_over(lift), frame.to_local(wo), frame.to_local(wi))
        }
        Bsdf::Measured(b) => {
            let frame = Frame::from_normal(n);
            b.value(number_over(lift), frame.to_local(wo), frame.to_local(wi))
        }
        Bsdf::RoughDiffuse(b) => {
            let frame = Frame::from_normal(n);
            b.value(number_over(lift), frame.to_local(wo), frame.to_local(wi))
        }
        Bsdf::Ward(b) => {
            let frame = Frame::from_normal(n);
            b.value(number_over(lift), frame.to_local(wo), frame.to_local(wi))
        }
        Bsdf::TwoSided(b) if a.cos_o.re() >= 0.0 => value_over(&b.front, wo, wi, n, lift),
        Bsdf::TwoSided(b) => value_over(b.back.as_ref().unwrap_or(&b.front), wo, wi, -n, lift),
    }
}

/// What `Framed::value` takes, of `lift`: of a colour the lanes of its first channel stand for all.
fn number_over<T: Real>(
    lift: &mut dyn FnMut(Property, Rgb) -> Rgb<T>,
) -> impl Fn(Property, f64) -> T {
    let lift = core::cell::RefCell::new(lift);
    move |property, value| lift.borrow_mut()(property, Rgb::splat(value)).r
}

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

/// All models, smooth enough for quadrature.
fn cases() -> Vec<Bsdf> {
    use Distribution::{Beckmann, Ggx};
    let phong = Phong { reflectance: Rgb::new(0.5, 0.3, 0.1), ..Default::default() };
    let copper_front = TwoSided {
        front: Bsdf::RoughConductor(copper(Ggx, 0.4)),
        back: Some(Bsdf::Diffuse(Diffuse::default())),
    };
    alloc::vec![
        Bsdf::Diffuse(Diffuse::default()),
        Bsdf::Phong(phong),
        Bsdf::Phong(Phong { specular_reflectance: Rgb::ZERO, exponent: 2.5, ..phong }),
        Bsdf::RoughConductor(RoughConductor::default()),
        Bsdf::RoughConductor(copper(Beckmann, 0.5)),
        Bsdf::RoughConductor(copper(Ggx, 0.2)),
        Bsdf::RoughDielectric(glass(Beckmann, 0.3, 1.5)),
        Bsdf::RoughDielectric(glass(Ggx, 0.2, 1.2)),
        Bsdf::RoughDielectric(glass(Beckmann, 0.2, 1.0 / 1.33)),
        Bsdf::RoughDielectric(RoughDielectric {
            specular_transmittance: Rgb::ZERO,
            ..glass(Ggx, 0.5, 1.8)
        }),
        Bsdf::Plastic(rough_plastic(Beckmann, 0.3, 1.9)),
        Bsdf::Plastic(Plastic {
            nonlinear: true,
            specular_reflectance: Rgb::new(0.9, 0.4, 0.0),
            ..rough_plastic(Ggx, 0.2, 1.5)
        }),
        Bsdf::Plastic(smooth_plastic(1.5)),
        Bsdf::TwoSided(Box::new(TwoSided { front: Bsdf::Phong(phong), back: None })),
        Bsdf::TwoSided(Box::new(copper_front)),
        Bsdf::Plastic(unmixed_plastic(Beckmann, 0.3, 1.5)),
        blend(0.3, Bsdf::Phong(phong), Bsdf::RoughDielectric(glass(Ggx, 0.4, 1.5))),
        varnished(Bsdf::Diffuse(Diffuse { reflectance: Rgb::new(0.9, 0.6, 0.3) }), None),
        varnished(Bsdf::RoughConductor(copper(Ggx, 0.3)), Some((Beckmann, 0.2))),
        varnished(
            Bsdf::TwoSided(Box::new(TwoSided { front: Bsdf::Phong(phong), back: None })),
            Some((Ggx, 0.3)),
        ),
    ]
}

/// What needs a frame, or is made of others.
fn composed_cases() -> Vec<Bsdf> {
    use Distribution::{Beckmann, Ggx};
    alloc::vec![
        Bsdf::Mask(Box::new(Mask { bsdf: Bsdf::RoughConductor(copper(Ggx, 0.3)), opacity: 0.6 })),
        anisotropic(Bsdf::RoughConductor(copper(Beckmann, 0.3)), [0.2, 0.5]),
        anisotropic(Bsdf::RoughDielectric(glass(Ggx, 0.3, 1.5)), [0.5, 0.2]),
        Bsdf::Principled(Box::new(Principled {
            base_color: Rgb::new(0.2, 0.8, 0.1),
            metallic: 0.3,
            spec_tint: 0.4,
            sheen: 0.3,
            sheen_tint: 0.5,
            clearcoat: 0.9,
            flatness: 0.4,
            anisotropic: 0.8,
            ..Principled::default()
        })),
        Bsdf::Principled(Box::new(Principled { spec_trans: 0.7, roughness: 0.6, ..through() })),
        Bsdf::PrincipledThin(Box::new(thin())),
        Bsdf::RoughDiffuse(grooves(0.6, false)),
        Bsdf::RoughDiffuse(grooves(0.3, true)),
        Bsdf::Ward(Ward { alpha: [0.2, 0.5], ..Ward::default() }),
    ]
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
