//! The adjoint sweep against the same contribution written in dual numbers, path by path.

use alloc::vec;
use alloc::vec::Vec;

use drt_math::{Rgb, Rng, ValueChange};
use drt_motion::Parameter;

use crate::derivative::adjoint::Differentiator;
use crate::derivative::contraction::Contraction;
use crate::derivative::tests::changes::rates;
use crate::derivative::tests::moving::Moving;
use crate::derivative::tests::replay::replay;
use crate::derivative::tests::scenes::*;
use crate::derivative::tests::setup::{
    Fault, Faulty, Recording, coloured, motion, prepare, set, trace,
};
use crate::model::scene::Scene;
use crate::sampling::trace::Tracer;

/// What has been compared.
#[derive(Debug, Default)]
struct Tally {
    paths: u32,
    /// Paths with a derivative.
    moving: u32,
    /// Largest number of vertices.
    longest: usize,
    /// Largest relative deviation, and the path it is of.
    worst: (f64, u32),
}

/// Compares the two derivatives of paths until enough of them have one.
fn compare(scene: &Scene, parameter: &Parameter, fault: Fault) -> Tally {
    let (world, motion) = prepare(scene, parameter);
    let moving = Moving::new(scene, parameter, &world, &motion);
    let mut tracer = Tracer::new(&world);
    let mut path = Recording::material(&world, &motion);
    let mut differentiator = Differentiator::new(&world);
    let mut sink = Faulty(Contraction::new(&world, &motion), fault);
    let mut tally = Tally::default();
    while (tally.paths < 200 || tally.moving < 30) && tally.paths < 20_000 {
        let i = tally.paths;
        let slope = trace(&mut tracer, &mut path, None, 5, i);
        sink.0.clear();
        differentiator.differentiate(&path.path(), slope, Rng::new(6, 0, i), &mut sink);
        let record = &path.record;
        let truth = replay(&moving, record, slope);
        let value = truth.map(|v| v.re);
        let error = (value - record.value).max_abs();
        assert!(error <= 1e-11 * record.value.max_abs(), "path {i}: {value:?} {:?}", record.value);
        let (rate, expected) = (sink.0.rates[0], rates(truth));
        let scale = f64::max(expected.max_abs(), 1e-3 * record.value.max_abs());
        let error = (rate - expected).max_abs();
        tally.paths += 1;
        if !(expected.is_zero() && error == 0.0) {
            tally.moving += 1;
            if error > tally.worst.0 * scale {
                tally.worst = (error / scale, i);
            }
        }
        tally.longest = usize::max(tally.longest, record.nodes.len());
    }
    tally
}

fn compare_all(scene: &Scene, parameters: &[Parameter]) {
    for p in parameters {
        let tally = compare(scene, p, Fault::None);
        assert!(tally.moving >= 30 && tally.longest > 2, "{}: {tally:?}", p.name);
        assert!(tally.worst.0 <= 1e-9, "{}: {tally:?}", p.name);
    }
}

/// Every motion of every shape, light and the camera.
fn motions(scene: &Scene) -> Vec<Parameter> {
    let mut all = Vec::new();
    for id in scene.shapes.iter().filter_map(|s| s.id.as_deref()) {
        all.push(motion(id, "shift", shift()));
        all.push(motion(id, "turn", turn()));
        all.push(motion(id, "stretch", stretch()));
        all.push(motion(id, "wobble", wobble(scene, id, 3)));
    }
    for e in scene.emitters.iter().filter(|e| e.item.emitter.is_delta()) {
        let id = e.id.as_deref().expect("named");
        if e.item.emitter.position().is_some() {
            all.push(motion(id, "shift", shift()));
        }
        // Turning an even light about itself would do nothing.
        all.push(motion(id, "turn", turn()));
    }
    all.push(motion("camera", "shift", shift()));
    all.push(motion("camera", "turn", turn()));
    all
}

fn strengths() -> Vec<Parameter> {
    vec![
        set("glow", "lamp", "radiance", coloured()),
        set("bulb", "bulb", "intensity", ValueChange::MultiplyLog(0.7)),
        set("sun", "sun", "irradiance", ValueChange::Multiply(0.4)),
        set("sky", "sky", "radiance", coloured()),
        set("fov", "camera", "fov", grey(5.0)),
    ]
}

#[test]
fn surfaces_and_lights() {
    let scene = surfaces(phong(), diffuse(0.6, 0.5, 0.4));
    let mut parameters = motions(&scene);
    parameters.extend(strengths());
    parameters.push(set("spot", "spot", "intensity", coloured()));
    parameters.push(set("edge", "spot", "cutoff_angle", grey(3.0)));
    parameters.push(set("beam", "spot", "beam_width", grey(3.0)));
    compare_all(&scene, &parameters);
}

#[test]
fn materials() {
    for (bsdf, properties) in [
        (phong(), vec!["reflectance", "specular_reflectance", "exponent"]),
        (metal(), vec!["alpha", "eta", "k", "specular_reflectance"]),
        (glass(), vec!["alpha", "eta", "specular_reflectance", "specular_transmittance"]),
    ] {
        let scene = surfaces(bsdf, twosided(phong()));
        let transmissive = scene.bsdfs[0].item.is_transmissive();
        let number = |name| matches!(name, "alpha" | "exponent") || (name == "eta" && transmissive);
        let op = |name| if number(name) { grey(0.2) } else { coloured() };
        let mut parameters: Vec<Parameter> =
            properties.into_iter().map(|p| set(p, "ball", p, op(p))).collect();
        parameters.push(motion("ball", "shift", shift()));
        parameters.push(motion("ball", "turn", turn()));
        parameters.push(motion("ball", "wobble", wobble(&scene, "ball", 9)));
        compare_all(&scene, &parameters);
    }
}

fn fog_coefficients() -> Vec<Parameter> {
    let mut parameters = Vec::new();
    for medium in ["thin", "dense"] {
        for property in ["sigma_t", "albedo", "emission"] {
            parameters.push(set(&format!("{medium} {property}"), medium, property, coloured()));
        }
        parameters.push(set(&format!("{medium} g"), medium, "g", grey(0.5)));
    }
    parameters
}

#[test]
fn fog_with_interfaces_and_a_solid() {
    let scene = fog();
    let mut parameters = motions(&scene);
    parameters.extend(strengths());
    parameters.extend(fog_coefficients());
    compare_all(&scene, &parameters);
}

#[test]
fn several_effects_away_from_zero() {
    let scene = fog();
    let everything = parameter(
        "everything",
        0.2,
        vec![
            moves("box", stretch()),
            moves("ball", turn()),
            moves("ball", wobble(&scene, "ball", 4)),
            moves("bulb", shift()),
            moves("camera", turn()),
            changes("thin", "sigma_t", ValueChange::MultiplyLog(0.8)),
            changes("dense", "g", grey(0.3)),
            changes("lamp", "radiance", ValueChange::Multiply(0.5)),
        ],
    );
    compare_all(&scene, &[everything]);
}

/// What is zero now can still begin to count.
#[test]
fn factors_that_are_zero() {
    let scene = surfaces(diffuse(0.0, 0.5, 0.0), phong());
    compare_all(&scene, &[set("reflectance", "ball", "reflectance", coloured())]);
    let mut scene = fog();
    let clear = |sigma_t, albedo| homogeneous(sigma_t, albedo, Rgb::ZERO, 0.2);
    scene.media[0].item = clear(Rgb::new(0.0, 0.5, 0.0), Rgb::new(0.9, 0.0, 0.8));
    scene.media[1].item = clear(Rgb::new(0.0, 0.0, 0.0), Rgb::new(0.5, 0.8, 0.2));
    let mut parameters = fog_coefficients();
    // The others would need two zeros to change.
    parameters.retain(|p| p.name == "dense sigma_t" || p.name.starts_with("thin"));
    parameters.retain(|p| p.name != "thin g");
    compare_all(&scene, &parameters);
}

#[test]
fn faults_are_found() {
    let (surfaces, fog) = (surfaces(phong(), diffuse(0.6, 0.5, 0.4)), fog());
    for (scene, parameter, fault) in [
        (&surfaces, motion("floor", "stretch", stretch()), Fault::NoJacobian),
        (&surfaces, motion("floor", "turn", turn()), Fault::Normal),
        (&surfaces, motion("ball", "turn", turn()), Fault::ShadingNormal),
        (&fog, motion("ball", "shift", shift()), Fault::Volume),
    ] {
        let tally = compare(scene, &parameter, fault);
        assert!(tally.worst.0 > 1e-3, "{fault:?}: {tally:?}");
    }
}
