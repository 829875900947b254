//! How fast edges move.

use drt_motion::SurfaceMotion;

use crate::derivative::contraction::Motion;
use crate::derivative::velocity::EdgeMatter;
use crate::discontinuities::edge::Edge;
use crate::world::World;

/// How fast an edge moves across itself, at most and relative to the fastest vertex of each
/// parameter: 0 only for edges that stay in their lines.
pub(crate) fn speeds<'a>(motion: &'a Motion, world: &'a World) -> impl Fn(&Edge) -> f64 + 'a {
    let mut fastest = alloc::vec![0.0; motion.parameters()];
    for (shape, motions) in world.scene.shapes.iter().zip(&motion.tangents.shapes) {
        for (p, of_shape) in motions {
            fastest[*p] = f64::max(fastest[*p], of_shape.fastest(&shape.mesh));
        }
    }
    move |edge| {
        let of_matter = |matter: EdgeMatter| {
            let shape = matter.point.shape as usize;
            let mesh = &world.scene.shapes[shape].mesh;
            let speed = |(p, of_shape): &(usize, SurfaceMotion)| {
                let velocity = matter.push(of_shape.velocity(mesh, &matter.point.at));
                let across = velocity.reject(edge.wedge.tangent).length();
                across / f64::max(fastest[*p], f64::MIN_POSITIVE)
            };
            let triangle = matter.point.at.triangle;
            motion.tangents.felt_on(shape, triangle).map(speed).fold(0.0, f64::max)
        };
        let at = |end| {
            let (own, other) = edge.matter(world, end);
            of_matter(own) + other.map_or(0.0, &of_matter)
        };
        f64::max(at(0.0), at(1.0))
    }
}
