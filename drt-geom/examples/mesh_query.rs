//! What a mesh is like: sizes, topology, and how much of its surface sees the sky.
//!
//! `cargo run --release -p drt-geom --features obj,ply --example mesh_query -- [FILE.obj|FILE.ply]`;
//! without a file, a torus knot.

use drt_geom::{EdgeClass, Hit, Mesh, Ray, Skip, Topology, TriangleBvh, procedural};
use drt_math::{Frame, Rng, vec3};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mesh, dropped) = match std::env::args().nth(1) {
        Some(path) => load(&path)?,
        None => procedural::torus_knot(&procedural::TorusKnot::default()),
    }
    .drop_degenerate();
    let bounds = mesh.bounds();
    println!("{} vertices, {} triangles", mesh.positions.len(), mesh.triangles.len());
    println!("{dropped} degenerate or repeated triangles dropped");
    println!("bounds {:?} to {:?}", bounds.min.to_array(), bounds.max.to_array());
    println!("area {:.6}, volume {:.6}", mesh.surface_area(), mesh.volume());

    let topology = Topology::of(&mesh);
    println!("closed: {}", topology.is_closed());
    println!("consistently oriented: {}", topology.is_consistently_oriented());
    for class in [
        EdgeClass::Boundary,
        EdgeClass::Convex,
        EdgeClass::Concave,
        EdgeClass::Flat,
        EdgeClass::NonManifold,
    ] {
        let count = topology.edges.iter().filter(|e| e.class == class).count();
        println!("{count:8} edges {class:?}");
    }

    let bvh = TriangleBvh::of(&mesh)?;
    let (mean, stderr) = sky_visibility(&mesh, &bvh, 200_000);
    println!("mean visibility of the sky, cosine weighted: {mean:.4} ± {stderr:.4}");
    Ok(())
}

/// The fraction of cosine-distributed directions that leave the mesh, over random points of random
/// triangles, and its standard error.
fn sky_visibility(mesh: &Mesh, bvh: &TriangleBvh, samples: u32) -> (f64, f64) {
    let mut free = 0;
    for i in 0..samples {
        let mut rng = Rng::new(0, 0, i);
        let prim = (rng.next_f64() * mesh.triangles.len() as f64) as u32;
        let [u, v] = rng.next_2d();
        let hit = Hit { t: 0.0, prim, bary: [u.sqrt() * (1.0 - v), u.sqrt() * v] };

        let [u, v] = rng.next_2d();
        let (sin_phi, cos_phi) = (core::f64::consts::TAU * v).sin_cos();
        let local = vec3(u.sqrt() * cos_phi, u.sqrt() * sin_phi, (1.0 - u).sqrt());
        let dir = Frame::from_normal(mesh.normal(prim)).to_world(local);

        let ray = Ray::new(hit.point(mesh.triangle(prim)), dir);
        free += u32::from(!bvh.any(&ray, Skip::one(prim), |_| true));
    }
    let n = f64::from(samples);
    let mean = f64::from(free) / n;
    (mean, (mean * (1.0 - mean) / n).sqrt())
}

fn load(path: &str) -> Result<Mesh, Box<dyn std::error::Error>> {
    #[cfg(feature = "obj")]
    if path.ends_with(".obj") {
        return Ok(drt_geom::read_obj(path)?);
    }
    #[cfg(feature = "ply")]
    if path.ends_with(".ply") {
        return Ok(drt_geom::read_ply(path)?);
    }
    Err(format!("{path}: build with the feature obj or ply to read it").into())
}
