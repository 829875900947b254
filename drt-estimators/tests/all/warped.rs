//! Derivatives without boundary samples where geometry is at its oddest: they are finite, and where there are such those with samples.

use crate::common::*;
use drt_estimators::emitter::Emitter;
use drt_estimators::{EstimatorKind, Rendering, Scene, Session, Settings, Unattended, agreement};
use drt_geom::{Mesh, procedural};
use drt_math::{Affine, Mat3, Rgb, Vec3, vec3};
use drt_motion::Parameter;

fn at(scale: f64, shift: Vec3) -> Affine {
    Affine {
        linear: Mat3::rotation(Vec3::X, -core::f64::consts::FRAC_PI_2) * scale,
        translation: shift,
    }
}

fn plain(mesh: Mesh) -> ShapeBuilder {
    ShapeBuilder::new(mesh, diffuse(0.6, 0.5, 0.4))
}

/// A floor under a lamp, a bulb and the sun, and `more` shapes.
fn stage<const N: usize>(more: [(&str, ShapeBuilder); N]) -> Scene {
    let floor = procedural::grid(2, 2).transform(&at(4.0, vec3(0.0, -1.0, 0.0)));
    let lamp = procedural::rectangle().transform(&at(-0.5, vec3(0.9, 2.0, 0.3)));
    let (position, direction) = (vec3(-1.3, 2.3, 0.4), vec3(0.3, -1.0, -0.3));
    let scene = SceneBuilder::new()
        .shape("floor", plain(floor))
        .shape("lamp", glowing(lamp, Rgb::splat(6.0)))
        .emitter("bulb", Emitter::Point { position, intensity: Rgb::splat(2.0) })
        .emitter("sun", Emitter::Directional { direction, irradiance: Rgb::splat(0.5) });
    let scene = more.into_iter().fold(scene, |scene, (id, shape)| scene.shape(id, shape));
    seen(scene, [vec3(0.3, 1.0, 4.0), vec3(0.0, -0.6, 0.0)], 4)
}

fn by(estimator: EstimatorKind, scene: &Scene, seed: u64, spp: u32) -> Rendering {
    let moving = [
        parameter("it", 0.0, vec![moves("it", shift())]),
        parameter("bulb", 0.0, vec![moves("bulb", shift())]),
        parameter("camera", 0.0, vec![moves("camera", shift())]),
    ];
    let moving: Vec<Parameter> = moving.into();
    let settings = Settings { estimator, seed, ..Settings::default() };
    let mut session = Session::new(scene, &moving, &settings).expect("a valid scene");
    assert!(session.run(spp, &Unattended) && session.run(3 * spp, &Unattended));
    session.rendering()
}

fn warped(scene: &Scene, spp: u32) -> Rendering {
    let warped = by(EstimatorKind::Warped, scene, 1, spp);
    assert_eq!((warped.non_finite, warped.counters.boundary_samples), (0, 0));
    warped
}

fn check(scene: &Scene) {
    let warped = warped(scene, 512);
    let reference = by(EstimatorKind::PathSpace, scene, 2, 512);
    for (a, b) in warped.derivatives.iter().zip(&reference.derivatives) {
        let found = agreement(&a.total, &b.total, None);
        assert!(found.agrees, "{} {found:?}", a.name);
    }
}

fn block(x: f64) -> Mesh {
    placed(procedural::cube(), Vec3::splat(0.35), 0.5, vec3(x, -0.1, 0.2))
}

#[test]
fn sheets_in_one_place() {
    let sheet = || procedural::rectangle().transform(&at(0.5, vec3(0.1, -0.2, 0.0)));
    check(&stage([("it", plain(sheet())), ("other", plain(sheet()))]));
}

#[test]
fn triangles_without_area() {
    let good = block(0.1);
    let [a, b] = [good.positions[0], good.positions[1]];
    let mut positions = good.positions.clone();
    let n = positions.len() as u32;
    positions.extend([a, (a + b) * 0.5, b, a, a, a]);
    let mut triangles = good.triangles.clone();
    triangles.extend([[n, n + 1, n + 2], [n + 3, n + 4, n + 5]]);
    let mesh = Mesh::new(positions, triangles).expect("a mesh");
    check(&stage([("it", plain(mesh))]));
}

/// On what it moves through, of which the derivative is one to either side only.
#[test]
fn a_lamp_that_touches_what_moves() {
    let lamp = procedural::rectangle().transform(&at(0.35, vec3(0.1, 0.25, 0.2)));
    let upright = procedural::cube().transform(&scaled(0.35, vec3(0.1, -0.1, 0.2)));
    let patch = plain(lamp).emitter(Emitter::Area { radiance: Rgb::splat(2.0) });
    warped(&stage([("it", plain(upright)), ("patch", patch)]), 256);
}

/// A bulb on the line of an edge, and the sun along faces: what moves away from there has derivatives to either side only.
#[test]
fn lights_in_line_with_edges() {
    let upright = procedural::cube().transform(&scaled(0.35, vec3(0.1, -0.1, 0.2)));
    let mut scene = stage([("it", plain(upright))]);
    for light in &mut scene.emitters {
        match &mut light.item.emitter {
            Emitter::Point { position, .. } => *position = vec3(0.45, 1.6, 0.55),
            Emitter::Directional { direction, .. } => *direction = vec3(0.0, -1.0, 0.0),
            _ => {}
        }
    }
    warped(&scene, 256);
}
