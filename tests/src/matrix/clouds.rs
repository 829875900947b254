//! Stages in which most voxels of a cloud are empty, so that its extinction is differentiated by probes: every kind of border and light,
//! with the values of the grids that change, and the grids that move, turn and ride with a border that deforms.
//!
//! The borders and the lights are those of the scenes by which Yu et al. (*Sample Matching*, ACM TOG 2026) measure gradients of media at rest.

use std::f64::consts::FRAC_PI_2;

use drt_estimators::emitter::Emitter;
use drt_geom::Mesh;
use drt_geom::procedural::{TorusKnot, cube, icosphere, rectangle, torus_knot};
use drt_math::{Affine, Mat3, Rgb, Vec3, vec3};
use drt_medium::{Grid, GridMedium, Layout, Phase, Volume};
use drt_motion::{Change, Effect, GeometryChange, ValueChange};

use super::effects::{grow, translate, turn};
use super::set::{at, placed};
use super::textures::sky;
use super::{Cell, Set, Stage};
use crate::Result;
use crate::motion::{changes, moves};

/// What a cloud ends at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Border {
    /// A cube of half the width 1, which the grid fills.
    Cube,
    /// A sphere of radius 1.15, which holds nothing beside the grid.
    Sphere,
    /// A ring within the grid.
    Ring,
}

/// What lights a cloud.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Light {
    /// A sky that is the same everywhere.
    Even,
    /// A sky with an image.
    Sky,
    /// A lamp above the cloud.
    LampAbove,
    /// A lamp in the cloud.
    LampInside,
    /// A point beside the cloud.
    Point,
}

/// Voxels along each side.
const SIZE: usize = 8;

impl Border {
    fn mesh(self) -> Mesh {
        let ring =
            TorusKnot { p: 1, q: 0, major: 0.75, minor: 0.0, tube: 0.3, segments: 24, sides: 10 };
        match self {
            Self::Cube => cube(),
            Self::Sphere => at(&icosphere(2), Vec3::splat(1.15), Vec3::ZERO),
            Self::Ring => torus_knot(&ring),
        }
    }
}

impl Light {
    fn shine(self, set: Set) -> Result<Set> {
        let dim = |radiance| Emitter::Constant { radiance: Rgb::splat(radiance) };
        let above =
            placed(&rectangle(), vec3(1.2, 1.2, 1.0), Vec3::X, FRAC_PI_2, vec3(0.0, 2.5, 0.0));
        let inside = at(&rectangle(), Vec3::splat(0.25), vec3(0.0, 0.0, -0.5));
        Ok(match self {
            Self::Even => set.light("sky", dim(1.0)),
            Self::Sky => set.light("sky", sky()?),
            Self::LampAbove => set.lamp("lamp", above, Rgb::splat(6.0)),
            Self::LampInside => set.lamp("lamp", inside, Rgb::splat(25.0)).light("sky", dim(0.05)),
            Self::Point => {
                let (position, intensity) = (vec3(2.5, 2.5, 2.5), Rgb::splat(40.0));
                set.light("point", Emitter::Point { position, intensity }).light("sky", dim(0.02))
            }
        })
    }
}

/// A grid over the cube of half the width 1 with a value per voxel and channel by its place in the cube.
fn grid(channels: usize, value: impl Fn(Vec3, usize) -> f64) -> Result<Grid> {
    let places = (0..SIZE.pow(3)).map(|i| {
        let [x, y, z] = [i, i / SIZE, i / SIZE / SIZE]
            .map(|k| 2.0 * ((k % SIZE) as f64 + 0.5) / SIZE as f64 - 1.0);
        vec3(x, y, z)
    });
    let values = places.flat_map(|x| (0..channels).map(move |c| (x, c)));
    let values = values.map(|(x, c)| value(x, c)).collect();
    let grid = Grid::new([SIZE; 3], channels, values)?.with_layout(Layout::VoxelCentred);
    let place = Affine { linear: Mat3::diagonal(Vec3::splat(2.0)), translation: Vec3::splat(-1.0) };
    Ok(grid.with_placement(place)?)
}

/// A cloud with exact zeros around it.
fn density(x: Vec3, _: usize) -> f64 {
    let puff = 1.6 - 3.0 * x.length_squared() + 0.9 * (5.0 * x.x + 3.0 * x.y * x.z).sin();
    f64::max(puff, 0.0)
}

fn albedo(x: Vec3, c: usize) -> f64 {
    0.55 + [0.3 * x.x, 0.3 * x.y, 0.25 * x.z][c]
}

/// A cloud within a border by a light.
///
/// # Errors
/// When the library rejects the scene.
pub fn cloud(border: Border, light: Light) -> Result<Stage> {
    let [density, albedo] = [grid(1, density)?, grid(3, albedo)?];
    let smoke = GridMedium::new(density, 2.0, Volume::Grid(albedo), Volume::Constant(Rgb::ZERO))?;
    let set = Set::new(vec3(0.0, 0.0, 4.2), Vec3::ZERO, 40.0, 6)?
        .medium("smoke", smoke, Phase::Isotropic)
        .interface("border", border.mesh(), "smoke", None);
    let scene = light.shine(set)?.scene;
    let bends = |p: &Vec3| vec3(0.3 - p.x * p.z, 0.4 * p.x * p.y, 0.5 * p.x * p.x - 0.2 * p.y);
    let bends = border.mesh().positions.iter().map(bends).collect();
    let deforms = match border {
        // Flat tetrahedra across the creases of a ring turn over when these bend.
        Border::Ring => grow("border", vec3(0.5, -0.3, 0.6), Vec3::ZERO),
        _ => moves("border", GeometryChange::VertexVelocity(bends)),
    };
    let rides = || Effect { target: "smoke".into(), change: Change::Follow("border".into()) };
    let spin = turn("border", vec3(0.2, 1.0, 0.3), Vec3::ZERO);
    let grows = |property| changes("smoke", property, ValueChange::Multiply(1.0));
    let cells = vec![
        Cell::new("extinction grows", [grows("sigma_t")]).representative(),
        Cell::new("albedo grows", [grows("albedo")]),
        Cell::new("grid moves", [translate("smoke", vec3(0.5, 0.3, -0.4))]).representative(),
        Cell::new("grid turns", [turn("smoke", vec3(0.2, 1.0, 0.3), Vec3::ZERO)]),
        Cell::new("border turns, grid rides", [spin, rides()]),
        Cell::new("border deforms, grid rides", [deforms, rides()]),
    ];
    Ok(Stage { samples: 1024, boundary_samples: 1024, ..Stage::new("cloud", scene, cells) })
}

/// A cloud that fills a cube under an even sky.
///
/// # Errors
/// When the library rejects the scene.
pub fn cloud_under_a_sky() -> Result<Stage> {
    Ok(Stage { name: "cloud under a sky", ..cloud(Border::Cube, Light::Even)? })
}
