//! The coefficients of warps, and that any choice of them gives the same derivative.

use alloc::vec;
use alloc::vec::Vec;

use drt_geom::procedural;
use drt_math::{Rgb, Vec3, vec3};
use drt_motion::{Effect, GeometryChange};

use crate::derivative::tests::choice;
use crate::derivative::tests::choice::Sum;
use crate::derivative::tests::scenes::{
    SceneBuilder, ShapeBuilder, ball, diffuse, homogeneous, moves, parameter, placed, seen, shift,
};
use crate::derivative::velocity::Moved;
use crate::derivative::velocity::warp::{Stretch, SurfaceHit, warps};
use crate::model::emitter::Emitter;
use crate::model::scene::Scene;
use crate::world::vertex::SurfacePoint;

const MOMENT: Sum = Sum { samples: 48, ..choice::MOMENT };

fn hit(distance: f64, cosine: f64) -> SurfaceHit {
    let up = vec3(0.0, 0.0, 1.0);
    let point =
        SurfacePoint { prim: 0, shape: 0, triangle: 0, bary: [0.3; 2], ng: up, ns: Vec3::ZERO };
    SurfaceHit { point, x: Vec3::ZERO, distance, cosine, moves: true, after: None }
}

fn at_rest(distance: f64) -> SurfaceHit {
    SurfaceHit { moves: false, ..hit(distance, 0.7) }
}

/// The share of the surface at `distance` in the speed of the vertex at t, and its slope.
fn share(hits: &[SurfaceHit], t: f64, free_path: f64, distance: f64) -> (f64, f64) {
    let dir = vec3(0.0, 0.0, 1.0);
    let of: Vec<_> =
        warps(hits, dir, t, free_path).filter(|a| a.moved == Moved::RayPoint(distance)).collect();
    assert!(of.len() <= 1);
    of.first().map_or((0.0, 0.0), |a| (a.displacement.dot(dir), a.divergence))
}

/// Shares are continuous between two surfaces, have the slope that they say, and at both leave what goes to the
/// flux; at the ray's start, and at surfaces that do not tow, they vanish.
#[test]
fn shares_and_slopes() {
    let list = [hit(1.0, -0.9), hit(1.4, 0.2), at_rest(3.0), hit(4.0, 0.8), hit(4.3, -0.5)];
    for free_path in [0.1, 0.7, 40.0] {
        for i in 0..=list.len() {
            let ends = [i.checked_sub(1).map(|i| &list[i]), list.get(i)];
            let stretch = Stretch::new(ends, free_path);
            let start = ends[0].map_or(0.0, |m| m.distance);
            let end = ends[1].map_or(start + 4.0 * free_path, |m| m.distance);
            let of = |end: usize, t: f64| {
                let moving = ends[end].filter(|m| m.moves);
                moving.map_or((0.0, 0.0), |m| share(&list, t, free_path, m.distance))
            };
            for (e, t) in [(0, start + 1e-12), (1, end - 1e-12)] {
                let left = match ends[e] {
                    Some(_) => stretch.left(e),
                    // Towed by the other end, nothing must move here.
                    None => [0.0; 2],
                };
                if ends[e].is_some_and(|m| m.moves) {
                    assert!((of(e, t).0 + left[0] - 1.0).abs() < 1e-9, "{free_path} {i} {e}");
                }
                assert!((of(1 - e, t).0 + left[1]).abs() < 1e-9, "{free_path} {i} {e}");
            }
            let length = end - start;
            for (e, k) in (1..20).flat_map(|k| [(0, k), (1, k)]) {
                let (t, h) = (start + length * (0.05 * f64::from(k) + 0.003), 1e-6 * length);
                let difference = (of(e, t + h).0 - of(e, t - h).0) / (2.0 * h);
                assert!((difference - of(e, t).1).abs() < 1e-5 / length, "{free_path} {i} {e} {k}");
            }
        }
    }
}

/// Before the only surface, transmittance and the rate of distances together are constant.
#[test]
fn reparameterised_free_flight() {
    let (sigma, list) = (1.3, [hit(1.7, 1.0)]);
    let rate = |t: f64| {
        let (share, slope) = share(&list, t, 1.0 / sigma, 1.7);
        slope - sigma * share
    };
    let expected = sigma / f64::exp_m1(sigma * 1.7);
    for t in [0.01, 0.5, 1.1, 1.69] {
        assert!((rate(t) - expected).abs() < 1e-12, "{t}");
    }
}

/// Where two surfaces move alike, so does the little between them.
#[test]
fn thin_layers_go_along() {
    let list = [hit(1.0, 0.8), hit(1.1, -0.9)];
    for t in [1.01, 1.06, 1.09] {
        let [(a, a_slope), (b, b_slope)] = [1.0, 1.1].map(|d| share(&list, t, 40.0, d));
        assert!((a + b - 1.0).abs() < 1e-4 && (a_slope + b_slope).abs() < 1e-3, "{t}");
    }
}

/// A ball in a room of mist under the sky.
#[derive(Clone, Copy, PartialEq)]
enum Ball {
    Milk,
    /// There is only mist around it.
    Matter,
    /// The same in thin mist, with a thin coat.
    Coated,
}

fn ball_in_mist(kind: Ball) -> Scene {
    let medium = |s| homogeneous(Rgb::new(1.0, 0.8, 1.2) * s, Rgb::splat(0.9), Rgb::ZERO, 0.2);
    let room = placed(procedural::cube(), Vec3::splat(1.4), 0.0, Vec3::ZERO);
    let inner = ball(0.8, Vec3::ZERO);
    let mut scene = SceneBuilder::new()
        .medium("mist", medium(if kind == Ball::Matter { 1.5 } else { 0.2 }))
        .shape("room", ShapeBuilder::interface(room).interior("mist"))
        .emitter("sky", Emitter::Constant { radiance: Rgb::splat(1.0) });
    scene = if kind == Ball::Milk {
        let milk = ShapeBuilder::interface(inner).interior("milk").exterior("mist");
        scene.medium("milk", medium(5.0)).shape("ball", milk)
    } else {
        scene.shape("ball", ShapeBuilder::new(inner, diffuse(0.1, 0.1, 0.1)))
    };
    if kind == Ball::Coated {
        let coat = ShapeBuilder::interface(ball(0.9, Vec3::ZERO));
        let coat = coat.interior("varnish").exterior("mist");
        scene = scene.medium("varnish", medium(2.0)).shape("coat", coat);
    }
    seen(scene, [vec3(0.3, 0.9, 4.0), Vec3::ZERO], 4)
}

/// Warps of three lengths, of none at first.
fn check(kind: Ball, effects: Vec<Effect>) {
    let scene = ball_in_mist(kind);
    let motion = parameter("ball", 0.0, effects);
    choice::check(MOMENT, &|strength| {
        let (mut prepared, motion) = choice::prepare(&scene, &motion, 4);
        prepared.change_spatial(|s| {
            for free_path in &mut s.free_paths {
                *free_path = free_path.map(|r| r * strength).filter(|r| *r > 0.0);
            }
        });
        (prepared, motion)
    });
}

/// Nor how often a flux is followed: the same with few of them, each counting as much more.
#[test]
fn what_is_followed_stands_for_all() {
    let scene = ball_in_mist(Ball::Milk);
    let motion = parameter("ball", 0.0, vec![moves("ball", shift())]);
    let [all, few] = [1.0, 20.0].map(|followed| {
        let (mut prepared, motion) = choice::prepare(&scene, &motion, 4);
        if let Some(flux) = &mut prepared.terms.flux {
            flux.followed = followed;
        }
        // Then all of it is flux.
        prepared.change_spatial(|s| s.free_paths.clear());
        choice::derivative(MOMENT, &(prepared, motion))
    });
    let (z, error) = few.off(&all);
    assert!(z.abs() < 4.0 && error < 0.15, "{z} {error}");
}

#[test]
fn the_choice_does_not_matter() {
    check(Ball::Milk, vec![moves("ball", shift())]);
}

#[test]
fn nor_does_it_around_matter() {
    check(Ball::Matter, vec![moves("ball", shift())]);
}

/// The two sides of a coat tow it together, even where they part.
#[test]
fn nor_does_it_in_a_coat() {
    let back = GeometryChange::Translate(vec3(-0.7, 0.4, -0.5));
    check(Ball::Coated, vec![moves("ball", back), moves("coat", shift())]);
}
