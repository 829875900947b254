//! Stages with participating media.

use std::f64::consts::{FRAC_PI_2, PI};

use drt_estimators::InteriorMotion;
use drt_estimators::emitter::Emitter;
use drt_estimators::surface::{Bsdf, Phong, RoughDielectric};
use drt_geom::Mesh;
use drt_geom::procedural::{bumpy_sphere, cube, grid, icosphere, rectangle};
use drt_math::{Affine, Mat3, Rgb, Vec3, vec3};
use drt_medium::{Grid, GridMedium, Homogeneous, Layout, Phase, Volume};
use drt_motion::{Change, Effect, GeometryChange, PropertyChange, ValueChange};

use super::effects::{add, grow, raise, translate, turn};
use super::set::{at, diffuse, inside_out, placed};
use super::{Cell, Set, Stage};
use crate::Result;
use crate::motion::moves;

fn fog(sigma_t: [f64; 3], albedo: [f64; 3]) -> Result<Homogeneous> {
    Ok(Homogeneous::new(sigma_t.into(), albedo.into(), Rgb::ZERO)?)
}

fn forward(g: f64) -> Result<Phase> {
    Ok(Phase::henyey_greenstein(g)?)
}

/// A rectangle that shines down.
fn ceiling_lamp(half_width: f64, place: Vec3) -> Mesh {
    placed(&rectangle(), vec3(half_width, half_width, 1.0), Vec3::X, FRAC_PI_2, place)
}

/// A body that moves through a box of fog with the camera inside: the fog's inside stays static.
///
/// # Errors
/// When the library rejects the scene.
pub fn fog_box() -> Result<Stage> {
    let body = placed(&cube(), Vec3::splat(0.25), vec3(1.0, 2.0, 0.5), 0.6, vec3(0.2, -0.1, 0.4));
    let scene = Set::new(vec3(0.1, 0.05, -0.85), vec3(0.1, -0.05, 1.0), 65.0, 3)?
        .medium("fog", fog([0.5, 0.7, 0.9], [0.9, 0.8, 0.7])?, forward(0.3)?)
        .interface("border", cube(), "fog", None)
        .shape("body", body, diffuse([0.5, 0.6, 0.3]))
        .lamp("lamp", ceiling_lamp(0.6, vec3(-0.2, 1.4, 0.3)), Rgb::new(5.0, 6.0, 7.0))
        .scene;
    let cells = vec![
        Cell::new("body moves", [translate("body", vec3(0.8, 0.5, -0.2))]).representative(),
        Cell::new("body turns", [turn("body", vec3(0.3, 1.0, 0.2), vec3(0.2, -0.1, 0.4))]),
        Cell::new("border grows", [grow("border", vec3(0.5, 1.0, 0.7), Vec3::ZERO)]),
        Cell::new("camera moves", [translate("camera", vec3(0.6, 0.2, -0.3))]),
        Cell::new("lamp moves", [translate("lamp", vec3(0.7, 0.4, 0.3))]),
        Cell::new("extinction", [add("fog", "sigma_t", [1.0, 0.5, 0.7])])
            .step(0.25)
            .samples(512)
            .representative(),
    ];
    // The turning body's boundary is a third of its derivative, to be told apart from much noise.
    Ok(Stage { samples: 8192, ..Stage::new("fog box", scene, cells) })
}

/// A bumpy translucent blob without a surface of its own.
///
/// # Errors
/// When the library rejects the scene.
pub fn blob() -> Result<Stage> {
    let blob = at(&bumpy_sphere(2, 0.3, 3.0), Vec3::splat(0.8), Vec3::ZERO);
    let breathe = blob.positions.iter().map(|p| *p * (1.0 + 2.0 * p.x * p.y) + vec3(0.0, p.z, 0.0));
    let breathe = GeometryChange::VertexVelocity(breathe.collect());
    let corner = GeometryChange::Vertex { index: 20, direction: blob.positions[20] * 3.0 };
    let scene = Set::new(vec3(0.4, 0.5, -2.6), Vec3::ZERO, 36.0, 4)?
        .medium("milk", fog([4.0, 2.5, 1.5], [0.95, 0.8, 0.6])?, forward(0.5)?)
        .interface("blob", blob, "milk", None)
        .lamp("lamp", ceiling_lamp(0.8, vec3(-0.4, 2.0, -0.3)), Rgb::new(8.0, 7.0, 6.0))
        .scene;
    let cells = vec![
        Cell::new("blob moves", [translate("blob", vec3(0.7, 0.3, -0.4))]),
        Cell::new("blob breathes", [moves("blob", breathe)]).representative(),
        Cell::new("blob's corner", [moves("blob", corner)]),
        Cell::new("extinction", [add("milk", "sigma_t", [3.0, 2.0, -1.0])]).step(0.25),
        Cell::new("albedo", [add("milk", "albedo", [-0.5, 0.5, 1.0])]).step(0.1).samples(512),
        Cell::new("asymmetry", [raise("milk", "g", 1.0)]).step(0.1).samples(512).representative(),
        Cell::new("extinction of a thick one", [add("milk", "sigma_t", [1.0; 3])])
            .step(0.25)
            .at(1.5),
    ];
    Ok(Stage::new("blob", scene, cells))
}

/// The blob with an inside that stays where it is while its border moves: all of the rest is flux.
///
/// # Errors
/// When the library rejects the scene.
pub fn still_blob() -> Result<Stage> {
    let mut stage = blob()?;
    stage.name = "still blob";
    stage.insides = vec![(0, InteriorMotion::Static)];
    stage.cells.retain(|c| ["blob moves", "blob breathes"].contains(&&*c.parameter.name));
    Ok(stage)
}

/// The shade of a cloud out of view, on a floor and in a glossy wall, with a post under it.
///
/// # Errors
/// When the library rejects the scene.
pub fn shade() -> Result<Stage> {
    let centre = vec3(-0.2, 0.7, 0.2);
    let cloud = placed(&cube(), vec3(0.35, 0.25, 0.3), vec3(0.5, 1.0, 0.2), 0.5, centre);
    let floor = placed(&grid(3, 3), vec3(1.6, 1.6, 1.0), Vec3::X, -FRAC_PI_2, vec3(0.0, -1.0, 0.0));
    let wall = placed(&rectangle(), vec3(1.6, 1.2, 1.0), Vec3::Y, PI, vec3(0.0, 0.0, 1.3));
    let post = at(&cube(), vec3(0.1, 0.4, 0.1), vec3(0.3, -0.6, 0.1));
    let polished = Bsdf::Phong(Phong {
        reflectance: Rgb::splat(0.3),
        specular_reflectance: Rgb::splat(0.5),
        exponent: 40.0,
    });
    let scene = Set::new(vec3(0.3, 0.2, -2.6), vec3(0.0, -0.9, 0.3), 36.0, 4)?
        .medium("water", fog([6.0, 5.0, 4.0], [0.95, 0.8, 0.6])?, forward(0.3)?)
        .interface("cloud", cloud, "water", None)
        .shape("floor", floor, diffuse([0.7, 0.6, 0.5]))
        .shape("wall", wall, polished)
        .shape("post", post, diffuse([0.5, 0.6, 0.7]))
        .lamp("lamp", ceiling_lamp(0.7, vec3(0.4, 2.0, -0.2)), Rgb::new(8.0, 7.0, 6.0))
        .scene;
    let cells = vec![
        Cell::new("cloud moves", [translate("cloud", vec3(0.7, 0.3, -0.4))]).representative(),
        Cell::new("cloud turns", [turn("cloud", vec3(0.3, 1.0, 0.5), centre)]),
        Cell::new("cloud grows", [grow("cloud", vec3(0.6, 0.3, 0.8), centre)]),
        Cell::new("post moves", [translate("post", vec3(0.3, 0.2, -0.2))]),
    ];
    Ok(Stage::new("shade", scene, cells))
}

/// Smoke on a grid, in sunlight.
///
/// # Errors
/// When the library rejects the scene.
pub fn smoke() -> Result<Stage> {
    let size = 5_usize;
    let puff = |i: usize| {
        let [x, y, z] = [i % size, i / size % size, i / size / size].map(|k| k as f64 / 4.0 - 0.5);
        f64::max(1.0 - 3.0 * (x * x + y * y + z * z) + 0.5 * (9.0 * x + 5.0 * y * z).sin(), 0.0)
    };
    let values = |scale: f64| (0..size.pow(3)).map(|i| scale * puff(i)).collect();
    // Larger than its box, which cuts it off wherever it moves.
    let place = Affine { linear: Mat3::diagonal(Vec3::splat(2.0)), translation: Vec3::splat(-1.0) };
    let grid = |scale: f64| -> Result<Grid> {
        let grid = Grid::new([size; 3], 1, values(scale))?.with_layout(Layout::NodeCentred);
        Ok(grid.with_placement(place)?)
    };
    let albedo = Volume::Constant(Rgb::new(0.9, 0.7, 0.5));
    let glow = Volume::Grid(grid(0.3)?);
    let sun = Emitter::Directional {
        direction: vec3(-0.7, -1.0, 0.4),
        irradiance: Rgb::new(4.0, 5.0, 6.0),
    };
    let scene = Set::new(vec3(0.3, 0.4, -2.6), Vec3::ZERO, 36.0, 3)?
        .medium("smoke", GridMedium::new(grid(1.0)?, 2.5, albedo, glow)?, forward(-0.2)?)
        .interface("box", at(&cube(), Vec3::splat(0.8), Vec3::ZERO), "smoke", None)
        .light("sun", sun)
        .scene;
    let voxel = PropertyChange {
        property: "sigma_t".into(),
        op: ValueChange::Add(Rgb::splat(5.0)),
        voxels: Some([2, 1, 2]),
        texels: None,
    };
    let voxel = Effect { target: "smoke".into(), change: Change::Property(voxel) };
    let ride = Effect { target: "smoke".into(), change: Change::Follow("box".into()) };
    let cells = vec![
        Cell::new("grid moves", [translate("smoke", vec3(0.7, 0.3, -0.4))]),
        Cell::new("box moves, grid rides", [turn("box", vec3(0.2, 1.0, 0.3), Vec3::ZERO), ride])
            .representative(),
        Cell::new("box shrinks", [grow("box", vec3(-0.7, -0.5, -1.0), Vec3::ZERO)]),
        Cell::new("a voxel", [voxel]).step(0.25).representative(),
        Cell::new("extinction", [raise("smoke", "sigma_t", 1.0)]).step(0.25),
        Cell::new("albedo", [add("smoke", "albedo", [0.3, 0.5, 1.0])]).step(0.1).samples(512),
        Cell::new("emission", [add("smoke", "emission", [0.3, 0.5, 1.0])]).step(0.1).samples(512),
        Cell::new("sun turns", [turn("sun", vec3(0.5, 0.1, 1.0), Vec3::ZERO)]),
    ];
    Ok(Stage::new("smoke", scene, cells))
}

/// A rough glass ball filled with a medium.
///
/// # Errors
/// When the library rejects the scene.
pub fn glass() -> Result<Stage> {
    glass_body("glass ball", at(&icosphere(2), Vec3::splat(0.7), Vec3::ZERO))
}

/// A ball of syrup in rough glass, half sunk in a wall that parts what is inside and outside of it.
///
/// # Errors
/// When the library rejects the scene.
pub fn sunk_glass() -> Result<Stage> {
    let glass = RoughDielectric { alpha: 0.5, eta: 1.1, ..RoughDielectric::default() };
    let wall = placed(&rectangle(), vec3(2.0, 2.0, 1.0), Vec3::X, PI, vec3(0.0, 0.0, 0.2));
    let ball = at(&icosphere(2), Vec3::splat(0.7), Vec3::ZERO);
    let scene = Set::new(vec3(0.6, 0.9, -2.6), Vec3::ZERO, 34.0, 3)?
        .medium("syrup", fog([0.6, 1.0, 1.5], [0.9, 0.8, 0.7])?, forward(0.4)?)
        .filled("ball", ball, Bsdf::RoughDielectric(glass), "syrup", None)
        .shape("wall", wall, diffuse([0.6, 0.5, 0.4]))
        .light("sky", Emitter::Constant { radiance: Rgb::new(0.8, 0.9, 1.0) })
        .scene;
    let cells = vec![
        Cell::new("ball moves", [translate("ball", vec3(0.3, 0.4, -0.7))]).representative(),
        Cell::new("wall moves", [translate("wall", vec3(0.0, 0.2, 0.6))]),
    ];
    Ok(Stage::new("sunk glass", scene, cells))
}

/// A ball half sunk in a floor in fog.
///
/// # Errors
/// When the library rejects the scene.
pub fn sunk_in_fog() -> Result<Stage> {
    let place = vec3(0.1, -0.4, 0.3);
    let floor = placed(&grid(2, 2), vec3(1.4, 1.4, 1.0), Vec3::X, -FRAC_PI_2, vec3(0.0, -0.5, 0.0));
    let lamp = ceiling_lamp(0.5, vec3(-0.3, 0.8, 0.3));
    let scene = Set::new(vec3(0.2, 0.4, -0.9), vec3(0.1, -0.4, 0.3), 60.0, 3)?
        .medium("fog", fog([0.5, 0.7, 0.9], [0.9, 0.8, 0.7])?, forward(0.3)?)
        .interface("border", at(&cube(), Vec3::splat(1.2), Vec3::ZERO), "fog", None)
        .shape("floor", floor, diffuse([0.7, 0.6, 0.5]))
        .shape("ball", at(&icosphere(2), Vec3::splat(0.35), place), diffuse([0.3, 0.5, 0.8]))
        .lamp("lamp", lamp, Rgb::new(5.0, 6.0, 7.0))
        .scene;
    let cells = vec![
        Cell::new("ball rises", [translate("ball", Vec3::Y)]).representative(),
        Cell::new("ball slides", [translate("ball", vec3(0.8, 0.0, 0.5))]),
        Cell::new("floor tilts", [turn("floor", vec3(1.0, 0.0, 0.4), place)]),
    ];
    Ok(Stage::new("sunk in fog", scene, cells))
}

/// A lamp half sunk in a black floor, that lights fog.
///
/// # Errors
/// When the library rejects the scene.
pub fn sunk_lamp() -> Result<Stage> {
    let floor = placed(&grid(2, 2), vec3(1.4, 1.4, 1.0), Vec3::X, -FRAC_PI_2, vec3(0.0, -0.5, 0.0));
    let place = vec3(-0.4, -0.5, 0.4);
    let lamp = placed(&rectangle(), vec3(0.3, 0.25, 1.0), Vec3::Y, FRAC_PI_2, place);
    let scene = Set::new(vec3(0.2, 0.4, -0.9), vec3(0.1, -0.3, 0.3), 60.0, 2)?
        .medium("fog", fog([0.5, 0.7, 0.9], [0.9, 0.8, 0.7])?, forward(0.3)?)
        .interface("border", at(&cube(), Vec3::splat(1.2), Vec3::ZERO), "fog", None)
        .shape("floor", floor, diffuse([0.0; 3]))
        .lamp("lamp", lamp, Rgb::new(6.0, 4.0, 2.0))
        .scene;
    let cells = vec![
        Cell::new("lamp rises", [translate("lamp", vec3(0.1, 0.8, 0.2))]).representative(),
        Cell::new("floor rises", [translate("floor", Vec3::Y)]),
    ];
    Ok(Stage::new("sunk lamp", scene, cells))
}

/// A refractive body with dents: edges that graze from inside.
///
/// # Errors
/// When the library rejects the scene.
pub fn dented_glass() -> Result<Stage> {
    glass_body("dented glass", at(&bumpy_sphere(1, 0.5, 3.0), Vec3::splat(0.7), Vec3::ZERO))
}

fn glass_body(name: &'static str, body: Mesh) -> Result<Stage> {
    let stretch = body.positions.iter().map(|p| vec3(p.x + p.y * p.z, 0.5 * p.y, p.x * p.x));
    let stretch = GeometryChange::VertexVelocity(stretch.collect());
    let glass = RoughDielectric { alpha: 0.4, eta: 1.3, ..RoughDielectric::default() };
    let floor = placed(&rectangle(), vec3(2.0, 2.0, 1.0), Vec3::X, PI, vec3(0.0, 0.0, 1.3));
    let scene = Set::new(vec3(0.3, 0.4, -2.6), Vec3::ZERO, 34.0, 4)?
        .medium("syrup", fog([0.6, 1.0, 1.5], [0.9, 0.8, 0.7])?, forward(0.4)?)
        .filled("body", body, Bsdf::RoughDielectric(glass), "syrup", None)
        .shape("wall", floor, diffuse([0.6, 0.5, 0.4]))
        .light("sky", Emitter::Constant { radiance: Rgb::new(0.8, 0.9, 1.0) })
        .scene;
    let cells = vec![
        Cell::new("body moves", [translate("body", vec3(0.7, 0.3, -0.4))]),
        Cell::new("body deforms", [moves("body", stretch)]).representative(),
        Cell::new("alpha", [raise("body", "alpha", 1.0)]).step(0.1),
        Cell::new("eta", [raise("body", "eta", 1.0)]).step(0.1),
        Cell::new("transmittance", [add("body", "specular_transmittance", [-1.0, -0.5, -0.2])]),
        Cell::new("extinction", [add("syrup", "sigma_t", [1.0, 0.5, 2.0])]).step(0.25),
    ];
    Ok(Stage::new(name, scene, cells))
}

/// A point light outside a box of fog, a body inside it.
///
/// # Errors
/// When the library rejects the scene.
pub fn beam() -> Result<Stage> {
    let body =
        placed(&cube(), vec3(0.35, 0.1, 0.25), vec3(0.2, 1.0, 0.3), 0.7, vec3(0.1, 0.3, 0.0));
    let light =
        Emitter::Point { position: vec3(-0.3, 2.2, 0.3), intensity: Rgb::new(7.0, 8.0, 9.0) };
    let scene = Set::new(vec3(0.3, 0.3, -3.6), Vec3::ZERO, 34.0, 3)?
        .medium("fog", fog([0.5, 0.7, 0.9], [0.9, 0.8, 0.7])?, forward(0.4)?)
        .interface("border", cube(), "fog", None)
        .shape("body", body, diffuse([0.5, 0.6, 0.3]))
        .light("light", light)
        .scene;
    let cells = vec![
        Cell::new("body moves", [translate("body", vec3(0.5, 0.3, -0.4))]).representative(),
        Cell::new("light moves", [translate("light", vec3(0.7, 0.5, 0.4))]),
        Cell::new("intensity", [add("light", "intensity", [1.0, 3.0, 2.0])]).samples(512),
        Cell::new("border moves", [translate("border", vec3(0.6, 0.3, -0.5))]),
    ];
    Ok(Stage::new("beam", scene, cells))
}

/// Two media with a null interface between them.
///
/// # Errors
/// When the library rejects the scene.
pub fn layers() -> Result<Stage> {
    let half = vec3(0.9, 0.4, 0.9);
    let [low, high] = [-0.4, 0.4].map(|y| {
        let mut open = at(&cube(), half, vec3(0.0, y, 0.0));
        // Without the side in y = 0.
        let inner = |t: &[u32; 3]| t.iter().all(|&i| open.positions[i as usize].y.abs() < 1e-9);
        let outer = open.triangles.iter().copied().filter(|t| !inner(t)).collect();
        open.triangles = outer;
        open
    });
    let middle = placed(&rectangle(), vec3(0.9, 0.9, 1.0), Vec3::X, -FRAC_PI_2, Vec3::ZERO);
    let bend = [("low", &low), ("high", &high), ("middle", &middle)].map(|(id, mesh)| {
        let rise = |p: &Vec3| f64::from(p.y.abs() < 1e-9) * (1.0 + 0.5 * p.x);
        let velocity = mesh.positions.iter().map(|p| vec3(0.0, rise(p), 0.0));
        moves(id, GeometryChange::VertexVelocity(velocity.collect()))
    });
    let scene = Set::new(vec3(0.4, 0.5, -3.2), Vec3::ZERO, 36.0, 4)?
        .medium("dense", fog([2.0, 1.5, 1.0], [0.9, 0.8, 0.6])?, forward(0.3)?)
        .medium("thin", fog([0.3, 0.5, 0.8], [0.6, 0.8, 0.9])?, forward(-0.3)?)
        .interface("middle", middle, "dense", Some("thin"))
        .interface("low", low, "dense", None)
        .interface("high", high, "thin", None)
        .lamp("lamp", ceiling_lamp(0.7, vec3(-0.4, 2.0, -0.3)), Rgb::new(8.0, 7.0, 6.0))
        .scene;
    let everything = ["low", "middle", "high"];
    let turned = everything.map(|id| turn(id, vec3(0.3, 1.0, 0.2), vec3(0.2, 0.0, 0.0)));
    let cells = vec![
        Cell::new("interface bends", bend).representative(),
        Cell::new("everything turns", turned),
        Cell::new("extinction below", [add("dense", "sigma_t", [1.0, 2.0, 0.5])]).step(0.25),
        Cell::new("asymmetry above", [raise("thin", "g", 1.0)]).step(0.1).samples(512),
    ];
    Ok(Stage::new("layers", scene, cells))
}

/// An open sheet in fog: edges with one face.
///
/// # Errors
/// When the library rejects the scene.
pub fn sheet() -> Result<Stage> {
    let sheet =
        placed(&grid(2, 2), vec3(0.45, 0.35, 1.0), vec3(1.0, 0.4, 0.2), 1.1, vec3(0.0, 0.1, 0.0));
    let curl = sheet.positions.iter().map(|p| vec3(0.2, 2.0 * p.x * p.x, p.x));
    let curl = GeometryChange::VertexVelocity(curl.collect());
    let scene = Set::new(vec3(0.3, 0.3, -3.4), Vec3::ZERO, 34.0, 3)?
        .medium("fog", fog([0.5, 0.7, 0.9], [0.9, 0.8, 0.7])?, Phase::Isotropic)
        .interface("border", cube(), "fog", None)
        .shape("sheet", sheet, diffuse([0.7, 0.5, 0.4]))
        .lamp("lamp", ceiling_lamp(0.5, vec3(-0.2, 1.6, -0.3)), Rgb::new(6.0, 7.0, 8.0))
        .scene;
    let cells = vec![
        Cell::new("sheet moves", [translate("sheet", vec3(0.5, 0.4, -0.3))]),
        Cell::new("sheet turns", [turn("sheet", vec3(1.0, 0.2, 0.3), vec3(0.0, 0.1, 0.0))]),
        Cell::new("sheet curls", [moves("sheet", curl)]).representative(),
        Cell::new("camera moves", [translate("camera", vec3(0.5, -0.3, 0.6))]),
    ];
    Ok(Stage::new("sheet", scene, cells))
}

/// A glowing medium around a dark body.
///
/// # Errors
/// When the library rejects the scene.
pub fn ember() -> Result<Stage> {
    let glow = Rgb::new(2.0, 1.0, 0.5);
    let ember = Homogeneous::new(Rgb::new(0.8, 1.2, 1.6), Rgb::new(0.2, 0.4, 0.5), glow)?;
    let body = placed(&cube(), vec3(0.2, 0.4, 0.2), vec3(0.2, 1.0, 0.3), 0.7, vec3(0.1, 0.1, -0.2));
    let walls = at(&inside_out(cube()), Vec3::splat(1.8), vec3(0.0, 0.0, 0.2));
    let scene = Set::new(vec3(0.1, 0.2, -1.5), Vec3::ZERO, 60.0, 3)?
        .medium("ember", ember, Phase::Rayleigh)
        .interface("border", at(&icosphere(1), Vec3::splat(0.9), Vec3::ZERO), "ember", None)
        .shape("body", body, diffuse([0.2, 0.3, 0.5]))
        .shape("walls", walls, diffuse([0.5, 0.4, 0.3]))
        .scene;
    let cells = vec![
        Cell::new("emission", [add("ember", "emission", [1.0, 2.0, 3.0])])
            .step(0.1)
            .samples(512)
            .representative()
            .precise(),
        Cell::new("extinction", [add("ember", "sigma_t", [1.0, -0.5, 0.7])]).step(0.25),
        Cell::new("border moves", [translate("border", vec3(0.5, 0.3, -0.4))]),
        Cell::new("body moves", [translate("body", vec3(0.5, 0.3, -0.4))]),
    ];
    Ok(Stage::new("ember", scene, cells))
}
