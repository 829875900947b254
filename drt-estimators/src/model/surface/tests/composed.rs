//! BSDFs that need a frame, or are made of others.

use alloc::string::ToString;

use drt_math::testing::{SIGNIFICANCE, sphere_chi_square};

use super::*;

const SAMPLES: u32 = 40_000;

/// p-value of samples against the density of another BSDF.
fn p_value(bsdf: &Bsdf, from: Vec3, other: &Bsdf) -> f64 {
    let mut rng = Rng::new(71, 0, 0);
    let samples = (0..SAMPLES).map(|_| {
        let drawn = bsdf.sample(from, normal(), random_3d(&mut rng), Given::Wo);
        drawn.map_or(Vec3::splat(f64::NAN), |s| s.w)
    });
    sphere_chi_square(samples, |w| other.pdf(from, w, normal(), Given::Wo))
}

#[test]
fn exchanged_roughnesses_are_rejected() {
    let metal = |alpha| anisotropic(Bsdf::RoughConductor(copper(Distribution::Ggx, 0.3)), alpha);
    assert!(p_value(&metal([0.3, 0.33]), tilted(40.0), &metal([0.33, 0.3])) < SIGNIFICANCE);
}

/// Even roughness is the isotropic model's.
#[test]
fn even_roughness_changes_nothing() {
    let mut rng = Rng::new(74, 0, 0);
    for distribution in [Distribution::Beckmann, Distribution::Ggx] {
        for base in [
            Bsdf::RoughConductor(copper(distribution, 0.3)),
            Bsdf::RoughDielectric(glass(distribution, 0.3, 1.5)),
        ] {
            let even = anisotropic(base.clone(), [0.3; 2]);
            for _ in 0..500 {
                let [wo, wi] = [random_direction(&mut rng), random_direction(&mut rng)];
                let [a, b] = [&base, &even].map(|b| b.gradient(wo, wi, normal()));
                assert!((a.value - b.value).max_abs() <= 1e-9 * a.value.max_abs());
                let largest = [a.wo, a.wi].map(|v| v.g.max_abs()).into_iter().fold(0.0, f64::max);
                // Along the spheres: models continue off them in ways of their own.
                for (a, b, v) in [(a.wo, b.wo, wo), (a.wi, b.wi, wi)] {
                    let off = (a.g - b.g).reject(v);
                    assert!(off.max_abs() <= 1e-8 * largest, "{base:?}: {a:?} {b:?}");
                }
                let [a, b] = [&base, &even].map(|b| b.pdf(wo, wi, normal(), Given::Wo));
                assert!((a - b).abs() <= 1e-9 * a, "{base:?}: {a} {b}");
            }
        }
    }
}

#[test]
fn masks_pass_what_is_not_there() {
    let mask =
        |opacity| Bsdf::Mask(Box::new(Mask { bsdf: Bsdf::Diffuse(Diffuse::default()), opacity }));
    let from = tilted(40.0);
    let s = mask(0.6).sample_specular(from, normal(), 0.7, Given::Wo).expect("a way through");
    assert!(s.straight && s.w == -from && s.weight == Rgb::ONE);
    assert!(mask(0.6).sample_specular(from, normal(), 0.5, Given::Wo).is_none());
    assert!(mask(7.0).sample_specular(from, normal(), 0.999, Given::Wo).is_none());
    assert!(mask(-1.0).sample_specular(from, normal(), 0.001, Given::Wo).is_some());
    assert_eq!(mask(0.3).straight(None, 0.5), Rgb::splat(0.7));
}

#[test]
fn what_cannot_be_held_is_refused() {
    let pane = || Bsdf::ThinDielectric(ThinDielectric::default());
    let fails = |bsdf: Bsdf, part: &str| {
        let message = bsdf.validate().unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    };
    fails(
        blend(0.5, pane(), Bsdf::Diffuse(Diffuse::default())),
        "a blendbsdf BSDF cannot hold a thin",
    );
    fails(
        Bsdf::Mask(Box::new(Mask { bsdf: Bsdf::Null, opacity: 0.5 })),
        "mask BSDF cannot hold a null",
    );
    fails(blend(f64::NAN, through_all(), through_all()), "weight");
    let masked = Bsdf::Mask(Box::new(Mask { bsdf: through_all(), opacity: 0.5 }));
    fails(Bsdf::TwoSided(Box::new(TwoSided { front: masked, back: None })), "twosided");
    fails(Bsdf::Principled(Box::new(Principled { metallic: 1.5, ..through() })), "metallic");
    fails(
        Bsdf::PrincipledThin(Box::new(PrincipledThin { diff_trans: 2.5, ..thin() })),
        "diff_trans",
    );
    fails(anisotropic(Bsdf::Diffuse(Diffuse::default()), [0.1; 2]), "diffuse");
}

fn through_all() -> Bsdf {
    Bsdf::Principled(Box::new(through()))
}
