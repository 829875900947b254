//! Tetrahedra around and inside surfaces: our own and TetGen's.
//!
//! `cargo bench -p drt-geom --features tetgen,obj --bench tetgen -- "$PWD"/examples/meshes/*.obj`
//!
//! A bumpy sphere of 20 000 triangles comes after the meshes that are named. Seconds are the least of three runs. The shape of a tetrahedron
//! is its volume over that of the regular one with its longest edge: 1 is regular, 0 flat. The table has the least shape and the median.

use std::error::Error;
use std::time::{Duration, Instant};

use drt_geom::{
    Mesh, TetMesh, Tetrahedralization, TetrahedralizeInput, procedural, read_obj, tetrahedralize,
    tetrahedralize_tetgen,
};

const RUNS: usize = 3;
const LIMIT: Duration = Duration::from_secs(600);

type Made = Result<Tetrahedralization, Box<dyn Error>>;

fn main() -> Result<(), Box<dyn Error>> {
    let mut meshes = Vec::new();
    // Cargo adds --bench.
    for path in std::env::args().skip(1).filter(|w| w != "--bench") {
        let mesh = read_obj(&path)?;
        let name = path.rsplit('/').next().unwrap_or(&path).to_owned();
        meshes.push((name, mesh.drop_degenerate().0));
    }
    meshes.push(("bumpy sphere".into(), procedural::bumpy_sphere(5, 0.2, 6.0)));
    println!(
        "| mesh | triangles | by | seconds | vertices | tetrahedra | least shape | median shape |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for (name, mesh) in &meshes {
        let input = TetrahedralizeInput { surfaces: &[mesh], points: &[], margin: 0.1 };
        row(name, mesh, "drt", || Ok(tetrahedralize(&input)?));
        row(name, mesh, "TetGen", || Ok(tetrahedralize_tetgen(&input, LIMIT)?));
    }
    Ok(())
}

/// Prints a row of the table.
fn row(name: &str, mesh: &Mesh, by: &str, make: impl FnMut() -> Made) {
    let triangles = mesh.triangles.len();
    let (seconds, made) = least(make);
    let result = made.map(|made| {
        let (vertices, tets) = (made.mesh.positions.len(), made.mesh.tets.len());
        let [worst, median] = shapes(&made.mesh);
        format!("{seconds:.3} | {vertices} | {tets} | {worst:.1e} | {median:.2}")
    });
    let result = result.unwrap_or_else(|error| format!("{error} | | | |"));
    println!("| {name} | {triangles} | {by} | {result} |");
}

/// The least and the median shape.
fn shapes(mesh: &TetMesh) -> [f64; 2] {
    let shape = |tet: &[u32; 4]| {
        let [a, b, c, d] = tet.map(|v| mesh.positions[v as usize]);
        let edges = [b - a, c - a, d - a, c - b, d - b, d - c];
        let longest = edges.iter().map(|e| e.length()).fold(0.0, f64::max);
        (b - a).cross(c - a).dot(d - a).abs() * 2.0_f64.sqrt() / longest.powi(3)
    };
    let mut shapes: Vec<f64> = mesh.tets.iter().map(shape).collect();
    shapes.sort_by(f64::total_cmp);
    [shapes[0], shapes[shapes.len() / 2]]
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
