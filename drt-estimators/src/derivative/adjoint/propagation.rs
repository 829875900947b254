//! Where the sensitivities of a vertex go: to the matter that it moves with, and back along the ray that
//! found it.
//!
//! With the symbols of [`velocity`](crate::derivative::velocity), v = φ u + (1-φ) c + Σ a (b·w) is linear in
//! the velocities of matter, of the ray's origin and of the rate of its direction, so a sensitivity to v is
//! one to each of them. Those to the ray are propagated from vertex to vertex to the camera, and leave what
//! belongs to surfaces on the way. So one backward sweep serves any number of parameters, and has a
//! transpose.

use drt_math::{Rgb, RgbVec, Vec3};

use crate::derivative::adjoint::chain::Single;
use crate::derivative::adjoint::segment::{Far, Stretch};
use crate::derivative::adjoint::{Differentiator, moves, send};
use crate::derivative::recorded_path::RecordedPath;
use crate::derivative::sensitivity::{AdjointSink, SurfaceAdjoint, VelocityTerm};
use crate::derivative::velocity::{Auxiliary, Moved, VertexVelocity};
use crate::model::sensor::SensorGradient;
use crate::sampling::record::PathRecord;
use crate::world::World;
use crate::world::vertex::{Kind, SurfacePoint, Vertex};

/// A vertex whose sensitivities are sent off.
pub(super) struct Propagated<'a> {
    pub(super) vertex: &'a Vertex,
    pub(super) velocity: &'a VertexVelocity,
    pub(super) auxiliary: &'a [Auxiliary],
    /// Light that passes.
    pub(super) weight: Rgb,
    /// Sensitivities to the velocity of the matter that the vertex is on.
    pub(super) matter: RgbVec,
}

/// Sensitivities to the rate of the direction of the ray that found a vertex.
pub(super) struct TurnedBack {
    /// As surfaces beside the vertex move along the ray.
    pub(super) by_surfaces: RgbVec,
    /// As the vertex moves with the ray.
    pub(super) by_ray: RgbVec,
}

impl Differentiator<'_> {
    /// Sends the sensitivities `here` of the vertex at the far end of a stretch: leaves those of matter, adds
    /// those of the near end to `near`, and returns those of the direction's rate.
    pub(super) fn propagate<S: AdjointSink>(
        &self,
        path: &Stretch<'_>,
        end: &Propagated<'_>,
        here: &mut SurfaceAdjoint,
        near: &mut SurfaceAdjoint,
        sink: &mut S,
    ) -> TurnedBack {
        let Propagated { vertex, velocity, auxiliary, weight, matter } = *end;
        let blend = velocity.blend;
        let free = 1.0 - blend.weight;
        let mut by_surfaces = RgbVec::ZERO;
        let still = |a: &&Auxiliary| self.edges_at_rest && a.moved == Moved::FromViewer;
        for a in auxiliary.iter().filter(|a| !still(a)) {
            let g = match a.moved {
                // A longer way dims what passes.
                Moved::RayPoint(_) => {
                    let dims = self.world.sigma_t_at_border(vertex.medium, vertex.x, -path.dir)
                        * a.displacement.dot(path.dir);
                    (here.u.dot(a.displacement) - dims * weight) * free
                        + weight * free * a.divergence
                }
                _ => self.moved_by(a, vertex, here, matter) + weight * a.divergence,
            };
            let [origin, turned] = summand(a, g, sink);
            near.u += origin;
            by_surfaces += turned;
        }
        if free == 0.0 {
            here.u += matter;
            send(vertex, here, sink);
            return TurnedBack { by_surfaces, by_ray: RgbVec::ZERO };
        }
        let Kind::Surface(point) = &vertex.kind else {
            let u = here.u * blend.weight + matter;
            send(vertex, &SurfaceAdjoint { u, ..*here }, sink);
            let back = here.u * free;
            near.u += back;
            return TurnedBack { by_surfaces, by_ray: back * path.length };
        };
        let shift = weight.outer(blend.gradient);
        let dims = self.dims(path, vertex, weight * free);
        let (back, mut lift) = split(self.world, point, path.dir, free, here, shift, dims);
        lift.u += matter;
        if sink.active().shapes[point.shape as usize] {
            sink.surface(&point.material(), &lift);
        }
        near.u += back;
        TurnedBack { by_surfaces, by_ray: back * path.length }
    }

    /// Sensitivity to the length of a stretch that ends at a surface, at fixed direction.
    fn dims(&self, path: &Stretch<'_>, end: &Vertex, weight: Rgb) -> Rgb {
        let medium = path.crossings.last().map_or(path.medium, |c| c.after);
        self.world.sigma_t_at_border(medium, end.x, -path.dir) * -weight
    }

    /// Sensitivity to the rate of a stretch's direction by where it ends, `here` being what is known of the end.
    pub(super) fn landing(
        &self,
        path: &Stretch<'_>,
        end: &Vertex,
        here: &SurfaceAdjoint,
        weight: Rgb,
    ) -> RgbVec {
        let Kind::Surface(point) = &end.kind else { return here.u * path.length };
        let dims = self.dims(path, end, weight);
        split(self.world, point, path.dir, 1.0, here, RgbVec::ZERO, dims).0 * path.length
    }

    /// The sensitivity to b·w of a summand that moves the vertex itself.
    fn moved_by(
        &self,
        a: &Auxiliary,
        vertex: &Vertex,
        here: &SurfaceAdjoint,
        matter: RgbVec,
    ) -> Rgb {
        let slide = match &vertex.kind {
            Kind::Surface(point) => slide(self.world, point, here),
            _ => RgbVec::ZERO,
        };
        (here.u + slide + matter).dot(a.displacement)
    }

    /// A stretch whose far end moves with its matter, `weight` of light passing: adds the sensitivities of that end to `fixed`,
    /// and returns that of transmittance to the rate of the direction.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn material_end<S: AdjointSink>(
        &mut self,
        path: &Stretch<'_>,
        end: &Vertex,
        ray_moves: bool,
        weight: Rgb,
        fixed: &mut SurfaceAdjoint,
        near: &mut SurfaceAdjoint,
        sink: &mut S,
    ) -> RgbVec {
        let moving = ray_moves || moves(end, sink.active());
        self.segment(path, Far::Vertex(end, fixed), moving, weight, near, sink)
    }

    /// Sends the sensitivities of a ray along `dir` from a node: to the velocity of its `origin`, and to the rate of its
    /// direction, `turn`. `turns` is its index among the rays that turn.
    #[allow(clippy::too_many_arguments)]
    pub(crate) fn send_back_ray<S: AdjointSink>(
        &self,
        path: &RecordedPath<'_>,
        node: usize,
        dir: Vec3,
        turns: Option<u32>,
        mut origin: RgbVec,
        mut turn: RgbVec,
        sink: &mut S,
    ) {
        if let Some(ray) = path.ray_motion(turns) {
            origin -= ray.send(dir, &turn, Rgb::ZERO, sink);
            turn -= turn * ray.turn.weight;
        }
        let at = SurfaceAdjoint::of_place(origin);
        self.send_back(path, node, at, RgbVec::ZERO, turn, sink);
    }

    /// Sends the sensitivities of a node: `here` to its velocity and normals, `matter` to the velocity of what
    /// it is on, and of the camera, `turn` to the rate of its ray's direction. No light depends on the distance of the
    /// node or on its area.
    pub(crate) fn send_back<S: AdjointSink>(
        &self,
        path: &RecordedPath<'_>,
        node: usize,
        mut here: SurfaceAdjoint,
        mut matter: RgbVec,
        mut turn: RgbVec,
        sink: &mut S,
    ) {
        let RecordedPath { record, velocities, .. } = *path;
        let mut k = node;
        loop {
            let velocity = velocities.of(k);
            let node = &record.nodes[k];
            let Some(arrival) = &node.arrival else { break };
            let Some(vertex) = node.vertex() else { return };
            if !velocity.moves {
                return send(vertex, &SurfaceAdjoint::of_place(matter), sink);
            }
            let free = 1.0 - velocity.blend.weight;
            let mut back = RgbVec::ZERO;
            let mut turned = RgbVec::ZERO;
            let mut turned_wholly = RgbVec::ZERO;
            if let Some(single) = Single::at(self.world, node) {
                let (to_wo, by_n) = single.pull(self.world, turn, sink);
                here.ns += by_n;
                turned -= to_wo;
                turned_wholly -= to_wo;
            }
            for a in velocities.auxiliary(velocity) {
                let g = match a.moved {
                    Moved::RayPoint(_) => here.u.dot(a.displacement) * free,
                    _ => self.moved_by(a, vertex, &here, matter),
                };
                let [origin, direction] = summand(a, g, sink);
                back += origin;
                turned += direction;
                turned_wholly += direction;
            }
            if let Some(ray) = path.ray_motion(velocity.turn) {
                let (dir, distance, none) = (arrival.dir, arrival.distance, RgbVec::ZERO);
                turned_wholly += match &vertex.kind {
                    Kind::Surface(point) => {
                        split(self.world, point, dir, 1.0, &here, none, Rgb::ZERO).0 * distance
                    }
                    _ => here.u * distance,
                };
                back -= ray.send(dir, &turned_wholly, Rgb::ZERO, sink);
                turned -= turned_wholly * ray.turn.weight;
            }
            match &vertex.kind {
                _ if free == 0.0 => {
                    send(vertex, &SurfaceAdjoint { u: here.u + matter, ..here }, sink);
                    if back == RgbVec::ZERO {
                        return;
                    }
                }
                Kind::Surface(point) => {
                    let (dir, none) = (arrival.dir, RgbVec::ZERO);
                    let (own, mut lift) =
                        split(self.world, point, dir, free, &here, none, Rgb::ZERO);
                    lift.u += matter;
                    if sink.active().shapes[point.shape as usize] {
                        sink.surface(&point.material(), &lift);
                    }
                    back += own;
                    turned += own * arrival.distance;
                }
                _ => {
                    let u = here.u * velocity.blend.weight + matter;
                    send(vertex, &SurfaceAdjoint::of_place(u), sink);
                    let own = here.u * free;
                    back += own;
                    turned += own * arrival.distance;
                }
            }
            (here, matter, turn) = (SurfaceAdjoint::of_place(back), RgbVec::ZERO, turned);
            k = arrival.parent as usize;
        }
        self.camera_ray(record, here.u + matter, turn, &Default::default(), sink);
    }

    /// Sends the sensitivities to the camera ray's origin and to the rate of its direction, besides what
    /// was `seen` of its own.
    pub(super) fn camera_ray<S: AdjointSink>(
        &self,
        record: &PathRecord,
        origin: RgbVec,
        turn: RgbVec,
        seen: &[SensorGradient; 3],
        sink: &mut S,
    ) {
        if !sink.active().sensor {
            return;
        }
        let gradient = |origin: Vec3, turn: Vec3, seen: &SensorGradient| {
            let mut g = self.camera.ray_gradient(record.origin, record.nodes[0].wi, origin, turn);
            g += *seen;
            self.world.camera.lens_gradient(record.camera_ray.lens, g)
        };
        sink.sensor(&[
            gradient(origin.r, turn.r, &seen[0]),
            gradient(origin.g, turn.g, &seen[1]),
            gradient(origin.b, turn.b, &seen[2]),
        ]);
    }
}

/// Sends the sensitivity `g` to b·w of a summand; returns those to the velocity of the ray's origin and to the
/// rate of its direction.
fn summand<S: AdjointSink>(a: &Auxiliary, g: Rgb, sink: &mut S) -> [RgbVec; 2] {
    if sink.active().moves(&a.matter) {
        VelocityTerm::of(a.matter, a.functional).send(g, sink);
    }
    let origin = -g.outer(a.functional);
    match a.moved {
        Moved::RayPoint(distance) => [origin, origin * distance],
        Moved::FromViewer => [origin, RgbVec::ZERO],
        #[cfg(test)]
        Moved::Vertex => [RgbVec::ZERO; 2],
    }
}

/// Sensitivity to the place of a point on its surface, by what changes there.
fn slide(world: &World, point: &SurfacePoint, here: &SurfaceAdjoint) -> RgbVec {
    here.ns.map(|ns| world.normal_slide(point, ns)) + here.slide
}

/// Sensitivities of a point where a ray along `dir` lands, `shift` to the velocity of matter less that of
/// the ray there, and `dims` to the ray's length: split into one to the ray's velocity there, and those
/// of the surface. `free` is 1 - φ.
fn split(
    world: &World,
    point: &SurfacePoint,
    dir: Vec3,
    free: f64,
    here: &SurfaceAdjoint,
    shift: RgbVec,
    dims: Rgb,
) -> (RgbVec, SurfaceAdjoint) {
    let by_ray = (here.u + slide(world, point, here)) * free - shift;
    let by_length = by_ray.dot(dir) + dims;
    let along_normal = by_length.outer(point.ng / point.ng.dot(dir));
    let u = along_normal + here.u - by_ray;
    let lift = SurfaceAdjoint { u, ..*here };
    (by_ray - along_normal, lift)
}
