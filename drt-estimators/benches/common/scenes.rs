//! The scenes that are measured, with what moves and changes in them: opaque surfaces in the open and
//! in a room, a body in fog, a coloured blob, a cloud of voxels. The same floor, lights and camera in
//! all of them.

use std::sync::Arc;

use drt_estimators::emitter::Emitter;
use drt_estimators::filter::{Filter, FilterKind};
use drt_estimators::sensor::{Lens, Sensor};
use drt_estimators::surface::{Bsdf, Diffuse};
use drt_estimators::{
    Integrator, MediumBoundary, Named, Scene, SceneEmitter, SceneSensor, Shape, Surrounding,
};
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
fn open(detail: Detail) -> Subject {
    let mut scene = stage();
    scene.shapes.push(shape("knot", knot(detail), 0));
    scene.shapes.push(shape("ball", sized(&procedural::icosphere(3), 0.5, vec3(0.9, 0.8, 0.5)), 0));
    let parameters = vec![
        ("moves", ten(|i| moves(&["knot"], i))),
        ("colour", ten(|i| paints("gray", "reflectance", i))),
    ];
    Subject { name: "open", scene, parameters, vertices_of: "knot" }
}

/// The same between walls: no path escapes.
fn room(detail: Detail) -> Subject {
    let open = open(detail);
    let mut scene = open.scene;
    scene.shapes.push(shape("walls", walls(), 0));
    Subject { name: "room", scene, ..open }
}

/// The knot in a room full of fog.
fn fog(detail: Detail) -> Subject {
    let mut scene = stage();
    scene.shapes.push(shape("knot", knot(detail), 0));
    let fog = homogeneous(Rgb::splat(0.15), Rgb::splat(0.9), 0.3);
    let border = sized(&procedural::cube(), 6.0, vec3(0.0, 0.0, 5.0));
    enclose(&mut scene, "border", border, "fog", fog);
    let parameters = vec![
        ("moves", ten(|i| moves(&["knot"], i))),
        ("extinction", ten(|i| paints("fog", "sigma_t", i))),
    ];
    Subject { name: "fog", scene, parameters, vertices_of: "knot" }
}

/// A bumpy blob that scatters each colour differently.
fn blob(detail: Detail) -> Subject {
    let mut scene = stage();
    let mut mesh = procedural::uv_sphere(match detail {
        Detail::Fine => 50,
        Detail::Coarse => 12,
    });
    for p in &mut mesh.positions {
        *p *= 1.0 + 0.15 * ((5.0 * p.x).sin() + (4.0 * p.y).sin() * (5.0 * p.z).sin());
    }
    mesh.normals = None;
    let milk = homogeneous(Rgb::new(1.0, 2.0, 4.0), Rgb::new(0.95, 0.9, 0.7), 0.2);
    enclose(&mut scene, "blob", sized(&mesh, 1.0, vec3(0.0, 0.0, 1.4)), "milk", milk);
    let parameters = vec![
        ("moves", ten(|i| moves(&["blob"], i))),
        ("extinction", ten(|i| paints("milk", "sigma_t", i))),
    ];
    Subject { name: "blob", scene, parameters, vertices_of: "blob" }
}

/// Voxels of smoke that fade out inside their box, over the knot.
fn cloud(detail: Detail) -> Subject {
    let mut scene = stage();
    scene.shapes.push(shape("knot", knot(detail), 0));
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
    enclose(&mut scene, "border", border, "smoke", smoke);
    let parameters = vec![
        ("moves", ten(|i| moves(&["border", "smoke"], i))),
        ("density", ten(|i| paints("smoke", "sigma_t", i))),
    ];
    Subject { name: "cloud", scene, parameters, vertices_of: "knot" }
}

/// A closed room in which nothing is ever absorbed and no path ends before `max_depth`: a ball under
/// a bulb, in mist where `misty`.
pub(crate) fn furnace(misty: bool, max_depth: u32) -> Subject {
    let mut scene = stage();
    scene.shapes.clear();
    scene.emitters.retain(|e| e.id.as_deref() == Some("bulb"));
    scene.bsdfs[0] = Named::new("white", Bsdf::Diffuse(Diffuse { reflectance: Rgb::ONE }));
    scene.shapes.push(shape("walls", walls(), 0));
    scene.shapes.push(shape("ball", sized(&procedural::icosphere(2), 1.0, vec3(0.0, 0.0, 1.2)), 0));
    scene.integrator =
        Integrator { max_depth: Some(max_depth), rr_depth: u32::MAX, ..Integrator::default() };
    let mut parameters = vec![
        ("moves", ten(|i| moves(&["ball"], i))),
        ("colour", ten(|i| paints("white", "reflectance", i))),
    ];
    if misty {
        scene.media.push(Named::new("mist", homogeneous(Rgb::splat(0.15), Rgb::ONE, 0.0)));
        for s in &mut scene.shapes {
            s.boundary = Some(MediumBoundary { interior: None, exterior: Some(0) });
        }
        parameters.push(("extinction", ten(|i| paints("mist", "sigma_t", i))));
    }
    let name = if misty { "misty" } else { "clear" };
    Subject { name, scene, parameters, vertices_of: "ball" }
}

/// A floor under a lamp and a bulb, and a camera.
fn stage() -> Scene {
    let emitter =
        |id: &str, emitter| Named::new(id, SceneEmitter { emitter, medium: Surrounding::Counted });
    let radiance = Rgb::splat(12.0);
    let (position, intensity) = (vec3(-2.5, -2.0, 4.0), Rgb::splat(20.0));
    let mut lamp = sized(&procedural::rectangle(), 0.7, vec3(2.0, 1.5, 4.5));
    lamp.flip();
    let view = [vec3(0.5, -7.0, 4.0), vec3(0.0, 0.0, 1.0), Vec3::Z];
    let filter = Filter::new(FilterKind::TENT).expect("a tent");
    let sensor = Sensor::look_at(view, Lens::with_fov(40.0), [48, 48], filter).expect("a camera");
    let medium = Surrounding::Counted;
    Scene {
        shapes: vec![
            shape("floor", sized(&procedural::grid(8, 8), 5.0, Vec3::ZERO), 0),
            Shape { emitter: Some(0), ..shape("lamp", lamp, 0) },
        ],
        bsdfs: vec![Named::new("gray", Bsdf::Diffuse(Diffuse { reflectance: Rgb::splat(0.6) }))],
        media: Vec::new(),
        emitters: vec![
            emitter("glow", Emitter::Area { radiance }),
            emitter("bulb", Emitter::Point { position, intensity }),
        ],
        sensors: vec![Named::new("camera", SceneSensor { sensor, medium, sample_count: None })],
        integrator: Integrator { max_depth: Some(6), rr_depth: 4, ..Integrator::default() },
        ..Scene::default()
    }
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

fn shape(id: &str, mesh: Mesh, bsdf: usize) -> Shape {
    Shape { id: Some(id.into()), mesh: Arc::new(mesh), bsdf, boundary: None, emitter: None }
}

fn homogeneous(sigma_t: Rgb, albedo: Rgb, g: f64) -> Medium {
    let coefficients = Homogeneous::new(sigma_t, albedo, Rgb::ZERO).expect("coefficients");
    Medium::new(coefficients, Phase::henyey_greenstein(g).expect("a mean cosine"))
}

/// Puts a medium inside an invisible surface.
fn enclose(scene: &mut Scene, id: &str, mesh: Mesh, medium_id: &str, medium: Medium) {
    scene.media.push(Named::new(medium_id, medium));
    scene.bsdfs.push(Named::new("none", Bsdf::Null));
    let boundary = MediumBoundary { interior: Some(scene.media.len() - 1), exterior: None };
    let bsdf = scene.bsdfs.len() - 1;
    scene.shapes.push(Shape { boundary: Some(boundary), ..shape(id, mesh, bsdf) });
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
