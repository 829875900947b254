//! The spatial form: vertices carried by rays (2019 paper, Eqs. 19–32; theory sheet §2, §3).
//!
//! A path is a function of the camera's ray and of directions and distances that do not depend on the
//! parameters. A ray x + t d whose origin has the velocity x_dot, and whose direction turns by d_dot (the
//! camera's alone; every other direction is an integration variable), carries the points along it by
//! x_dot + t d_dot: volume vertices at fixed t, and the points at which coefficients are looked up. It
//! lands on a surface with unit normal n and velocity u at the distance D, where (D19.19)
//!
//! ```text
//! D_dot = n·(u - x_dot - D d_dot) / (n·d),     x0_dot = x_dot + D d_dot + D_dot d.
//! ```
//!
//! Both are linear in the velocities, so a sensitivity to x0_dot is one to x_dot, d_dot and u: it is
//! carried back from vertex to vertex to the camera, and left on every surface on the way. So one
//! backward sweep serves any number of parameters here, too, and has a transpose.
//!
//! A landing point slides over its triangle with the velocity x0_dot - u. A plane's normal does not mind;
//! an interpolated one does, and turns with the barycentric weights.
//!
//! In homogeneous media surfaces [tow](crate::transport::tow) the volume vertices of rays that meet them: these move
//! along the ray by a share of D_dot.
//!
//! Where a surface is grazed, and in media that move as a whole, vertices [hold](crate::transport::hold) to their
//! matter with a share φ, which adds φ times the material form of their segment.
//!
//! What these derivatives leave out, jumps of the integrand that move, is in
//! [`radiative`](crate::radiative).

use drt_math::{Rgb, RgbVec, Vec3};

use super::{Differentiator, Far, Stretch, moves, send};
use crate::sensitivity::{AdjointSink, SurfaceAdjoint};
use crate::sensor::SensorGradient;
use crate::transport::hold::Hold;
use crate::transport::record::PathRecord;
use crate::transport::tow::Tow;
use crate::transport::vertex::{Kind, SurfacePoint, Vertex};
use crate::transport::world::World;

impl Differentiator<'_> {
    /// The far end of a stretch: `weight` of light passes, `here` holds the sensitivities of the vertex
    /// there, `matter` those to the velocity of the matter it is on. Leaves those of the surface, adds
    /// those of the near end, and returns those of the direction's rate.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn land<S: AdjointSink>(
        &self,
        path: &Stretch<'_>,
        end: &Vertex,
        hold: &Hold,
        here: &SurfaceAdjoint,
        matter: RgbVec,
        weight: Rgb,
        near: &mut SurfaceAdjoint,
        sink: &mut S,
    ) -> RgbVec {
        let free = 1.0 - hold.share;
        let Kind::Surface(point) = &end.kind else {
            let u = here.u * hold.share + matter;
            send(end, &SurfaceAdjoint { u, ..*here }, sink);
            let back = here.u * free;
            near.u += back;
            return back * path.length;
        };
        let shift = weight.outer(hold.slope);
        // A longer way dims what passes.
        let medium = path.crossings.last().map_or(path.medium, |c| c.after);
        let dims = self.world.sigma_t_at_border(medium, end.x, -path.dir) * (weight * -free);
        let (back, mut lift) = split(self.world, point, path.dir, free, here, shift, dims);
        lift.u += matter;
        if sink.interest().shapes[point.shape as usize] {
            sink.surface(&point.material(), &lift);
        }
        near.u += back;
        back * path.length
    }

    /// A stretch whose far end moves with its matter, `weight` of light passing: the sensitivities of that end.
    pub(super) fn held<S: AdjointSink>(
        &mut self,
        path: &Stretch<'_>,
        end: &Vertex,
        near_moves: bool,
        weight: Rgb,
        near: &mut SurfaceAdjoint,
        sink: &mut S,
    ) -> SurfaceAdjoint {
        let mut held = SurfaceAdjoint::default();
        let moving = near_moves || moves(end, sink.interest(), false);
        self.segment(path, Far::Vertex(end, &mut held), moving, weight, near, sink);
        held
    }

    /// What [tows](crate::transport::tow) a volume vertex at the far end of a stretch: leaves its surfaces'
    /// sensitivities, `weight` of light passing and `here` being that to the vertex's velocity. Returns that of
    /// the near end, and that of the direction's rate.
    pub(super) fn tow<S: AdjointSink>(
        &self,
        tows: &[Tow],
        path: &Stretch<'_>,
        end: &Vertex,
        here: RgbVec,
        weight: Rgb,
        sink: &mut S,
    ) -> [RgbVec; 2] {
        let along = here.dot(path.dir)
            - self.world.sigma_t_at_border(end.medium, end.x, -path.dir) * weight;
        let [mut near, mut turn] = [RgbVec::ZERO; 2];
        for tow in tows {
            let g = pull(tow, path.dir, along * tow.share + weight * tow.slope, sink);
            near -= g;
            turn -= g * tow.distance;
        }
        [near, turn]
    }

    /// Sends the sensitivities of a `node`, by its place to the velocity of the ray that left it, and to the rate of that
    /// ray's direction.
    pub(crate) fn carry_back<S: AdjointSink>(
        &self,
        record: &PathRecord,
        node: usize,
        mut here: SurfaceAdjoint,
        turn: RgbVec,
        sink: &mut S,
    ) {
        let (mut k, mut turn) = (node, turn);
        loop {
            let node = &record.nodes[k];
            if !node.carried {
                return;
            }
            let Some(arrival) = &node.arrival else { break };
            if let Some(Vertex { kind: Kind::Surface(point), .. }) = node.vertex() {
                let (dir, none) = (arrival.dir, RgbVec::ZERO);
                let free = 1.0 - node.hold.share;
                let (back, lift) = split(self.world, point, dir, free, &here, none, Rgb::ZERO);
                if sink.interest().shapes[point.shape as usize] {
                    sink.surface(&point.material(), &lift);
                }
                here = SurfaceAdjoint::of_place(back);
            } else if let Some(vertex) = node.vertex() {
                let held = here.u * node.hold.share;
                send(vertex, &SurfaceAdjoint::of_place(held), sink);
                here.u -= held;
            }
            let u = &mut here.u;
            turn = *u * arrival.distance;
            let along = u.dot(arrival.dir);
            for tow in &record.tows[node.tows.clone()] {
                let g = pull(tow, arrival.dir, along * tow.share, sink);
                *u -= g;
                turn -= g * tow.distance;
            }
            k = arrival.parent as usize;
        }
        self.camera_ray(record, here.u, turn, &Default::default(), sink);
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
        if !sink.interest().sensor {
            return;
        }
        let camera = &self.world.camera;
        let gradient = |origin: Vec3, turn: Vec3, seen: &SensorGradient| {
            let mut g = camera.ray_gradient(record.nodes[0].wi, origin, turn);
            g += *seen;
            g
        };
        sink.sensor(&[
            gradient(origin.r, turn.r, &seen[0]),
            gradient(origin.g, turn.g, &seen[1]),
            gradient(origin.b, turn.b, &seen[2]),
        ]);
    }
}

/// Sends the sensitivity `g` to the speed along `dir` at which a ray's distance to a surface grows; returns
/// that to the surface's velocity, which the ray's own opposes.
fn pull<S: AdjointSink>(tow: &Tow, dir: Vec3, g: Rgb, sink: &mut S) -> RgbVec {
    let n = tow.point.ng;
    let u = g.outer(n / n.dot(dir));
    if sink.interest().shapes[tow.point.shape as usize] {
        sink.surface(&tow.point.material(), &SurfaceAdjoint::of_place(u));
    }
    u
}

/// Sensitivities of a point where a ray along `dir` lands, `shift` to the velocity of matter less that of
/// the ray there, and `dims` to the ray's length: split into one to the ray's velocity there, and those
/// of the surface. The point is carried with a share of `free`.
fn split(
    world: &World,
    point: &SurfacePoint,
    dir: Vec3,
    free: f64,
    here: &SurfaceAdjoint,
    shift: RgbVec,
    dims: Rgb,
) -> (RgbVec, SurfaceAdjoint) {
    let slide = here.ns.map(|ns| world.normal_slide(point, ns));
    let carried = (here.u + slide) * free - shift;
    let by_length = carried.dot(dir) + dims;
    let along_normal = by_length.outer(point.ng / point.ng.dot(dir));
    let u = along_normal + here.u - carried;
    let lift = SurfaceAdjoint { u, ..*here };
    (carried - along_normal, lift)
}
