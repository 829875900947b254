//! Weights and their gradients, and that any choice of them gives the same derivative.

use alloc::sync::Arc;
use alloc::vec;

use drt_math::{Rng, Vec3, vec3};
use drt_motion::GeometryChange;

use crate::derivative::contraction::Motion;
use crate::derivative::tests::choice;
use crate::derivative::tests::choice::{LIGHT, MOMENT, Sum};
use crate::derivative::tests::scenes::{
    diffuse, fog, glow, moves, parameter, phong, shift, stretch, surfaces,
};
use crate::derivative::velocity::blend::{Blend, Blends};
use crate::sampling::record::CameraRay;
use crate::terms::prepared::Prepared;
use crate::world::vertex::{Kind, SurfacePoint, Vertex};

/// A ball over a floor that moves. It has smooth normals, or `facets`.
fn prepare(facets: bool) -> (Prepared, Motion) {
    let mut scene = surfaces(phong(), diffuse(0.6, 0.5, 0.4));
    if facets {
        let ball = scene.shapes.iter_mut().find(|s| s.id.as_deref() == Some("ball"));
        Arc::make_mut(&mut ball.expect("a ball").mesh).normals = None;
    }
    let motion = parameter("ball", 0.0, vec![moves("ball", shift())]);
    choice::prepare(&scene, &motion, 4)
}

/// Along the surface.
#[test]
fn gradients_are_those_of_weights() {
    let (prepared, _) = prepare(false);
    let world = &prepared.world;
    let own = &prepared.terms.edges.as_ref().expect("the spatial form").spatial.blends;
    let mut rng = Rng::new(1, 2, 3);
    let mut counts = [0; 2];
    for _ in 0..20_000 {
        // One of the ball's.
        let prim = (rng.next_f64() * 80.0) as u32;
        let from = vec3(rng.next_f64(), rng.next_f64(), rng.next_f64()) * 6.0 - Vec3::splat(3.0);
        let viewer = Vertex { x: from, medium: None, kind: Kind::Point };
        let blends: [&dyn Fn(&Vertex) -> Blend; 2] = [
            &|v| own.of(world, &viewer, v, (v.x - from).normalize(), (v.x - from).length()),
            &|v| {
                let pixel = world.camera.view(world.point(prim, [0.3; 2]).1).pixel;
                let pixel = pixel.map(|p| p.clamp(0.0, 4.0) as u32);
                let ray = CameraRay { pixel, lens: [0.0; 2] };
                let d = v.x - world.camera.eye_of(v.x);
                own.in_pixel(world, v, d.normalize(), d.length(), ray)
            },
        ];
        let at = |bary: [f64; 2]| -> (SurfacePoint, Vertex) {
            let (point, x) = world.point(prim, bary);
            (point, Vertex { x, medium: None, kind: Kind::Surface(point) })
        };
        for (blend, count) in blends.iter().zip(&mut counts) {
            let (_, here) = at([0.3; 2]);
            let Blend { weight, gradient } = blend(&here);
            if weight == 0.0 || weight > 0.999 {
                continue;
            }
            *count += 1;
            let step = 1e-5;
            let ([_, a], [_, b]) = (
                [0.0, step].map(|s| at([0.3 + s, 0.3]).1),
                [0.0, step].map(|s| at([0.3 - s, 0.3]).1),
            );
            let difference = blend(&a).weight - blend(&b).weight;
            let expected = gradient.dot(a.x - b.x);
            let size = gradient.length() * (a.x - b.x).length();
            assert!(
                (difference - expected).abs() < 1e-3 * size + 1e-12,
                "{difference} {expected} {size}"
            );
        }
    }
    assert!(counts.iter().all(|c| *c > 100), "{counts:?}");
}

/// The same of lamps, from surfaces and from fog.
#[test]
fn nor_of_lamps() {
    let mut near = surfaces(diffuse(0.6, 0.5, 0.4), phong());
    let lamp = near.shapes.iter_mut().find(|s| s.emitter.is_some()).expect("a lamp");
    Arc::make_mut(&mut lamp.mesh).positions.iter_mut().for_each(|p| p.y -= 0.9);
    for (scene, moved, change) in [
        (&fog(), "lamp", shift()),
        (&near, "lamp", shift()),
        (&near, "lamp", stretch()),
        (&near, "ball", shift()),
    ] {
        let motion = parameter(moved, 0.0, vec![moves(moved, change)]);
        choice::check(MOMENT, &|strength| {
            let (mut prepared, motion) = choice::prepare(scene, &motion, 4);
            prepared.change_spatial(|s| {
                let lamps = s.blends.lamps.iter_mut().flatten();
                lamps.for_each(|lamp| lamp.strength = 2.0 * strength);
            });
            (prepared, motion)
        });
    }
}

/// The same of a medium that moves as a whole.
#[test]
fn nor_of_media() {
    for change in [shift(), stretch()] {
        check_medium(LIGHT, change);
    }
}

/// The same well enough to see what edges before the medium, and those that are seen from it, amount to: a thirtieth.
#[test]
#[ignore = "minutes"]
fn nor_of_media_beside_edges() {
    check_medium(Sum { samples: 8192, ..LIGHT }, shift());
}

fn check_medium(sum: Sum, change: GeometryChange) {
    let scene = glow();
    let motion = parameter("block", 0.0, vec![moves("block", change)]);
    choice::check(sum, &|strength| {
        let (mut prepared, motion) = choice::prepare(&scene, &motion, 4);
        prepared.change_spatial(|s| {
            let media = &mut s.blends.media;
            assert_eq!(media.iter().flatten().count(), 1);
            media.iter_mut().flatten().for_each(|m| m.strength = strength);
        });
        (prepared, motion)
    });
}

/// Weights of three strengths.
fn check(facets: bool) {
    choice::check(Sum { samples: 64, ..MOMENT }, &|strength| {
        let (mut prepared, motion) = prepare(facets);
        prepared.change_spatial(|s| {
            let Blends { curvatures, camera_cosines, .. } = &mut s.blends;
            curvatures.iter_mut().chain(camera_cosines).for_each(|b| *b *= strength);
        });
        (prepared, motion)
    });
}

#[test]
fn the_choice_does_not_matter() {
    check(false);
}

#[test]
fn nor_does_it_with_facets() {
    check(true);
}
