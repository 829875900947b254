//! The adjoint sweep against the same contribution written in dual numbers, path by path.

use alloc::vec;
use alloc::vec::Vec;

use drt_math::{Moments, Rgb, RgbVec, Rng, ValueChange, Vec3};
use drt_motion::Parameter;

use super::moving::{Moving, rates};
use super::replay::replay;
use super::scenes::*;
use crate::contraction::{Contraction, Motion};
use crate::emitter::EmitterGradient;
use crate::scene::Scene;
use crate::sensitivity::{AdjointSink, CoefficientAdjoint, Interest, SurfaceAdjoint};
use crate::sensor::SensorGradient;
use crate::surface::BsdfParams;
use crate::transport::{Differentiator, PathRecord, SurfacePoint, Tracer, World};
use crate::{inside, tangents};

/// A scene prepared at a parameter's value, as a session does.
fn prepare(scene: &Scene, parameter: &Parameter) -> (World, Motion) {
    let (at_value, tangents) =
        tangents::apply(scene, core::slice::from_ref(parameter), 0).expect("a valid parameter");
    let mut world =
        World::new(at_value, 0, scene.integrator.max_depth, None).expect("a valid scene");
    let insides = inside::plan(&world, &tangents, &[]).expect("a valid scene");
    let motion = Motion::new(tangents, insides);
    world.prepare_for_derivatives(motion.needs());
    (world, motion)
}

/// Traces a path from some pixel; returns the filter's gradient over the density.
fn trace(tracer: &mut Tracer<'_>, record: &mut PathRecord, seed: u64, i: u32) -> [f64; 2] {
    let pixels = FILM[0] * FILM[1];
    let mut rng = Rng::new(seed, u64::from(i % pixels), i / pixels);
    let view = tracer.world.camera.sample_view(i % pixels, rng.next_2d(), true);
    let weight = Rgb::splat(view.weight);
    record.begin(view.direction, weight);
    tracer.rng = rng;
    tracer.trace_camera(view.direction, weight, record);
    view.slope
}

/// Something done wrong on purpose.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    None,
    /// The area Jacobian is left out.
    NoJacobian,
    /// The geometric normal's rate has the wrong sign.
    Normal,
    /// Interpolated normals stay.
    ShadingNormal,
    /// Volume vertices stay.
    Volume,
    /// The box of a moving grid stays.
    GridFace,
}

/// A contraction that makes a mistake.
struct Faulty<'a>(Contraction<'a>, Fault);

impl AdjointSink for Faulty<'_> {
    fn interest(&self) -> &Interest {
        self.0.interest()
    }
    fn surface(&mut self, point: &SurfacePoint, adjoint: &SurfaceAdjoint) {
        let mut a = *adjoint;
        match self.1 {
            Fault::NoJacobian => a.j = Rgb::ZERO,
            Fault::Normal => a.n = -a.n,
            Fault::ShadingNormal => a.ns = RgbVec::ZERO,
            Fault::None | Fault::Volume | Fault::GridFace => {}
        }
        self.0.surface(point, &a);
    }
    fn volume(&mut self, medium: usize, x: Vec3, u: &RgbVec, j: Rgb) {
        if self.1 != Fault::Volume {
            self.0.volume(medium, x, u, j);
        }
    }
    fn medium(&mut self, medium: usize, x: Vec3, adjoint: &CoefficientAdjoint) {
        self.0.medium(medium, x, adjoint);
    }
    fn grid_face(&mut self, medium: usize, x: Vec3, u: &RgbVec) {
        if self.1 != Fault::GridFace {
            self.0.grid_face(medium, x, u);
        }
    }
    fn bsdf(&mut self, bsdf: usize, params: &BsdfParams, weight: Rgb) {
        self.0.bsdf(bsdf, params, weight);
    }
    fn emitter(&mut self, emitter: usize, gradient: &[EmitterGradient; 3]) {
        self.0.emitter(emitter, gradient);
    }
    fn sensor(&mut self, gradient: &[SensorGradient; 3]) {
        self.0.sensor(gradient);
    }
}

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
    let mut record = PathRecord::default();
    let mut differentiator = Differentiator::new(&world);
    let mut sink = Faulty(Contraction::new(&world, &motion), fault);
    let mut tally = Tally::default();
    while (tally.paths < 200 || tally.moving < 30) && tally.paths < 20_000 {
        let i = tally.paths;
        let slope = trace(&mut tracer, &mut record, 5, i);
        sink.0.clear();
        differentiator.differentiate(&record, slope, Rng::new(6, 0, i), &mut sink);
        let truth = replay(&moving, &record, slope);
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

fn set(name: &str, id: &str, property: &str, op: ValueChange) -> Parameter {
    parameter(name, 0.0, vec![changes(id, property, op)])
}

fn motion(id: &str, name: &str, change: drt_motion::GeometryChange) -> Parameter {
    parameter(&format!("{id} {name}"), 0.0, vec![moves(id, change)])
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

fn coloured() -> ValueChange {
    ValueChange::Add(Rgb::new(0.5, -0.2, 0.3))
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
            properties.into_iter().map(|p| set(p, "ball-bsdf", p, op(p))).collect();
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
    compare_all(&scene, &[set("reflectance", "ball-bsdf", "reflectance", coloured())]);
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

/// Line integrals through voxels are random: their mean must be right, and all else exact.
#[test]
fn voxels_on_average() {
    let scene = smoke(0.0);
    let one = ValueChange::Add(Rgb::splat(0.8));
    let voxel = vec![changes_voxel("smoke", "sigma_t", [2, 2, 2], one)];
    for p in [
        set("density", "smoke", "sigma_t", ValueChange::MultiplyLog(1.0)),
        parameter("voxel", 0.0, voxel),
        set("albedo", "smoke", "albedo", grey(0.5)),
        set("emission", "smoke", "emission", coloured()),
        motion("box", "shift", shift()),
        motion("lamp", "wobble", wobble(&scene, "lamp", 2)),
    ] {
        judge(&scene, &p);
    }
    // With a jump of the extinction at the grid's box.
    let scene = smoke(1.0);
    for p in [
        motion("smoke", "turn", turn()),
        motion("smoke", "shift", shift()),
        motion("sun", "turn", turn()),
        motion("bulb", "shift", shift()),
        motion("camera", "turn", turn()),
    ] {
        judge(&scene, &p);
    }
    let turned = motion("smoke", "turn", turn());
    let off = |z: &f64| z.abs() > 6.0;
    assert!(mean_deviations(&scene, &turned, Fault::None, 1.02).iter().any(off));
    assert!(mean_deviations(&scene, &turned, Fault::GridFace, 1.0).iter().any(off));
}

fn judge(scene: &Scene, parameter: &Parameter) {
    let deviations = mean_deviations(scene, parameter, Fault::None, 1.0);
    let n = deviations.len() as f64;
    let squares: f64 = deviations.iter().map(|z| z * z).sum();
    let worst = deviations.iter().fold(0.0, |w: f64, z| w.max(z.abs()));
    // Chi-squared with n degrees of freedom, whose variance is 2 n.
    let fits = squares <= n + 4.0 * (2.0 * n).sqrt();
    assert!(fits && worst < 4.5, "{}: {deviations:?}", parameter.name);
}

/// Deviations, path by path, of the mean over line points in standard errors; `factor` multiplies
/// what is expected. Where nothing is random, a deviation of more than rounding counts as many.
fn mean_deviations(scene: &Scene, parameter: &Parameter, fault: Fault, factor: f64) -> Vec<f64> {
    let (world, motion) = prepare(scene, parameter);
    let moving = Moving::new(scene, parameter, &world, &motion);
    let mut tracer = Tracer::new(&world);
    let mut record = PathRecord::default();
    let mut differentiator = Differentiator::new(&world);
    let mut sink = Faulty(Contraction::new(&world, &motion), fault);
    let mut deviations = Vec::new();
    for i in 0..120 {
        let slope = trace(&mut tracer, &mut record, 15, i);
        let expected = rates(replay(&moving, &record, slope)).g * factor;
        let mean: Moments = (0..1000)
            .map(|j| {
                sink.0.clear();
                differentiator.differentiate(&record, slope, Rng::new(16, j, i), &mut sink);
                sink.0.rates[0].g
            })
            .collect();
        let (error, stderr) = (mean.mean() - expected, mean.standard_error());
        let rounding = 1e-10 * f64::max(expected.abs(), record.value.g);
        if error.abs() > rounding || stderr > rounding {
            deviations.push(error / f64::hypot(stderr, rounding));
        }
    }
    deviations
}
