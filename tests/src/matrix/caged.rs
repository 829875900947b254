//! Stages whose bodies are deformed by cages: procedural ones, and any from a file.

use std::collections::{HashMap, HashSet};
use std::path::Path;
use std::sync::Arc;

use drt_estimators::InteriorMotion;
use drt_estimators::surface::Bsdf;
use drt_geom::procedural::{bumpy_sphere, cube, icosphere};
use drt_geom::{Mesh, read_obj, weld};
use drt_math::{Vec3, vec3};
use drt_motion::{Effect, GeometryChange};

use super::deforming::{fog, forward, glass, inside, sky, sun};
use super::set::{at, block, diffuse};
use super::{Cell, Set, Stage};
use crate::Result;
use crate::motion::moves;

/// Moves vertices of a cage around a shape, each by a velocity that depends on where it is.
fn caged(shape: &str, cage: &Arc<Mesh>, velocity: impl Fn(Vec3) -> Vec3) -> Effect {
    let all = (0..).zip(&cage.positions).map(|(i, p)| (i, velocity(*p)));
    let vertices = all.filter(|(_, v)| *v != Vec3::ZERO).collect();
    moves(shape, GeometryChange::Cage { mesh: Arc::clone(cage), vertices })
}

/// One vertex of a cage moves, then all of them.
fn of_cage(shape: &str, cage: &Arc<Mesh>, vertex: usize) -> Vec<Cell> {
    let chosen = cage.positions[vertex];
    let one = |p: Vec3| chosen * (2.0 * f64::from(p == chosen));
    let all = |p: Vec3| vec3(1.2 * p.y * p.z, 0.7 * p.x, 0.5 - 0.6 * p.z * p.x);
    vec![
        Cell::new("a cage vertex", [caged(shape, cage, one)]).representative(),
        Cell::new("the cage squeezed", [caged(shape, cage, all)]),
    ]
}

/// A translucent body with its cage.
fn body(name: &'static str, mesh: Mesh, surface: Bsdf, cage: Mesh) -> Result<Stage> {
    let scene = Set::new(vec3(0.3, 0.6, -2.6), Vec3::ZERO, 36.0, 4)?
        .medium("milk", fog([2.0, 1.5, 1.0], [0.95, 0.8, 0.6])?, forward(0.4)?)
        .filled("body", mesh, surface, "milk", None)
        .light("sky", sky())
        .light("sun", sun())
        .scene;
    Ok(Stage::new(name, scene, of_cage("body", &Arc::new(cage), 2)))
}

/// A blob without a surface of its own in a cage of twenty triangles.
///
/// # Errors
/// When the library rejects the scene.
pub fn caged_milk() -> Result<Stage> {
    let blob = at(&bumpy_sphere(1, 0.3, 3.0), Vec3::splat(0.7), Vec3::ZERO);
    body("caged milk", blob, Bsdf::Null, at(&icosphere(0), Vec3::splat(1.2), Vec3::ZERO))
}

/// A refractive block in a cage of blocks, with its inside by mean value coordinates.
///
/// # Errors
/// When the library rejects the scene.
pub fn caged_glass() -> Result<Stage> {
    let half = vec3(0.6, 0.5, 0.55);
    let stage = body("caged glass", block([2, 2, 2], half), glass(), block([2, 1, 1], half * 1.3))?;
    Ok(inside(stage, 1, &InteriorMotion::MeanValue))
}

/// A solid in fog, and a cage around the solid alone.
///
/// # Errors
/// When the library rejects the scene.
pub fn caged_solid() -> Result<Stage> {
    let solid = at(&bumpy_sphere(1, 0.3, 3.0), Vec3::splat(0.4), Vec3::ZERO);
    let cage = Arc::new(at(&cube(), Vec3::splat(0.7), Vec3::ZERO));
    let scene = Set::new(vec3(0.3, 0.3, -3.4), Vec3::ZERO, 32.0, 3)?
        .medium("fog", fog([0.5, 0.7, 0.9], [0.9, 0.8, 0.7])?, forward(0.3)?)
        .interface("border", cube(), "fog", None)
        .shape("solid", solid, diffuse([0.5, 0.6, 0.3]))
        .light("sun", sun())
        .scene;
    Ok(Stage::new("caged solid", scene, of_cage("solid", &cage, 7)))
}

/// A body from an OBJ file, translucent and without a surface of its own, in a cage of twenty
/// triangles. Its holes are closed.
///
/// # Errors
/// When the file cannot be read, or the library rejects it.
pub fn scanned(path: &Path) -> Result<Stage> {
    let read = read_obj(path)?;
    let bounds = read.bounds();
    let size = 1.4 / bounds.extent().max_abs();
    let scan = at(&closed(&read)?, Vec3::splat(size), -bounds.center() * size);
    let cage = at(&icosphere(0), Vec3::splat(1.3), Vec3::ZERO);
    let stage = body("scanned", scan, Bsdf::Null, cage)?;
    let cells = stage.cells.into_iter().map(|c| c.samples(8192)).collect();
    Ok(Stage { samples: 16384, cells, ..stage })
}

/// The mesh with a fan across every loop of edges that have one face.
fn closed(mesh: &Mesh) -> Result<Mesh> {
    let first = weld(&mesh.positions);
    let same = |t: &[u32; 3]| t.map(|v| first[v as usize]);
    let mut triangles: Vec<[u32; 3]> = mesh.triangles.iter().map(same).collect();
    let mut positions = mesh.positions.clone();
    let sides = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
    let both: HashSet<[u32; 2]> = triangles.iter().flat_map(sides).collect();
    let open = both.iter().filter(|[a, b]| !both.contains(&[*b, *a]));
    let mut next: HashMap<u32, u32> = open.map(|[a, b]| (*a, *b)).collect();
    while let Some(start) = next.keys().min().copied() {
        let mut around = vec![start];
        while let Some(to) = next.remove(&around[around.len() - 1]) {
            around.push(to);
        }
        let count = around.len() - 1;
        let sum = around[1..].iter().fold(Vec3::ZERO, |s, v| s + positions[*v as usize]);
        let middle = positions.len() as u32;
        positions.push(sum * (1.0 / count as f64));
        triangles.extend(around.windows(2).map(|e| [e[1], e[0], middle]));
    }
    Ok(Mesh::new(positions, triangles)?)
}
