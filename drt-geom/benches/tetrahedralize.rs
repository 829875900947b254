//! Seconds to fill a box around a surface with tetrahedra, and how many come of it.
//!
//! `cargo bench -p drt-geom --features obj --bench tetrahedralize -- [MESH.obj]…`
//!
//! Without meshes, shapes made by formula. The median of three runs.

use std::error::Error;
use std::time::Instant;

use drt_geom::{Mesh, TetVertexOrigin, TetrahedralizeInput, procedural, tetrahedralize};

fn main() -> Result<(), Box<dyn Error>> {
    println!(
        "mesh                 triangles  positions   vertices  (added)     tetrahedra  seconds"
    );
    // Cargo adds --bench.
    let paths: Vec<String> = std::env::args().skip(1).filter(|w| w != "--bench").collect();
    if paths.is_empty() {
        report("sphere", &procedural::icosphere(5));
        report("bumpy sphere", &procedural::bumpy_sphere(6, 0.2, 6.0));
        report("knot", &procedural::torus_knot(&procedural::TorusKnot::default()));
        report("grid", &procedural::grid(100, 100));
    }
    for path in paths {
        report(path.rsplit('/').next().unwrap_or(&path), &load(&path)?);
    }
    Ok(())
}

#[cfg(feature = "obj")]
fn load(path: &str) -> Result<Mesh, Box<dyn Error>> {
    Ok(drt_geom::read_obj(path)?)
}

#[cfg(not(feature = "obj"))]
fn load(path: &str) -> Result<Mesh, Box<dyn Error>> {
    Err(format!("{path}: build with --features obj").into())
}

fn report(name: &str, mesh: &Mesh) {
    let input = TetrahedralizeInput { surfaces: &[mesh], points: &[], margin: 0.1 };
    let run = || {
        let start = Instant::now();
        (tetrahedralize(&input), start.elapsed().as_secs_f64())
    };
    let mut runs = [0; 3].map(|_| run());
    runs.sort_by(|a, b| a.1.total_cmp(&b.1));
    let seconds = runs[1].1;
    match &runs[1].0 {
        Ok(made) => {
            let on_corner = |o: &&TetVertexOrigin| match o {
                TetVertexOrigin::Surface { bary: [u, v], .. } => {
                    [*u, *v].iter().all(|w| [0.0, 1.0].contains(w))
                }
                _ => false,
            };
            let given = made.origins.iter().filter(on_corner).count();
            let vertices = made.origins.len();
            println!(
                "{name:20} {:9} {given:10} {vertices:10}  {:7} {:14} {seconds:8.3}",
                mesh.triangles.len(),
                vertices - given - 8,
                made.mesh.tets.len(),
            );
        }
        Err(error) => {
            println!("{name:20} {:9} after {seconds:.3} s: {error}", mesh.triangles.len())
        }
    }
}
