//! The velocity field of rays that turn with edges.

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_math::Vec3;

use crate::derivative::sensitivity::ActiveInputs;
use crate::derivative::velocity::{
    Auxiliary, Blend, Found, Probe, RayTurn, Spatial, TurnPart, TurnParts, TurningRay,
    VelocityField, VertexVelocity, Weight,
};
use crate::sampling::trace::Endpoint;
use crate::terms::warped::edges::TurningEdges;
use crate::terms::warped::near::ANGLE;
use crate::terms::warped::shadows::Flow;
use crate::world::World;
use crate::world::lights::LightSample;
use crate::world::vertex::Vertex;

/// Pixels.
const PIXELS: f64 = 2.0;

/// The spatial form, with rays that turn.
#[derive(Debug)]
pub(super) struct EdgeTurns {
    spatial: Arc<Spatial>,
    edges: TurningEdges,
    /// Shapes that move and on which vertices may have a blend weight.
    blended: Vec<bool>,
    /// Shapes with curved surfaces: vertices on them move with their matter.
    curved: Vec<bool>,
}

impl EdgeTurns {
    pub(super) fn new(
        world: &World,
        active: &ActiveInputs,
        spatial: Arc<Spatial>,
        edges: TurningEdges,
        curved: Vec<bool>,
    ) -> Self {
        let blends = |s: u32| spatial.blends.acts_on(world, s);
        let blended = (0..)
            .zip(&active.shapes)
            .map(|(s, moves)| *moves && (blends(s) || curved[s as usize]))
            .collect();
        Self { spatial, edges, blended, curved }
    }
}

impl VelocityField for EdgeTurns {
    fn camera(&self) -> VertexVelocity {
        self.spatial.camera()
    }

    fn vertex(
        &self,
        world: &World,
        found: &Found<'_>,
        probe: &mut Probe,
        auxiliary: &mut Vec<Auxiliary>,
    ) -> VertexVelocity {
        let mut velocity = self.spatial.vertex(world, found, probe, auxiliary);
        if let Endpoint::Surface(v) = &found.arrival.end
            && v.surface().is_some_and(|s| self.curved[s.shape as usize])
        {
            velocity.blend = Blend::MATERIAL;
        }
        if let Some(turn) = found.turn {
            velocity.moves = true;
            velocity.blend = velocity.blend.and(turn.rest(found.arrival.distance));
        }
        velocity
    }

    fn may_move(&self) -> bool {
        self.spatial.may_move()
    }

    fn turn(
        &self,
        world: &World,
        ray: &TurningRay<'_>,
        _: &mut Probe,
        parts: &mut Vec<TurnPart>,
    ) -> Option<RayTurn> {
        let always = ray.end.is_some_and(|s| self.blended[s.shape as usize]);
        if !(ray.moves || always || self.edges.any_moves()) {
            return None;
        }
        let (angle, rest) = around(world, ray);
        self.edges.turn(ray, angle, rest, always, parts)
    }

    fn turn_with_shadows(
        &self,
        world: &World,
        ray: &TurningRay<'_>,
        light: &LightSample,
        light_moves: bool,
        parts: &mut TurnParts,
    ) -> Option<RayTurn> {
        if !(ray.moves || light_moves || self.edges.any_moves()) {
            return None;
        }
        let (angle, rest) = around(world, ray);
        let flow = Flow::new(ray, ray.end?, light, angle, world.geometry.radius)?;
        self.edges.turn_with_shadows(ray, &flow, angle, rest, light_moves, parts)
    }

    fn blend(
        &self,
        world: &World,
        viewer: &Vertex,
        end: &Vertex,
        dir: Vec3,
        distance: f64,
    ) -> Blend {
        match end.surface() {
            Some(s) if self.curved[s.shape as usize] => Blend::MATERIAL,
            _ => self.spatial.blend(world, viewer, end, dir, distance),
        }
    }
}

/// Within which angle edges turn a ray, and the weight of what does not turn with it.
fn around(world: &World, ray: &TurningRay<'_>) -> (f64, Weight) {
    let Some(pixel) = ray.pixel else { return (ANGLE, Weight::default()) };
    let camera = &world.camera;
    let angle = f64::min(PIXELS * camera.pinhole().pixel_size, ANGLE);
    if !camera.has_borders() {
        return (angle, Weight::default());
    }
    let view = camera.view(camera.position() + ray.dir);
    let (window, slope) = camera.window(pixel, view.pixel);
    let (slope, _) = camera.view_gradient(&view, slope, 0.0);
    // As edges do it rises with the inverse square of the distance.
    let gradient = slope.reject(ray.dir) * (-2.0 / (window * window * window));
    (angle, Weight { value: 1.0 / (window * window) - 1.0, gradient })
}
