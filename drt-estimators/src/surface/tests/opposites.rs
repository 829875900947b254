use alloc::format;

use drt_math::stats::Moments;

use super::counterparts::rough;
use super::*;

/// How fast the normal and the direction `wo` turn, and the index changes.
const TURN: [Vec3; 2] = [Vec3 { x: 0.4, y: 0.3, z: -0.6 }, Vec3 { x: -0.2, y: 0.7, z: 0.5 }];
const INDEX: f64 = 0.3;

/// A derivative, whole and by its odd part, relative to the value.
fn rates(bsdf: &Bsdf, wo: Vec3, wi: Vec3, odd: &Odd) -> [f64; 2] {
    let g = bsdf.gradient(wo, wi, normal());
    // Unit vectors turn.
    let [dn, dwo] = [(TURN[0], normal()), (TURN[1], wo)].map(|(by, v)| by.cross(v));
    let index = if bsdf.is_transmissive() { INDEX } else { 0.0 };
    let whole = g.n.g.dot(dn) + g.wo.g.dot(dwo) + g.params.eta.g * index;
    [whole / g.value.g, odd.n.dot(dn) + odd.wo.dot(dwo) + odd.eta * index]
}

#[test]
fn opposites_are_mutual() {
    let mut rng = Rng::new(41, 0, 0);
    let mut found = 0;
    for alpha in [0.4, 0.05, 1e-3] {
        for bsdf in rough(alpha) {
            for _ in 0..300 {
                let wo = tilted(160.0 * rng.next_f64());
                let drawn = bsdf.sample(wo, normal(), random_3d(&mut rng), Given::Wo);
                let Some(wi) = drawn.map(|s| s.w) else { continue };
                let Some(there) = bsdf.opposite(wo, wi, normal()) else { continue };
                let back = bsdf.opposite(wo, there.w, normal()).expect("the way back");
                let message = || format!("{bsdf:?} {wo:?} {wi:?} {there:?} {back:?}");
                assert!((back.w - wi).length() < 1e-7 * alpha, "{}", message());
                assert!((back.share + there.share - 1.0).abs() < 1e-9, "{}", message());
                assert!((back.ratio * there.ratio - 1.0).abs() < 1e-7, "{}", message());
                let (a, b) = (back.odd, there.odd);
                let size = b.wo.length() + b.n.length();
                let vectors = [(a.wo, b.wo), (a.n, b.n), (a.wi, b.wi)];
                let sums = vectors.map(|(a, b)| (a + b).length());
                assert!(sums.iter().all(|s| *s < 1e-6 * size), "{}", message());
                assert!((a.eta + b.eta).abs() < 1e-6 * size, "{}", message());
                found += 1;
            }
        }
    }
    assert!(found > 3000, "{found}");
}

/// What is not told by pairs does not grow as lobes narrow.
#[test]
fn the_odd_part_is_most_of_it() {
    let mut rng = Rng::new(42, 0, 0);
    for bsdf in rough(1e-3) {
        for degrees in [15.0, 50.0, 130.0] {
            let wo = tilted(degrees);
            for _ in 0..50 {
                let drawn = bsdf.sample(wo, normal(), random_3d(&mut rng), Given::Wo);
                let Some(wi) = drawn.map(|s| s.w) else { continue };
                let Some(other) = bsdf.opposite(wo, wi, normal()) else { continue };
                let [whole, odd] = rates(&bsdf, wo, wi, &other.odd);
                let width = (wi - other.w).length();
                let close = (whole - odd).abs() < 40.0 + 20.0 * width * odd.abs();
                assert!(close, "{bsdf:?} {degrees} {whole} {odd}");
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
        let other = bsdf.opposite(wo, s.w, normal());
        let [whole, odd] = rates(bsdf, wo, s.w, &other.map_or(Odd::default(), |o| o.odd));
        let value = bsdf.eval(wo, s.w, normal()).g;
        let single = whole * value * light(s.w);
        let apart = other.map_or(single, |o| {
            let there = ratio(o.ratio) * bsdf.eval(wo, o.w, normal()).g * light(o.w);
            let own = value * light(s.w);
            single + odd * (o.share * (own - there) - own)
        });
        moments[0].push(single / s.pdf);
        moments[1].push(apart / s.pdf);
    }
    moments
}

#[test]
fn pairs_tell_how_lobes_turn() {
    let z = |[whole, apart]: [Moments; 2]| {
        let variance = whole.variance_of_mean() + apart.variance_of_mean();
        (whole.mean() - apart.mean()) / f64::sqrt(variance)
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
