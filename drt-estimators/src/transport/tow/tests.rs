//! The tows' algebra, and that they are one choice among many.

use alloc::vec;
use alloc::vec::Vec;

use drt_geom::procedural;
use drt_math::{Rgb, Vec3, vec3};

use super::super::tests::choice;
use super::super::tests::scenes::{
    Build, ball, diffuse, homogeneous, moves, parameter, placed, shift,
};
use super::{Met, tows};
use crate::Scene;
use crate::emitter::Emitter;
use crate::transport::SurfacePoint;

fn met(distance: f64, cosine: f64) -> Met {
    let up = vec3(0.0, 0.0, 1.0);
    let point =
        SurfacePoint { prim: 0, shape: 0, triangle: 0, bary: [0.3; 2], ng: up, ns: Vec3::ZERO };
    Met { point, distance, cosine }
}

/// The share of the surface at `distance` in the speed of the vertex at t, and its slope.
fn share(met: &[Met], t: f64, reach: f64, distance: f64) -> (f64, f64) {
    let of: Vec<_> = tows(met, t, reach).filter(|tow| tow.distance == distance).collect();
    assert!(of.len() <= 1);
    of.first().map_or((0.0, 0.0), |tow| (tow.share, tow.slope))
}

/// Shares are continuous between two surfaces, vanish at the other one and at the ray's start, and have the
/// slope that they say. A surface that does not tow ends the reach of others all the same.
#[test]
fn shares_and_slopes() {
    for reach in [0.1, 0.7, 40.0] {
        let list = [met(1.0, -0.9), met(1.4, 0.2), met(3.0, 0.0), met(4.0, 0.8)];
        for (i, m) in list.iter().enumerate() {
            let neighbours = [
                if i == 0 { 0.0 } else { list[i - 1].distance },
                list.get(i + 1).map_or(f64::INFINITY, |n| n.distance),
            ];
            for (side, other) in neighbours.into_iter().enumerate() {
                let sign = if side == 0 { -1.0 } else { 1.0 };
                let at = |away: f64| share(&list, m.distance + sign * away, reach, m.distance);
                let length = f64::min((other - m.distance).abs(), 3.0 * reach);
                assert!(at(length * (1.0 - 1e-9)).0 < 1e-8);
                assert_eq!(at(length * (1.0 + 1e-9)).0, 0.0);
                let full = super::grip(m.cosine, (other - m.distance).abs() / reach);
                assert!(m.cosine == 0.0 || (at(1e-12).0 - full).abs() < 1e-9);
                for k in 1..10 {
                    let (t, h) = (length * 0.1 * f64::from(k), 1e-6 * length);
                    let difference = (at(t + h).0 - at(t - h).0) / (2.0 * h);
                    let slope = at(t).1 * sign;
                    assert!(
                        (difference - slope).abs() < 1e-6 * full / length + 1e-9,
                        "{reach} {i} {k}"
                    );
                }
            }
        }
    }
}

/// Before the only surface, transmittance and the rate of distances together are constant.
#[test]
fn reparameterised_free_flight() {
    let (sigma, list) = (1.3, [met(1.7, 1.0)]);
    let rate = |t: f64| {
        let (share, slope) = share(&list, t, 1.0 / sigma, 1.7);
        slope - sigma * share
    };
    let expected = sigma / f64::exp_m1(sigma * 1.7);
    for t in [0.01, 0.5, 1.1, 1.69] {
        assert!((rate(t) - expected).abs() < 1e-12, "{t}");
    }
}

/// A ball in a room of mist under the sky: of milk, or of matter, which only has mist around it.
fn ball_in_mist(milk: bool) -> Scene {
    let mut b = Build::default();
    let medium = |b: &mut Build, id, s| {
        b.medium(id, homogeneous(Rgb::new(1.0, 0.8, 1.2) * s, Rgb::splat(0.9), Rgb::ZERO, 0.2))
    };
    let mist = medium(&mut b, "mist", if milk { 0.2 } else { 1.5 });
    let room = placed(procedural::cube(), Vec3::splat(1.4), 0.0, Vec3::ZERO);
    b.interface("room", room, mist, None);
    if milk {
        let milk = medium(&mut b, "milk", 5.0);
        b.interface("ball", ball(0.8, Vec3::ZERO), milk, Some(mist));
    } else {
        let bsdf = b.bsdf("ball-bsdf", diffuse(0.1, 0.1, 0.1));
        b.shape("ball", ball(0.8, Vec3::ZERO), bsdf);
    }
    b.light("sky", Emitter::Constant { radiance: Rgb::splat(1.0) });
    b.camera(vec3(0.3, 0.9, 4.0), Vec3::ZERO, 4)
}

/// Tows of three reaches, of none at first.
fn check(milk: bool) {
    let scene = ball_in_mist(milk);
    let motion = parameter("ball", 0.0, vec![moves("ball", shift())]);
    choice::check(&|strength| {
        let (mut prepared, motion) = choice::prepare(&scene, &motion, 4);
        for reach in &mut prepared.world.reaches {
            *reach = reach.map(|r| r * strength).filter(|r| *r > 0.0);
        }
        (prepared, motion)
    });
}

#[test]
fn the_choice_does_not_matter() {
    check(true);
}

#[test]
fn nor_does_it_around_matter() {
    check(false);
}
