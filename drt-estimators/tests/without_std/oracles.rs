//! The cases, named as in `tests/data/oracles.json`.

use drt_estimators::emitter::Emitter;
use drt_estimators::sensor::Sensor;
use drt_estimators::{SceneBuilder, ShapeBuilder};
use drt_geom::procedural;
use drt_math::{Rgb, vec3};
use drt_medium::{Homogeneous, Medium, Phase};

use crate::judge::judge;
use crate::scenes::*;

#[test]
fn p01_lambert_triangle() {
    let meter = Sensor::irradiance_meter(vec3(0.1, -0.2, 0.0), vec3(0.0, 0.0, 1.0));
    let corners = [[0.1, 0.8, 1.4], [0.9, -0.3, 1.9], [-0.7, -0.5, 1.6]];
    let scene = SceneBuilder::new().shape("lamp", glowing(triangle(corners), 2.0));
    let scene = seen(scene, meter.expect("a valid meter"));
    let turn = [[0.0, 0.0, 0.0], [0.52, 0.41, 0.07], [0.81, -0.62, -0.79]];
    let parameters = [
        (deforms("vertex", "lamp", &[[0.0; 3], [0.0; 3], [0.3, -0.2, 0.5]]), -0.15773024283405),
        (moves("lamp", "lamp", [1.0, 0.0, 0.0]), -0.042829000949833),
        (deforms("turn", "lamp", &turn), 0.12559989055832),
        (moves("receiver", "sensor", [0.4, 0.1, -0.3]), -0.17879542108805),
    ];
    judge(&scene, 0.64056791327105, &parameters, 1);
}

#[test]
fn p06_absorbing_emitting_box() {
    let forward = [0.9841356626102459, 0.0984135662610246, 0.14762034939153687];
    let up = [-0.14688773767637173, -0.014688773767637177, 0.9890441003542363];
    let right = [0.09950371902099894, -0.9950371902099893, 0.0];
    // Narrow enough to stand for a single ray.
    let camera = pixel([-3.0, 0.1, -0.2], [right, up, forward], [0.0, 0.0], 1e-4);
    let gas = Homogeneous::new(Rgb::splat(1.3), Rgb::ZERO, Rgb::splat(0.8)).expect("valid numbers");
    let cube = procedural::cube();
    let face = |x: f64| -> Vec<[f64; 3]> {
        cube.positions.iter().map(|p| [f64::from(p.x == x), 0.0, 0.0]).collect()
    };
    let (low, high) = (face(-1.0), face(1.0));
    let scene = SceneBuilder::new()
        .medium("gas", Medium::new(gas, Phase::Isotropic))
        .shape("box", ShapeBuilder::interface(cube).interior("gas"))
        .emitter("light", Emitter::Constant { radiance: Rgb::splat(2.5) });
    let scene = seen(scene, camera);
    let parameters = [
        (grows("sigma", "gas", "sigma_t"), -0.24606852332684),
        (deforms("high face", "box", &high), -0.15994454016244),
        (deforms("low face", "box", &low), 0.15994454016244),
        (moves("box", "box", [0.3, 0.5, -0.2]), 0.0),
    ];
    judge(&scene, 0.92108240462589, &parameters, 1);
}

#[test]
fn p12_pixel_emissive_triangle() {
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let camera = pixel([0.0; 3], axes, [0.02, 0.03], 0.1);
    let lamp = triangle([[0.1, 0.4, 1.8], [0.5, -0.1, 2.5], [-0.3, -0.2, 2.0]]);
    let occluder = triangle([[-0.05, -0.3, 1.2], [0.2, -0.1, 1.3], [0.0, 0.1, 1.1]]);
    let scene = SceneBuilder::new()
        .shape("lamp", glowing(lamp, 1.7))
        .shape("occluder", diffuse(occluder, 0.0));
    let scene = seen(scene, camera);
    let parameters = [
        (moves("lamp", "lamp", [0.3, -0.2, 0.6]), -0.78924125466711),
        (moves("camera", "sensor", [0.5, 0.0, 0.2]), -0.47449655400322),
        (moves("occluder", "occluder", [0.0, 1.0, 0.0]), -8.3341001754736),
    ];
    judge(&scene, 0.82873256271869, &parameters, 1);
}

#[test]
fn p13_pixel_floor_shadow() {
    let axes = [
        [0.30850469803743646, 0.9512228189487625, 0.0],
        [-0.5809314034798662, 0.188410184912389, 0.7918461382567905],
        [-0.7532221158063158, 0.2442882537750213, -0.6107206344375533],
    ];
    let camera = pixel([4.0, -1.0, 3.0], axes, [0.0, 0.0], 0.05);
    let light = Emitter::Point { position: vec3(0.5, 0.4, 3.0), intensity: Rgb::splat(9.0) };
    let floor =
        quad([[-20.0, -20.0, 0.0], [20.0, -20.0, 0.0], [20.0, 20.0, 0.0], [-20.0, 20.0, 0.0]]);
    let occluder = quad([[-2.0, -2.0, 1.2], [0.35, -2.2, 1.0], [0.45, 2.0, 1.1], [-2.0, 2.1, 1.3]]);
    let scene = SceneBuilder::new()
        .shape("floor", diffuse(floor, 0.7))
        .shape("occluder", diffuse(occluder, 0.0))
        .emitter("light", light);
    let scene = seen(scene, camera);
    let parameters = [
        (moves("occluder", "occluder", [0.6, 0.1, 0.3]), -0.44411710275367),
        (moves("light", "light", [1.0, 0.0, 0.0]), 0.26737152477938),
        (moves("floor", "floor", [0.0, 0.0, 1.0]), 0.63035141922801),
        (moves("camera", "sensor", [1.0, 0.0, 0.0]), 0.4929846044487),
    ];
    judge(&scene, 0.079256635186462, &parameters, 2);
}
