//! Stages with media that are bent, squeezed and pushed into.

use std::sync::Arc;

use drt_estimators::emitter::Emitter;
use drt_estimators::surface::{Bsdf, RoughDielectric};
use drt_estimators::{InteriorMotion, Scene};
use drt_geom::Mesh;
use drt_geom::procedural::{bumpy_sphere, cube, icosphere};
use drt_math::{Affine, Mat3, Rgb, Vec3, vec3};
use drt_medium::{Grid, GridMedium, Homogeneous, Layout, Phase, Volume};
use drt_motion::{Change, Effect, GeometryChange};

use super::effects::{translate, turn};
use super::set::{at, block, diffuse};
use super::{Cell, Set, Stage};
use crate::Result;
use crate::motion::moves;

pub(super) fn fog(sigma_t: [f64; 3], albedo: [f64; 3]) -> Result<Homogeneous> {
    Ok(Homogeneous::new(sigma_t.into(), albedo.into(), Rgb::ZERO)?)
}

pub(super) fn forward(g: f64) -> Result<Phase> {
    Ok(Phase::henyey_greenstein(g)?)
}

pub(super) fn sun() -> Emitter {
    Emitter::Directional { direction: vec3(-0.7, -1.0, 0.6), irradiance: Rgb::new(4.0, 5.0, 6.0) }
}

pub(super) fn sky() -> Emitter {
    Emitter::Constant { radiance: Rgb::new(0.8, 0.9, 1.0) }
}

pub(super) fn glass() -> Bsdf {
    Bsdf::RoughDielectric(RoughDielectric { alpha: 0.4, eta: 1.3, ..RoughDielectric::default() })
}

/// Moves each vertex of a shape by a velocity that depends on where it is.
pub(super) fn flows(scene: &Scene, shape: &str, velocity: impl Fn(Vec3) -> Vec3) -> Effect {
    let mut named = scene.shapes.iter().filter(|s| s.id.as_deref() == Some(shape));
    let positions = named.next().map_or(&[][..], |s| &s.mesh.positions);
    let velocities = positions.iter().map(|p| velocity(*p)).collect();
    moves(shape, GeometryChange::VertexVelocity(velocities))
}

/// The insides of the first media by one kind.
pub(super) fn inside(stage: Stage, media: usize, kind: &InteriorMotion) -> Stage {
    Stage { insides: (0..media).map(|m| (m, kind.clone())).collect(), ..stage }
}

/// A bar of wax without a surface of its own.
fn bar(name: &'static str) -> Result<Stage> {
    let scene = Set::new(vec3(0.3, 1.6, -2.4), Vec3::ZERO, 38.0, 4)?
        .medium("wax", fog([2.5, 2.0, 1.5], [0.9, 0.8, 0.6])?, forward(0.3)?)
        .interface("bar", block([4, 1, 2], vec3(0.9, 0.25, 0.5)), "wax", None)
        .light("sun", sun())
        .scene;
    let bends = |p: Vec3| vec3(-1.6 * p.x * p.y, 1.6 * p.x * p.x, 0.0);
    let twists = |p: Vec3| vec3(0.0, -p.z, p.y) * (2.0 * p.x);
    let tapers = |p: Vec3| vec3(0.6 * p.x, p.y * p.x, p.z * p.x);
    let end = scene.shapes[0].mesh.positions.iter().position(|p| p.x > 0.8 && p.y > 0.2);
    let index = end.ok_or("a bar has an end")? as u32;
    let corner = GeometryChange::Vertex { index, direction: vec3(1.5, 1.0, -0.8) };
    let cells = vec![
        Cell::new("bar bends", [flows(&scene, "bar", bends)]).representative(),
        Cell::new("bar twists", [flows(&scene, "bar", twists)]),
        Cell::new("bar stretched to a wedge", [flows(&scene, "bar", tapers)]),
        Cell::new("bar's corner", [moves("bar", corner)]),
    ];
    Ok(Stage::new(name, scene, cells))
}

/// A bar bent and twisted, as the plan chooses: by tetrahedra.
///
/// # Errors
/// When the library rejects the scene.
pub fn wax() -> Result<Stage> {
    bar("wax")
}

/// The bar with an inside by mean value coordinates, in other places of the parameters.
///
/// # Errors
/// When the library rejects the scene.
pub fn mean_value_wax() -> Result<Stage> {
    let mut stage = inside(bar("wax by mean values")?, 1, &InteriorMotion::MeanValue);
    stage.cells.truncate(2);
    stage.cells[1] = stage.cells[1].clone().at(0.2);
    Ok(stage)
}

/// The bar with an inside at rest.
///
/// # Errors
/// When the library rejects the scene.
pub fn still_wax() -> Result<Stage> {
    let mut stage = inside(bar("wax at rest")?, 1, &InteriorMotion::Static);
    stage.cells.truncate(3);
    stage.samples *= 2;
    Ok(stage)
}

/// A solid in jelly, which gives way.
///
/// # Errors
/// When the library rejects the scene.
pub fn jelly() -> Result<Stage> {
    let scene = Set::new(vec3(0.3, 1.7, -2.6), Vec3::ZERO, 36.0, 4)?
        .medium("jelly", fog([0.8, 1.2, 1.6], [0.9, 0.8, 0.7])?, forward(0.4)?)
        .interface("block", block([2, 1, 2], vec3(0.8, 0.4, 0.8)), "jelly", None)
        .shape(
            "body",
            at(&cube(), vec3(0.3, 0.1, 0.25), vec3(0.1, 0.1, 0.0)),
            diffuse([0.6, 0.4, 0.3]),
        )
        .light("sky", sky())
        .light("sun", sun())
        .scene;
    let below = |p: Vec3| vec3(0.4 * p.x, -0.6, 0.3 * p.z) * f64::from(p.y > 0.0);
    let shakes = |p: Vec3| vec3(0.8, 0.1, 0.3) * (p.y + 0.4);
    let cells = vec![
        Cell::new(
            "body pushed in",
            [translate("body", vec3(0.0, -0.5, 0.1)), flows(&scene, "block", below)],
        )
        .representative(),
        Cell::new("jelly shakes", [flows(&scene, "block", shakes)]),
        Cell::new("body slides", [translate("body", vec3(0.8, 0.1, -0.4))]),
    ];
    Ok(inside(Stage::new("jelly", scene, cells), 1, &InteriorMotion::Tetrahedral(None)))
}

/// Refractive bodies that move as a whole, with the one field that fits.
///
/// # Errors
/// When the library rejects the scene.
pub fn sheared_glass() -> Result<Stage> {
    let scene = Set::new(vec3(0.3, 0.4, -2.6), Vec3::ZERO, 34.0, 4)?
        .medium("syrup", fog([0.6, 1.0, 1.5], [0.9, 0.8, 0.7])?, forward(0.4)?)
        .filled(
            "body",
            at(&bumpy_sphere(1, 0.4, 3.0), Vec3::splat(0.7), Vec3::ZERO),
            glass(),
            "syrup",
            None,
        )
        .light("sky", sky())
        .light("sun", sun())
        .scene;
    let linear = Mat3::from_rows(vec3(0.3, 0.8, 0.0), vec3(0.0, -0.3, 0.4), vec3(0.3, 0.0, 0.2));
    let shear = GeometryChange::Matrix(Affine { linear, translation: vec3(0.3, 0.1, 0.0) });
    let cells = vec![
        Cell::new("body sheared", [moves("body", shear)]).representative(),
        Cell::new("body turns", [turn("body", vec3(0.2, 1.0, 0.3), vec3(1.2, 0.0, 0.6))]),
    ];
    Ok(inside(Stage::new("sheared glass", scene, cells), 1, &InteriorMotion::Affine))
}

/// A ball of one medium in a box of another.
///
/// # Errors
/// When the library rejects the scene.
pub fn nested() -> Result<Stage> {
    let ball = at(&icosphere(1), Vec3::splat(0.5), vec3(0.2, 0.1, -0.1));
    let scene = Set::new(vec3(0.4, 0.7, -3.6), Vec3::ZERO, 36.0, 3)?
        .medium("thin", fog([0.5, 0.7, 0.9], [0.9, 0.8, 0.6])?, forward(0.3)?)
        .medium("thick", fog([4.0, 2.0, 3.0], [0.6, 0.9, 0.8])?, Phase::Isotropic)
        .interface("box", cube(), "thin", None)
        .interface("ball", ball, "thick", Some("thin"))
        .light("sun", sun())
        .scene;
    let squeezed = |p: Vec3| vec3(0.3 * p.y, 0.8 * p.y * p.z, 0.4 * p.x);
    let bulges = |p: Vec3| vec3(2.0 * p.x * p.y, 1.5 * p.x, 0.8 * p.z);
    let moving = translate("ball", vec3(0.7, 0.3, -0.4));
    let cells = vec![
        Cell::new("ball moves", [moving.clone()]).representative(),
        Cell::new("ball moves, box squeezed", [moving, flows(&scene, "box", squeezed)]),
        Cell::new("both deform", [flows(&scene, "ball", bulges), flows(&scene, "box", squeezed)]),
    ];
    Ok(inside(Stage::new("nested", scene, cells), 2, &InteriorMotion::Blend))
}

/// Two media that touch, by mean value coordinates.
///
/// # Errors
/// When the library rejects the scene.
pub fn touching() -> Result<Stage> {
    let mut stage = inside(super::media::layers()?, 2, &InteriorMotion::MeanValue);
    stage.name = "touching";
    // Corners at exactly the same places: mean value coordinates need closed surfaces.
    for shape in &mut stage.scene.shapes {
        let round = |x: f64| (x * 1e6).round() * 1e-6 + 0.0;
        for p in &mut Arc::make_mut(&mut shape.mesh).positions {
            *p = vec3(round(p.x), round(p.y), round(p.z));
        }
    }
    let scene = &stage.scene;
    let flow = |p: Vec3| vec3(0.6 * p.y, 0.5 * p.x * p.x, 0.3) * (1.0 + p.y);
    let flowing = ["low", "middle", "high"].map(|shape| flows(scene, shape, flow));
    // What the lower one has below stays; what both share moves with neither.
    let sides = ["low", "high"].map(|shape| {
        flows(scene, shape, |p| vec3(p.y * 0.8, 0.0, -p.y * 0.5) * f64::from(p.y.abs() > 1e-9))
    });
    stage.cells = vec![
        Cell::new("both flow", flowing).representative(),
        Cell::new("outer sides shift", sides),
    ];
    Ok(stage)
}

/// A ball in fog, deformed vertex by vertex.
///
/// # Errors
/// When the library rejects the scene.
pub fn pulse() -> Result<Stage> {
    let place = vec3(0.2, 0.1, 0.1);
    let scene = Set::new(vec3(0.3, 0.3, -3.4), vec3(0.1, 0.0, 0.0), 32.0, 3)?
        .medium("fog", fog([0.5, 0.7, 0.9], [0.9, 0.8, 0.7])?, forward(0.3)?)
        .interface("border", cube(), "fog", None)
        .shape("ball", at(&icosphere(1), Vec3::splat(0.4), place), diffuse([0.5, 0.6, 0.3]))
        .light("sun", sun())
        .scene;
    let pulses = |p: Vec3| (p - place) * (2.0 + 3.0 * p.x);
    let sags = |p: Vec3| vec3(0.0, -0.8 * (1.0 - p.x * p.x), 0.2);
    let corner = GeometryChange::Vertex { index: 7, direction: vec3(1.0, -1.5, -1.0) };
    let cells = vec![
        Cell::new("ball pulses", [flows(&scene, "ball", pulses)]).representative(),
        Cell::new("ball's corner", [moves("ball", corner)]),
        Cell::new("ball moves", [translate("ball", vec3(0.8, 0.4, -0.3))]),
        Cell::new("border sags", [flows(&scene, "border", sags)]),
    ];
    Ok(inside(Stage::new("pulse", scene, cells), 1, &InteriorMotion::Tetrahedral(None)))
}

/// A camera in fog that flows.
///
/// # Errors
/// When the library rejects the scene.
pub fn immersed() -> Result<Stage> {
    let ball = at(&icosphere(1), Vec3::splat(0.35), vec3(0.2, -0.1, 0.4));
    let scene = Set::new(vec3(0.1, 0.05, -0.7), vec3(0.1, -0.05, 1.0), 65.0, 3)?
        .medium("fog", fog([0.5, 0.7, 0.9], [0.9, 0.8, 0.7])?, forward(0.3)?)
        .interface("border", block([2, 2, 2], Vec3::splat(1.0)), "fog", None)
        .shape("ball", ball, diffuse([0.5, 0.6, 0.3]))
        .light("sun", sun())
        .scene;
    let flow = |p: Vec3| vec3(0.5 * p.y * p.z, 0.8 * p.x, 0.6 * p.y + 0.3);
    let camera = translate("camera", vec3(0.6, 0.2, -0.3));
    let cells = vec![
        Cell::new("border flows", [flows(&scene, "border", flow)]).representative(),
        Cell::new("camera moves, border flows", [camera, flows(&scene, "border", flow)]),
        Cell::new("ball flows", [flows(&scene, "ball", flow)]),
    ];
    Ok(Stage { samples: 4096, ..Stage::new("immersed", scene, cells) })
}

/// A point light in a glowing medium that absorbs: were it to scatter, the image itself would have no
/// variance (theory sheet §14.2).
///
/// # Errors
/// When the library rejects the scene.
pub fn lantern() -> Result<Stage> {
    let light =
        Emitter::Point { position: vec3(0.1, 0.1, 0.1), intensity: Rgb::new(3.0, 4.0, 5.0) };
    let glow = Rgb::new(0.6, 0.8, 0.4);
    let ink = Homogeneous::new(Rgb::new(0.8, 1.2, 1.6), Rgb::ZERO, glow)?;
    let back = at(&cube(), vec3(2.0, 2.0, 0.1), vec3(0.0, 0.0, 1.3));
    let scene = Set::new(vec3(0.3, 0.8, -2.8), vec3(0.0, 0.0, 0.3), 44.0, 3)?
        .medium("ink", ink, Phase::Isotropic)
        .interface(
            "shade",
            at(&bumpy_sphere(1, 0.3, 3.0), Vec3::splat(0.7), Vec3::ZERO),
            "ink",
            None,
        )
        .shape("wall", back, diffuse([0.7, 0.5, 0.6]))
        .light("light", light)
        .scene;
    let bulges = |p: Vec3| p * (1.0 + p.x) + vec3(0.0, p.z, 0.3 * p.x);
    let cells = vec![
        Cell::new("shade bulges", [flows(&scene, "shade", bulges)]).representative(),
        Cell::new(
            "light moves in it",
            [flows(&scene, "shade", bulges), translate("light", vec3(0.3, -0.4, 0.5))],
        ),
    ];
    Ok(Stage::new("lantern", scene, cells))
}

/// Smoke on a grid, in a box that deforms: it stays, turns, or glows.
///
/// # Errors
/// When the library rejects the scene.
pub fn stirred_smoke() -> Result<Stage> {
    let size = 5_usize;
    let values = (0..size.pow(3)).map(|i| 1.0 + 0.9 * (2.3 * i as f64).sin()).collect();
    let place = Affine { linear: Mat3::diagonal(Vec3::splat(2.4)), translation: Vec3::splat(-1.2) };
    let grid = Grid::new([size; 3], 1, values)?.with_layout(Layout::NodeCentred);
    let [albedo, glow] = [[0.9, 0.7, 0.5], [0.3, 0.2, 0.1]].map(|c| Volume::Constant(c.into()));
    let smoke = GridMedium::new(grid.with_placement(place)?, 1.5, albedo, glow)?;
    let scene = Set::new(vec3(0.3, 0.95, -3.0), Vec3::ZERO, 36.0, 3)?
        .medium("smoke", smoke, forward(-0.2)?)
        .interface("box", block([2, 1, 2], Vec3::splat(0.8)), "smoke", None)
        .light("sun", sun())
        .scene;
    let flow = |p: Vec3| vec3(0.5 * p.x * p.y, 0.9 * p.x, 0.8 * p.z * p.z);
    let smoke_turns = turn("smoke", vec3(0.2, 1.0, 0.3), Vec3::ZERO);
    let ride = Effect { target: "smoke".into(), change: Change::Follow("box".into()) };
    let cells = vec![
        Cell::new("border flows", [flows(&scene, "box", flow)]).representative(),
        Cell::new("border flows, grid turns", [flows(&scene, "box", flow), smoke_turns]),
        Cell::new("border moves with its grid", [translate("box", vec3(0.5, 0.3, -0.4)), ride]),
    ];
    Ok(Stage::new("stirred smoke", scene, cells))
}

/// The smoke with an inside at rest, whether its grid rests or not.
///
/// # Errors
/// When the library rejects the scene.
pub fn still_smoke() -> Result<Stage> {
    let mut stage = inside(stirred_smoke()?, 1, &InteriorMotion::Static);
    stage.name = "smoke at rest";
    stage.cells.truncate(2);
    Ok(stage)
}

/// A body of more triangles than are blended one by one.
fn fine(name: &'static str, surface: Bsdf) -> Result<Stage> {
    let mesh: Mesh = at(&bumpy_sphere(3, 0.2, 3.0), Vec3::splat(0.7), Vec3::ZERO);
    let scene = Set::new(vec3(0.3, 0.6, -2.6), Vec3::ZERO, 34.0, 4)?
        .medium("milk", fog([2.0, 1.5, 1.0], [0.95, 0.8, 0.6])?, forward(0.4)?)
        .filled("body", mesh, surface, "milk", None)
        .light("sky", sky())
        .light("sun", sun())
        .scene;
    let swells = |p: Vec3| vec3(p.x + p.y * p.z, 0.8 * p.y, p.x * p.x + 0.3);
    let twists = |p: Vec3| vec3(-p.z, 0.0, p.x) * (2.0 * p.y);
    let cells = vec![
        Cell::new("body swells", [flows(&scene, "body", swells)]).representative(),
        Cell::new("body twists", [flows(&scene, "body", twists)]),
    ];
    Ok(Stage::new(name, scene, cells))
}

/// A body of 1280 triangles without a surface of its own.
///
/// # Errors
/// When the library rejects the scene.
pub fn fine_milk() -> Result<Stage> {
    fine("fine milk", Bsdf::Null)
}

/// A refractive body of 1280 triangles.
///
/// # Errors
/// When the library rejects the scene.
pub fn fine_glass() -> Result<Stage> {
    fine("fine glass", glass())
}
