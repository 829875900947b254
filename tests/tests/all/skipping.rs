//! What a scene does not need is not done: the plan says so, the counters prove it, and the time is
//! not spent. The ratios of times:
//!
//! ```sh
//! cargo test --release -p drt-tests --test all -- --ignored skipping:: --nocapture
//! ```

use std::sync::Arc;
use std::time::Instant;

use drt_estimators::emitter::Emitter;
use drt_estimators::filter::{Filter, FilterKind};
use drt_estimators::sensor::{Lens, Sensor};
use drt_estimators::surface::{Bsdf, Diffuse};
use drt_estimators::{
    Counters, EstimatorKind, Layer, Rendering, Scene, SceneBuilder, Session, Settings,
    ShapeBuilder, Term, Unattended, agreement,
};
use drt_geom::{Mesh, procedural};
use drt_math::{Affine, Mat3, Rgb, ValueChange, Vec3, vec3};
use drt_medium::{Grid, GridMedium, Homogeneous, Medium, Phase, Volume};
use drt_motion::{Change, Effect, GeometryChange, Parameter, PropertyChange};

/// Pixels along each side.
const SIDE: u32 = 24;
const PIXELS: u64 = (SIDE * SIDE) as u64;
/// Objects of the crowd, the floor among them.
const OBJECTS: usize = 50;

fn scaled(mesh: &Mesh, size: f64, at: Vec3) -> Mesh {
    mesh.transform(&Affine { linear: Mat3::IDENTITY * size, translation: at })
}

/// A floor with 49 things on it, under a lamp and a bulb.
fn crowd() -> SceneBuilder {
    let gray = Bsdf::Diffuse(Diffuse { reflectance: Rgb::splat(0.6) });
    let bulb = Emitter::Point { position: vec3(-2.5, -2.0, 3.0), intensity: Rgb::splat(15.0) };
    let floor = scaled(&procedural::rectangle(), 5.0, Vec3::ZERO);
    let mut scene = SceneBuilder::new()
        .bsdf("gray", gray)
        .emitter("bulb", bulb)
        .shape("floor", ShapeBuilder::sharing(floor, "gray"));
    for i in 1..OBJECTS as u32 {
        let [x, y] = [(i - 1) % 7, (i - 1) / 7].map(|k| f64::from(k) - 3.0);
        let (mesh, size) = match i % 3 {
            0 => (procedural::cube(), 0.2),
            _ => (procedural::icosphere(1), 0.3),
        };
        let thing = ShapeBuilder::sharing(scaled(&mesh, size, vec3(x, y, 0.4)), "gray");
        scene = scene.shape(format!("thing {i}"), thing);
    }
    let mut lamp = scaled(&procedural::rectangle(), 0.5, vec3(2.0, 2.0, 3.5));
    lamp.flip();
    let glow = Emitter::Area { radiance: Rgb::splat(20.0) };
    let view = [vec3(0.5, -7.0, 4.0), vec3(0.0, -0.3, 0.2), Vec3::Z];
    let filter = Filter::new(FilterKind::TENT).expect("a tent");
    let sensor = Sensor::look_at(view, Lens::with_fov(45.0), [SIDE, SIDE], filter);
    scene
        .shape("lamp", ShapeBuilder::sharing(lamp, "gray").emitter(glow))
        .sensor("camera", sensor.expect("a camera"))
        .max_depth(3)
}

/// The crowd in vacuum.
fn clear() -> Scene {
    crowd().build().expect("a scene")
}

/// The crowd in a box of a medium.
fn hazy(medium: Medium) -> Scene {
    let walls = scaled(&procedural::cube(), 4.5, vec3(0.0, 0.0, 2.0));
    let scene = crowd().medium("haze", medium);
    let scene = scene.shape("walls", ShapeBuilder::interface(walls).interior("haze"));
    scene.build().expect("a scene")
}

fn homogeneous() -> Medium {
    let [sigma_t, albedo] = [0.05, 0.8].map(Rgb::splat);
    let h = Homogeneous::new(sigma_t, albedo, Rgb::ZERO).expect("coefficients");
    Medium::new(h, Phase::Isotropic)
}

/// The same medium as voxels.
fn voxels() -> Medium {
    voxels_of(vec![0.05; 64])
}

/// What fades out before the walls.
fn fading() -> Medium {
    let inside = |i: usize| [i % 4, i / 4 % 4, i / 16].iter().all(|k| (1..3).contains(k));
    voxels_of((0..64).map(|i| if inside(i) { 0.05 } else { 0.0 }).collect())
}

fn voxels_of(density: Vec<f64>) -> Medium {
    let place = Affine { linear: Mat3::IDENTITY * 9.0, translation: vec3(-4.5, -4.5, -2.5) };
    let grid = Grid::new([4; 3], 1, density).and_then(|g| g.with_placement(place));
    let [albedo, emission] = [Rgb::splat(0.8), Rgb::ZERO].map(Volume::Constant);
    let medium = GridMedium::new(grid.expect("a grid"), 1.0, albedo, emission).expect("a medium");
    Medium::new(medium, Phase::Isotropic)
}

fn parameter(effects: Vec<Effect>) -> Vec<Parameter> {
    vec![Parameter { name: "p".into(), value: 0.0, effects }]
}

fn moves(targets: &[&str]) -> Vec<Parameter> {
    let shift = GeometryChange::Translate(vec3(0.8, 0.3, 0.5));
    let effect = |t: &&str| Effect { target: (*t).into(), change: Change::Geometry(shift.clone()) };
    parameter(targets.iter().map(effect).collect())
}

fn rests() -> Vec<Parameter> {
    let change = Change::Geometry(GeometryChange::Translate(Vec3::ZERO));
    parameter(vec![Effect { target: "thing 7".into(), change }])
}

fn paints() -> Vec<Parameter> {
    let op = ValueChange::Add(Rgb::ONE);
    let change = PropertyChange { property: "reflectance".into(), op, voxels: None, texels: None };
    parameter(vec![Effect { target: "gray".into(), change: Change::Property(change) }])
}

fn rendered(scene: &Scene, parameters: &[Parameter], spp: u32) -> Rendering {
    rendered_by(EstimatorKind::default(), scene, parameters, spp)
}

fn rendered_by(
    estimator: EstimatorKind,
    scene: &Scene,
    parameters: &[Parameter],
    spp: u32,
) -> Rendering {
    let settings = Settings { estimator, terms: true, threads: 1, seed: 3, ..Settings::default() };
    let mut session = Session::new(scene, parameters, &settings).expect("a valid scene");
    assert!(session.run(spp, &Unattended));
    let r = session.rendering();
    assert_eq!(r.non_finite, 0);
    r
}

fn term(r: &Rendering, term: Term) -> &Layer {
    let mut terms = r.derivatives[0].terms.iter();
    &terms.find(|(t, _)| *t == term).expect("the term was sampled").1
}

#[test]
fn no_medium() {
    let r = rendered(&clear(), &moves(&["thing 25"]), 4);
    assert!(r.plan.media.is_empty());
    assert_eq!((r.counters.tracking_steps, r.counters.flux_samples), (0, 0));
}

#[test]
fn homogeneous_only() {
    let r = rendered(&hazy(homogeneous()), &[], 4);
    assert_eq!((r.plan.media[0].tracking.as_str(), r.counters.tracking_steps), ("closed form", 0));
    // What the counter counts where it must.
    let r = rendered(&hazy(voxels()), &[], 4);
    assert_eq!(r.plan.media[0].tracking, "delta tracking");
    assert!(r.counters.tracking_steps > PIXELS);
}

/// Nothing flows through walls that a cloud does not reach.
#[test]
fn faded_out() {
    let samples = |medium| {
        let mut scene = hazy(medium);
        scene.shapes.retain(|s| s.boundary.is_some() || s.emitter.is_some());
        let above = Affine { linear: Mat3::IDENTITY, translation: Vec3::Z * 5.0 };
        scene.shapes[0].mesh = Arc::new(scene.shapes[0].mesh.transform(&above));
        rendered_by(EstimatorKind::Radiative, &scene, &moves(&["camera"]), 4).counters.flux_samples
    };
    assert_eq!(samples(fading()), 0);
    assert!(samples(voxels()) > PIXELS / 2);
}

#[test]
fn nothing_moves() {
    let still = rendered(&clear(), &rests(), 4);
    let forward = rendered(&clear(), &[], 4);
    assert!(!still.plan.record && still.plan.edges == [0, 0]);
    assert_eq!(
        Counters { recorded_vertices: 0, ..still.counters },
        forward.counters,
        "only the record is kept"
    );
    let means = |r: &Rendering| r.image.pixels.iter().map(|p| p.mean).collect::<Vec<_>>();
    for (a, b) in means(&still).into_iter().zip(means(&forward)) {
        assert!((a - b).max_abs() < 1e-12);
    }
}

#[test]
fn only_materials_change() {
    let r = rendered(&clear(), &paints(), 4);
    let c = &r.counters;
    assert_eq!((c.boundary_samples, c.border_samples, c.flux_samples), (0, 0, 0));
    assert_eq!(r.plan.edges, [0, 0], "no edge was even looked at");
    assert!(!r.plan.antithetic && r.plan.record);
    assert_eq!(c.differentiated_paths, 4 * PIXELS);
    // Where nothing is reflected now, something may be: a few rays more.
    let forward = rendered(&clear(), &[], 4).counters.rays;
    assert!(c.rays * 10 < forward * 11, "{} rays, {forward} forward", c.rays);
}

#[test]
fn no_parameters() {
    for scene in [clear(), hazy(homogeneous()), hazy(voxels())] {
        let r = rendered(&scene, &[], 4);
        let Counters { paths, rays, tracking_steps, .. } = r.counters;
        assert_eq!(r.counters, Counters { paths, rays, tracking_steps, ..Counters::default() });
        assert!(!r.plan.record && r.plan.edges == [0, 0] && r.derivatives.is_empty());
    }
}

/// Edges that rest count only where what moves can be seen past them.
#[test]
fn one_object_of_fifty_moves() {
    let all: Vec<String> = (1..OBJECTS).map(|i| format!("thing {i}")).collect();
    let all: Vec<&str> = all.iter().map(String::as_str).collect();
    let every = rendered(&clear(), &moves(&all), 4).plan.edges;
    let one = rendered(&clear(), &moves(&["thing 25"]), 4).plan;
    assert_eq!((one.moving_shapes.len(), one.edges[1]), (1, every[1]));
    assert!(one.primary && one.direct && one.indirect);
    assert!(one.edges[0] * 5 < every[0] * 2, "{:?} of {every:?}", one.edges);
}

/// What rests is not looked at by what rests: a camera alone moves only what it sees itself, a bulb
/// only its own shadows.
#[test]
fn a_camera_or_a_bulb_alone() {
    let camera = rendered(&clear(), &moves(&["camera"]), 4).plan;
    assert_eq!((camera.primary, camera.direct, camera.indirect), (true, false, false));
    let bulb = rendered(&clear(), &moves(&["bulb"]), 4).plan;
    assert_eq!((bulb.primary, bulb.direct, bulb.indirect), (false, true, false));
    // Where these terms are sampled for the sake of others, not one sample counts for these two.
    for (target, skipped) in
        [("camera", [Term::Direct, Term::Indirect]), ("bulb", [Term::Primary, Term::Indirect])]
    {
        let company = rendered(&clear(), &in_company(moves(&[target])), 16);
        for t in skipped {
            assert!(term(&company, t).pixels.iter().all(|p| p.mean.is_zero()), "{target} {t:?}");
        }
    }
    // In a haze around both, insides move with them, and everything counts.
    let hazy = rendered(&hazy(homogeneous()), &moves(&["bulb"]), 4).plan;
    assert!(hazy.primary && hazy.direct && hazy.indirect);
}

/// Everything moves with the second parameter, so that no edge is skipped for the first.
fn in_company(mut parameters: Vec<Parameter>) -> Vec<Parameter> {
    let scene = clear();
    let shapes = scene.shapes.iter().filter_map(|s| s.id.as_deref());
    let all: Vec<&str> = shapes.chain(["camera", "bulb"]).collect();
    parameters.extend(moves(&all).into_iter().map(|p| Parameter { name: "all".into(), ..p }));
    parameters
}

/// Nothing that counts is left out: a derivative is the same whether edges are skipped or not.
#[test]
fn skipped_edges_contribute_nothing() {
    let scene = clear();
    for target in ["thing 25", "thing 3", "floor", "lamp"] {
        let alone = rendered(&scene, &moves(&[target]), 512);
        let company = rendered(&scene, &in_company(moves(&[target])), 512);
        let verdict = |layer: &Layer| agreement(layer, &company.derivatives[0].total, None);
        let found = verdict(&alone.derivatives[0].total);
        assert!(found.agrees, "{target}: {found:?}");
        let without = verdict(term(&alone, Term::Interior));
        assert!(!without.agrees, "{target} does not need its boundary: {without:?}");
    }
}

/// The median of the seconds that each task takes, taken in turns.
fn seconds<const N: usize>(tasks: [&dyn Fn(); N]) -> [f64; N] {
    let mut times = [const { Vec::new() }; N];
    for _ in 0..7 {
        for (task, times) in tasks.iter().zip(&mut times) {
            let start = Instant::now();
            task();
            times.push(start.elapsed().as_secs_f64());
        }
    }
    times.map(|mut t| {
        t.sort_by(f64::total_cmp);
        t[t.len() / 2]
    })
}

#[test]
#[ignore = "measures time"]
fn the_time_is_not_spent() {
    let (vacuum, fog, smoke) = (clear(), hazy(homogeneous()), hazy(voxels()));
    let all: Vec<String> = (1..OBJECTS).map(|i| format!("thing {i}")).collect();
    let all: Vec<&str> = all.iter().map(String::as_str).collect();
    let (one, every) = (moves(&["thing 25"]), moves(&all));
    let run = |scene: &Scene, parameters: &[Parameter]| drop(rendered(scene, parameters, 64));
    let (paints, rests) = (paints(), rests());
    let [forward, closed, tracked, still, painted, single, crowded] = seconds([
        &|| run(&vacuum, &[]),
        &|| run(&fog, &[]),
        &|| run(&smoke, &[]),
        &|| run(&vacuum, &rests),
        &|| run(&vacuum, &paints),
        &|| run(&vacuum, &one),
        &|| run(&vacuum, &every),
    ]);
    println!("no medium / voxels            {:.2}", forward / tracked);
    println!("homogeneous / voxels          {:.2}", closed / tracked);
    println!("nothing moves / no parameters {:.2}", still / forward);
    println!("materials / no parameters     {:.2}", painted / forward);
    println!("one moves / no parameters     {:.2}", single / forward);
    println!("one moves / all move          {:.2}", single / crowded);
    // What skipping edges is worth: the variance of one's boundary terms among all edges, over that
    // among those that count.
    let [alone, company] = [one.clone(), in_company(one)].map(|p| rendered(&vacuum, &p, 512));
    for t in [Term::Primary, Term::Direct, Term::Indirect] {
        let [a, b] = [&alone, &company].map(|r| term(r, t).relative_noise(Some(1.0)).powi(2));
        println!("variance of the term {:<9} {:.2}", t.name(), b / a);
    }
    // Generous: machines are busy.
    assert!(still < 1.5 * forward && painted < 3.0 * forward && closed < tracked);
}
