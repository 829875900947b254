//! Models of the past: rough diffuse surfaces and Ward's, against their papers.

use core::f64::consts::{FRAC_1_PI, PI};

use drt_math::testing::{SIGNIFICANCE, sphere_chi_square};

use crate::model::surface::tests::*;

/// Oren and Nayar's formula in angles, of one channel, times the cosine at the light.
fn oren_nayar(rho: f64, alpha: f64, [wo, wi]: [Vec3; 2]) -> f64 {
    let s2 = alpha * alpha / 2.0;
    let polar = |w: Vec3| w.z.clamp(-1.0, 1.0).acos();
    let phi = wo.y.atan2(wo.x) - wi.y.atan2(wi.x);
    let (a, b) = (polar(wo).max(polar(wi)), polar(wo).min(polar(wi)));
    let c1 = 1.0 - 0.5 * s2 / (s2 + 0.33);
    let c2 = 0.45 * s2 / (s2 + 0.09)
        * (a.sin() - if phi.cos() >= 0.0 { 0.0 } else { (2.0 * b / PI).powi(3) });
    let c3 = 0.125 * s2 / (s2 + 0.09) * (4.0 * a * b / (PI * PI)).powi(2);
    let once = c1 + phi.cos() * c2 * b.tan() + (1.0 - phi.cos().abs()) * c3 * ((a + b) / 2.0).tan();
    let twice = 0.17 * s2 / (s2 + 0.13) * (1.0 - phi.cos() * (2.0 * b / PI).powi(2));
    (rho * once + rho * rho * twice) * FRAC_1_PI * wi.z
}

#[test]
fn rough_diffuse_values_follow_the_paper() {
    let mut rng = Rng::new(211, 0, 0);
    for alpha in [0.1, 0.4] {
        let rough = grooves(alpha, false);
        let (mut compared, mut planted) = (0, 0);
        for _ in 0..2000 {
            let [wo, wi] = [random_direction(&mut rng), random_direction(&mut rng)];
            let value = Bsdf::RoughDiffuse(rough).eval(wo, wi, Vec3::Z).g;
            if wo.z <= 0.01 || wi.z <= 0.01 {
                assert!(wo.z.min(wi.z) > 0.0 || value == 0.0);
                continue;
            }
            let expected = oren_nayar(rough.reflectance.g, alpha, [wo, wi]);
            assert!((value - expected).abs() <= 1e-9 * expected, "{wo:?} {wi:?}");
            compared += 1;
            // Planted: the property taken for the deviation itself.
            let other = oren_nayar(rough.reflectance.g, alpha * 2_f64.sqrt(), [wo, wi]);
            planted += i32::from((value - other).abs() > 1e-3 * expected);
        }
        assert!(compared > 300 && planted > 200, "{compared} {planted}");
    }
}

#[test]
fn without_roughness_it_is_lambertian() {
    let mut rng = Rng::new(212, 0, 0);
    let reflectance = Rgb::new(0.9, 0.6, 0.3);
    let flat = Bsdf::Diffuse(Diffuse { reflectance });
    for fast in [false, true] {
        let rough = Bsdf::RoughDiffuse(grooves(0.0, fast));
        for _ in 0..500 {
            let [wo, wi] = [random_direction(&mut rng), random_direction(&mut rng)];
            let [a, b] = [&flat, &rough].map(|b| b.eval(wo, wi, normal()));
            assert!((a - b).max_abs() <= 1e-14);
        }
    }
    // Steep grooves send no light that is less than none.
    let steep = Bsdf::RoughDiffuse(grooves(30.0, false));
    for _ in 0..2000 {
        let [wo, wi] = [random_direction(&mut rng), random_direction(&mut rng)];
        let value = steep.eval(wo, wi, normal());
        assert!(value.to_array().into_iter().all(|v| v >= 0.0));
    }
}

/// The three normalisations are one where both directions are the normal, and the density is that of Gaussian slopes.
#[test]
fn wards_lobe_is_gaussian() {
    let black = |variant| Ward {
        variant,
        reflectance: Rgb::ZERO,
        specular_reflectance: Rgb::splat(0.7),
        alpha: [0.2, 0.3],
    };
    for variant in [WardVariant::Ward, WardVariant::Duer, WardVariant::Balanced] {
        let top = Bsdf::Ward(black(variant)).eval(Vec3::Z, Vec3::Z, Vec3::Z).r;
        assert!((top - 0.7 / (4.0 * PI * 0.06)).abs() < 1e-12, "{variant:?}: {top}");
    }
    let from = tilted(35.0);
    let p_value = |wrong: [f64; 2]| {
        let mut rng = Rng::new(213, 0, 0);
        let drawn = |rng: &mut Rng| {
            let s = Bsdf::Ward(black(WardVariant::Balanced));
            s.sample(from, normal(), random_3d(rng), Given::Wo)
        };
        let samples = (0..100_000).map(|_| drawn(&mut rng).map_or(Vec3::splat(f64::NAN), |s| s.w));
        let other = Bsdf::Ward(Ward { alpha: wrong, ..black(WardVariant::Balanced) });
        sphere_chi_square(samples, |w| other.pdf(from, w, normal(), Given::Wo))
    };
    assert!(p_value([0.2, 0.3]) > SIGNIFICANCE);
    assert!(p_value([0.3, 0.2]) < SIGNIFICANCE);
}

#[test]
fn even_ward_needs_no_frame() {
    let even = Bsdf::Ward(Ward::default());
    assert!(!even.is_oriented() && even.undifferentiated(Property::AlphaU).is_some());
    let uneven = Bsdf::Ward(Ward { alpha: [0.1, 0.2], ..Ward::default() });
    assert!(uneven.is_oriented() && uneven.undifferentiated(Property::AlphaU).is_none());
}
