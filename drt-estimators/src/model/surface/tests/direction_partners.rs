use alloc::format;

use drt_math::stats::Moments;

use crate::model::surface::tests::roughness_partners::{rough, scattered};
use crate::model::surface::tests::*;

/// How fast the normal and the direction `wo` turn, and the index changes.
const TURN: [Vec3; 2] = [Vec3 { x: 0.4, y: 0.3, z: -0.6 }, Vec3 { x: -0.2, y: 0.7, z: 0.5 }];
const INDEX: f64 = 0.3;

/// A derivative relative to the value.
fn region(bsdf: &Bsdf, wo: Vec3, wi: Vec3) -> f64 {
    let g = bsdf.gradient(wo, wi, normal());
    let ([dn, dwo], index) = motion(bsdf, wo);
    (g.n.g.dot(dn) + g.wo.g.dot(dwo) + g.params.get(Property::Eta).g * index) / g.value.g
}

/// The part of it that pairs tell.
fn found(bsdf: &Bsdf, wo: Vec3, turn: &Turn) -> f64 {
    let ([dn, dwo], index) = motion(bsdf, wo);
    turn.n.dot(dn) + turn.wo.dot(dwo) + turn.eta * index
}

/// Unit vectors turn.
fn motion(bsdf: &Bsdf, wo: Vec3) -> ([Vec3; 2], f64) {
    let index = if bsdf.is_transmissive() { INDEX } else { 0.0 };
    ([TURN[0].cross(normal()), TURN[1].cross(wo)], index)
}

#[test]
fn opposites_are_mutual() {
    let mut found = 0;
    scattered(41, |alpha, bsdf, [wo, wi]| {
        let Some(there) = bsdf.direction_partner(None, wo, wi, normal()) else { return };
        let back = bsdf.direction_partner(None, wo, there.w, normal()).expect("the way back");
        let message = || format!("{bsdf:?} {wo:?} {wi:?} {there:?} {back:?}");
        assert!((back.w - wi).length() < 1e-7 * alpha, "{}", message());
        assert!((back.ratio * there.ratio - 1.0).abs() < 1e-7, "{}", message());
        let ([a, b], [c, d]) = (back.turns, there.turns);
        for (a, b) in [(a, d), (b, c)] {
            let size = 1.0 + a.wo.length() + a.n.length();
            let vectors = [(a.wo, b.wo), (a.n, b.n), (a.wi, b.wi)];
            let apart = vectors.map(|(a, b)| (a - b).length());
            assert!(apart.iter().all(|s| *s < 1e-6 * size), "{}", message());
            assert!((a.eta - b.eta).abs() < 1e-6 * size, "{}", message());
        }
        found += 1;
    });
    assert!(found > 3000, "{found}");
}

/// What is not found by pairs does not grow as lobes narrow.
#[test]
fn most_of_it_is_told_and_odd() {
    let mut rng = Rng::new(42, 0, 0);
    for bsdf in rough(1e-3) {
        for degrees in [15.0, 50.0, 130.0] {
            let wo = tilted(degrees);
            for _ in 0..50 {
                let drawn = bsdf.sample(wo, normal(), random_3d(&mut rng), Given::Wo);
                let Some(wi) = drawn.map(|s| s.w) else { continue };
                let Some(other) = bsdf.direction_partner(None, wo, wi, normal()) else { continue };
                let region = region(&bsdf, wo, wi);
                let [here, there] = other.turns.map(|turn| found(&bsdf, wo, &turn));
                let small = 40.0 + 0.01 * here.abs();
                let close = (region - here).abs() < small && (here + there).abs() < small;
                assert!(close, "{bsdf:?} {degrees} {region} {here} {there}");
            }
        }
    }
}

/// The derivative of what a smooth sky brings: along single directions, and by pairs.
fn derivatives(bsdf: &Bsdf, wo: Vec3, ratio: impl Fn(f64) -> f64) -> [Moments; 2] {
    let light = |w: Vec3| 1.0 + 0.6 * w.x - 0.5 * w.y * w.z;
    let mut rng = Rng::new(43, 0, 0);
    let mut moments = [Moments::default(); 2];
    for _ in 0..200_000 {
        let drawn = bsdf.sample(wo, normal(), random_3d(&mut rng), Given::Wo);
        let Some(s) = drawn else {
            moments.iter_mut().for_each(|m| m.push(0.0));
            continue;
        };
        let other = bsdf.direction_partner(None, wo, s.w, normal());
        let own = bsdf.eval(wo, s.w, normal()).g * light(s.w);
        let single = region(bsdf, wo, s.w) * own;
        let apart = other.map_or(single, |o| {
            let others = ratio(o.ratio) * bsdf.eval(wo, o.w, normal()).g * light(o.w);
            let [here, there] = o.turns.map(|turn| found(bsdf, wo, &turn));
            let share = s.pdf / (s.pdf + o.ratio * bsdf.pdf(wo, o.w, normal(), Given::Wo));
            single + share * (here * own + there * others) - here * own
        });
        moments[0].push(single / s.pdf);
        moments[1].push(apart / s.pdf);
    }
    moments
}

#[test]
fn pairs_tell_how_lobes_turn() {
    let z = |[region, apart]: [Moments; 2]| {
        let variance = region.variance_of_mean() + apart.variance_of_mean();
        (region.mean() - apart.mean()) / f64::sqrt(variance)
    };
    for bsdf in rough(0.3) {
        // Metal is black from behind.
        let sides: &[f64] =
            if bsdf.is_transmissive() { &[20.0, 70.0, 140.0] } else { &[20.0, 70.0] };
        for &degrees in sides {
            let wo = tilted(degrees);
            let fair = derivatives(&bsdf, wo, |ratio| ratio);
            assert!(z(fair).abs() < 4.0, "{bsdf:?} at {degrees} degrees: {fair:?}");
        }
        // Planted: the sign of what comes from the other side.
        let faulty = derivatives(&bsdf, tilted(20.0), |ratio| -ratio);
        assert!(z(faulty).abs() > 8.0, "{bsdf:?}: {faulty:?}");
    }
}

#[test]
fn noise_of_opposites_does_not_grow_as_lobes_narrow() {
    for distribution in [Distribution::Beckmann, Distribution::Ggx] {
        let noise = |alpha: f64| {
            let metal = Bsdf::RoughConductor(copper(distribution, alpha));
            derivatives(&metal, tilted(30.0), |ratio| ratio).map(|m| m.variance_of_mean())
        };
        let [wide, narrow] = [0.1, 0.001].map(noise);
        let growth = [0, 1].map(|k| narrow[k] / wide[k]);
        assert!(growth[0] > 3000.0 && growth[1] < 3.0, "{growth:?}");
        assert!(wide[1] < 0.1 * wide[0], "{wide:?}");
    }
}
