//! The velocity field of rays that turn with edges.

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_math::Vec3;

use crate::derivative::sensitivity::ActiveInputs;
use crate::derivative::velocity::{
    Auxiliary, Blend, ChainPart, ChainedRay, Found, LinkChange, Probe, RayTurn, Spatial, TurnPart,
    TurnParts, TurningRay, VelocityField, VertexVelocity, Weight,
};
use crate::estimators::warped::behind_chains::TurnedBehind;
use crate::estimators::warped::edge_weights::ANGLE;
use crate::estimators::warped::edges::{Limits, TurningEdges, divide};
use crate::estimators::warped::rates_across::Border;
use crate::estimators::warped::shadows::Flow;
use crate::model::sensor::Pinhole;
use crate::sampling::record::CameraRay;
use crate::sampling::trace::Endpoint;
use crate::world::World;
use crate::world::lights::LightSample;
use crate::world::vertex::{SurfacePoint, Vertex};

/// Pixels.
const PIXELS: f64 = 2.0;

/// Of the radius of curvature: from how far vertices on a curved surface move with their matter.
const NEAR: f64 = 0.5;

/// The spatial form, with rays that turn.
#[derive(Debug)]
pub(super) struct EdgeTurns {
    spatial: Arc<Spatial>,
    edges: TurningEdges,
    /// Shapes that move and on which vertices may have a blend weight.
    blended: Vec<bool>,
    /// Shapes whose index of refraction changes, and turns light that goes on in a single direction.
    bending: Vec<bool>,
    /// The camera moves.
    camera_moves: bool,
    /// Mean curvatures of the shapes, 1 / scene units: on curved surfaces vertices move with their matter.
    curvatures: Vec<f64>,
}

impl EdgeTurns {
    pub(super) fn new(
        world: &World,
        active: &ActiveInputs,
        spatial: Arc<Spatial>,
        edges: TurningEdges,
    ) -> Self {
        let blends = |s: u32| spatial.blends.acts_on(world, s);
        let blended = (0..).zip(&active.shapes).map(|(s, moves)| *moves && blends(s)).collect();
        let bending = world.scene.shapes.iter().map(|s| active.bending[s.bsdf]).collect();
        let shapes = 0..world.scene.shapes.len() as u32;
        let curvatures = shapes.map(|s| spatial.blends.curvature(s)).collect();
        Self { spatial, edges, blended, bending, camera_moves: active.sensor, curvatures }
    }

    /// φ of a vertex on a curved surface; `None` on others. `of_camera` is the ray that the path starts with, where it is this
    /// ray that found the vertex.
    ///
    /// Where a pixel's filter jumps, what the camera sees at the border must keep its image point, so that φ falls to 0 there.
    /// A viewer in a medium, on another surface, or whose ray turned does not move with this matter, however near it is, and the
    /// segment between them turns by the difference over its length r. So near it φ falls with the square of r; farther away φ is
    /// 1, as the difference grows where a ray grazes, and must not meet a slope of φ there.
    fn of_matter(
        &self,
        world: &World,
        of_camera: Option<CameraRay>,
        end: &Vertex,
        dir: Vec3,
        distance: f64,
    ) -> Option<Blend> {
        let curvature = self.curvatures[end.surface()?.shape as usize];
        if curvature == 0.0 {
            return None;
        }
        Some(match of_camera {
            Some(ray) if world.camera.has_borders() => Blend::of_window(world, end.x, ray),
            Some(_) => Blend::MATERIAL,
            None => Blend::of_distance(dir, distance, curvature / NEAR),
        })
    }

    fn limits(&self, world: &World, ray: &TurningRay<'_>) -> Limits {
        let (angle, rest) = around(world, ray);
        Limits { angle, rest, borders: self.borders(world, ray) }
    }

    /// The borders of the pixel that a ray is in, if it starts at a camera at rest whose filter jumps there.
    fn borders(&self, world: &World, ray: &TurningRay<'_>) -> Option<[Border; 2]> {
        let has_borders = world.camera.has_borders() && !self.camera_moves;
        let CameraRay { pixel, lens } = ray.of_camera.filter(|_| has_borders)?;
        let camera = &*world.camera.at_lens(lens);
        let view = camera.view(camera.position() + ray.dir);
        let Pinhole { right, up, forward, .. } = *camera.pinhole();
        let border = |k: usize, axis: Vec3| {
            let (window, slope) = camera.window_along(pixel, view.pixel, k);
            let mut slopes = [0.0; 2];
            slopes[k] = slope;
            let (slope, _) = camera.view_gradient(&view, slopes, 0.0);
            let gradient = slope.reject(ray.dir) * (-2.0 / (window * window * window));
            let weight = Weight { value: 1.0 / (window * window) - 1.0, gradient };
            Border { axis, forward, weight }
        };
        Some([border(0, right), border(1, up)])
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
        let Found { viewer, arrival, .. } = *found;
        let of_camera = viewer.is_none().then_some(found.camera_ray);
        if let Endpoint::Surface(v) = &arrival.end
            && let Some(blend) = self.of_matter(world, of_camera, v, arrival.dir, arrival.distance)
        {
            velocity.blend = blend;
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

    fn follows_edges(&self) -> bool {
        true
    }

    fn is_continuous_in_view(&self) -> bool {
        true
    }

    fn bends(&self, s: &SurfacePoint) -> bool {
        self.bending[s.shape as usize]
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
        self.edges.turn(ray, &self.limits(world, ray), always, parts)
    }

    fn turn_with_chain(
        &self,
        world: &World,
        chain: &ChainedRay<'_>,
        parts: &mut Vec<TurnPart>,
        chained: &mut Vec<ChainPart>,
    ) -> Option<RayTurn> {
        let tangent_plane = TurnedBehind::tangent_plane(chain);
        let start = &TurningRay { tangent_plane, ..chain.start };
        let (angle, rest) = around(world, start);
        let behind = TurnedBehind::new(world, &self.edges, chain, angle, |s| LinkChange {
            moves: self.spatial.moves(s),
            bends: self.bends(s),
        });
        if !(behind.moves || start.moves || self.edges.moves_beside(start, angle)) {
            return None;
        }
        let first = [parts.len(), chained.len()];
        let near = self.edges.near(start, angle);
        let beside = self.edges.gather(&near, start.moves, parts);
        let all = behind.by_u(&beside) + behind.sum;
        if all.re == 0.0 {
            return None;
        }
        let total = all + behind.by_u(&(Weight::constant(1.0) + rest));
        divide(&mut parts[first[0]..], start.dir, behind.by_direction(total));
        chained.extend(behind.finish(total));
        let Weight { value: weight, gradient } = behind.by_direction(all / total);
        let [parts, chain] = [first[0]..parts.len(), first[1]..chained.len()];
        Some(RayTurn { weight, gradient, parts, chain, shadow: None })
    }

    fn emission_turns_apart(&self, s: &SurfacePoint) -> bool {
        self.edges.emission_turns_apart(s)
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
        let limits = self.limits(world, ray);
        let flow = Flow::new(world, ray, ray.end?, light, limits.angle)?;
        self.edges.turn_with_shadows(ray, &flow, &limits, light_moves, parts)
    }

    fn blend(
        &self,
        world: &World,
        viewer: &Vertex,
        end: &Vertex,
        dir: Vec3,
        distance: f64,
    ) -> Blend {
        self.of_matter(world, None, end, dir, distance)
            .unwrap_or_else(|| self.spatial.blend(world, viewer, end, dir, distance))
    }
}

/// Within which angle edges turn a ray, and the weight of what does not turn with it.
fn around(world: &World, ray: &TurningRay<'_>) -> (f64, Weight) {
    let Some(CameraRay { pixel, lens }) = ray.of_camera else { return (ANGLE, Weight::default()) };
    let camera = &*world.camera.at_lens(lens);
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
