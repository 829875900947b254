//! Reflectors under a layer: limits, reciprocity, energy, single directions, and properties.

use core::f64::consts::FRAC_1_PI;

use drt_math::testing::{SIGNIFICANCE, sphere_chi_square, z_score};
use drt_math::{Moments, ValueChange};

use crate::model::surface::fresnel::dielectric_reflected;
use crate::model::surface::tests::*;

fn clear(bsdf: Bsdf, eta: f64) -> Coated {
    Coated::new(bsdf, Coating::smooth(eta).expect("a coating"))
}

fn held(coated: Coated) -> Bsdf {
    Bsdf::Coated(Box::new(coated))
}

/// With the index of what is around it a layer is nothing.
#[test]
fn a_layer_that_does_not_refract_changes_nothing() {
    let mut rng = Rng::new(201, 0, 0);
    for bsdf in [
        Bsdf::Diffuse(Diffuse::default()),
        Bsdf::Phong(Phong::default()),
        Bsdf::RoughConductor(copper(Distribution::Ggx, 0.3)),
        anisotropic(Bsdf::RoughConductor(copper(Distribution::Ggx, 0.3)), [0.2, 0.5]),
    ] {
        let coated = held(clear(bsdf.clone(), 1.0 + 1e-10));
        for _ in 0..500 {
            let [wo, wi] = [random_direction(&mut rng), random_direction(&mut rng)];
            let [a, b] = [&bsdf, &coated].map(|b| b.gradient(wo, wi, normal()));
            assert!((a.value - b.value).max_abs() <= 1e-6 * a.value.max_abs(), "{bsdf:?}");
            // Grazing, what is left of the index counts most.
            if normal().dot(wo).abs() > 0.01 && normal().dot(wi).abs() > 0.01 {
                for (a, b, w) in [(a.wo, b.wo, wo), (a.wi, b.wi, wi)] {
                    let off = (a.g - b.g).reject(w).max_abs();
                    assert!(off <= 1e-4 * (a.g.max_abs() + 1e-6), "{bsdf:?}: {a:?} {b:?}");
                }
            }
        }
    }
}

/// A Lambertian base under a clear layer is smooth plastic whose inner reflections are left out.
#[test]
fn over_a_diffuse_base_it_is_plastic_without_inner_reflections() {
    let (eta, mut rng) = (1.5, Rng::new(202, 0, 0));
    let reflectance = Rgb::new(0.1, 0.27, 0.36);
    let coated = held(clear(Bsdf::Diffuse(Diffuse { reflectance }), eta));
    let plastic = smooth_plastic(eta);
    let kept = 1.0 - plastic.coating.internal_reflectance();
    let plastic = Bsdf::Plastic(plastic);
    for _ in 0..300 {
        let [wo, wi] = [random_direction(&mut rng), random_direction(&mut rng)];
        let [a, b] = [&coated, &plastic].map(|b| b.eval(wo, wi, normal()));
        assert!((a - b * kept).max_abs() <= 1e-12, "{a:?} {b:?}");
    }
}

/// The light that returns from a white base: what gets in, spread evenly, gets out through the cone of directions that are not
/// reflected back, in closed form the mean transmittance from inside.
#[test]
fn a_white_base_returns_what_gets_in_and_out() {
    let (eta, white) = (1.5, Bsdf::Diffuse(Diffuse { reflectance: Rgb::ONE }));
    let out = 1.0 - Coating::smooth(eta).expect("glass").internal_reflectance();
    let coated = held(clear(white, eta));
    for degrees in [0.0, 50.0, 80.0] {
        let wo = tilted(degrees);
        let f = dielectric_reflected(normal().dot(wo), eta);
        let (mut sum, mut planted, mut rng) =
            (Moments::default(), Moments::default(), Rng::new(203, 0, 0));
        for _ in 0..60_000 {
            let u = random_3d(&mut rng);
            let (light, faulty) = match coated.sample_specular(wo, normal(), u[2], Given::Wo) {
                Some(s) => (s.weight.g, s.weight.g),
                None => coated.sample(wo, normal(), u, Given::Wo).map_or((0.0, 0.0), |s| {
                    let light = coated.eval(wo, s.w, normal()).g / s.pdf;
                    // Planted: solid angles that the layer does not compress.
                    (light, light * eta * eta)
                }),
            };
            sum.push(light);
            planted.push(faulty);
        }
        let truth = f + (1.0 - f) * out;
        let z = z_score(&sum, truth);
        assert!(z.abs() < 4.0, "{degrees}: {} {truth} z = {z}", sum.mean());
        assert!(z_score(&planted, truth).abs() > 4.0);
    }
}

/// Rough layers that are hardly rough are smooth ones, by what they let through.
#[test]
fn a_rough_layer_becomes_a_smooth_one() {
    let base = || Bsdf::Diffuse(Diffuse::default());
    let rough = Coating::rough(Distribution::Beckmann, 1e-3, 1.5).expect("a coating");
    let (rough, smooth) = (held(Coated::new(base(), rough)), held(clear(base(), 1.5)));
    assert_eq!((smooth.name(), rough.name()), ("coating", "roughcoating"));
    assert!(smooth.is_smooth() && !rough.is_smooth());
    // Away from the mirror's direction.
    for (o, i) in [(20.0, 50.0), (60.0, 10.0), (5.0, 70.0)] {
        let [a, b] = [&smooth, &rough].map(|b| b.eval(tilted(o), tilted(i), normal()).g);
        assert!((a - b).abs() < 5e-3 * a, "{a} {b}");
    }
}

/// The tint is that of both slanted ways through the layer.
#[test]
fn absorption_follows_the_way_through_the_layer() {
    let clear = clear(Bsdf::Diffuse(Diffuse::default()), 1.5);
    let sigma_a = Rgb::new(0.1, 0.2, 0.5);
    let tinted = held(Coated { sigma_a, thickness: 2.0, ..clear.clone() });
    let inside = |degrees: f64| (1.0 - (degrees.to_radians().sin() / 1.5).powi(2)).sqrt();
    let [a, b] = [held(clear), tinted].map(|b| b.eval(tilted(60.0), tilted(-30.0), normal()));
    let path = 2.0 * (1.0 / inside(60.0) + 1.0 / inside(30.0));
    let expected = a * sigma_a.map(|s| (-s * path).exp());
    assert!((b - expected).max_abs() < 1e-12 * expected.max_abs());
}

/// A mirror under a layer, and one under two.
#[test]
fn mirrors_below_reflect_into_the_direction_of_the_layer() {
    let n = normal();
    let mirror =
        Bsdf::Conductor(Conductor { specular_reflectance: Rgb::splat(0.6), ..Default::default() });
    let once = Coated { sigma_a: Rgb::splat(0.3), ..clear(mirror, 1.5) };
    let twice = Coated { specular_reflectance: Rgb::splat(0.8), ..clear(held(once.clone()), 1.3) };
    for (coated, degrees) in [(&once, 0.0), (&once, 65.0), (&twice, 40.0)] {
        let (bsdf, wo) = (held(coated.clone()), tilted(degrees));
        let mut sum = Moments::default();
        let steps = 40_000;
        for i in 0..steps {
            let choice = (f64::from(i) + 0.5) / f64::from(steps);
            let s = bsdf.sample_specular(wo, n, choice, Given::Wo).expect("a mirror");
            assert!((s.w - (n * (2.0 * n.dot(wo)) - wo)).max_abs() < 1e-9);
            sum.push(s.weight.g);
        }
        let wi = n * (2.0 * n.dot(wo)) - wo;
        let found = bsdf.specular(None, wo, wi, n).expect("a mirror");
        assert!((found.probability - 1.0).abs() < 1e-12);
        let z = z_score(&sum, found.value.g);
        assert!(z.abs() < 1.0, "{} {:?}", sum.mean(), found.value);
        for property in [Property::SigmaA, Property::SpecularReflectance] {
            let at = |theta: f64| {
                let mut moved = bsdf.clone();
                let op = ValueChange::Add(Rgb::ONE);
                moved.apply(&BsdfChange { property, op }, theta).expect("a property");
                moved.specular(None, wo, wi, n).expect("a mirror").value.g
            };
            let slope = (at(1e-5) - at(0.0)) / 1e-5;
            let off = (found.params.get(property).g - slope).abs();
            assert!(off < 1e-4, "{property}: {slope} {:?}", found.params.get(property));
        }
    }
    // Both sides of a layer reflect, whatever is below.
    let dark = held(clear(Bsdf::Diffuse(Diffuse::default()), 1.5));
    let s = dark.sample_specular(tilted(150.0), n, 1e-3, Given::Wo).expect("a reflection");
    assert!(n.dot(s.w) < 0.0 && dark.eval(tilted(150.0), tilted(140.0), n).is_zero());
}

/// Given either direction the other one is drawn by the same density, of the given number of lobes.
#[test]
fn densities_without_the_jacobian_are_rejected() {
    let bsdf = varnished(Bsdf::RoughConductor(copper(Distribution::Ggx, 0.3)), None);
    let (wo, n) = (tilted(50.0), normal());
    let p_value = |factor: &dyn Fn(Vec3) -> f64| {
        let mut rng = Rng::new(204, 0, 0);
        let samples = (0..100_000).map(|_| {
            let drawn = bsdf.sample(wo, n, random_3d(&mut rng), Given::Wo);
            drawn.map_or(Vec3::splat(f64::NAN), |s| s.w)
        });
        sphere_chi_square(samples, |w| bsdf.pdf(wo, w, n, Given::Wo) * factor(w))
    };
    assert!(p_value(&|_| 1.0) > SIGNIFICANCE);
    let inside = |w: Vec3| (1.0 - (1.0 - n.dot(w).powi(2)) / 2.25).sqrt();
    assert!(p_value(&|w| inside(w) / n.dot(w).abs().max(1e-3)) < SIGNIFICANCE);
}

#[test]
fn properties_are_the_layers_and_those_of_what_is_below() {
    let metal = varnished(Bsdf::RoughConductor(copper(Distribution::Ggx, 0.3)), None);
    for property in [Property::Alpha, Property::K, Property::SigmaA, Property::Thickness] {
        assert!(metal.is_number(property).is_some(), "{property}");
    }
    assert!(metal.undifferentiated(Property::Alpha).is_none());
    assert!(metal.undifferentiated(Property::Thickness).is_some());
    // Two sides in one have no property that is one number.
    let sides = TwoSided {
        front: Bsdf::Diffuse(Diffuse::default()),
        back: Some(Bsdf::Diffuse(Diffuse::default())),
    };
    let sides = varnished(Bsdf::TwoSided(Box::new(sides)), None);
    assert_eq!(sides.is_number(Property::Reflectance), None);
    let mask = Mask { bsdf: metal, opacity: 0.5 };
    assert!(Bsdf::Mask(Box::new(mask)).undifferentiated(Property::Opacity).is_none());
}

#[test]
fn what_no_layer_covers_is_refused() {
    use alloc::string::ToString;
    let glass = Bsdf::RoughDielectric(glass(Distribution::Ggx, 0.3, 1.5));
    for bsdf in [Bsdf::Null, glass, Bsdf::ThinDielectric(ThinDielectric::default())] {
        let message = held(clear(bsdf, 1.5)).validate().unwrap_err().to_string();
        assert!(message.contains("a coating BSDF cannot hold"), "{message}");
    }
    let base = || clear(Bsdf::Diffuse(Diffuse::default()), 1.5);
    let negative = Coated { thickness: -1.0, ..base() };
    assert!(held(negative).validate().unwrap_err().to_string().contains("thickness"));
    let negative = Coated { sigma_a: Rgb::splat(-1.0), ..base() };
    assert!(held(negative).validate().unwrap_err().to_string().contains("sigma_a"));
    // A layer over both sides stands in for them.
    let two = TwoSided { front: held(base()), back: None };
    assert!(Bsdf::TwoSided(Box::new(two)).validate().is_ok());
    assert!(
        (held(base()).eval(tilted(0.0), tilted(0.0), normal()).g - 0.96 * 0.96 / 4.5 * FRAC_1_PI)
            .abs()
            < 1e-9
    );
}
