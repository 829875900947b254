//! Reverse mode is the transpose of forward mode: ⟨a, J v⟩ = ⟨Jᵀ a, v⟩ to rounding, from the same
//! random numbers.

use std::sync::Arc;

use crate::common::pairing::{pair, targets};
use crate::common::*;
use drt_estimators::emitter::Emitter;
use drt_estimators::filter::{Filter, FilterKind};
use drt_estimators::fit::{Group, GroupKind};
use drt_estimators::sensor::{Aperture, Lens, Sensor};
use drt_estimators::surface::{
    Anisotropic, Bsdf, Conductor, Dielectric, Mask, Measured, MeasuredTables, Perturbation,
    Perturbed, Principled, RoughConductor,
};
use drt_estimators::texture::{Bitmap, Texture};
use drt_estimators::{
    EstimatorKind, InteriorMotion, PathSampling, Scene, Session, Settings, Shape, Unattended, moved,
};
use drt_geom::procedural;
use drt_math::{Rgb, Rng, ValueChange, Vec3, vec3};
use drt_motion::{Effect, GeometryChange, Parameter};

/// Samples per pixel, where not said otherwise.
const SPP: u32 = 16;

/// Every inside moves as said.
fn with(kind: &InteriorMotion) -> Settings {
    let insides = vec![(0, kind.clone()), (1, kind.clone())];
    Settings { seed: 3, threads: 1, guiding: false, insides, ..Settings::default() }
}

/// Insides stay, and the flux is added.
fn settings() -> Settings {
    with(&InteriorMotion::Static)
}

/// Insides move with tetrahedra.
fn with_tetrahedra() -> Settings {
    with(&InteriorMotion::Tetrahedral(None))
}

/// A random number per pixel and channel.
fn adjoint(scene: &Scene) -> Vec<Rgb> {
    let [width, height] = scene.sensors[0].item.sensor.film();
    let mut rng = Rng::new(99, 0, 0);
    let mut signed = || 2.0 * rng.next_f64() - 1.0;
    (0..width * height).map(|_| Rgb::new(signed(), signed(), signed())).collect()
}

/// Both sides, and the sum of the absolute values of the left one's summands.
fn sides(scene: &Scene, parameter: &Parameter, settings: &Settings, spp: u32) -> (f64, f64, f64) {
    let a = adjoint(scene);
    let mut settings = settings.clone();
    settings.insides.retain(|(m, _)| *m < scene.media.len());
    let settings = &settings;
    let mut session =
        Session::new(scene, core::slice::from_ref(parameter), settings).expect("a valid scene");
    assert!(session.run(spp, &Unattended));
    let rendering = session.rendering();
    assert_eq!(rendering.non_finite, 0, "{:?}", rendering.non_finite_examples);
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
    // From the same preparation.
    let g = session.gradient(&wanted, spp, &a, &Unattended).expect("a valid scene");
    assert_eq!(g.non_finite, 0);
    (forward, pair(scene, parameter, &g), size)
}

fn agree(name: &str, scene: &Scene, effects: Vec<Effect>, settings: &Settings) {
    agree_from(SPP, name, scene, effects, settings);
}

fn agree_from(spp: u32, name: &str, scene: &Scene, effects: Vec<Effect>, settings: &Settings) {
    by_one_estimator(name, scene, effects.clone(), settings, spp, EXACT);
    // Normals that are computed anew differ in their last bits. That tips the choice between edges of
    // next to no weight, those in the plane of the face that looks: of 182 events of the ball one then
    // had 1e-5 for 1e-12.
    let both = Settings { sampling: PathSampling::Bidirectional, ..settings.clone() };
    by_one_estimator(&format!("{name}, from both ends"), scene, effects.clone(), &both, spp, EXACT);
    let named = format!("{name}, radiative");
    by_one_estimator(&named, scene, effects.clone(), &radiative(settings), spp, 1e-4);
    let warped = Settings { estimator: EstimatorKind::Warped, ..settings.clone() };
    by_one_estimator(&format!("{name}, warped"), scene, effects.clone(), &warped, spp, 1e-9);
    let both = Settings { sampling: PathSampling::Bidirectional, ..warped };
    by_one_estimator(&format!("{name}, warped, from both ends"), scene, effects, &both, spp, 1e-9);
}

const EXACT: f64 = 1e-12;

fn radiative(settings: &Settings) -> Settings {
    Settings { estimator: EstimatorKind::Radiative, ..settings.clone() }
}

fn by_one_estimator(
    name: &str,
    scene: &Scene,
    effects: Vec<Effect>,
    settings: &Settings,
    spp: u32,
    limit: f64,
) {
    let parameter = parameter(name, 0.0, effects);
    let (forward, reverse, size) = sides(scene, &parameter, settings, spp);
    let error = (forward - reverse).abs() / size;
    assert!(
        size > 1e-3 && error < limit,
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
fn hidden_emitters() {
    let mut scene = surfaces(metal(), phong());
    scene.integrator.hide_emitters = true;
    let effects = wobbles(&scene);
    by_one_estimator("hidden", &scene, effects, &settings(), SPP, 1e-9);
}

#[test]
fn surfaces_everything_at_once() {
    let scene = surfaces(metal(), phong());
    let mut effects = wobbles(&scene);
    effects.extend([
        changes("ball", "alpha", grey(0.3)),
        changes("ball", "eta", coloured()),
        changes("floor", "reflectance", coloured()),
        changes("floor", "exponent", grey(2.0)),
        changes("lamp", "radiance", coloured()),
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

/// Both sides for a change of a body along a direction of the group's values, in a pose that is known, and the size of the summands; then
/// the right one as if the pose were not known.
fn sides_in_a_pose(
    scene: &Scene,
    group: &Group,
    along: GeometryChange,
    direction: &[f64],
    settings: &Settings,
) -> [f64; 4] {
    let turn = GeometryChange::Rotate { axis: vec3(0.3, 1.0, -0.2), pivot: vec3(0.1, 0.1, 0.0) };
    let changes = [
        parameter("along", 0.0, vec![moves("ball", along)]),
        parameter("pose", 0.7, vec![moves("ball", turn)]),
    ];
    let a = adjoint(scene);
    let mut session = Session::new(scene, &changes, settings).expect("a valid scene");
    assert!(session.run(SPP, &Unattended));
    let along = &session.rendering().derivatives[0].total;
    let products: Vec<Rgb> = along.pixels.iter().zip(&a).map(|(p, a)| p.mean * *a).collect();
    let found = session.gradient(&[group.wanted()], SPP, &a, &Unattended).expect("a valid scene");
    let posed = moved(scene, &changes).expect("a valid scene");
    let reverse = |changes: &[Parameter]| -> f64 {
        let collector = group.collector(scene, &posed, changes).expect("a group of it");
        let mut numbers = vec![0.0; group.count(scene)];
        collector.add_to(&found, 1.0, &mut numbers);
        numbers.iter().zip(direction).map(|(g, d)| g * d).sum()
    };
    [
        products.iter().map(|p| p.sum()).sum(),
        reverse(&changes),
        products.iter().map(|p| p.abs().sum()).sum(),
        reverse(&changes[..1]),
    ]
}

/// Gradients by a body's vertices and by those of a cage around it go back through the pose in which a view shows the body.
#[test]
fn groups_in_a_pose() {
    let scene = surfaces(diffuse(0.7, 0.5, 0.3), diffuse(0.4, 0.5, 0.6));
    let mut rng = Rng::new(5, 0, 0);
    let mut random = |_| vec3(rng.next_f64(), rng.next_f64(), rng.next_f64()) - Vec3::splat(0.5);
    let velocities: Vec<Vec3> = scene.shapes[0].mesh.positions.iter().map(&mut random).collect();
    let cage = Arc::new(procedural::cube().transform(&scaled(1.3, vec3(0.1, 0.1, 0.0))));
    let corners: Vec<Vec3> = cage.positions.iter().map(&mut random).collect();
    let vertices = (0..).zip(corners.iter().copied()).collect();
    let group = |kind| Group::new("body", &scene, &"ball", kind).expect("a shape");
    let trials = [
        (
            group(GroupKind::Vertices),
            GeometryChange::VertexVelocity(velocities.clone().into()),
            velocities,
        ),
        (
            group(GroupKind::Cage(cage.clone())),
            GeometryChange::Cage { mesh: cage, vertices },
            corners,
        ),
    ];
    for (group, along, direction) in trials {
        let direction: Vec<f64> = direction.iter().flat_map(|v| v.to_array()).collect();
        for estimator in [EstimatorKind::PathSpace, EstimatorKind::Radiative, EstimatorKind::Warped]
        {
            let settings = Settings { estimator, ..settings() };
            let settings = Settings { insides: Vec::new(), ..settings };
            let [forward, reverse, size, still] =
                sides_in_a_pose(&scene, &group, along.clone(), &direction, &settings);
            let [off, planted] = [reverse, still].map(|r| (forward - r).abs() / size);
            assert!(size > 1e-3 && off < 1e-9, "{estimator:?}: off by {off:e} of {size}");
            assert!(planted > 1e-3, "{estimator:?}: {planted:e}");
        }
    }
}

/// Lines where surfaces pass through each other move with both of them.
#[test]
fn surfaces_that_pass_through_each_other() {
    for mut scene in [surfaces(diffuse(0.7, 0.6, 0.5), diffuse(0.6, 0.5, 0.4)), fog()] {
        let body = scene.shapes.iter().find(|s| s.id.as_deref() == Some("ball")).expect("a ball");
        let at = body.mesh.bounds().center() + vec3(0.1, 0.05, -0.1);
        let card = placed(procedural::rectangle(), Vec3::splat(0.8), 0.7, at);
        let card = Shape { id: Some("card".into()), mesh: Arc::new(card), ..body.clone() };
        scene.shapes.push(card);
        agree("sunk", &scene, wobbles(&scene), &settings());
    }
}

/// In narrow lobes, where pairs of rays tell of what turns.
#[test]
fn narrow_lobes_everything_at_once() {
    let mut metal = metal();
    let mut glass = glass();
    if let Bsdf::RoughConductor(b) = &mut metal {
        b.alpha = 0.08;
    }
    if let Bsdf::RoughDielectric(b) = &mut glass {
        b.alpha = 0.08;
    }
    for ball in [metal, glass] {
        let scene = surfaces(ball, diffuse(0.6, 0.5, 0.4));
        let mut effects = wobbles(&scene);
        effects.extend([
            changes("ball", "alpha", grey(0.3)),
            changes("ball", "eta", grey(0.2)),
            moves("camera", turn()),
        ]);
        agree("narrow", &scene, effects, &settings());
    }
}

/// Frames turn with the corners of their triangles.
#[test]
fn uneven_materials_everything_at_once() {
    let base_color = Rgb::new(0.6, 0.4, 0.2);
    let ball = Principled { base_color, metallic: 0.4, clearcoat: 0.3, ..Principled::default() };
    let floor = Anisotropic { base: metal(), alpha: [0.5, 0.2] };
    let ball = Bsdf::Principled(Box::new(ball));
    let scene = with_coordinates(surfaces(ball, Bsdf::Anisotropic(Box::new(floor))));
    let mut effects = wobbles(&scene);
    effects.extend([
        changes("ball", "base_color", coloured()),
        changes("ball", "roughness", grey(0.3)),
        changes("ball", "metallic", grey(-0.4)),
        changes("ball", "clearcoat", grey(0.6)),
        changes("floor", "alpha_u", grey(0.5)),
        changes("floor", "alpha_v", grey(-0.3)),
        changes("floor", "k", coloured()),
    ]);
    agree("uneven", &scene, effects, &settings());
}

/// Normals of a map follow the frame, and those of heights the stretch of the coordinates.
#[test]
fn bent_normals() {
    let texels = [[0.7, 0.4, 0.9], [0.3, 0.8, 0.8], [0.9, 0.6, 0.7], [0.4, 0.2, 0.6]].to_vec();
    let map = Texture::Bitmap(Bitmap::new([2, 2], texels).expect("an image"));
    for perturbation in [Perturbation::Normals, Perturbation::Heights(0.4)] {
        let bent = Bsdf::Perturbed(Box::new(Perturbed {
            bsdf: metal(),
            map: map.clone(),
            perturbation,
            flip_invalid_normals: true,
            use_shadowing_function: true,
        }));
        let scene = with_coordinates(surfaces(diffuse(0.5, 0.6, 0.4), bent));
        let mut effects = wobbles(&scene);
        effects.extend([changes("floor", "alpha", grey(0.3)), moves("camera", turn())]);
        match perturbation {
            Perturbation::Normals => agree("bent", &scene, effects, &settings()),
            // The slopes of heights jump, so that only path space has them.
            Perturbation::Heights(_) => {
                let (name, exact) = ("engraved", EXACT);
                by_one_estimator(name, &scene, effects, &settings(), SPP, exact);
            }
        }
    }
}

#[test]
fn measured_materials() {
    let measured = |alpha, phi_i: &[f32]| {
        let metal = RoughConductor::default();
        let tables = MeasuredTables::of_metal(&metal, alpha, phi_i, [5, 9, 5]).expect("tables");
        Bsdf::Measured(Measured::new(tables).expect("a material").into())
    };
    let whole = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|k| k * core::f32::consts::FRAC_PI_2);
    let scene = surfaces(measured([0.4; 2], &[0.0]), measured([0.5, 0.2], &whole));
    let scene = with_coordinates(scene);
    let effects = wobbles(&scene);
    agree("measured", &scene, effects, &settings());
}

/// Texture coordinates for the floor, along none of its sides.
fn with_coordinates(mut scene: Scene) -> Scene {
    for shape in scene.shapes.iter_mut().filter(|s| s.id.as_deref() == Some("floor")) {
        let mesh = &shape.mesh;
        let place = |v: u32| mesh.positions[v as usize];
        let at = |v| [place(v).x + 0.3 * place(v).y, place(v).y - 0.5 * place(v).z];
        let texcoords = mesh.triangles.iter().map(|t| t.map(at)).collect();
        let mesh = mesh.as_ref().clone().with_texcoords(texcoords).expect("coordinates");
        shape.mesh = mesh.into();
    }
    scene
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
        ("reflectance", vec![changes("floor", "reflectance", coloured())]),
        ("index", vec![changes("ball", "eta", grey(0.2))]),
        ("radiance", vec![changes("lamp", "radiance", coloured())]),
        ("bulb", vec![moves("bulb", shift())]),
        ("spot", vec![moves("spot", turn())]),
        ("sun", vec![moves("sun", turn())]),
    ] {
        agree(name, &scene, effects, &settings());
    }
}

fn fog_with_a_solid_in(settings: &Settings) {
    let scene = fog();
    let mut effects = wobbles(&scene);
    for medium in ["thin", "dense"] {
        for property in ["sigma_t", "albedo", "emission"] {
            effects.push(changes(medium, property, coloured()));
        }
        effects.push(changes(medium, "g", grey(0.4)));
    }
    effects.push(changes("ball", "reflectance", coloured()));
    effects.push(changes("bulb", "intensity", coloured()));
    effects.push(moves("sun", turn()));
    effects.push(moves("camera", turn()));
    agree("everything", &scene, effects, settings);
    let coefficients = ["sigma_t", "albedo"].map(|p| changes("thin", p, coloured()));
    agree("coefficients", &scene, coefficients.into(), settings);
    let extinction = vec![changes("thin", "sigma_t", coloured())];
    agree("extinction alone", &scene, extinction, settings);
    agree("box", &scene, vec![moves("box", wobble(&scene, "box", 5))], settings);
    agree("ball", &scene, vec![moves("ball", wobble(&scene, "ball", 5))], settings);
    agree("ball turns", &scene, vec![moves("ball", turn())], settings);
    agree("bulb", &scene, vec![moves("bulb", shift())], settings);
}

#[test]
fn fog_with_a_solid() {
    fog_with_a_solid_in(&settings());
}

#[test]
fn fog_carried_by_a_solid() {
    fog_with_a_solid_in(&with_tetrahedra());
}

#[test]
fn fog_bent_by_cages() {
    let scene = fog();
    for (name, settings) in [("static", settings()), ("with tetrahedra", with_tetrahedra())] {
        for (shape, size) in [("ball", 0.9), ("blob", 1.5), ("box", 2.5)] {
            let effects = vec![moves(shape, bend(size))];
            agree(&format!("{shape}, {name}"), &scene, effects, &settings);
        }
    }
}

/// Fog seen from inside.
#[test]
fn a_camera_and_a_light_in_the_fog() {
    let mut scene = fog();
    let eye = [vec3(0.1, 0.9, 1.2), vec3(0.2, -0.1, 0.0), Vec3::Y];
    let filter = Filter::new(FilterKind::Tent { radius: 1.0 }).expect("a valid filter");
    let sensor = Sensor::look_at(eye, Lens::with_fov(70.0), FILM, filter);
    scene.sensors[0].item.sensor = sensor.expect("a valid camera");
    let camera = moves("camera", turn());
    for settings in [settings(), with_tetrahedra()] {
        agree("camera", &scene, vec![camera.clone()], &settings);
        agree("bulb", &scene, vec![moves("bulb", shift())], &settings);
        let mut effects = wobbles(&scene);
        effects.extend([camera.clone(), moves("bulb", shift())]);
        agree("everything", &scene, effects, &settings);
    }
}

/// Two corners of a cage around everything move.
fn bend(size: f64) -> GeometryChange {
    let cage = placed(procedural::cube(), Vec3::splat(size), 0.4, vec3(0.1, 0.0, 0.2));
    let vertices = [(0, vec3(0.5, -0.7, 0.2)), (5, vec3(-0.4, 0.1, 0.9))];
    GeometryChange::Cage { mesh: cage.into(), vertices: vertices.into() }
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
    agree("with motions", &scene, effects.clone(), &settings());
    agree("grid turns", &scene, vec![moves("smoke", turn())], &settings());
    effects.extend([moves("box", wobble(&scene, "box", 2)), moves("smoke", turn())]);
    agree("in a moving box", &scene, effects, &with_tetrahedra());
}

/// Voxels of phase functions, at rest and moving.
#[test]
fn voxels_of_phase_functions() {
    for (scene, property) in varied_smoke(1.0).iter().zip(["g", "weight"]) {
        let mut rng = Rng::new(8, 0, 0);
        let mut index = || (4.0 * rng.next_f64()) as usize;
        let voxels = (0..20).map(|_| [index(), index(), index()]);
        let mut effects: Vec<Effect> =
            voxels.map(|v| changes_voxel("smoke", property, v, grey(0.3))).collect();
        agree(property, scene, effects.clone(), &settings());
        agree("grid turns", scene, vec![moves("smoke", turn())], &settings());
        effects.extend([moves("box", wobble(scene, "box", 2)), moves("smoke", turn())]);
        agree("in a moving box", scene, effects, &with_tetrahedra());
    }
}

/// Microflakes in voxels and the same everywhere, at rest, and turned by motions that change them.
#[test]
fn microflakes() {
    let both = |voxel: Option<[usize; 3]>| {
        ["sggx_diagonal", "sggx_off_diagonal"].map(|property| match voxel {
            Some(voxel) => changes_voxel("smoke", property, voxel, coloured()),
            None => changes("smoke", property, coloured()),
        })
    };
    let mut rng = Rng::new(8, 0, 0);
    let mut index = || (4.0 * rng.next_f64()) as usize;
    let voxels: Vec<_> = (0..10).map(|_| Some([index(), index(), index()])).collect();
    for (scene, places) in [(flaky_smoke(1.0), voxels), (flaky_fog(), vec![None])] {
        let mut effects: Vec<Effect> = places.into_iter().flat_map(both).collect();
        effects.push(changes("smoke", "sigma_t", coloured()));
        effects.push(changes("smoke", "emission", coloured()));
        agree("values", &scene, effects.clone(), &settings());
        agree("flakes turn", &scene, vec![moves("smoke", turn())], &settings());
        effects.extend([moves("box", wobble(&scene, "box", 2)), moves("smoke", turn())]);
        agree("in a moving box", &scene, effects, &with_tetrahedra());
    }
}

/// Texels, with what their textures are on at rest and moving.
#[test]
fn texels() {
    let scene = under_an_image(textures());
    let effects = vec![
        changes_texel("ball", "alpha", Some([1, 2]), grey(0.4)),
        changes_texel("ball", "specular_reflectance", None, ValueChange::Multiply(0.7)),
        changes_texel("floor", "reflectance", None, coloured()),
        changes_texel("floor", "specular_reflectance", Some([1, 0]), coloured()),
        changes("floor", "exponent", grey(2.0)),
        changes_texel("lamp", "radiance", None, coloured()),
        changes("lamp", "radiance", coloured()),
        changes_texel("sky", "radiance", Some([5, 3]), coloured()),
        changes_texel("sky", "radiance", None, ValueChange::MultiplyLog(0.4)),
        moves("sky", turn()),
    ];
    for estimator in [EstimatorKind::PathSpace, EstimatorKind::Radiative, EstimatorKind::Warped] {
        let alone = Settings { estimator, ..settings() };
        by_one_estimator("texels", &scene, effects.clone(), &alone, SPP, EXACT);
        if estimator != EstimatorKind::Radiative {
            let both = Settings { sampling: PathSampling::Bidirectional, ..alone };
            by_one_estimator("from both ends", &scene, effects.clone(), &both, SPP, EXACT);
        }
    }
    let mut effects = effects;
    effects.extend(wobbles(&scene));
    by_one_estimator("moving", &scene, effects, &settings(), SPP, EXACT);
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
    let other = Settings { antithetic: false, boundary_ratio: Some(4.0), ..settings() };
    agree_from(5, "unpaired", &scene, effects(), &other);
    let other = Settings { seed: 77, max_depth: drt_estimators::Depth::AtMost(2), ..settings() };
    agree("single scattering", &scene, effects(), &other);
    agree_from(7, "odd number of samples", &scene, effects(), &settings());
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
        let mut through = scene.clone();
        let sensor = &mut through.sensors[0].item.sensor;
        let aperture = Aperture { radius: 0.4, focus_distance: 2.0 };
        *sensor = sensor.clone().with_aperture(aperture).expect("a valid sensor");
        let mut of_lens = effects.clone();
        of_lens.push(changes("camera", "aperture_radius", grey(0.3)));
        of_lens.push(changes("camera", "focus_distance", grey(1.5)));
        agree("lens", &through, of_lens, &settings());
        let meter = Sensor::irradiance_meter(vec3(0.4, 0.8, 4.2), vec3(-0.1, -0.2, -1.0));
        scene.sensors[0].item.sensor = meter.expect("a valid sensor");
        agree_from(200, "meter", &scene, effects, &settings());
    }
}

/// A gradient of something slightly else is not the transpose.
#[test]
fn another_seed_is_no_transpose() {
    let scene = surfaces(phong(), phong());
    let parameter = parameter("ball", 0.0, vec![moves("ball", turn())]);
    let (forward, _, size) = sides(&scene, &parameter, &settings(), SPP);
    let (_, reverse, _) = sides(&scene, &parameter, &Settings { seed: 4, ..settings() }, SPP);
    assert!((forward - reverse).abs() > 1e-4 * size);
}

/// Where a motion at rest leaves even the last bits as they are, the tree of edges, too, takes the same
/// ways in both modes.
#[test]
fn rays_carry_back_exactly() {
    let scene = surfaces(phong(), phong());
    let exactly = |name: &str, id: &str, change: GeometryChange| {
        let effects = vec![moves(id, change)];
        by_one_estimator(name, &scene, effects, &radiative(&settings()), SPP, EXACT);
    };
    exactly("ball shifts", "ball", shift());
    exactly("ball turns", "ball", turn());
    exactly("floor", "floor", wobble(&scene, "floor", 1));
    exactly("lamp", "lamp", wobble(&scene, "lamp", 1));
    exactly("ball", "ball", wobble(&scene, "ball", 1));
}

#[test]
fn past_smooth_surfaces_and_masks() {
    let silver =
        Bsdf::Conductor(Conductor { eta: Rgb::ONE, k: Rgb::splat(2.0), ..Conductor::default() });
    let mask = Bsdf::Mask(Mask { bsdf: diffuse(0.6, 0.5, 0.4), opacity: 0.4 }.into());
    let sheet =
        |size: f64, angle: f64, at| placed(procedural::rectangle(), Vec3::splat(size), angle, at);
    let ball = placed(procedural::uv_sphere(6), Vec3::splat(0.3), 0.0, vec3(-0.4, 0.2, 0.4));
    let glass = Bsdf::Dielectric(Dielectric::default());
    let lamp = Emitter::Point { position: vec3(0.4, 0.2, 4.0), intensity: Rgb::splat(9.0) };
    let scene = SceneBuilder::new()
        .shape("floor", ShapeBuilder::new(sheet(3.0, 0.0, Vec3::ZERO), diffuse(0.5, 0.4, 0.3)))
        .shape("mirror", ShapeBuilder::new(sheet(0.5, 0.4, vec3(0.4, 0.3, 0.3)), silver))
        .shape("ball", ShapeBuilder::new(ball, glass))
        .shape("veil", ShapeBuilder::new(sheet(0.6, 0.2, vec3(0.0, -0.3, 0.9)), mask))
        .emitter("lamp", lamp)
        .emitter("sky", Emitter::Constant { radiance: Rgb::splat(0.3) });
    let scene = seen(scene, [vec3(0.3, 0.2, 2.5), Vec3::ZERO], 5);
    for (target, name) in [
        ("mirror", "k"),
        ("mirror", "specular_reflectance"),
        ("ball", "specular_transmittance"),
        ("veil", "opacity"),
        ("veil", "reflectance"),
        ("floor", "reflectance"),
        ("sky", "radiance"),
    ] {
        let amount = if name == "opacity" { Rgb::ONE } else { Rgb::new(1.0, 0.5, -0.5) };
        let effects = vec![changes(target, name, ValueChange::Add(amount))];
        by_one_estimator(&format!("{target}, {name}"), &scene, effects, &settings(), 64, EXACT);
    }
    // What moves, where no shadow is seen past them.
    let mut scene = scene;
    scene.emitters.retain(|e| !e.item.emitter.is_delta());
    for target in ["mirror", "ball", "veil", "floor", "camera"] {
        let name = format!("{target} moves");
        for change in [shift(), turn()] {
            let effects = vec![moves(target, change)];
            by_one_estimator(&name, &scene, effects, &settings(), 64, EXACT);
        }
    }
    let effects = vec![moves("ball", wobble(&scene, "ball", 1))];
    by_one_estimator("ball deforms", &scene, effects, &settings(), 64, EXACT);
}
