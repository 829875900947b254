//! Seconds to prepare a surface: the search for crossing triangles, and tetrahedra by TetGen.
//!
//! `cargo bench -p drt-geom --features tetgen,obj --bench tetgen -- [MESH.obj ...]`
//!
//! Without a mesh, bumpy spheres of 5 000, 20 000 and 82 000 triangles. The least of three runs.

use std::error::Error;
use std::time::{Duration, Instant};

use drt_geom::{
    Mesh, TetrahedralizeInput, crossing_pairs, load_obj, procedural, tetrahedralize_tetgen,
};

const RUNS: usize = 3;

fn main() -> Result<(), Box<dyn Error>> {
    let mut meshes = Vec::new();
    // Cargo adds --bench.
    for path in std::env::args().skip(1).filter(|w| w != "--bench") {
        let mesh = load_obj(&std::fs::read(&path)?, &path)?;
        meshes.push((path, mesh.drop_degenerate().0));
    }
    if meshes.is_empty() {
        let sphere = |n| (format!("bumpy sphere {n}"), procedural::bumpy_sphere(n, 0.2, 6.0));
        meshes = [4, 5, 6].map(sphere).into();
    }
    println!("triangles  crossing s  tetgen s     points       tets");
    for (name, mesh) in &meshes {
        let (crossing, _) = least(|| crossing_pairs(&[mesh], 1));
        let (seconds, made) = least(|| tetrahedralize(mesh));
        let result = match made {
            Ok((points, tets)) => format!("{points:10} {tets:10}  {name}"),
            Err(error) => format!("{name}: {error}"),
        };
        println!("{:9} {crossing:11.3} {seconds:9.3} {result}", mesh.triangles.len());
    }
    Ok(())
}

fn tetrahedralize(mesh: &Mesh) -> Result<(usize, usize), Box<dyn Error>> {
    let input = TetrahedralizeInput { surfaces: &[mesh], points: &[], margin: 0.1 };
    let made = tetrahedralize_tetgen(&input, Duration::from_secs(600))?;
    Ok((made.mesh.positions.len(), made.mesh.tets.len()))
}

/// The shortest time, in seconds, and the last result.
fn least<T>(mut work: impl FnMut() -> T) -> (f64, T) {
    let mut timed = || {
        let start = Instant::now();
        let result = work();
        (start.elapsed().as_secs_f64(), result)
    };
    let (mut seconds, mut result) = timed();
    for _ in 1..RUNS {
        let (again, next) = timed();
        (seconds, result) = (seconds.min(again), next);
    }
    (seconds, result)
}
