//! Nanoseconds to locate a point in a tetrahedral mesh, medians.
//!
//! `cargo bench -p drt-geom --bench locate -- [MESH.mesh] [--only NAME]`
//!
//! Without a mesh, a cube of 101 000 tetrahedra with its vertices moved at random, once in the order
//! of the grid and once shuffled, which is how mesh generators leave them. A single query is shorter
//! than it takes to read the clock, so that queries are timed by batches of a few: the median is that of
//! the batches' means. Points are of a walk through the domain (each with the last one's
//! tetrahedron as a hint), of anywhere with nothing to go by, and the mesh's vertices, which lie on
//! the faces of a dozen tetrahedra and more and are always searched from scratch.

use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

use drt_geom::{Aabb, TetLocator, TetMesh, procedural};
use drt_math::{Rng, Vec3, vec3};

/// Points of a batch.
const BATCH: usize = 16;
const BATCHES: usize = 20_000;

/// Length of a step of the walk, in mean edge lengths.
const STEP: f64 = 0.5;

fn main() -> Result<(), Box<dyn Error>> {
    let meshes = [("grid", grid()), ("shuffled", shuffled(grid()))];
    for (name, mesh) in meshes {
        measure(name, &mesh)?;
    }
    Ok(())
}

fn grid() -> TetMesh {
    const CELLS: u32 = 26;
    let unit = Aabb { min: Vec3::ZERO, max: Vec3::splat(1.0) };
    let mut mesh = procedural::tet_grid([CELLS; 3], &unit);
    let mut rng = Rng::new(1, 0, 0);
    for p in &mut mesh.positions {
        let shift = point(&mut rng) - Vec3::splat(0.5);
        let inner = (0..3).all(|k| p[k] > 0.0 && p[k] < 1.0);
        if inner {
            *p += shift * (0.3 / f64::from(CELLS));
        }
    }
    mesh
}

/// The same mesh with its vertices and tetrahedra in any order.
fn shuffled(mut mesh: TetMesh) -> TetMesh {
    let mut rng = Rng::new(2, 0, 0);
    let mut order: Vec<usize> = (0..mesh.positions.len()).collect();
    shuffle(&mut order, &mut rng);
    let positions = mesh.positions.clone();
    for (from, to) in order.iter().enumerate() {
        mesh.positions[*to] = positions[from];
    }
    for v in mesh.tets.iter_mut().flatten() {
        *v = order[*v as usize] as u32;
    }
    shuffle(&mut mesh.tets, &mut rng);
    mesh
}

fn shuffle<T>(items: &mut [T], rng: &mut Rng) {
    for i in (1..items.len()).rev() {
        items.swap(i, (rng.next_u64() % (i as u64 + 1)) as usize);
    }
}

fn measure(name: &str, mesh: &TetMesh) -> Result<(), Box<dyn Error>> {
    let start = Instant::now();
    mesh.validate()?;
    let checked = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let locator = TetLocator::new(mesh)?;
    let built = start.elapsed().as_secs_f64();
    let count = mesh.tets.len();
    println!(
        "{name}: {count} tetrahedra, checked in {:.0} ms, built in {:.0} ms",
        checked * 1e3,
        built * 1e3
    );
    let bounds = mesh.bounds();
    let extent = bounds.extent();
    let mut rng = Rng::new(3, 0, 0);
    let anywhere = |rng: &mut Rng| {
        let u = point(rng);
        bounds.min + vec3(u.x * extent.x, u.y * extent.y, u.z * extent.z)
    };
    let step = STEP * extent.max_abs() / (count as f64 / 6.0).cbrt();
    let mut at = bounds.center();
    let walk = batches(|| {
        let next = at + (point(&mut rng) - Vec3::splat(0.5)) * (2.0 * step);
        at = if bounds.contains(next) { next } else { at };
        at
    });
    let mut rng = Rng::new(4, 0, 0);
    let points = batches(|| anywhere(&mut rng));
    let mut rng = Rng::new(5, 0, 0);
    let vertices =
        batches(|| mesh.positions[(rng.next_u64() % mesh.positions.len() as u64) as usize]);
    println!("  walk     {:6.0} ns", hinted(&locator, &walk));
    println!("  anywhere {:6.0} ns", scratch(&locator, &points));
    println!("  vertices {:6.0} ns", scratch(&locator, &vertices));
    Ok(())
}

fn point(rng: &mut Rng) -> Vec3 {
    vec3(rng.next_f64(), rng.next_f64(), rng.next_f64())
}

fn batches(mut point: impl FnMut() -> Vec3) -> Vec<[Vec3; BATCH]> {
    (0..BATCHES).map(|_| [(); BATCH].map(|()| point())).collect()
}

fn hinted(locator: &TetLocator, batches: &[[Vec3; BATCH]]) -> f64 {
    let mut hint = None;
    time(batches, |p| {
        let found = locator.locate(p, hint);
        hint = found.map(|f| f.tet);
        black_box(found);
    })
}

fn scratch(locator: &TetLocator, batches: &[[Vec3; BATCH]]) -> f64 {
    time(batches, |p| {
        black_box(locator.locate(p, None));
    })
}

/// Median over the batches of the nanoseconds for each point.
fn time(batches: &[[Vec3; BATCH]], mut query: impl FnMut(Vec3)) -> f64 {
    let seconds = |batch: &[Vec3; BATCH]| {
        let start = Instant::now();
        batch.iter().for_each(|p| query(*p));
        start.elapsed().as_secs_f64()
    };
    let mut times: Vec<f64> = batches.iter().map(seconds).collect();
    times.sort_unstable_by(f64::total_cmp);
    times[times.len() / 2] / BATCH as f64 * 1e9
}
