//! The scenes that are measured, with what moves and changes in them: opaque surfaces in the open and
//! in a room, a body in fog, a coloured blob, a cloud of voxels. The same floor, lights and camera in
//! all of them.

use drt_estimators::emitter::Emitter;
use drt_estimators::filter::{Filter, FilterKind};
use drt_estimators::sensor::{Lens, Sensor};
use drt_estimators::surface::{Bsdf, Diffuse};
use drt_estimators::{Integrator, Scene, SceneBuilder, ShapeBuilder};
use drt_geom::{Mesh, procedural};
use drt_math::{Affine, Mat3, Rgb, Rng, ValueChange, Vec3, vec3};
use drt_medium::{Grid, GridMedium, Homogeneous, Medium, Phase, Volume};
use drt_motion::{Change, Effect, GeometryChange, Parameter, PropertyChange};

/// A scene, and ten parameters of each kind that it is measured with.
pub(crate) struct Subject {
    pub(crate) name: &'static str,
    pub(crate) scene: Scene,
    pub(crate) parameters: Vec<(&'static str, Vec<Parameter>)>,
    /// The shape whose vertices all get a gradient.
    pub(crate) vertices_of: &'static str,
}

impl Subject {
    pub(crate) fn with_film(mut self, film: [u32; 2]) -> Self {
        let sensor = &mut self.scene.sensors[0].item.sensor;
        *sensor = sensor.with_film(film).expect("a film");
        self
    }
}

/// Triangles of the bodies.
#[derive(Clone, Copy)]
pub(crate) enum Detail {
    /// Some 10 000.
    Fine,
    /// Some 600, quickly prepared.
    Coarse,
}

pub(crate) fn all(detail: Detail) -> [Subject; 5] {
    [open, room, fog, blob, cloud].map(|subject| subject(detail))
}

/// A knot and a ball over a floor.
fn knot_and_ball(name: &'static str, detail: Detail, more: Option<Mesh>) -> Subject {
    let ball = sized(&procedural::icosphere(3), 0.5, vec3(0.9, 0.8, 0.5));
    let mut scene = stage().shape("knot", gray(knot(detail))).shape("ball", gray(ball));
    if let Some(walls) = more {
        scene = scene.shape("walls", gray(walls));
    }
    let parameters = vec![
        ("moves", ten(|i| moves(&["knot"], i))),
        ("colour", ten(|i| paints("gray", "reflectance", i))),
    ];
    Subject { name, scene: built(scene), parameters, vertices_of: "knot" }
}

/// Both in the open.
fn open(detail: Detail) -> Subject {
    knot_and_ball("open", detail, None)
}

/// Both between walls: no path escapes.
fn room(detail: Detail) -> Subject {
    knot_and_ball("room", detail, Some(walls()))
}

/// The knot in a room full of fog.
fn fog(detail: Detail) -> Subject {
    let border = sized(&procedural::cube(), 6.0, vec3(0.0, 0.0, 5.0));
    let scene = stage()
        .medium("fog", homogeneous(Rgb::splat(0.15), Rgb::splat(0.9), 0.3))
        .shape("knot", gray(knot(detail)))
        .shape("border", ShapeBuilder::interface(border).interior("fog"));
    let parameters = vec![
        ("moves", ten(|i| moves(&["knot"], i))),
        ("extinction", ten(|i| paints("fog", "sigma_t", i))),
    ];
    Subject { name: "fog", scene: built(scene), parameters, vertices_of: "knot" }
}

/// A bumpy blob that scatters each colour differently.
fn blob(detail: Detail) -> Subject {
    let mut mesh = procedural::uv_sphere(match detail {
        Detail::Fine => 50,
        Detail::Coarse => 12,
    });
    for p in &mut mesh.positions {
        *p *= 1.0 + 0.15 * ((5.0 * p.x).sin() + (4.0 * p.y).sin() * (5.0 * p.z).sin());
    }
    mesh.normals = None;
    let milk = homogeneous(Rgb::new(1.0, 2.0, 4.0), Rgb::new(0.95, 0.9, 0.7), 0.2);
    let blob = ShapeBuilder::interface(sized(&mesh, 1.0, vec3(0.0, 0.0, 1.4))).interior("milk");
    let scene = built(stage().medium("milk", milk).shape("blob", blob));
    let parameters = vec![
        ("moves", ten(|i| moves(&["blob"], i))),
        ("extinction", ten(|i| paints("milk", "sigma_t", i))),
    ];
    Subject { name: "blob", scene, parameters, vertices_of: "blob" }
}

/// Voxels of smoke that fade out inside their box, over the knot.
fn cloud(detail: Detail) -> Subject {
    const N: usize = 32;
    let values = (0..N * N * N).map(|v| {
        let centred = |i: usize| 2.0 * (i as f64 + 0.5) / N as f64 - 1.0;
        let [x, y, z] = [v % N, v / N % N, v / N / N].map(centred);
        let wisps = 1.0 + (9.0 * x).sin() * (7.0 * y).sin() * (8.0 * z).sin();
        f64::max(0.0, 0.8 - (x * x + y * y + z * z)) * wisps
    });
    let place = Affine { linear: Mat3::IDENTITY * 3.0, translation: vec3(-1.5, -1.5, 0.6) };
    let density = Grid::new([N; 3], 1, values.collect()).and_then(|g| g.with_placement(place));
    let [albedo, emission] = [Rgb::splat(0.9), Rgb::ZERO].map(Volume::Constant);
    let smoke = GridMedium::new(density.expect("a grid"), 2.5, albedo, emission);
    let smoke = Medium::new(smoke.expect("coefficients"), Phase::Isotropic);
    let border = sized(&procedural::cube(), 1.6, vec3(0.0, 0.0, 2.1));
    let scene = stage()
        .medium("smoke", smoke)
        .shape("knot", gray(knot(detail)))
        .shape("border", ShapeBuilder::interface(border).interior("smoke"));
    let parameters = vec![
        ("moves", ten(|i| moves(&["border", "smoke"], i))),
        ("density", ten(|i| paints("smoke", "sigma_t", i))),
    ];
    Subject { name: "cloud", scene: built(scene), parameters, vertices_of: "knot" }
}

/// A closed room in which nothing is ever absorbed and no path ends before `max_depth`: a ball under
/// a bulb, in mist where `misty`.
pub(crate) fn furnace(misty: bool, max_depth: u32) -> Subject {
    let white = |mesh| {
        let shape = ShapeBuilder::sharing(mesh, "white");
        if misty { shape.exterior("mist") } else { shape }
    };
    let integrator =
        Integrator { max_depth: Some(max_depth), rr_depth: u32::MAX, ..Integrator::default() };
    let ball = sized(&procedural::icosphere(2), 1.0, vec3(0.0, 0.0, 1.2));
    let mut scene = SceneBuilder::new();
    if misty {
        scene = scene.medium("mist", homogeneous(Rgb::splat(0.15), Rgb::ONE, 0.0));
    }
    let scene = scene
        .bsdf("white", Bsdf::Diffuse(Diffuse { reflectance: Rgb::ONE }))
        .shape("walls", white(walls()))
        .shape("ball", white(ball))
        .emitter("bulb", bulb())
        .sensor("camera", camera())
        .integrator(integrator);
    let mut parameters = vec![
        ("moves", ten(|i| moves(&["ball"], i))),
        ("colour", ten(|i| paints("white", "reflectance", i))),
    ];
    if misty {
        parameters.push(("extinction", ten(|i| paints("mist", "sigma_t", i))));
    }
    let name = if misty { "misty" } else { "clear" };
    Subject { name, scene: built(scene), parameters, vertices_of: "ball" }
}

/// A floor under a lamp and a bulb, and a camera.
fn stage() -> SceneBuilder {
    let mut lamp = sized(&procedural::rectangle(), 0.7, vec3(2.0, 1.5, 4.5));
    lamp.flip();
    let glow = Emitter::Area { radiance: Rgb::splat(12.0) };
    SceneBuilder::new()
        .bsdf("gray", Bsdf::Diffuse(Diffuse { reflectance: Rgb::splat(0.6) }))
        .shape("floor", gray(sized(&procedural::grid(8, 8), 5.0, Vec3::ZERO)))
        .shape("lamp", gray(lamp).emitter(glow))
        .emitter("bulb", bulb())
        .sensor("camera", camera())
        .integrator(Integrator { max_depth: Some(6), rr_depth: 4, ..Integrator::default() })
}

fn bulb() -> Emitter {
    Emitter::Point { position: vec3(-2.5, -2.0, 4.0), intensity: Rgb::splat(20.0) }
}

fn camera() -> Sensor {
    let view = [vec3(0.5, -7.0, 4.0), vec3(0.0, 0.0, 1.0), Vec3::Z];
    let filter = Filter::new(FilterKind::TENT).expect("a tent");
    Sensor::look_at(view, Lens::with_fov(40.0), [48, 48], filter).expect("a camera")
}

fn gray(mesh: Mesh) -> ShapeBuilder {
    ShapeBuilder::sharing(mesh, "gray")
}

fn built(scene: SceneBuilder) -> Scene {
    scene.build().expect("a scene")
}

/// Many silhouettes.
fn knot(detail: Detail) -> Mesh {
    let (segments, sides) = match detail {
        Detail::Fine => (320, 16),
        Detail::Coarse => (60, 5),
    };
    let knot = procedural::TorusKnot { segments, sides, ..procedural::TorusKnot::default() };
    sized(&procedural::torus_knot(&knot), 0.9, vec3(-0.2, 0.0, 1.2))
}

/// Around everything, seen from inside.
fn walls() -> Mesh {
    let mut walls = sized(&procedural::cube(), 8.0, vec3(0.0, 0.0, 7.0));
    walls.flip();
    walls
}

fn sized(mesh: &Mesh, size: f64, at: Vec3) -> Mesh {
    mesh.transform(&Affine { linear: Mat3::IDENTITY * size, translation: at })
}

fn homogeneous(sigma_t: Rgb, albedo: Rgb, g: f64) -> Medium {
    let coefficients = Homogeneous::new(sigma_t, albedo, Rgb::ZERO).expect("coefficients");
    Medium::new(coefficients, Phase::henyey_greenstein(g).expect("a mean cosine"))
}

fn ten(make: impl Fn(u32) -> Parameter) -> Vec<Parameter> {
    (0..10).map(make).collect()
}

/// Shifts and turns, no two alike.
fn moves(targets: &[&str], i: u32) -> Parameter {
    let v = unlike(i);
    let change = match i % 2 {
        0 => GeometryChange::Translate(v),
        _ => GeometryChange::Rotate { axis: v, pivot: vec3(0.0, 0.0, 1.0) },
    };
    let effect =
        |t: &&str| Effect { target: (*t).into(), change: Change::Geometry(change.clone()) };
    parameter(i, targets.iter().map(effect).collect())
}

fn paints(target: &str, property: &str, i: u32) -> Parameter {
    let v = unlike(i);
    let op = ValueChange::Add(Rgb::new(v.x, v.y, v.z));
    let change = Change::Property(PropertyChange {
        property: property.into(),
        op,
        voxels: None,
        texels: None,
    });
    parameter(i, vec![Effect { target: target.into(), change }])
}

fn unlike(i: u32) -> Vec3 {
    let mut rng = Rng::new(1, 0, i);
    vec3(rng.next_f64(), rng.next_f64(), rng.next_f64()) * 2.0 - Vec3::splat(1.0)
}

fn parameter(i: u32, effects: Vec<Effect>) -> Parameter {
    Parameter { name: format!("p{i}"), value: 0.0, effects }
}
