use core::f64::consts::PI;

use drt_math::Moments;
use drt_math::sobol::SobolSampler;
use drt_math::testing::{welch_z, z_score};
use drt_math::warp::uniform_sphere;

use crate::model::surface::fresnel::{conductor_reflected, dielectric_reflected};
use crate::model::surface::tests::*;

const SAMPLES: u32 = 40_000;

/// Batches of evenly spread directions, and how many directions each one has.
const BATCHES: u32 = 40;
const BATCH: u32 = 1 << 11;

/// Index on a direction's side over that of the exterior.
pub(super) fn index(bsdf: &Bsdf, w: Vec3) -> f64 {
    match bsdf {
        _ if normal().dot(w) >= 0.0 => 1.0,
        Bsdf::RoughDielectric(b) => b.eta,
        Bsdf::Anisotropic(b) => index(&b.base, w),
        Bsdf::Principled(b) => b.eta,
        Bsdf::Blend(b) => index(&b.bsdfs[1], w),
        Bsdf::Mask(b) => index(&b.bsdf, w),
        _ => 1.0,
    }
}

/// The integral over `wi` of the green value times `factor`, by the BSDF's own sampling.
fn sampled(bsdf: &Bsdf, wo: Vec3, factor: impl Fn(Vec3) -> f64) -> Moments {
    let mut rng = Rng::new(21, 0, 0);
    let mut sum = Moments::default();
    for _ in 0..SAMPLES {
        let drawn = bsdf.sample(wo, normal(), random_3d(&mut rng), Given::Wo);
        let weight = |s: DirectionSample| bsdf.eval(wo, s.w, normal()).g / s.pdf * factor(s.w);
        sum.push(drawn.map_or(0.0, weight));
    }
    sum
}

/// The integral over `wi` of the green value by directions spread evenly, in batches that are spread evenly each.
fn spread(bsdf: &Bsdf, wo: Vec3) -> Moments {
    let batch = |seed: u32| {
        let value = |index: u32| {
            let mut point = SobolSampler::new(seed, index);
            let wi = uniform_sphere([point.next_f64(), point.next_f64()]);
            bsdf.eval(wo, wi, normal()).g
        };
        (0..BATCH).map(value).sum::<f64>() * (4.0 * PI) / f64::from(BATCH)
    };
    (0..BATCHES).map(batch).collect()
}

#[test]
fn sampling_and_uniform_directions_integrate_alike() {
    for bsdf in cases() {
        for degrees in [20.0, 70.0, 150.0] {
            let wo = tilted(degrees);
            let (a, b) = (sampled(&bsdf, wo, |_| 1.0), spread(&bsdf, wo));
            let z = welch_z(&a, &b);
            assert!(z.abs() < 4.0, "{bsdf:?} at {degrees}: {} {} z = {z}", a.mean(), b.mean());
        }
    }
}

#[test]
fn a_missing_jacobian_is_rejected() {
    let bsdf = Bsdf::RoughDielectric(glass(Distribution::Ggx, 0.3, 1.2));
    let wo = tilted(30.0);
    // The squared index that turns a density of half vectors into one of directions.
    let faulty = sampled(&bsdf, wo, |w| index(&bsdf, w).powi(2));
    assert!(welch_z(&faulty, &spread(&bsdf, wo)).abs() > 4.0);
}

#[test]
fn no_surface_returns_more_than_it_receives() {
    let mut all = cases();
    all.extend(sharp_cases());
    for bsdf in all {
        for degrees in [0.0, 45.0, 80.0, 88.0, 110.0, 170.0] {
            let wo = tilted(degrees);
            // Radiance over squared index is what refraction conserves.
            let conserved = |wi| (index(&bsdf, wi) / index(&bsdf, wo)).powi(2);
            let furnace = sampled(&bsdf, wo, conserved);
            // Walter's fit of Beckmann's masking is up to 0.35 % too bright.
            assert!(furnace.mean() <= 1.0035, "{bsdf:?} at {degrees}: {}", furnace.mean());
        }
    }
}

#[test]
fn known_albedos_are_met() {
    let z = |bsdf: Bsdf, degrees: f64, truth: f64| {
        let albedo = sampled(&bsdf, tilted(degrees), |_| 1.0);
        if albedo.variance_of_mean() > 0.0 {
            z_score(&albedo, truth)
        } else {
            albedo.mean() - truth
        }
    };
    assert!(z(Bsdf::Diffuse(Diffuse::default()), 75.0, 0.5).abs() < 1e-9);
    // The glossy lobe is normalised at normal incidence.
    let phong = z(Bsdf::Phong(Phong::default()), 0.0, 0.7);
    assert!(phong.abs() < 4.0, "{phong}");
    // Sharp microfacets reflect and refract as a smooth surface does.
    for distribution in [Distribution::Beckmann, Distribution::Ggx] {
        let metal = copper(distribution, 1e-3);
        let truth = metal.specular_reflectance.g
            * conductor_reflected(45_f64.to_radians().cos(), metal.eta.g, metal.k.g);
        let albedo = sampled(&Bsdf::RoughConductor(metal), tilted(45.0), |_| 1.0);
        assert!((albedo.mean() - truth).abs() < 1e-4 * truth);

        let interface = glass(distribution, 1e-3, 1.5);
        for (degrees, eta) in [(45.0, 1.5), (150.0, 1.0 / 1.5), (130.0, 1.0 / 1.5)] {
            let cos = f64::to_radians(degrees).cos().abs();
            let reflected = dielectric_reflected(cos, eta);
            let truth = reflected + (1.0 - reflected) / (eta * eta);
            let albedo = sampled(&Bsdf::RoughDielectric(interface), tilted(degrees), |_| 1.0);
            let error = (albedo.mean() - truth).abs();
            assert!(error < 4e-3 * truth + 4.0 * albedo.variance_of_mean().sqrt(), "{degrees}");
        }
    }
}

#[test]
fn exchanged_directions_scatter_alike() {
    let mut rng = Rng::new(23, 0, 0);
    let n = normal();
    for bsdf in cases() {
        // Thin sheets are not where facets hide the light that goes through, nor is what was measured.
        if matches!(bsdf, Bsdf::PrincipledThin(_) | Bsdf::Measured(_)) {
            continue;
        }
        let mut compared = 0;
        for _ in 0..2000 {
            let [wo, wi] = [random_direction(&mut rng), random_direction(&mut rng)];
            let forth = bsdf.eval(wo, wi, n).g * n.dot(wo).abs() * index(&bsdf, wi).powi(2);
            let back = bsdf.eval(wi, wo, n).g * n.dot(wi).abs() * index(&bsdf, wo).powi(2);
            assert!((forth - back).abs() <= 1e-9 * forth.abs(), "{bsdf:?}: {forth} {back}");
            compared += u32::from(forth > 0.0);
        }
        assert!(compared > 100, "{bsdf:?}: {compared}");
    }
}
