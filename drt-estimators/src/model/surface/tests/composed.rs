//! BSDFs that need a frame, or are made of others.

use alloc::string::ToString;

use drt_math::Moments;
use drt_math::testing::{SIGNIFICANCE, sphere_chi_square};

use super::energy::index;
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
fn samples_follow_their_density() {
    for bsdf in composed_cases() {
        for degrees in [20.0, 75.0, 130.0] {
            let p = p_value(&bsdf, tilted(degrees), &bsdf);
            assert!(p > SIGNIFICANCE, "{bsdf:?} at {degrees} degrees: p = {p:e}");
        }
    }
    // Planted: both roughnesses exchanged.
    let metal = |alpha| anisotropic(Bsdf::RoughConductor(copper(Distribution::Ggx, 0.3)), alpha);
    assert!(p_value(&metal([0.3, 0.33]), tilted(40.0), &metal([0.33, 0.3])) < SIGNIFICANCE);
}

/// The light that returns, by samples and by directions spread evenly.
fn albedos(bsdf: &Bsdf, wo: Vec3) -> [Moments; 2] {
    let mut rng = Rng::new(72, 0, 0);
    let mut moments = [Moments::default(); 2];
    let conserved = |w| (index(bsdf, w) / index(bsdf, wo)).powi(2);
    for _ in 0..SAMPLES {
        let drawn = bsdf.sample(wo, normal(), random_3d(&mut rng), Given::Wo);
        let light = |w| bsdf.eval(wo, w, normal()).g * conserved(w);
        moments[0].push(drawn.map_or(0.0, |s| light(s.w) / s.pdf));
        moments[1].push(light(random_direction(&mut rng)) * 4.0 * core::f64::consts::PI);
    }
    moments
}

#[test]
fn no_more_light_returns_than_comes() {
    for bsdf in composed_cases() {
        for degrees in [10.0, 70.0, 150.0] {
            let [a, b] = albedos(&bsdf, tilted(degrees));
            let error = (a.variance_of_mean() + b.variance_of_mean()).sqrt();
            let off = (a.mean() - b.mean()).abs();
            assert!(off <= 4.5 * error, "{bsdf:?} at {degrees}: {} {}", a.mean(), b.mean());
            assert!(a.mean() <= 1.0 + 4.0 * a.variance_of_mean().sqrt(), "{bsdf:?}: {}", a.mean());
        }
    }
}

#[test]
fn exchanged_directions_scatter_alike() {
    let mut rng = Rng::new(73, 0, 0);
    let n = normal();
    // Thin sheets are not reciprocal where facets hide the light that goes through.
    for bsdf in composed_cases().iter().filter(|b| !matches!(b, Bsdf::PrincipledThin(_))) {
        for _ in 0..500 {
            let [wo, wi] = [random_direction(&mut rng), random_direction(&mut rng)];
            let forth = bsdf.eval(wo, wi, n).g * n.dot(wo).abs() * index(bsdf, wi).powi(2);
            let back = bsdf.eval(wi, wo, n).g * n.dot(wi).abs() * index(bsdf, wo).powi(2);
            assert!((forth - back).abs() <= 1e-9 * forth.abs(), "{bsdf:?}: {forth} {back}");
        }
    }
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
fn slopes_are_those_of_finite_differences() {
    let mut rng = Rng::new(75, 0, 0);
    let (n, step) = (normal(), 1e-5);
    for bsdf in composed_cases() {
        for _ in 0..100 {
            let wo = random_direction(&mut rng);
            let Some(s) = bsdf.sample(wo, n, random_3d(&mut rng), Given::Wo) else { continue };
            if n.dot(wo).abs() < 0.05 || n.dot(s.w).abs() < 0.05 {
                continue;
            }
            let velocity = [wo, s.w].map(|v| random_direction(&mut rng).reject(v));
            let moved = |t: f64| {
                let [wo, wi] =
                    [(wo, velocity[0]), (s.w, velocity[1])].map(|(w, by)| (w + by * t).normalize());
                bsdf.eval(wo, wi, n)
            };
            let g = bsdf.gradient(wo, s.w, n);
            assert_eq!(g.value, bsdf.eval(wo, s.w, n));
            let slope = g.wo.dot(velocity[0]) + g.wi.dot(velocity[1]);
            let coarse = (moved(step) - moved(-step)) * (0.5 / step);
            let fine = (moved(0.5 * step) - moved(-0.5 * step)) * (1.0 / step);
            let tolerance = 4.0 * (fine - coarse).max_abs() + 1e-6 * (1.0 + slope.max_abs());
            assert!((slope - fine).max_abs() <= tolerance, "{bsdf:?}: {slope:?} {fine:?}");
        }
    }
}

#[test]
fn directions_in_the_surface_give_zeros_not_nans() {
    let tiny = [0.0, 1e-300, 1e-160, 1e-17, 1e-9];
    for bsdf in composed_cases() {
        for (zo, zi) in tiny.into_iter().flat_map(|zo| tiny.map(|zi| (zo, zi))) {
            for wi in [vec3(1.0, 0.0, zi), vec3(-1.0, 0.0, zi), vec3(-1.0, 0.0, -zi)] {
                let wo = vec3(1.0, 0.0, zo);
                let g = bsdf.gradient(wo, wi, Vec3::Z);
                assert!(g.value.is_finite() && g.wo.is_finite(), "{bsdf:?} {wo:?} {wi:?} {g:?}");
                assert!(g.wi.is_finite(), "{bsdf:?} {wo:?} {wi:?} {g:?}");
                assert!(!bsdf.pdf(wo, wi, Vec3::Z, Given::Wo).is_nan());
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
