//! Stages in which a grid rides with a box that bends and twists.

use drt_estimators::InteriorMotion;
use drt_estimators::emitter::Emitter;
use drt_geom::Mesh;
use drt_geom::procedural::cube;
use drt_math::{Affine, Mat3, Rgb, Vec3, vec3};
use drt_medium::{Grid, GridMedium, Layout, MediumKind, Phase, UniformMedium, Volume};
use drt_motion::{Change, Effect, GeometryChange, PropertyChange, ValueChange};

use super::effects::{add, translate, turn};
use super::set::placed;
use super::{Cell, Set, Stage};
use crate::Result;
use crate::motion::moves;

/// Half the width of the box.
const HALF: f64 = 0.8;

/// A lumpy field of one or three channels in a box of the given half width, turned like the box.
fn lumps(half: f64, scale: [f64; 3], channels: usize) -> Result<Grid> {
    let size = 5_usize;
    let values = (0..size.pow(3)).flat_map(|i| {
        let [x, y, z] = [i % size, i / size % size, i / size / size].map(|k| k as f64 / 4.0 - 0.5);
        let wave = (0..channels).map(move |c| (9.0 * x + 5.0 * y * z + 2.0 * c as f64).sin());
        let round = 1.0 - 2.0 * (x * x + y * y + z * z);
        wave.enumerate().map(move |(c, wave)| scale[c] * f64::max(round + 0.4 * wave, 0.02))
    });
    let grid = Grid::new([size; 3], channels, values.collect())?.with_layout(Layout::NodeCentred);
    let place = Affine {
        linear: turned() * Mat3::diagonal(Vec3::splat(2.0 * half)),
        translation: turned() * Vec3::splat(-half),
    };
    Ok(grid.with_placement(place)?)
}

/// How the box stands.
fn turned() -> Mat3 {
    Mat3::rotation(AXIS.normalize(), ANGLE)
}

const AXIS: Vec3 = vec3(0.3, 1.0, 0.2);
const ANGLE: f64 = 0.4;

fn body() -> Mesh {
    placed(&cube(), Vec3::splat(HALF), AXIS, ANGLE, Vec3::ZERO)
}

/// A deformation of the box by its vertices.
fn deforms(field: impl Fn(Vec3) -> Vec3) -> Effect {
    let velocities = body().positions.iter().map(|p| field(*p)).collect();
    moves("box", GeometryChange::VertexVelocity(velocities))
}

fn bend() -> Effect {
    deforms(|p| vec3(0.5 - p.x * p.z, 0.6 * p.x * p.y, p.x * p.x - 0.3 * p.y))
}

fn twist() -> Effect {
    deforms(|p| vec3(p.y * p.z, 0.4 * p.z, -p.x * p.y))
}

fn rides() -> Effect {
    Effect { target: "smoke".into(), change: Change::Follow("box".into()) }
}

/// A box with a grid of the given half width, every coefficient of which varies in space and colour.
fn stage(name: &'static str, half: f64) -> Result<Stage> {
    let smoke = GridMedium::new(lumps(half, [1.0; 3], 1)?, 2.0, albedo(half)?, glow(half)?)?;
    // A sample takes far longer than in other stages; half as many tell the scale to 0.7 to 1.5 %.
    Ok(Stage { samples: 1024, boundary_samples: 1024, ..around(name, smoke)? })
}

fn albedo(half: f64) -> Result<Volume> {
    Ok(Volume::Grid(lumps(half, [0.7, 0.6, 0.5], 3)?))
}

fn glow(half: f64) -> Result<Volume> {
    Ok(Volume::Grid(lumps(half, [0.3, 0.2, 0.5], 3)?))
}

/// A box of a medium that rides with it.
fn around(name: &'static str, smoke: impl Into<MediumKind>) -> Result<Stage> {
    let sun = Emitter::Directional {
        direction: vec3(-0.7, -1.0, 0.4),
        irradiance: Rgb::new(4.0, 5.0, 6.0),
    };
    let scene = Set::new(vec3(0.3, 0.4, -2.6), Vec3::ZERO, 36.0, 3)?
        .medium("smoke", smoke, Phase::henyey_greenstein(-0.2)?)
        .interface("box", body(), "smoke", None)
        .light("sun", sun)
        .scene;
    let cells = vec![
        Cell::new("bends", [bend(), rides()]),
        Cell::new("twists", [twist(), rides()]),
        Cell::new("bent, bends on", [bend(), rides()]).at(0.15).representative(),
        Cell::new("twisted, twists on", [twist(), rides()]).at(-0.15),
    ];
    Ok(Stage::new(name, scene, cells))
}

/// A grid larger than its box, which cuts it off.
///
/// # Errors
/// When the library rejects the scene.
pub fn riding() -> Result<Stage> {
    let mut stage = stage("riding", 1.0)?;
    let corner = GeometryChange::Vertex { index: 6, direction: vec3(0.9, 0.6, -0.7) };
    let spin = turn("box", vec3(0.2, 1.0, 0.3), Vec3::ZERO);
    stage.cells[0].representative = true;
    stage.cells.extend([
        Cell::new("a corner", [moves("box", corner), rides()]),
        Cell::new("turns and bends", [spin.clone(), bend(), rides()]),
        // With a step of 0.06 the difference itself is off: rms z 1.48, then 1.00 and 0.83 as it halves.
        Cell::new("turned and bent", [spin, bend(), rides()]).at(0.2).step(0.03),
        Cell::new("bent, thins", [bend(), rides(), add("smoke", "sigma_t", [-0.5, 0.3, 0.4])])
            .at(0.15),
    ]);
    Ok(stage)
}

/// A grid that ends exactly on its box.
///
/// # Errors
/// When the library rejects the scene.
pub fn riding_tight() -> Result<Stage> {
    stage("riding, tight", HALF)
}

/// A grid that ends inside of its box: its own faces ride too.
///
/// # Errors
/// When the library rejects the scene.
pub fn riding_inside() -> Result<Stage> {
    stage("riding inside", 0.6)
}

/// The inside of the medium stays where it is, the grid does not.
///
/// # Errors
/// When the library rejects the scene.
pub fn riding_still() -> Result<Stage> {
    let insides = vec![(0, InteriorMotion::Static)];
    Ok(Stage { insides, ..stage("riding, still inside", 1.0)? })
}

/// Mean value coordinates move the inside.
///
/// # Errors
/// When the library rejects the scene.
pub fn riding_mean_value() -> Result<Stage> {
    let insides = vec![(0, InteriorMotion::MeanValue)];
    Ok(Stage { insides, ..stage("riding, mean value", HALF)? })
}

/// One extinction everywhere, in a box larger than the grid of the albedo.
///
/// # Errors
/// When the library rejects the scene.
pub fn dyed() -> Result<Stage> {
    let sigma_t = Rgb::new(1.0, 1.4, 2.0);
    let mut stage = around("dyed", UniformMedium::new(sigma_t, albedo(0.6)?, glow(1.0)?)?)?;
    let voxel = PropertyChange {
        property: "albedo".into(),
        op: ValueChange::Add(Rgb::new(1.0, 0.8, 0.6)),
        voxels: Some([2, 1, 2]),
        texels: None,
    };
    let voxel = Effect { target: "smoke".into(), change: Change::Property(voxel) };
    let spin = turn("box", vec3(0.2, 1.0, 0.3), Vec3::ZERO);
    stage.cells.extend([
        Cell::new("dye moves", [translate("smoke", vec3(0.7, 0.3, -0.4))]).representative(),
        Cell::new("box moves", [translate("box", vec3(0.4, 0.3, -0.4))]),
        Cell::new("box turns, dye rides", [spin, rides()]),
        Cell::new("a voxel", [voxel]).step(0.25).representative(),
        Cell::new("extinction", [add("smoke", "sigma_t", [-0.5, 0.3, 0.4])]),
        Cell::new("albedo", [add("smoke", "albedo", [0.3, 0.5, 0.4])]).step(0.1),
    ]);
    Ok(stage)
}
