//! Derivatives by roughness from pairs of rays, against those along single ones.

use drt_math::stats::Moments;
use drt_math::{Rgb, Rng};

use super::choice::prepare;
use super::scenes::*;
use super::setup::{set, trace};
use crate::contraction::Contraction;
use crate::scene::Scene;
use crate::surface::{Bsdf, Distribution, RoughConductor};
use crate::transport::pairs::Pair;
use crate::transport::{Differentiator, Form, PathRecord, Tracer};

/// The derivative of all light of lamps and the sky by the roughness of the ball: along single rays, and from pairs whose other
/// ray brings what `other` makes of it.
fn derivatives(scene: &Scene, paths: u32, other: impl Fn(&Pair, Rgb) -> Rgb) -> [Moments; 2] {
    let (prepared, motion) = prepare(scene, &set("alpha", "ball-bsdf", "alpha", grey(1.0)), 5);
    let world = &prepared.world;
    let mut tracer = Tracer::new(world);
    let mut record = PathRecord::default();
    let mut differentiator = Differentiator::new(world, Form::Material);
    let mut sink = Contraction::new(world, &motion);
    let mut moments = [Moments::default(); 2];
    for (seed, moments) in (20..).zip(&mut moments) {
        for i in 0..paths {
            let choices = (seed == 21).then(|| Rng::new(9, 1, i));
            record.pairs.begin(choices);
            let slope = trace(&mut tracer, &mut record, seed, i);
            sink.clear();
            differentiator.differentiate(&record, slope, Rng::new(6, 0, i), &mut sink);
            record.pairs.follow(&mut tracer, |pair, chance, light| {
                differentiator.pair(&record, pair, chance, other(pair, light), &mut sink);
            });
            moments.push(sink.rates[0].mean());
        }
    }
    moments
}

fn z([single, pairs]: [Moments; 2]) -> f64 {
    let variance = single.variance_of_mean() + pairs.variance_of_mean();
    (single.mean() - pairs.mean()) / f64::sqrt(variance)
}

fn check(ball: Bsdf) {
    let scene = surfaces(ball, twosided(phong()));
    let fair = derivatives(&scene, 400_000, |_, light| light);
    assert!(z(fair).abs() < 4.0, "{fair:?}");
    // Planted: one of the sides is too dark.
    let faulty = derivatives(&scene, 400_000, |pair, light| match pair.slope < 0.0 {
        true => light * 0.75,
        false => light,
    });
    assert!(z(faulty).abs() > 5.0, "{faulty:?}");
}

#[test]
fn pairs_of_rays_from_metal() {
    check(metal());
}

/// In narrow lobes light is found by scattering as well as by connections.
#[test]
fn pairs_of_rays_from_narrow_lobes() {
    let glossy = |alpha| match metal() {
        Bsdf::RoughConductor(metal) => {
            let distribution = Distribution::Beckmann;
            Bsdf::RoughConductor(RoughConductor { alpha, distribution, ..metal })
        }
        other => other,
    };
    check(glossy(0.07));
}

#[test]
fn pairs_of_rays_through_glass() {
    check(glass());
}
