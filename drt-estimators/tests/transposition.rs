//! Reverse mode is the transpose of forward mode: ⟨a, J v⟩ = ⟨Jᵀ a, v⟩ to rounding, from the same
//! random numbers.

mod common;

use common::pairing::{pair, targets};
use common::*;
use drt_estimators::filter::{Filter, FilterKind};
use drt_estimators::sensor::Sensor;
use drt_estimators::{InsideKind, Scene, Session, Settings, Unattended, gradient};
use drt_math::{Rgb, Rng, ValueChange, vec3};
use drt_motion::{Effect, Parameter};

/// Insides stay, as reverse mode takes them.
fn settings() -> Settings {
    let insides = vec![(0, InsideKind::Static), (1, InsideKind::Static)];
    Settings { spp: 16, seed: 3, threads: 1, insides, ..Settings::default() }
}

/// A random number per pixel and channel.
fn adjoint(scene: &Scene) -> Vec<Rgb> {
    let [width, height] = scene.sensors[0].item.sensor.film();
    let mut rng = Rng::new(99, 0, 0);
    let mut signed = || 2.0 * rng.next_f64() - 1.0;
    (0..width * height).map(|_| Rgb::new(signed(), signed(), signed())).collect()
}

/// Both sides, and the sum of the absolute values of the left one's summands.
fn sides(scene: &Scene, parameter: &Parameter, settings: &Settings) -> (f64, f64, f64) {
    let a = adjoint(scene);
    let mut session =
        Session::new(scene, core::slice::from_ref(parameter), settings).expect("a valid scene");
    assert!(session.run(settings.spp, &Unattended));
    let rendering = session.rendering();
    assert_eq!(rendering.non_finite, 0);
    let products: Vec<Rgb> = rendering.derivatives[0]
        .total
        .pixels
        .iter()
        .zip(&a)
        .map(|(pixel, a)| pixel.mean * *a)
        .collect();
    let forward = products.iter().map(|p| p.sum()).sum();
    let size = products.iter().map(|p| p.abs().sum()).sum();
    let wanted = targets(scene, parameter);
    let g = gradient(scene, &wanted, settings, &a, &Unattended).expect("a valid scene");
    assert_eq!(g.non_finite, 0);
    (forward, pair(scene, parameter, &g), size)
}

fn agree(name: &str, scene: &Scene, effects: Vec<Effect>, settings: &Settings) {
    let parameter = parameter(name, 0.0, effects);
    let (forward, reverse, size) = sides(scene, &parameter, settings);
    let error = (forward - reverse).abs() / size;
    assert!(
        size > 1e-3 && error < 1e-12,
        "{name}: {forward} {reverse} of {size}, off by {error:e}"
    );
}

fn coloured() -> ValueChange {
    ValueChange::Add(Rgb::new(0.5, -0.2, 0.3))
}

/// Vertex velocities of every shape.
fn wobbles(scene: &Scene) -> Vec<Effect> {
    let ids = scene.shapes.iter().filter_map(|s| s.id.as_deref());
    ids.enumerate().map(|(i, id)| moves(id, wobble(scene, id, i as u64))).collect()
}

#[test]
fn surfaces_everything_at_once() {
    let scene = surfaces(metal(), phong());
    let mut effects = wobbles(&scene);
    effects.extend([
        changes("ball-bsdf", "alpha", grey(0.3)),
        changes("ball-bsdf", "eta", coloured()),
        changes("floor-bsdf", "reflectance", coloured()),
        changes("floor-bsdf", "exponent", grey(2.0)),
        changes("glow", "radiance", coloured()),
        changes("bulb", "intensity", ValueChange::MultiplyLog(0.7)),
        moves("bulb", shift()),
        changes("spot", "cutoff_angle", grey(4.0)),
        moves("spot", turn()),
        moves("sun", turn()),
        changes("sky", "radiance", coloured()),
        moves("camera", turn()),
        changes("camera", "fov", grey(3.0)),
    ]);
    agree("everything", &scene, effects, &settings());
}

#[test]
fn surfaces_one_at_a_time() {
    let scene = surfaces(glass(), diffuse(0.6, 0.5, 0.4));
    for (name, effects) in [
        ("ball", vec![moves("ball", wobble(&scene, "ball", 1))]),
        ("ball turns", vec![moves("ball", turn())]),
        ("floor", vec![moves("floor", stretch())]),
        ("camera", vec![moves("camera", shift())]),
        ("lamp", vec![moves("lamp", wobble(&scene, "lamp", 2))]),
        ("reflectance", vec![changes("floor-bsdf", "reflectance", coloured())]),
        ("index", vec![changes("ball-bsdf", "eta", grey(0.2))]),
        ("radiance", vec![changes("glow", "radiance", coloured())]),
        ("bulb", vec![moves("bulb", shift())]),
        ("spot", vec![moves("spot", turn())]),
        ("sun", vec![moves("sun", turn())]),
    ] {
        agree(name, &scene, effects, &settings());
    }
}

#[test]
fn fog_with_a_solid() {
    let scene = fog();
    let mut effects = wobbles(&scene);
    for medium in ["thin", "dense"] {
        for property in ["sigma_t", "albedo", "emission"] {
            effects.push(changes(medium, property, coloured()));
        }
        effects.push(changes(medium, "g", grey(0.4)));
    }
    effects.push(changes("ball-bsdf", "reflectance", coloured()));
    effects.push(changes("bulb", "intensity", coloured()));
    effects.push(moves("sun", turn()));
    effects.push(moves("camera", turn()));
    agree("everything", &scene, effects, &settings());
    let coefficients = ["sigma_t", "albedo"].map(|p| changes("thin", p, coloured()));
    agree("coefficients", &scene, coefficients.into(), &settings());
    let extinction = vec![changes("thin", "sigma_t", coloured())];
    agree("extinction alone", &scene, extinction, &settings());
    agree("box", &scene, vec![moves("box", wobble(&scene, "box", 5))], &settings());
    agree("ball", &scene, vec![moves("ball", wobble(&scene, "ball", 5))], &settings());
    agree("ball turns", &scene, vec![moves("ball", turn())], &settings());
    agree("bulb", &scene, vec![moves("bulb", shift())], &settings());
}

#[test]
fn voxels() {
    let scene = smoke(1.0);
    let mut rng = Rng::new(8, 0, 0);
    let mut voxels = |property: &str, count| -> Vec<Effect> {
        let mut index = || (5.0 * rng.next_f64()) as usize;
        let mut some = || [index(), index(), index()];
        (0..count).map(|_| changes_voxel("smoke", property, some(), grey(0.7))).collect()
    };
    let mut effects = voxels("sigma_t", 40);
    effects.push(changes("smoke", "albedo", coloured()));
    effects.push(changes("smoke", "g", grey(0.4)));
    agree("voxels", &scene, effects.clone(), &settings());
    effects.push(moves("lamp", wobble(&scene, "lamp", 1)));
    effects.push(moves("camera", shift()));
    agree("with motions", &scene, effects, &settings());
    agree("carried", &scene, vec![moves("smoke", turn())], &settings());
}

#[test]
fn other_settings() {
    let scene = fog();
    let effects = || {
        vec![
            moves("ball", wobble(&scene, "ball", 6)),
            changes("thin", "sigma_t", coloured()),
            changes("thin", "albedo", coloured()),
            moves("camera", turn()),
        ]
    };
    let other = Settings { antithetic: false, spp: 5, boundary_spp: Some(20), ..settings() };
    agree("unpaired", &scene, effects(), &other);
    let other = Settings { seed: 77, max_depth: Some(Some(2)), ..settings() };
    agree("single scattering", &scene, effects(), &other);
    let other = Settings { spp: 7, ..settings() };
    agree("odd number of samples", &scene, effects(), &other);
}

#[test]
fn other_sensors() {
    for mut scene in [surfaces(phong(), phong()), fog()] {
        let mut effects = wobbles(&scene);
        effects.push(moves("camera", turn()));
        let sensor = &mut scene.sensors[0].item.sensor;
        let filter = Filter::new(FilterKind::BOX).expect("a valid filter");
        *sensor = sensor.clone().with_filter(filter);
        agree("box filter", &scene, effects.clone(), &settings());
        let meter = Sensor::irradiance_meter(vec3(0.4, 0.8, 4.2), vec3(-0.1, -0.2, -1.0));
        scene.sensors[0].item.sensor = meter.expect("a valid sensor");
        agree("meter", &scene, effects, &Settings { spp: 200, ..settings() });
    }
}

/// A gradient of something slightly else is not the transpose.
#[test]
fn another_seed_is_no_transpose() {
    let scene = surfaces(phong(), phong());
    let parameter = parameter("ball", 0.0, vec![moves("ball", turn())]);
    let (forward, _, size) = sides(&scene, &parameter, &settings());
    let (_, reverse, _) = sides(&scene, &parameter, &Settings { seed: 4, ..settings() });
    assert!((forward - reverse).abs() > 1e-4 * size);
}
