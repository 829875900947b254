//! Surfaces that scatter into single directions, and coatings.

use core::f64::consts::PI;

use drt_math::Moments;
use drt_math::testing::z_score;

use crate::model::surface::fresnel::{conductor_reflected, dielectric_reflected};
use crate::model::surface::specular::Bend;
use crate::model::surface::tests::*;
use crate::model::texture::Texture;

const SAMPLES: u32 = 100_000;

/// The part of the green light that leaves from `wo` over all directions, single ones and others, each
/// times `factor`.
fn albedo(bsdf: &Bsdf, wo: Vec3, factor: impl Fn(Vec3) -> f64) -> Moments {
    let mut rng = Rng::new(51, 0, 0);
    let mut sum = Moments::default();
    for _ in 0..SAMPLES {
        let u = random_3d(&mut rng);
        sum.push(match bsdf.sample_specular(wo, normal(), u[2], Given::Wo) {
            Some(s) => s.weight.g * factor(s.w),
            None => bsdf
                .sample(wo, normal(), u, Given::Wo)
                .map_or(0.0, |s| bsdf.eval(wo, s.w, normal()).g / s.pdf * factor(s.w)),
        });
    }
    sum
}

#[test]
fn mirrors_reflect_as_fresnel_says() {
    let (eta, k) = (Rgb::new(0.2, 0.92, 1.1), Rgb::new(3.91, 2.45, 2.14));
    let metal = Bsdf::Conductor(Conductor { eta, k, specular_reflectance: Rgb::splat(0.9) });
    for degrees in [0.0, 40.0, 80.0] {
        let (wo, n) = (tilted(degrees), normal());
        let s = metal.sample_specular(wo, n, 0.3, Given::Wo).expect("a mirror");
        assert!((s.w - (n * (2.0 * n.dot(wo)) - wo)).max_abs() < 1e-14 && !s.straight);
        let truth = 0.9 * conductor_reflected(f64::to_radians(degrees).cos(), eta.g, k.g);
        assert!((s.weight.g - truth).abs() < 1e-12);
    }
    assert!(metal.sample_specular(tilted(100.0), normal(), 0.3, Given::Wo).is_none());
    assert!(metal.sample(tilted(30.0), normal(), [0.3; 3], Given::Wo).is_none());
}

/// Rough surfaces have tests of their own; sharp ones are what smooth ones are the limit of.
#[test]
fn glass_is_the_limit_of_rough_glass() {
    let n = normal();
    for degrees in [20.0, 70.0, 120.0, 150.0, 175.0] {
        let wo = tilted(degrees);
        let smooth = Bsdf::Dielectric(Dielectric { eta: 1.5, ..Default::default() });
        let rough = Bsdf::RoughDielectric(glass(Distribution::Beckmann, 1e-3, 1.5));
        for side in [1.0, -1.0] {
            let there = |w: Vec3| if n.dot(w) * side > 0.0 { 1.0 } else { 0.0 };
            let [a, b] = [&smooth, &rough].map(|bsdf| albedo(bsdf, wo, there));
            let error = (a.variance_of_mean() + b.variance_of_mean()).sqrt();
            let off = (a.mean() - b.mean()).abs();
            assert!(off < 4.0 * error + 4e-3, "{degrees} {side}: {} {}", a.mean(), b.mean());
        }
        // Radiance over squared index is conserved, which planted faults are not.
        let index = |w: Vec3| if n.dot(w) < 0.0 { 1.5_f64 } else { 1.0 };
        let conserved = albedo(&smooth, wo, |w| (index(w) / index(wo)).powi(2));
        assert!((conserved.mean() - 1.0).abs() < 1e-9, "{}", conserved.mean());
        let planted = albedo(&smooth, wo, |_| 1.0);
        let total = degrees == 120.0;
        assert!(total || (planted.mean() - 1.0).abs() > 0.1, "{degrees}: {}", planted.mean());
    }
}

#[test]
fn refraction_and_its_way_back_are_alike() {
    let smooth = Bsdf::Dielectric(Dielectric { eta: 1.33, ..Default::default() });
    for degrees in [10.0, 50.0, 80.0] {
        let (wo, n) = (tilted(degrees), normal());
        let there = smooth.sample_specular(wo, n, 1.0 - 1e-9, Given::Wo).expect("refracted");
        let back = smooth.sample_specular(there.w, n, 1.0 - 1e-9, Given::Wo).expect("refracted");
        assert!((back.w - wo).max_abs() < 1e-12);
        // Snell's law.
        let sin = |w: Vec3| w.reject(n).length();
        assert!((sin(wo) - 1.33 * sin(there.w)).abs() < 1e-12);
        assert!((there.weight.g * back.weight.g - 1.0).abs() < 1e-12);
        // The share that is reflected is the same from both sides.
        let cos = n.dot(there.w).abs();
        let [outside, inside] =
            [dielectric_reflected(n.dot(wo), 1.33), dielectric_reflected(cos, 1.33_f64.recip())];
        assert!((outside - inside).abs() < 1e-12);
        let importance = smooth.sample_specular(wo, n, 1.0 - 1e-9, Given::Wi).expect("refracted");
        assert_eq!(importance.weight, Rgb::ONE);
    }
}

#[test]
fn panes_let_light_straight_through() {
    let pane = Bsdf::ThinDielectric(ThinDielectric { eta: 1.5, ..Default::default() });
    for degrees in [0.0, 60.0, 130.0] {
        let wo = tilted(degrees);
        let through = pane.sample_specular(wo, normal(), 1.0 - 1e-9, Given::Wo).expect("through");
        assert!(through.straight && through.w == -wo);
        let r = dielectric_reflected(normal().dot(wo).abs(), 1.5);
        // Geometric series over the turns inside: r + (1 - r)² r (1 + r² + r⁴ + …).
        let truth = r + (1.0 - r) * (1.0 - r) * r / (1.0 - r * r);
        let reflected = albedo(&pane, wo, |w| if w == -wo { 0.0 } else { 1.0 });
        let z = z_score(&reflected, truth);
        assert!(z.abs() < 4.0, "{degrees}: z = {z}");
        let once = z_score(&reflected, r);
        assert!(once.abs() > 4.0, "planted: one reflection, z = {once}");
    }
}

/// A coating's mirror is what sharp microfacets are near, and as much goes through both.
#[test]
fn smooth_plastic_is_the_limit_of_rough_plastic() {
    let black = |p: Plastic| Plastic { reflectance: Rgb::ZERO, ..p };
    let sharp = rough_plastic(Distribution::Beckmann, 1e-3, 1.9);
    let [a, b] = [&smooth_plastic(1.9).coating, &sharp.coating];
    for cos in [0.1, 0.3, 0.7, 1.0] {
        // Interpolated over 64 cosines.
        assert!((a.let_through(cos) - b.let_through(cos)).abs() < 2e-3, "{cos}");
    }
    // Inside, the mean over 64 cosines, as Mitsuba takes it.
    let cosines = (0..64).map(|i| f64::from(i) / 63.0).filter(|cos| *cos > 0.0);
    let sum: f64 = cosines.map(|cos| cos * dielectric_reflected(cos, 1.0 / 1.9)).sum();
    let off = b.internal_reflectance() - 2.0 * sum / 64.0;
    assert!(off.abs() < 1e-3, "{off}");
    // As tabulated for 1.5: 0.596 (Egan and Hilgeman 1973).
    assert!((Coating::smooth(1.5).expect("glass").internal_reflectance() - 0.596).abs() < 1e-3);

    let smooth = Bsdf::Plastic(black(smooth_plastic(1.9)));
    let rough = Bsdf::Plastic(black(sharp));
    for degrees in [0.0, 45.0, 75.0] {
        let [a, b] = [&smooth, &rough].map(|bsdf| albedo(bsdf, tilted(degrees), |_| 1.0));
        let error = (a.variance_of_mean() + b.variance_of_mean()).sqrt();
        let off = (a.mean() - b.mean()).abs();
        assert!(off < 4.0 * error + 1e-3 * a.mean(), "{degrees}: {} {}", a.mean(), b.mean());
    }
    assert!(smooth.is_smooth() && !rough.is_smooth());
    assert_eq!((smooth.name(), rough.name()), ("plastic", "roughplastic"));
}

/// Values that Mitsuba 3.9.1 (scalar_rgb) evaluates, at polar angles and an azimuth between them.
#[test]
fn plastics_are_mitsubas() {
    let grey = |p: Plastic| Plastic { nonlinear: true, ..p };
    let bk7 = 1.49 / 1.000_277;
    let dense = 1.9 / 1.000_277;
    let cases = [
        (
            rough_plastic(Distribution::Beckmann, 0.1, dense),
            [
                [0.017_904_17, 0.048_341_26, 0.064_455_02],
                [0.024_057_85, 0.064_956_19, 0.086_608_26],
                [1.235_639_69, 1.268_981_10, 1.286_632_42],
                [0.004_429_61, 0.010_948_17, 0.014_399_18],
            ],
        ),
        (
            grey(rough_plastic(Distribution::Ggx, 0.4, bk7)),
            [
                [0.011_302_39, 0.026_561_73, 0.035_460_69],
                [0.020_017_08, 0.041_152_92, 0.053_478_95],
                [0.040_614_22, 0.057_092_21, 0.066_701_86],
                [0.157_273_14, 0.161_340_92, 0.163_713_19],
            ],
        ),
        (
            smooth_plastic(dense),
            [
                [0.019_152_70, 0.051_712_30, 0.068_949_74],
                [0.025_700_66, 0.069_391_78, 0.092_522_38],
                [0.020_990_29, 0.056_673_79, 0.075_565_06],
                [0.003_887_92, 0.010_497_37, 0.013_996_50],
            ],
        ),
        (
            grey(smooth_plastic(bk7)),
            [
                [0.008_889_53, 0.026_868_02, 0.038_241_77],
                [0.011_993_02, 0.036_248_12, 0.051_592_65],
                [0.009_754_18, 0.029_481_38, 0.041_961_42],
                [0.001_814_73, 0.005_484_90, 0.007_806_77],
            ],
        ),
    ];
    let directions = [[20.0, 50.0, 1.0], [70.0, 10.0, 2.5], [45.0, 45.0, PI], [80.0, 75.0, 3.0]];
    for (plastic, values) in cases {
        let bsdf = Bsdf::Plastic(plastic);
        for ([to, ti, azimuth], value) in directions.into_iter().zip(values) {
            let at = |degrees: f64, azimuth: f64| {
                let (sin, cos) = degrees.to_radians().sin_cos();
                vec3(sin * azimuth.cos(), sin * azimuth.sin(), cos)
            };
            let own = bsdf.eval(at(to, 0.0), at(ti, azimuth), Vec3::Z).to_array();
            for (a, b) in own.into_iter().zip(value) {
                assert!((a / b - 1.0).abs() < 4e-3, "{}: {own:?}, not {value:?}", bsdf.name());
            }
        }
    }
}

#[test]
fn coatings_out_of_range_are_refused() {
    for eta in [1.0, 0.5, f64::NAN] {
        assert!(Coating::smooth(eta).is_err());
    }
    assert!(Coating::rough(Distribution::Ggx, 0.0, 1.5).is_err());
    let bad = Dielectric { eta: 0.0, ..Default::default() };
    assert!(Bsdf::Dielectric(bad).validate().is_err());
    let two = TwoSided { front: Bsdf::Dielectric(Dielectric::default()), back: None };
    assert!(Bsdf::TwoSided(Box::new(two)).validate().is_err());
}

/// An index of refraction that varies over a surface has finite differences alone, under a mask, too.
#[test]
fn an_index_that_varies_is_not_differentiated() {
    let glass = Bsdf::Dielectric(Dielectric::default());
    let mask = Bsdf::Mask(Mask { bsdf: glass.clone(), opacity: 0.4 }.into());
    for bsdf in [glass, mask] {
        assert_eq!(bsdf.undifferentiated(Property::Eta), None);
        let texture = Texture::Checkerboard {
            colours: [Rgb::splat(1.4), Rgb::splat(1.6)],
            to_uv: crate::texture::UvMap::IDENTITY,
        };
        let textured = Textured::new(bsdf, alloc::vec![(Property::Eta, texture)]);
        let textured = Bsdf::Textured(alloc::boxed::Box::new(textured.expect("a texture")));
        assert!(textured.undifferentiated(Property::Eta).is_some());
    }
}

/// Behind the horizon of the shading normal, but in front of the facet, light is reflected as at the horizon.
#[test]
fn light_is_continuous_at_shading_horizons() {
    let metal = Conductor { specular_reflectance: Rgb::splat(0.9), ..Conductor::default() };
    let glass = Dielectric { eta: 1.5, ..Dielectric::default() };
    for (bsdf, part) in [(Bsdf::Conductor(metal), 0.9), (Bsdf::Dielectric(glass), 1.0)] {
        let ns = normal();
        for side in [1.0, -1.0] {
            // A metal has no inside.
            if side < 0.0 && part < 1.0 {
                continue;
            }
            // The facet is seen at a larger angle than the normal that is interpolated.
            let towards = (tilted(90.0) - ns * ns.dot(tilted(90.0))).normalize();
            let ng = (ns + towards * (0.2 * side)).normalize();
            let local = bsdf.at(None, ng, ns, true);
            let from = |cosine: f64| (towards + ns * (side * cosine)).normalize();
            for cosine in [1e-7, -1e-7, -0.05, -0.15] {
                let from = from(cosine);
                let s = local.sample_specular(from, 0.5, Given::Wo).expect("reflected");
                let value = local.specular(from, s.w).expect("a single direction");
                assert!((s.w + from).max_abs() < 1e-6, "{side} {cosine}: {:?}", s.w);
                assert!((s.weight.g - part).abs() < 1e-5, "{side} {cosine}: {:?}", s.weight);
                assert!((value.value - s.weight).g.abs() < 1e-9);
                assert!(cosine > 0.0 || (value.by_cosine.g == 0.0 && value.bend == Bend::Straight));
            }
            // Planted: the shading normal alone.
            let alone = bsdf.at(None, ng, ns, false);
            let s = alone.sample_specular(from(-0.05), 0.5, Given::Wo);
            assert!(s.is_none_or(|s| (s.w + from(-0.05)).max_abs() > 0.05));
        }
    }
}
