//! What is seen in a plane mirror is what stands behind it, turned round, and so are all derivatives.

use super::*;
use crate::model::surface::Conductor;

/// The plane of the mirror is z = -1.
const PLACE: f64 = -1.0;

fn turned_round(x: Vec3) -> Vec3 {
    vec3(x.x, x.y, 2.0 * PLACE - x.z)
}

/// A block that glows behind the camera, which sees a mirror, or the block where it is seen in that.
fn block(mirrored: bool) -> Scene {
    let glow = Rgb::new(4.0, 3.0, 5.0);
    let cube = |at| placed(procedural::cube(), Vec3::splat(0.9), 0.0, at);
    let place = vec3(0.4, 0.2, 5.0);
    let scene = if mirrored {
        let silver = Bsdf::Conductor(Conductor::default());
        let mesh = placed(procedural::rectangle(), Vec3::splat(20.0), 0.0, vec3(0.0, 0.0, PLACE));
        SceneBuilder::new()
            .shape("block", glowing(cube(place), glow))
            .shape("mirror", ShapeBuilder::new(mesh, silver))
    } else {
        SceneBuilder::new().shape("block", glowing(cube(turned_round(place)), glow))
    };
    seen(scene, [vec3(0.3, 0.2, 2.5), vec3(0.1, 0.0, PLACE)], 2)
}

fn compare_mirrored(mirrored: &Parameter, direct: &Parameter, sum: Sum, faults: &[Fault]) {
    let by =
        |kind, scene: &Scene, motion| prepare_lit(kind, EmitterMask::Extended, scene, motion, 2);
    let reference = derivative(sum, &by(EstimatorKind::Radiative, &block(false), direct));
    let scene = block(true);
    assert_found(&reference, sum, || by(EstimatorKind::Warped, &scene, mirrored), faults);
}

fn one(name: &str, change: GeometryChange) -> Parameter {
    parameter(name, 0.0, alloc::vec![moves(name, change)])
}

const ALL: [Fault; 4] = [Fault::Divergence, Fault::Sign, Fault::Weight, Fault::Direction];

#[test]
fn what_moves_in_a_mirror() {
    let sum = Sum { samples: 96, ..MOMENT };
    let by = vec3(0.5, 0.3, 0.4);
    let there = vec3(by.x, by.y, -by.z);
    let [mirrored, direct] = [by, there].map(|by| one("block", GeometryChange::Translate(by)));
    compare_mirrored(&mirrored, &direct, sum, &ALL);
}

/// As it moves what is seen in it moves twice as far, and as it turns by twice the angle.
#[test]
fn a_mirror_moves() {
    let sum = Sum { samples: 64, ..MOMENT };
    let forward = |by: f64| GeometryChange::Translate(Vec3::Z * by);
    let light = Sum { samples: 64, ..LIGHT };
    compare_mirrored(&one("mirror", forward(1.0)), &one("block", forward(2.0)), light, &[]);
    let (axis, pivot) = (Vec3::Y, vec3(0.0, 0.0, PLACE));
    let turns = one("mirror", GeometryChange::Rotate { axis, pivot });
    let twice = (0..2).map(|_| moves("block", GeometryChange::Rotate { axis, pivot })).collect();
    compare_mirrored(&turns, &parameter("block", 0.0, twice), sum, &[Fault::Direction]);
}

#[test]
fn the_camera_moves_before_a_mirror() {
    let sum = Sum { samples: 96, ..MOMENT };
    let change = || GeometryChange::Translate(vec3(0.5, 0.3, 0.4));
    compare_mirrored(&one("camera", change()), &one("camera", change()), sum, &[Fault::Direction]);
}

/// A black block that casts shadows on a wall behind the camera, which sees a mirror, or where it is seen in that.
fn shadows_in_a_mirror(mirrored: bool) -> Scene {
    let at = |x: Vec3| if mirrored { x } else { turned_round(x) };
    let there = |v: Vec3| if mirrored { v } else { vec3(v.x, v.y, -v.z) };
    let [black, grey] = [diffuse(0.0, 0.0, 0.0), diffuse(0.6, 0.5, 0.4)];
    let block = placed(procedural::cube(), vec3(0.8, 0.7, 0.3), 0.0, at(vec3(0.4, 0.2, 6.0)));
    let wall = placed(procedural::cube(), vec3(9.0, 9.0, 0.5), 0.0, at(vec3(0.0, 0.0, 8.0)));
    let position = at(vec3(0.9, 0.7, 3.8));
    let bulb = Emitter::Point { position, intensity: Rgb::new(30.0, 40.0, 20.0) };
    // It comes from beside the mirror.
    let direction = there(vec3(-0.8, 0.2, 0.6));
    let sun = Emitter::Directional { direction, irradiance: Rgb::new(2.1, 1.8, 1.5) };
    let mut scene = SceneBuilder::new()
        .shape("block", ShapeBuilder::new(block, black))
        .shape("wall", ShapeBuilder::new(wall, grey))
        .emitter("bulb", bulb)
        .emitter("sun", sun);
    if mirrored {
        let silver = Bsdf::Conductor(Conductor::default());
        let mesh = placed(procedural::rectangle(), Vec3::splat(3.0), 0.0, vec3(0.0, 0.0, PLACE));
        scene = scene.shape("mirror", ShapeBuilder::new(mesh, silver));
    }
    seen(scene, [vec3(0.3, 0.2, 2.5), vec3(0.1, 0.0, PLACE)], 3)
}

/// The shadows of points and directions move in a mirror as they do where it shows them.
#[test]
fn shadows_move_in_a_mirror() {
    let by = vec3(0.5, 0.3, 0.4);
    let there = vec3(by.x, by.y, -by.z);
    let shift = |name: &str, by: Vec3| moves(name, GeometryChange::Translate(by));
    let spin = |name: &str, axis: Vec3| {
        moves(name, GeometryChange::Rotate { axis, pivot: vec3(0.0, 0.0, PLACE) })
    };
    let one = |effect| alloc::vec![effect];
    let sum = Sum { samples: 64, ..MOMENT };
    let cases = [
        (one(shift("block", by)), one(shift("block", there)), &ALL[..]),
        (one(shift("bulb", by)), one(shift("bulb", there)), &[Fault::Direction][..]),
        (one(spin("sun", Vec3::Y)), one(spin("sun", -Vec3::Y)), &[Fault::Direction][..]),
    ];
    for (mirrored, direct, faults) in cases {
        let [mirrored, direct] = [mirrored, direct].map(|list| parameter("all", 0.0, list));
        let by = |kind, scene: &Scene, motion: &Parameter, depth| {
            prepare_lit(kind, EmitterMask::Delta, scene, motion, depth)
        };
        let straight = shadows_in_a_mirror(false);
        let reference = derivative(sum, &by(EstimatorKind::PathSpace, &straight, &direct, 2));
        let scene = shadows_in_a_mirror(true);
        assert_found(&reference, sum, || by(EstimatorKind::Warped, &scene, &mirrored, 3), faults);
    }
}
