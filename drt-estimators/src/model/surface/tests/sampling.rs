use drt_math::testing::{SIGNIFICANCE, sphere_chi_square};

use crate::model::surface::tests::*;

const SAMPLES: u32 = 200_000;

/// p-value of the samples against a density; lost samples lie nowhere.
fn p_value(bsdf: &Bsdf, from: Vec3, given: Given, pdf: impl Fn(Vec3) -> f64) -> f64 {
    let mut rng = Rng::new(11, 0, 0);
    let lost = Vec3::splat(f64::NAN);
    let samples = (0..SAMPLES)
        .map(|_| bsdf.sample(from, normal(), random_3d(&mut rng), given).map_or(lost, |s| s.w));
    sphere_chi_square(samples, pdf)
}

#[test]
fn samples_follow_their_density_from_everywhere() {
    for bsdf in cases() {
        for degrees in [0.0, 40.0, 85.0, 130.0] {
            let from = tilted(degrees);
            let given = if degrees == 40.0 { Given::Wi } else { Given::Wo };
            let p = p_value(&bsdf, from, given, |w| bsdf.pdf(from, w, normal(), given));
            assert!(p > SIGNIFICANCE, "{bsdf:?} at {degrees} degrees: p = {p:e}");
        }
    }
}

#[test]
fn a_density_of_slightly_wrong_roughness_is_rejected() {
    let from = tilted(60.0);
    for distribution in [Distribution::Beckmann, Distribution::Ggx] {
        let pairs = [
            [0.30, 0.31].map(|alpha| Bsdf::RoughConductor(copper(distribution, alpha))),
            [0.30, 0.31].map(|alpha| Bsdf::RoughDielectric(glass(distribution, alpha, 1.5))),
        ];
        for [right, wrong] in pairs {
            let pdf = |w| wrong.pdf(from, w, normal(), Given::Wo);
            assert!(p_value(&right, from, Given::Wo, pdf) < SIGNIFICANCE);
        }
    }
}

#[test]
fn the_density_covers_all_values_and_their_derivatives() {
    let mut rng = Rng::new(12, 0, 0);
    for bsdf in cases() {
        let mut properties: Vec<_> = bsdf.differentiated().iter().collect();
        properties.retain(|p| bsdf.undifferentiated(*p).is_none());
        for _ in 0..2000 {
            let [wo, wi] = [random_direction(&mut rng), random_direction(&mut rng)];
            let g = bsdf.gradient(wo, wi, normal());
            let needed =
                !g.value.is_zero() || properties.iter().any(|p| !g.params.get(*p).is_zero());
            for (from, to, given) in [(wo, wi, Given::Wo), (wi, wo, Given::Wi)] {
                let pdf = bsdf.pdf(from, to, normal(), given);
                assert!(pdf.is_finite() && pdf >= 0.0);
                assert!(pdf > 0.0 || !needed, "{bsdf:?}: {g:?} from {from:?} to {to:?}");
            }
        }
    }
}

/// Visible normals leave only Fresnel's factor, the choice of the lobe and the masking of the drawn
/// direction in the weight: never much above one, however sharp the surface.
#[test]
fn weights_of_sharp_surfaces_stay_bounded() {
    let mut rng = Rng::new(13, 0, 0);
    for bsdf in sharp_cases() {
        for degrees in [0.0, 30.0, 80.0, 89.9, 120.0, 179.0] {
            let from = tilted(degrees);
            let mut drawn = 0;
            for _ in 0..1000 {
                let Some(s) = bsdf.sample(from, normal(), random_3d(&mut rng), Given::Wo) else {
                    continue;
                };
                drawn += 1;
                let weight = bsdf.eval(from, s.w, normal()).max_channel() / s.pdf;
                // Refraction into the thinner side carries 1.5² in radiance.
                assert!((0.0..2.27).contains(&weight), "{bsdf:?} at {degrees}: {weight}");
            }
            let opaque = !bsdf.is_transmissive() && degrees > 90.0;
            assert!(
                if opaque { drawn == 0 } else { drawn > 500 },
                "{bsdf:?} at {degrees}: {drawn}"
            );
        }
    }
}

#[test]
fn grazing_and_opposite_directions_give_zeros_not_nans() {
    let n = Vec3::Z;
    let tiny = [0.0, 1e-300, 1e-160, 1e-17, 1e-9];
    let mut cases = cases();
    cases.extend(sharp_cases());
    cases.extend(every_kind());
    for bsdf in &cases {
        for zo in tiny {
            for zi in tiny {
                for wi in [vec3(1.0, 0.0, zi), vec3(-1.0, 0.0, zi), vec3(-1.0, 0.0, -zi)] {
                    let wo = vec3(1.0, 0.0, zo);
                    let g = bsdf.gradient(wo, wi, n);
                    let value = bsdf.eval(wo, wi, n);
                    assert!(value.is_finite() && g.value.is_finite(), "{bsdf:?} {wo:?} {wi:?}");
                    assert!(!bsdf.pdf(wo, wi, n, Given::Wo).is_nan());
                    for vector in [g.wo, g.wi, g.n] {
                        assert!(vector.is_finite(), "{bsdf:?} {wo:?} {wi:?} {g:?}");
                    }
                }
            }
            let drawn = bsdf.sample(vec3(1.0, 0.0, zo), n, [0.3, 0.6, 0.5], Given::Wo);
            assert!(drawn.is_none_or(|s| s.w.is_finite() && s.pdf.is_finite()));
        }
    }
}

#[test]
fn extreme_random_numbers_give_directions() {
    let ends = [1e-16, 0.5, 1.0 - 1e-16];
    let mut cases = cases();
    cases.extend(sharp_cases());
    for bsdf in &cases {
        for degrees in [0.0, 1e-7, 45.0, 89.999_999] {
            for u in ends {
                for v in ends {
                    for choice in ends {
                        let u = [u, v, choice];
                        let drawn = bsdf.sample(tilted(degrees), normal(), u, Given::Wo);
                        let unit = |s: DirectionSample| (s.w.length() - 1.0).abs() < 1e-9;
                        assert!(drawn.is_none_or(unit), "{bsdf:?} at {degrees} from {u:?}");
                    }
                }
            }
        }
    }
}
