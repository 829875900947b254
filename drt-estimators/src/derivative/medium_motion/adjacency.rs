//! Which media touch which shapes.

use alloc::vec::Vec;

use crate::world::World;

/// The media that each shape touches.
pub(crate) fn adjacency(world: &World) -> Vec<Vec<usize>> {
    let scene = &world.scene;
    scene
        .shapes
        .iter()
        .enumerate()
        .map(|(i, shape)| match shape.boundary {
            Some(b) => b.interior.into_iter().chain(b.exterior).collect(),
            // A null sheet that separates nothing has no effect at all.
            None if world.is_null(i as u32) || !world.has_media() => Vec::new(),
            None => {
                let mut found: Vec<usize> = Vec::new();
                let step = 1 + shape.mesh.triangles.len() / 256;
                for t in (0..shape.mesh.triangles.len() as u32).step_by(step) {
                    let [a, b, c] = shape.mesh.triangle(t);
                    if let Some(m) = world.medium_at((a + b + c) * (1.0 / 3.0))
                        && !found.contains(&m)
                    {
                        found.push(m);
                    }
                }
                found
            }
        })
        .collect()
}
