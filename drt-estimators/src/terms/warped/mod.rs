//! The warped estimator.

mod beside;
mod edges;

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_math::Vec3;

use crate::derivative::sensitivity::ActiveInputs;
use crate::derivative::velocity::{
    Auxiliary, Blend, Found, RayTurn, Spatial, TurnPart, TurningRay, VelocityField, VertexVelocity,
};
use crate::edges::discontinuities::DiscontinuityEdges;
use crate::terms::warped::edges::{TurningEdges, Weight};
use crate::world::World;
use crate::world::vertex::{SurfacePoint, Vertex};

/// Radians.
const ANGLE: f64 = 0.1;
/// Pixels.
const PIXELS: f64 = 2.0;

#[derive(Debug)]
pub(crate) struct Warped {
    pub(crate) spatial: Arc<Spatial>,
    edges: TurningEdges,
    /// Shapes that move and on which vertices may have a blend weight.
    blended: Vec<bool>,
    /// Edges that can turn rays, and edges in all.
    pub(crate) count: [u64; 2],
}

impl Warped {
    pub(crate) fn new(world: &World, active: &ActiveInputs, spatial: Arc<Spatial>) -> Self {
        let any = active.sensor || active.shapes.contains(&true);
        let found = if any {
            DiscontinuityEdges::collect(world, &active.shapes)
        } else {
            DiscontinuityEdges::default()
        };
        let count = [found.list.len() as u64, found.all];
        let edges = TurningEdges::new(&found, |shape| active.shapes[shape as usize]);
        let blended =
            (0..).zip(&active.shapes).map(|(s, moves)| *moves && spatial.blends.acts_on(world, s));
        let blended = blended.collect();
        Self { spatial, edges, blended, count }
    }
}

impl VelocityField for Warped {
    fn camera(&self) -> VertexVelocity {
        self.spatial.camera()
    }

    fn vertex(
        &self,
        world: &World,
        found: &Found<'_>,
        auxiliary: &mut Vec<Auxiliary>,
    ) -> VertexVelocity {
        let mut velocity = self.spatial.vertex(world, found, auxiliary);
        if let Some(turn) = found.turn {
            velocity.moves = true;
            velocity.blend = velocity.blend.and(turn.rest(found.arrival.distance));
        }
        velocity
    }

    fn turn(
        &self,
        world: &World,
        ray: &TurningRay<'_>,
        parts: &mut Vec<TurnPart>,
    ) -> Option<RayTurn> {
        let always = ray.end.is_some_and(|s| self.blended[s.shape as usize]);
        if !(ray.moves || always || self.edges.any_moves()) {
            return None;
        }
        let mut angle = ANGLE;
        let mut rest = Weight::default();
        if let Some(pixel) = ray.pixel {
            let camera = &world.camera;
            angle = f64::min(PIXELS * camera.pinhole().pixel_size, ANGLE);
            if camera.has_borders() {
                let view = camera.view(camera.position() + ray.dir);
                let (window, slope) = camera.window(pixel, view.pixel);
                let (slope, _) = camera.view_gradient(&view, slope, 0.0);
                // As edges do it rises with the inverse square of the distance.
                rest = Weight {
                    value: 1.0 / (window * window) - 1.0,
                    gradient: slope.reject(ray.dir) * (-2.0 / (window * window * window)),
                };
            }
        }
        self.edges.turn(ray, angle, rest, always, parts)
    }

    fn blend(
        &self,
        world: &World,
        viewer: &Vertex,
        end: &Vertex,
        dir: Vec3,
        distance: f64,
    ) -> Blend {
        self.spatial.blend(world, viewer, end, dir, distance)
    }

    fn turns_rays(&self, _: &World, _: &SurfacePoint, _: &VertexVelocity) -> bool {
        false
    }

    fn widest_paired(&self, _: bool) -> f64 {
        0.0
    }
}
