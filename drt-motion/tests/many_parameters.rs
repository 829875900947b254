//! What a parameter costs that moves little.

use std::time::Instant;

use drt_geom::procedural;
use drt_math::Vec3;
use drt_motion::parameter::{Applied, GeometryChange};
use drt_motion::surface::{SurfaceMotion, move_mesh};

const COUNT: usize = 100;

/// Seconds for a mesh that so many changes move, each by a parameter of its own that is zero.
fn seconds(change: impl Fn(u32) -> GeometryChange) -> f64 {
    let mesh = procedural::uv_sphere(64);
    let changes: Vec<_> = (0..COUNT as u32).map(change).collect();
    let applied: Vec<_> = (changes.iter().enumerate())
        .map(|(parameter, change)| Applied { parameter, theta: 0.0, change })
        .collect();
    let start = Instant::now();
    let moved = move_mesh(&mesh, &applied, COUNT).unwrap();
    assert!(moved.motions.iter().all(|m| *m != SurfaceMotion::Rest));
    start.elapsed().as_secs_f64()
}

/// Normals change around a vertex that moves, and nowhere else.
#[test]
fn single_vertices_cost_less_than_all() {
    let count = procedural::uv_sphere(64).source_vertex_count as usize;
    let all = seconds(|_| GeometryChange::VertexVelocity(vec![Vec3::Z; count].into()));
    let single = seconds(|index| GeometryChange::Vertex { index, direction: Vec3::X });
    assert!(single < 0.5 * all, "{single} s for single vertices, {all} s for all");
}
