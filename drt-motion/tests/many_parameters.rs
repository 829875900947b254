//! What many parameters do that each move little.

use drt_geom::procedural;
use drt_math::Vec3;
use drt_motion::parameter::{Applied, GeometryChange};
use drt_motion::surface::{SurfaceMotion, move_mesh};

const COUNT: usize = 100;

/// Normals change around a vertex that moves, and nowhere else.
#[test]
fn single_vertices_turn_few_normals() {
    let mesh = procedural::uv_sphere(64);
    let change = |index| GeometryChange::Vertex { index, direction: Vec3::X };
    let changes: Vec<_> = (0..COUNT as u32).map(change).collect();
    let applied: Vec<_> = (changes.iter().enumerate())
        .map(|(parameter, change)| Applied { parameter, theta: 0.0, change })
        .collect();
    let moved = move_mesh(&mesh, &applied, COUNT).unwrap();
    for motion in &moved.motions {
        let SurfaceMotion::Vertices { positions, normals } = motion else {
            panic!("a vertex moves, not {motion:?}");
        };
        assert!(positions.iter().any(|v| *v != Vec3::ZERO));
        let turned = normals.iter().flat_map(|n| n.iter()).filter(|n| **n != Vec3::ZERO).count();
        assert!(turned < mesh.positions.len() / 10, "{turned} normals turn");
    }
}
