//! Writes the meshes of the example scenes as OBJ files, and the vertex velocities that go with
//! them as text.
//!
//! `cargo run --release -p drt-geom --example write_meshes -- examples/meshes`

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs, io, process};

use drt_geom::procedural::{self, BranchingTree, TorusKnot};
use drt_geom::{Aabb, Mesh, NONE, TetMesh};
use drt_math::{Affine, Vec3, vec3};

/// Radius of the star's notches; its tips are on the unit circle.
const NOTCH: f64 = 0.4;

fn main() {
    let Some(folder) = env::args_os().nth(1).map(PathBuf::from) else {
        eprintln!("expected the folder to write to");
        process::exit(2);
    };
    if let Err(error) = write_all(&folder) {
        eprintln!("{}: {error}", folder.display());
        process::exit(3);
    }
}

fn write_all(folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    let star = procedural::star(7, NOTCH, 1.0);
    let tree = BranchingTree { seed: 5, sides: 6, radius: 0.12, ..BranchingTree::default() };
    let knot = TorusKnot { segments: 160, sides: 14, tube: 0.22, ..TorusKnot::default() };
    // Where the scene puts the bar.
    let cage = box_surface([1, 3, 1], vec3(0.5, 1.2, 0.5));
    let meshes = [
        ("bar", bar()),
        ("bar-cage", cage.transform(&Affine::translation(vec3(0.0, 1.12, 0.0)))),
        ("body-cage", body_cage()),
        ("bumpy", procedural::bumpy_sphere(4, 0.35, 4.0)),
        ("crystal", crystal()),
        ("knot", procedural::torus_knot(&knot)),
        ("sphere", procedural::icosphere(4)),
        ("tree", procedural::branching_tree(&tree)),
        ("star", star.clone()),
    ];
    for (name, mesh) in meshes {
        fs::write(folder.join(name).with_extension("obj"), obj(&mesh))?;
    }
    fs::write(folder.join("star-tips.txt"), tips_outward(&star))
}

fn obj(mesh: &Mesh) -> String {
    let mut text = String::new();
    for p in &mesh.positions {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "v {:.6} {:.6} {:.6}", p.x, p.y, p.z);
    }
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| i + 1);
        let _ = writeln!(text, "f {a} {b} {c}");
    }
    text
}

/// The surface of a box around the origin, its sides divided into triangles.
fn box_surface(cells: [u32; 3], half: Vec3) -> Mesh {
    let tets = procedural::tet_grid(cells, &Aabb { min: -half, max: half });
    let neighbours = tets.neighbours().expect("a mesh by construction");
    let faces = TetMesh::boundary_faces(&neighbours).map(|(tet, k)| tets.face(tet, k));
    let faces: Vec<[u32; 3]> = faces.collect();
    let mut numbers = vec![NONE; tets.positions.len()];
    let mut positions = Vec::new();
    for v in faces.iter().flatten() {
        if numbers[*v as usize] == NONE {
            numbers[*v as usize] = positions.len() as u32;
            positions.push(tets.positions[*v as usize]);
        }
    }
    let triangles = faces.iter().map(|t| t.map(|v| numbers[v as usize])).collect();
    Mesh::new(positions, triangles).expect("the arrays are right by construction")
}

/// An upright bar with round edges.
fn bar() -> Mesh {
    let mut bar = box_surface([8, 24, 8], vec3(1.0, 1.0, 1.0));
    for p in &mut bar.positions {
        let size = (p.x.powi(8) + p.y.powi(8) + p.z.powi(8)).powf(0.125);
        *p = vec3(0.42 * p.x / size, 1.05 * p.y / size, 0.3 * p.z / size);
    }
    bar
}

/// A hexagonal prism with pointed ends along z, from -1 to 1: few edges, all of them creases.
/// Vertex 0 is the upper tip.
fn crystal() -> Mesh {
    const SIDES: u32 = 6;
    let ring = |z: f64| {
        (0..SIDES).map(move |i| {
            let (s, c) = (std::f64::consts::TAU * f64::from(i) / f64::from(SIDES)).sin_cos();
            vec3(0.5 * c, 0.5 * s, z)
        })
    };
    let mut positions = vec![Vec3::Z];
    positions.extend(ring(0.45).chain(ring(-0.6)));
    positions.push(-Vec3::Z);
    let last = positions.len() as u32 - 1;
    let (upper, lower) = (|i: u32| 1 + i % SIDES, |i: u32| 1 + SIDES + i % SIDES);
    let side = |i: u32| {
        let (a, b, c, d) = (lower(i), lower(i + 1), upper(i + 1), upper(i));
        [[0, d, c], [a, b, c], [a, c, d], [last, b, a]]
    };
    let triangles = (0..SIDES).flat_map(side).collect();
    Mesh::new(positions, triangles).expect("the arrays are right by construction")
}

/// Sixteen corners around a body that stands on the ground, about as high as it is wide: a top, a ring of
/// seven, one below it that is turned by half a step, and a bottom.
fn body_cage() -> Mesh {
    const RING: u32 = 7;
    let (middle, radius, latitude) = (vec3(0.0, 0.92, 0.0), 1.15, 27_f64.to_radians());
    let ring = |height: f64, turned: f64| {
        (0..RING).map(move |i| {
            let (s, c) =
                (std::f64::consts::TAU * (f64::from(i) + turned) / f64::from(RING)).sin_cos();
            let (up, out) = height.sin_cos();
            vec3(out * c, up, out * s)
        })
    };
    let mut positions = vec![Vec3::Y];
    positions.extend(ring(latitude, 0.0).chain(ring(-latitude, 0.5)));
    positions.push(-Vec3::Y);
    for p in &mut positions {
        *p = middle + *p * radius;
    }
    let last = positions.len() as u32 - 1;
    let (upper, lower) = (|i: u32| 1 + i % RING, |i: u32| 1 + RING + i % RING);
    let sector = |i: u32| {
        let (a, b, c, d) = (upper(i), upper(i + 1), lower(i), lower(i + 1));
        [[0, b, a], [a, b, c], [b, d, c], [last, c, d]]
    };
    let triangles = (0..RING).flat_map(sector).collect();
    Mesh::new(positions, triangles).expect("the arrays are right by construction")
}

/// One velocity per vertex of the star: its tips move away from the middle.
fn tips_outward(star: &Mesh) -> String {
    let mut text = String::from("# one velocity per vertex of star.obj\n");
    for p in &star.positions {
        let is_tip = p.length() > 0.5 * (1.0 + NOTCH);
        let v = if is_tip { *p } else { Vec3::ZERO };
        let _ = writeln!(text, "{:.6} {:.6} {:.6}", v.x, v.y, v.z);
    }
    text
}
