use alloc::string::ToString;

use drt_math::ValueChange;

use crate::model::surface::tests::*;

fn every_change() -> Vec<BsdfChange> {
    let mut changes = Vec::new();
    for property in Property::ALL {
        let add = Rgb::splat(0.3);
        for op in
            [ValueChange::Add(add), ValueChange::Multiply(0.7), ValueChange::MultiplyLog(-0.4)]
        {
            changes.push(BsdfChange { property, op });
        }
    }
    changes
}

#[test]
fn tangents_are_the_rates_of_applied_changes() {
    let mut rng = Rng::new(41, 0, 0);
    let (n, step) = (normal(), 1e-5);
    for bsdf in cases() {
        let mut left = bsdf.differentiated();
        for change in every_change() {
            let theta = 0.2;
            if bsdf.undifferentiated(change.property).is_some() {
                continue;
            }
            let Ok(velocity) = bsdf.tangent(&change, theta) else { continue };
            let at = |theta: f64| {
                let mut changed = bsdf.clone();
                changed.apply(&change, theta).map(|()| changed)
            };
            // Some changes leave the range of their property.
            let [Ok(before), Ok(now), Ok(after)] = [theta - step, theta, theta + step].map(at)
            else {
                continue;
            };
            left = left.without(PropertySet::new(&[change.property]));
            for _ in 0..50 {
                let wo = random_direction(&mut rng);
                let Some(s) = now.sample(wo, n, random_3d(&mut rng), Given::Wo) else { continue };
                let rate = now.gradient(wo, s.w, n).params.dot(&velocity);
                let [lower, value, upper] = [&before, &now, &after].map(|b| b.eval(wo, s.w, n));
                let difference = (upper - lower) * (0.5 / step);
                // Differences fail at the critical angle's square root: judge what is smooth.
                let bend = ((upper + lower - value * 2.0) * (1.0 / step)).max_abs();
                let tolerance = 1e-5 * (rate.max_abs() + value.max_abs()) + bend;
                let error = (rate - difference).max_abs();
                assert!(error <= tolerance, "{now:?} {change:?}: {rate:?} {difference:?}");
            }
        }
        let lost = |p: Property| bsdf.undifferentiated(p).is_none() && bsdf.is_number(p).is_some();
        assert!(!left.iter().any(lost), "{bsdf:?}: {left:?}");
    }
}

#[test]
fn a_scaled_reflectance_of_zero_still_has_a_slope() {
    let black = Bsdf::Diffuse(Diffuse { reflectance: Rgb::ZERO });
    let change = BsdfChange { property: Property::Reflectance, op: ValueChange::Add(Rgb::ONE) };
    let g = black.gradient(normal(), normal(), normal());
    let slope = g.params.dot(&black.tangent(&change, 0.0).unwrap());
    assert!((slope.r - core::f64::consts::FRAC_1_PI).abs() < 1e-12 && g.value.is_zero());
}

#[test]
fn scattering_is_the_transpose_of_contraction() {
    let bsdf = Bsdf::RoughConductor(copper(Distribution::Beckmann, 0.3));
    let params = bsdf.gradient(tilted(30.0), tilted(-20.0), normal()).params;
    let weight = Rgb::new(0.3, -1.2, 2.0);
    for change in every_change() {
        let Ok(velocity) = bsdf.tangent(&change, 0.1) else { continue };
        let mut gradient = BsdfTangent::default();
        gradient.scatter(&params, weight);
        let collected = gradient.get(change.property).dot(velocity.get(change.property));
        assert!((collected - weight.dot(params.dot(&velocity))).abs() < 1e-12 * collected.abs());
    }
}

#[test]
fn later_effects_carry_earlier_velocities() {
    let base = Bsdf::Diffuse(Diffuse::default());
    let first = BsdfChange { property: Property::Reflectance, op: ValueChange::Add(Rgb::ONE) };
    let second = BsdfChange { property: Property::Reflectance, op: ValueChange::MultiplyLog(2.0) };
    let both = |theta: f64| {
        let mut bsdf = base.clone();
        bsdf.apply(&first, theta).unwrap();
        bsdf.apply(&second, 0.3).unwrap();
        bsdf.eval(normal(), normal(), normal()).r
    };
    let mut velocity = base.tangent(&first, 0.1).unwrap();
    second.carry(&mut velocity, 0.3);
    let rate = velocity.get(Property::Reflectance).r * core::f64::consts::FRAC_1_PI;
    assert!((both(0.2) - both(0.1) - 0.1 * rate).abs() < 1e-12);
}

#[test]
fn refusals_say_what_would_do() {
    let unknown = Property::from_name("gloss").unwrap_err().to_string();
    assert!(unknown.contains("\"gloss\"") && unknown.contains("alpha, eta, k"), "{unknown}");
    assert_eq!(Property::from_name("diffuse_reflectance"), Ok(Property::Reflectance));

    let refusal = |mut bsdf: Bsdf, property, op, theta| {
        let before = bsdf.clone();
        let error = bsdf.apply(&BsdfChange { property, op }, theta).unwrap_err();
        assert_eq!(bsdf, before);
        error.to_string()
    };
    let add = |v| ValueChange::Add(Rgb::splat(v));
    let phong = || Bsdf::Phong(Phong::default());
    let metal = || Bsdf::RoughConductor(RoughConductor::default());
    let glass = || Bsdf::RoughDielectric(glass(Distribution::Ggx, 0.1, 1.5));
    let two = |back| Bsdf::TwoSided(Box::new(TwoSided { front: phong(), back }));

    let text = refusal(phong(), Property::Alpha, add(1.0), 0.1);
    assert_eq!(
        text,
        "a phong BSDF has no \"alpha\"; it has: reflectance, specular_reflectance, exponent"
    );
    let text = refusal(Bsdf::Null, Property::Alpha, add(1.0), 0.1);
    assert!(text.ends_with("nothing that can change"), "{text}");
    let text = refusal(metal(), Property::Alpha, add(-1.0), 0.2);
    assert!(text.contains("at least 1e-4"), "{text}");
    let text = refusal(metal(), Property::K, add(-1.0), 1.0);
    assert!(text.contains("above 0"), "{text}");
    let text = refusal(metal(), Property::Alpha, ValueChange::Add(Rgb::new(1.0, 2.0, 1.0)), 0.2);
    assert!(text.contains("single number"), "{text}");
    let text = refusal(glass(), Property::Eta, add(-1.0), 0.5);
    assert!(text.contains("not 1"), "{text}");
    let text = refusal(phong(), Property::Exponent, add(f64::NAN), 0.5);
    assert!(text.contains("NaN"), "{text}");
    let text = refusal(two(Some(phong())), Property::Exponent, add(1.0), 0.5);
    assert!(text.contains("different sides"), "{text}");

    assert!(two(None).validate().is_ok() && two(Some(metal())).validate().is_ok());
    let text = two(Some(glass())).validate().unwrap_err().to_string();
    assert_eq!(text, "a twosided BSDF cannot hold a roughdielectric BSDF; use it without twosided");
}
