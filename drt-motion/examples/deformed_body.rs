//! drt-motion and drt-geom alone, in somebody else's program: a body bent by a cage, what its surface
//! and the space around it do, how they go on moving with the bend, and the way back for an optimiser.
//!
//! `cargo run --release -p drt-motion --example deformed_body`

use std::sync::Arc;

use drt_geom::{TetrahedralizeInput, procedural, tetrahedralize};
use drt_math::{Affine, Mat3, Vec3, vec3};
use drt_motion::interior::{Carrier, TetrahedralField};
use drt_motion::mean_value::{Cage, CageWeights};
use drt_motion::parameter::Applied;
use drt_motion::surface::{VertexGradient, move_mesh};
use drt_motion::volume::VolumeAdjoint;
use drt_motion::{GeometryChange, SurfaceMotion, SurfacePoint};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let stretched = |mesh: &drt_geom::Mesh, size: Vec3| {
        mesh.transform(&Affine { linear: Mat3::diagonal(size), translation: Vec3::ZERO })
    };
    let body = stretched(&procedural::icosphere(3), vec3(0.4, 0.4, 1.0));
    let cage = Arc::new(stretched(&procedural::cube(), vec3(0.6, 0.6, 1.2)));

    // The upper corners of the cage move sideways, as far as the parameter says.
    let upper = cage.positions.iter().enumerate().filter(|(_, p)| p.z > 0.0);
    let sideways = upper.map(|(i, _)| (cage.source_vertex(i as u32), Vec3::X)).collect();
    let bend = GeometryChange::Cage { mesh: Arc::clone(&cage), vertices: sideways };
    let moved = move_mesh(&body, &[Applied { parameter: 0, theta: 0.3, change: &bend }], 1)?;
    let motion = &moved.motions[0];
    println!("volume {:.6}, bent {:.6}", body.volume(), moved.mesh.volume());

    // The surface: how its area grows.
    let triangles = 0..moved.mesh.triangles.len() as u32;
    let growth: f64 = triangles
        .clone()
        .map(|triangle| {
            let middle = SurfacePoint { triangle, bary: [1.0 / 3.0; 2] };
            moved.mesh.area(triangle) * motion.jet(&moved.mesh, &middle).j_dot
        })
        .sum();
    println!("area {:.6}, its derivative by the bend {growth:.6}", moved.mesh.surface_area());

    // The inside and the space around: a continuous field with the surface's velocity.
    let input = TetrahedralizeInput { surfaces: &[&moved.mesh], points: &[], margin: 0.5 };
    let field = TetrahedralField::new(tetrahedralize(&input)?)?;
    let velocities = field.velocities(&[Carrier { mesh: &moved.mesh, motion }], &[]);
    for z in [-0.9, 0.0, 0.9, 1.5] {
        let x = vec3(0.15 + 0.1 * z, 0.05, z);
        let jet = field.place(x).jet(&velocities);
        println!(
            "at {:?}: velocity {:?}, divergence {:.4}",
            x.to_array(),
            jet.u.to_array(),
            jet.j_dot
        );
    }

    // The way back: a wish at one point inside, in terms of the cage's corners.
    let mut at_vertices = vec![Vec3::ZERO; velocities.len()];
    let wish = VolumeAdjoint { u: vec3(1.0, 0.0, 0.5), j: 0.0 };
    let wished = vec3(0.2, 0.0, 0.6);
    field.place(wished).scatter(&wish, &mut at_vertices);
    let mut at_surface = VertexGradient::zeros(&moved.mesh);
    field.gather(at_vertices, &mut [(&moved.mesh, Some(&mut at_surface))], &mut []);
    let at_cage =
        CageWeights::new(&Cage::new(&cage)?, &body.positions).gather(&at_surface.positions);
    for (corner, gradient) in at_cage.iter().enumerate() {
        println!("corner {corner}: {:?}", gradient.to_array());
    }
    let SurfaceMotion::Vertices { positions, .. } = motion else { return Ok(()) };
    let along: f64 =
        at_surface.positions.iter().zip(positions.iter()).map(|(g, v)| g.dot(*v)).sum();
    let directly = field.place(wished).jet(&velocities).u.dot(wish.u);
    println!("along the bend {along:.12}, directly {directly:.12}");
    assert!((along - directly).abs() < 1e-12);
    Ok(())
}
