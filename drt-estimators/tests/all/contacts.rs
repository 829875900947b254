//! A box that slides over the floor that it stands on, or leaves it: the velocities of both surfaces differ right up to the line where they
//! touch, so that samples of the default velocity of vertices grow like one over the distance from it.

use crate::common::*;
use drt_estimators::{
    EstimatorKind, Layer, Rendering, Scene, SceneBuilder, Settings, ShapeBuilder, Tail, Unattended,
    agreement, finite_differences,
};
use drt_geom::procedural;
use drt_math::{Rgb, Vec3, vec3};
use drt_motion::{GeometryChange, Parameter};

/// A box that stands on a floor under a lamp.
fn box_on_floor() -> Scene {
    box_moved_by(Vec3::ZERO)
}

fn box_moved_by(shift: Vec3) -> Scene {
    let block = procedural::cube().transform(&scaled(0.5, shift - Vec3::Y * 0.5));
    let scene = SceneBuilder::new()
        .shape("box", ShapeBuilder::new(block, diffuse(0.8, 0.8, 0.8)))
        .shape("floor", ShapeBuilder::new(floor(), diffuse(0.8, 0.8, 0.8)))
        .shape("lamp", glowing(lamp(), Rgb::splat(5.0)));
    let mut scene = seen(scene, [vec3(0.4, 1.5, 5.0), vec3(0.0, -0.6, 0.0)], 5);
    let sensor = &mut scene.sensors[0].item.sensor;
    *sensor = sensor.with_film([64, 64]).unwrap();
    scene
}

fn slides() -> Parameter {
    parameter("slides", 0.0, vec![moves("box", GeometryChange::Translate(Vec3::X))])
}

fn leaves() -> Parameter {
    parameter("leaves", 0.0, vec![moves("box", GeometryChange::Translate(Vec3::Y))])
}

fn by(estimator: EstimatorKind, seed: u64, spp: u32, parameters: &[Parameter]) -> Rendering {
    let settings = Settings { estimator, seed, expected_spp: 1 << 10, ..Settings::default() };
    rendered(&box_on_floor(), parameters, &settings, spp)
}

#[test]
fn what_is_chosen_where_bodies_slide_or_part() {
    for parameter in [slides(), leaves()] {
        let chosen = by(EstimatorKind::Auto, 1, 16, &[parameter]);
        let why = chosen.plan.estimator.unwrap();
        assert!(why.starts_with("radiative: "), "{why}");
    }
}

/// The derivative of a box at another place on the floor, and off it or in it by a gap.
fn of_box_at(gap: f64, estimator: EstimatorKind, spp: u32, parameter: &Parameter) -> Layer {
    let settings = Settings { estimator, seed: 4, ..Settings::default() };
    let scene = box_moved_by(vec3(-1.0, gap, 0.0));
    let mut all = rendered(&scene, core::slice::from_ref(parameter), &settings, spp);
    all.derivatives.remove(0).total
}

/// The radiance at the foot of a lit face is discontinuous, wherever rounding puts the foot.
#[test]
fn feet_may_lie_under_the_floor_by_rounding() {
    let camera = vec![moves("camera", GeometryChange::Translate(vec3(0.4, 0.2, -0.3)))];
    let camera = parameter("camera moves", 0.0, camera);
    let [own, other] = [(EstimatorKind::Radiative, 256), (EstimatorKind::PathSpace, 1024)]
        .map(|(kind, spp)| of_box_at(0.0, kind, spp, &camera));
    let found = agreement(&own, &other, None);
    assert!(found.agrees, "{found:?}");
    for parameter in [camera, slides()] {
        let by = |gap| of_box_at(gap, EstimatorKind::Radiative, 16, &parameter);
        let on_it = by(0.0);
        for gap in [-1e-9, -1e-15, 1e-9] {
            let pairs = by(gap).blocks.into_iter().zip(&on_it.blocks);
            let differences = pairs.map(|(a, b)| (a.mean.g - b.mean.g).powi(2));
            let off = (differences.sum::<f64>() / 64.0).sqrt() / on_it.rms_value();
            assert!(off < 1e-3, "{}, {gap}: {off}", parameter.name);
        }
    }
}

#[test]
fn error_bars_hold_or_are_said_to_be_too_small() {
    let both = [slides(), leaves()];
    let known = by(EstimatorKind::Radiative, 1, 256, &both);
    let settings = Settings { seed: 3, ..Settings::default() };
    let (scene, slides) = (box_on_floor(), &both[..1]);
    let differences = finite_differences(&scene, slides, &settings, 512, 0.004, &Unattended);
    let (slope, difference) = (&known.derivatives[0].total, &differences.unwrap()[0]);
    let found = agreement(slope, difference, None);
    assert!(found.agrees, "{found:?}");
    // As if half of it were missing.
    let half = agreement(&multiple(slope, 0.5), difference, None);
    assert!(!half.agrees, "{half:?}");

    let mut heavy = 0;
    for seed in 0..24 {
        let default = by(EstimatorKind::PathSpace, seed, 32, &both);
        for (d, known) in default.derivatives.iter().zip(&known.derivatives) {
            let ([value, error], [known, other]) = (sum(&d.total), sum(&known.total));
            let off = (value - known).abs() / error.hypot(other);
            let told = d.total.tail.share() > Tail::HEAVY;
            heavy += u32::from(told);
            let name = &d.name;
            assert!(told || off < 4.0, "{name}: {value} ± {error}, {known} ± {other}");
        }
    }
    println!("{heavy} of 48 have a heavy tail");
    assert!(heavy > 0);
}
