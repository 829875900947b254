//! Sketches are like what they are of.

use core::f64::consts::{FRAC_1_PI, PI};
use drt_geom::edges::{Lobe, Lobes};

use drt_medium::Phase;

use crate::model::surface::tests::framed::framed_cases;
use crate::model::surface::tests::measured::measured_cases;
use crate::model::surface::tests::*;

const SAMPLES: u32 = 40_000;

/// What it costs to choose directions by a sketch of `f` and not by `f` itself: ∫ f² / s ∫ s / (∫ f)², 1
/// for a perfect one. Half the directions are drawn as `like_f`, which returns them with the density of that.
fn cost(
    f: impl Fn(Vec3) -> f64,
    sketch: impl Fn(Vec3) -> f64,
    like_f: impl Fn(&mut Rng) -> Option<Vec3>,
    density: impl Fn(Vec3) -> f64,
) -> f64 {
    let mut rng = Rng::new(3, 0, 0);
    let (mut light, mut region, mut second) = (0.0, 0.0, 0.0);
    for i in 0..SAMPLES {
        let w = if i % 2 == 0 { like_f(&mut rng) } else { Some(random_direction(&mut rng)) };
        let Some(w) = w else { continue };
        let inv_pdf = 2.0 / (density(w) + 0.25 * FRAC_1_PI);
        let (value, guess) = (f(w), sketch(w));
        light += value * inv_pdf;
        region += guess * inv_pdf;
        if value > 0.0 {
            assert!(guess > 0.0, "{w:?}");
            second += value * value / guess * inv_pdf;
        }
    }
    second * region / (light * light)
}

/// What a sketch says of a direction seen at a `cosine` to the normal.
fn toward(lobes: &Lobes, w: Vec3, cosine: f64) -> f64 {
    let off2 = |axis: Vec3| (w - axis).length_squared();
    let value = |l: &Lobe| Lobe::value(l.height, l.width2, off2(l.axis));
    let shown = lobes.lobes.iter().filter(|l| l.height > 0.0);
    lobes.even * cosine + shown.map(value).sum::<f64>()
}

fn cost_of(bsdf: &Bsdf, wo: Vec3, sketched: Vec3) -> f64 {
    let n = normal();
    let lobes = bsdf.lobes(None, sketched, n);
    let below = bsdf.is_transmissive();
    let sketch = |w: Vec3| {
        let cosine = n.dot(w) * n.dot(wo).signum();
        let shown = below || cosine > 0.0;
        if shown { toward(&lobes, w, cosine.abs()) } else { 0.0 }
    };
    let draw = |rng: &mut Rng| Some(bsdf.sample(wo, n, random_3d(rng), Given::Wo)?.w);
    let density = |w: Vec3| bsdf.pdf(wo, w, n, Given::Wo);
    cost(|w| bsdf.eval(wo, w, n).mean(), sketch, draw, density)
}

#[test]
fn surfaces() {
    let glass = |alpha| Bsdf::RoughDielectric(RoughDielectric { alpha, ..Default::default() });
    let metal = |alpha| Bsdf::RoughConductor(copper(Distribution::Beckmann, alpha));
    let gloss = |exponent| Bsdf::Phong(Phong { exponent, ..Default::default() });
    let diffuse = Bsdf::Diffuse(Diffuse { reflectance: Rgb::splat(0.7) });
    let bsdfs = [glass(0.3), glass(0.05), metal(0.3), metal(0.02), gloss(30.0), gloss(900.0)];
    for bsdf in &bsdfs {
        for angle in [5.0, 40.0, 65.0, 120.0, 170.0] {
            if angle > 90.0 && !bsdf.is_transmissive() {
                continue;
            }
            let wo = tilted(angle);
            let right = cost_of(bsdf, wo, wo);
            assert!(right < 4.0, "{right} for {bsdf:?} at {angle}");
            // Planted: the lobes of another direction.
            let off = if (50.0..90.0).contains(&angle) || angle > 150.0 { -35.0 } else { 35.0 };
            let wrong = cost_of(bsdf, wo, tilted(angle + off));
            assert!(wrong > 1.2 * right, "{wrong}, not {right} for {bsdf:?} at {angle}");
        }
    }
    let even = cost_of(&diffuse, tilted(40.0), tilted(40.0));
    assert!((even - 1.0).abs() < 1e-9, "{even}");
}

/// Where the mean surface refracts little or nothing, facets that are seen do.
#[test]
fn refractions_by_facets() {
    let bsdf = Bsdf::RoughDielectric(glass(Distribution::Ggx, 0.4, 1.3));
    for angle in [84.0, 120.0, 130.0] {
        let cost = cost_of(&bsdf, tilted(angle), tilted(angle));
        assert!(cost < 4.5, "{cost} at {angle}");
    }
}

/// Wide and narrow lobes, at worst by where they are narrow.
#[test]
fn surfaces_that_tell_directions_apart() {
    for bsdf in framed_cases().into_iter().chain(measured_cases()) {
        for angle in [5.0, 40.0, 65.0] {
            let cost = cost_of(&bsdf, tilted(angle), tilted(angle));
            assert!(cost < 4.5, "{cost} for {} at {angle}", bsdf.name());
        }
    }
}

#[test]
fn phase_functions() {
    let wo = tilted(20.0);
    for g in [0.0, 0.3, -0.6, 0.9, 0.99] {
        let phase = Phase::henyey_greenstein(g).expect("a valid asymmetry");
        let phase = phase.at(Vec3::ZERO);
        let aside = phase.eval(wo, tilted(110.0));
        let lobes = |peak: f64| Lobes::around(-wo * g.signum(), aside, peak);
        let cost_with = |peak: f64| {
            let lobes = lobes(peak);
            let draw = |rng: &mut Rng| Some(phase.sample(wo, rng.next_2d()).0);
            let f = |w: Vec3| phase.eval(wo, w);
            cost(f, |w| toward(&lobes, w, 1.0), draw, f)
        };
        let right = cost_with(phase.eval(wo, -wo * g.signum()));
        assert!(right < 1.4, "{right} for {g}");
        // Planted: no peak.
        let flat = cost_with(0.0);
        assert!(g.abs() < 0.5 || flat > 1.5 * right, "{flat}, not {right} for {g}");
    }
    assert_eq!(Lobes::around(wo, 0.25 * FRAC_1_PI, 0.25 * FRAC_1_PI), Lobes::even(0.25 / PI));
}
