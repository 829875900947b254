//! The segment by which a path arrived at a node, and the factors of the path's value that belong to it.
//!
//! Node k was found by the ray that left its parent p along d over the distance t. It receives R_k, and with the symbols of the
//! [module](super) its segment changes the value by
//!
//! | step | factor | by |
//! |---|---|---|
//! | [throughput](Differentiator::pass_on) | a_k R_k, a summand of the parent's C | |
//! | [turn of the parent's scattering](Differentiator::scatter_into) | f_p(d) | Θ_p σ_p a_k R_k / p, by d and what lies behind the parent |
//! | [end](Differentiator::end_at_vertex) | geometric term, Jacobian and transmittance, of the camera also importance and filter | Θ_k R_k, by both ends |
//! | [turn of the ray](Differentiator::turn_ray) | all of these once more | the rate at which a ray turns with the edges beside it |
//!
//! The far end has the velocity v = φ u + (1 - φ) c + Σ a (b·w) ([`velocity`](crate::derivative::velocity)). A part φ of it is that of
//! matter: there the segment is one between two points (2021 paper, Eqs. 23–30; theory sheet §2). The rest is that of the ray, which
//! lands somewhere else as it turns: there the segment is one along a direction (2019 paper, Eq. 19; theory sheet §3).

use drt_math::{Rgb, RgbVec, Vec3};

use crate::derivative::adjoint::antithetic::Apart;
use crate::derivative::adjoint::chain::Single;
use crate::derivative::adjoint::propagation::Propagated;
use crate::derivative::adjoint::segment::{Far, Stretch};
use crate::derivative::adjoint::{Differentiator, Local, NodeMotion, moves, send, turn};
use crate::derivative::recorded_path::RecordedPath;
use crate::derivative::sensitivity::{AdjointSink, SurfaceAdjoint};
use crate::derivative::velocity::RayTurn;
use crate::sampling::record::{Node, Role, Scattered};
use crate::sampling::trace::{Arrival, Endpoint};
use crate::world::vertex::Vertex;

/// The segment that ends at a node, for what the node receives by one of its motions.
struct Segment<'a> {
    path: &'a RecordedPath<'a>,
    node: usize,
    parent: usize,
    arrival: &'a Arrival,
    motion: &'a NodeMotion<'a>,
    /// The far end; `None` in the environment.
    vertex: Option<&'a Vertex>,
    /// The part φ of the far end's motion that is its matter's.
    phi: f64,
    /// The camera's rays are parallel, and this is one of them: it starts on the film, at a point that moves with what it sees, as far
    /// as that moves with matter.
    parallel: bool,
    /// a_k R_k, what reaches the parent per unit of its scattering.
    value: Rgb,
    /// a_k and Θ_k times what the factors of the segment multiply: R_k, less the level of the pixel where the camera looks along it.
    measured: Rgb,
    weight: Rgb,
    near_moves: bool,
    ray_moves: bool,
}

/// Sensitivities to the rate of a segment's direction.
struct Turned {
    /// Those by everything that the direction is seen by. A ray that turns with edges owes them.
    wholly: RgbVec,
    /// Those by what the direction brings the far end to, at a fixed image point. The camera's ray owes them.
    at_image_point: RgbVec,
}

impl<'a> Segment<'a> {
    fn new(
        path: &'a RecordedPath<'a>,
        node: usize,
        motion: &'a NodeMotion<'a>,
        received: Rgb,
        level: Rgb,
        parallel_rays: bool,
    ) -> Option<Self> {
        let recorded = &path.record.nodes[node];
        let arrival = recorded.arrival.as_ref()?;
        let parent = arrival.parent as usize;
        let vertex = recorded.vertex();
        let parallel = parent == 0 && parallel_rays;
        let fixed = parallel && vertex.is_none();
        let near_moves = path.velocities.moves(parent);
        Some(Self {
            path,
            node,
            parent,
            arrival,
            motion,
            vertex,
            phi: if fixed { 0.0 } else { motion.velocity.blend.weight },
            parallel,
            value: arrival.arrival * received,
            measured: arrival.arrival * (received - level),
            weight: arrival.throughput * (received - level),
            near_moves,
            ray_moves: near_moves || motion.ray.is_some(),
        })
    }

    fn role(&self) -> Role {
        self.path.record.nodes[self.node].role
    }

    fn from(&self) -> &'a Node {
        &self.path.record.nodes[self.parent]
    }

    /// The vertex that it starts at, with what has been multiplied by there. The `eye` is where the camera's rays start.
    fn start<'v>(&self, eye: &'v Vertex) -> Option<(&'v Vertex, Rgb)>
    where
        'a: 'v,
    {
        match &self.from().arrival {
            None => Some((eye, Rgb::ONE)),
            Some(a) => match &a.end {
                Endpoint::Surface(v) => Some((v, a.throughput)),
                Endpoint::Volume(v, c) => Some((v, a.throughput * c.sigma_s())),
                Endpoint::Environment => None,
            },
        }
    }

    fn stretch(&self, start: Vec3) -> Stretch<'a> {
        let record = self.path.record;
        Stretch {
            start,
            dir: self.arrival.dir,
            length: self.arrival.distance,
            medium: self.arrival.start_medium,
            crossings: &record.crossings[record.nodes[self.node].crossings.clone()],
        }
    }

    /// The weight of the filter, where it is the camera that looks along it.
    fn filter(&self) -> Option<Rgb> {
        (self.parent == 0).then_some(self.from().value)
    }

    /// Its ends or its direction move.
    fn moves(&self) -> bool {
        self.near_moves || self.motion.velocity.moves || self.ray_moves
    }
}

impl Differentiator<'_> {
    /// The segment from the parent to node `k`, and the parent's scattering into it, for what is `received` there by a
    /// motion of the node; `here` is what it has collected, `before` what nodes before it have.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn arrive<S: AdjointSink>(
        &mut self,
        recorded: &RecordedPath<'_>,
        k: usize,
        motion: &NodeMotion<'_>,
        received: Rgb,
        level: Rgb,
        here: &mut SurfaceAdjoint,
        before: &mut [SurfaceAdjoint],
        sink: &mut S,
    ) {
        let parallel_rays = self.world.camera.viewpoint().is_at_infinity();
        let Some(segment) = &Segment::new(recorded, k, motion, received, level, parallel_rays)
        else {
            return;
        };
        self.pass_on(segment);
        if self.ends_here(segment, here) {
            if let Some(v) = segment.vertex {
                here.u += self.locals[k].matter;
                send(v, here, sink);
            }
            return;
        }
        let eye = self.world.eye_at(recorded.record.origin);
        let Some(start) = segment.start(&eye) else { return };
        let Some((there, before)) = before[..=segment.parent].split_last_mut() else { return };
        // As far as this is not the camera's importance.
        let wholly = self.locals[k].turn;
        let mut turned = Turned { wholly, at_image_point: RgbVec::ZERO };
        let single = Single::at(self.world, segment.from());
        if single.is_none()
            && let Some(to_wi) = self.scatter_into(segment, start, there, before, sink)
        {
            turned.wholly += to_wi;
        }
        let stretch = &segment.stretch(start.0.x);
        match segment.vertex {
            // No end moves; what is between may.
            _ if !segment.moves() => {
                self.segment(stretch, Far::Direction, false, segment.weight, there, sink);
            }
            None => self.end_outside(segment, stretch, &mut turned, there, sink),
            Some(v) => self.end_at_vertex(segment, (stretch, v), &mut turned, here, there, sink),
        }
        self.turn_ray(segment, &mut turned, there, sink);
        if segment.parent == 0 {
            self.turn += turned.at_image_point;
        }
        if let Some(single) = single {
            self.bend_into(segment, &single, start.1, wholly + turned.at_image_point, there, sink);
        }
        if segment.parallel {
            self.origin += core::mem::take(&mut there.u);
        }
    }

    /// The throughput: adds a_k R_k to what the parent's scattering collects.
    #[inline]
    fn pass_on(&mut self, segment: &Segment<'_>) {
        let value = segment.value;
        match segment.role() {
            Role::Joined(Scattered { value: f, inv_pdf }) => {
                self.locals[segment.parent].joined += f * inv_pdf * value;
            }
            _ => self.locals[segment.parent].children += value,
        }
        self.locals[segment.node].incoming += value;
    }

    /// Nothing comes back along the segment, and nothing that the node has collected moves what comes before it.
    #[inline]
    fn ends_here(&self, segment: &Segment<'_>, here: &SurfaceAdjoint) -> bool {
        let outside = segment.vertex.is_none() && !segment.value.is_zero();
        if outside || !segment.measured.is_zero() {
            return false;
        }
        let Local { matter, turn, .. } = self.locals[segment.node];
        let nothing = here.is_zero() && [matter, turn] == [RgbVec::ZERO; 2];
        nothing || (segment.phi == 1.0 && segment.motion.ray.is_none())
    }

    /// The parent's scattering into the segment, Θ_p σ_p a_k R_k / p times the gradient of f_p, which sees both ends of the segment as a
    /// direction d: d_dot = (I - d dᵀ) (x_k_dot - x_p_dot) / t (theory sheet §2), of which the far end's matter makes a part φ. Returns
    /// the sensitivity to d; at the camera and on a light path, where the function depends on who looks, there is none.
    #[inline]
    fn scatter_into<S: AdjointSink>(
        &mut self,
        segment: &Segment<'_>,
        (from, theta): (&Vertex, Rgb),
        there: &mut SurfaceAdjoint,
        before: &mut [SurfaceAdjoint],
        sink: &mut S,
    ) -> Option<RgbVec> {
        let Segment { path, arrival, parent, .. } = *segment;
        let of_light = matches!(segment.role(), Role::OfLight { .. });
        let behind = self.behind(path, parent).filter(|_| !of_light)?;
        let node = segment.from();
        let (wi, inv_pdf, paired) = match segment.role() {
            Role::Joined(leaving) => (arrival.dir, leaving.inv_pdf, None),
            _ => (node.wi, node.inv_pdf, Some(Apart::of(path, parent))),
        };
        let adjoint = theta * segment.value * inv_pdf;
        let wo = node.arrival.as_ref().map_or(Vec3::ZERO, |a| -a.dir);
        let near_moves = segment.near_moves || path.velocities.moves(behind.parent);
        let moving = segment.motion.velocity.moves || near_moves;
        let behind = Some(behind);
        let to_wi =
            self.scattering(from, wo, wi, paired, adjoint, behind, moving, there, before, sink);
        if let (Some(to_wi), Some(_)) = (to_wi, segment.vertex) {
            let g = turn(&(to_wi * segment.phi), wi, arrival.distance);
            there.u -= g;
            self.locals[segment.node].matter += g;
        }
        to_wi
    }

    /// The parent's scattering into a segment that leaves in a single direction, which is owed `onward`.
    #[cold]
    fn bend_into<S: AdjointSink>(
        &mut self,
        segment: &Segment<'_>,
        single: &Single<'_>,
        theta: Rgb,
        onward: RgbVec,
        there: &mut SurfaceAdjoint,
        sink: &mut S,
    ) {
        let node = segment.from();
        let Some(arrival) = &node.arrival else { return };
        let before = arrival.parent as usize;
        let adjoint = theta * segment.value * node.inv_pdf;
        let moving = segment.moves() || segment.path.velocities.moves(before);
        self.bend(single, segment.parent, before, onward, adjoint, moving, there, sink);
    }

    /// A segment that ends in the environment, at a fixed direction: its transmittance, and what a ray that turns comes to see of the
    /// environment.
    #[inline]
    fn end_outside<S: AdjointSink>(
        &mut self,
        segment: &Segment<'_>,
        stretch: &Stretch<'_>,
        turned: &mut Turned,
        there: &mut SurfaceAdjoint,
        sink: &mut S,
    ) {
        let Segment { arrival, phi, measured, weight, ray_moves, .. } = *segment;
        if let Some(filter) = segment.filter().filter(|_| sink.active().sensor) {
            self.seen(None, arrival.dir, measured, filter, phi, sink.active());
        }
        let mut along = self.segment(stretch, Far::Direction, ray_moves, weight, there, sink);
        // Only rays of the camera, and those that turn with edges or behind smooth surfaces, come to see another part of it.
        let turns = segment.motion.ray.is_some() || segment.from().single;
        if (segment.parent == 0 || turns)
            && let Some(environment) = self.world.lights.environment()
        {
            let each = arrival.throughput * arrival.emission_weight;
            along += environment.gradient(arrival.dir) * each;
        }
        turned.wholly += along;
        turned.at_image_point = along * (1.0 - phi);
    }

    /// A segment that ends at a vertex v: its factors by the part φ of the vertex's motion that is its matter's, and by the part 1 - φ that is
    /// the ray's. What the vertex has collected then goes where the velocity of each part comes from.
    #[inline]
    fn end_at_vertex<S: AdjointSink>(
        &mut self,
        segment: &Segment<'_>,
        (stretch, v): (&Stretch<'_>, &Vertex),
        turned: &mut Turned,
        here: &mut SurfaceAdjoint,
        there: &mut SurfaceAdjoint,
        sink: &mut S,
    ) {
        let Segment { phi, weight, ray_moves, .. } = *segment;
        let NodeMotion { velocity, auxiliary, ray } = *segment.motion;
        let mut matter = self.locals[segment.node].matter;
        let by_place = self.seen_at_vertex(segment, v, sink);
        if ray.is_some() {
            turned.wholly += self.landing(stretch, v, here, weight);
        }
        if phi == 1.0 {
            here.u += by_place;
            let (along, film) =
                self.end_with_matter(segment, (stretch, v), weight, here, there, sink);
            turned.wholly += along;
            here.u += film;
        } else {
            let free = weight * (1.0 - phi);
            turned.at_image_point =
                self.segment(stretch, Far::Direction, ray_moves, free, there, sink);
            turned.wholly += turned.at_image_point;
            if phi > 0.0 {
                let part = &mut SurfaceAdjoint::default();
                let (along, film) =
                    self.end_with_matter(segment, (stretch, v), weight * phi, part, there, sink);
                turned.wholly += along;
                part.u += by_place + film;
                matter += part.u;
                here.n += part.n;
                here.j += part.j;
            }
        }
        let end = Propagated { vertex: v, velocity, auxiliary, weight, matter };
        let back = self.propagate(stretch, &end, here, there, sink);
        turned.wholly += back.by_surfaces;
        turned.at_image_point += back.by_surfaces + back.by_ray;
    }

    /// What the camera's importance and filter owe to the place of a vertex that it sees, as far as that moves with matter.
    #[inline]
    fn seen_at_vertex<S: AdjointSink>(
        &mut self,
        segment: &Segment<'_>,
        v: &Vertex,
        sink: &mut S,
    ) -> RgbVec {
        let Segment { arrival, phi, measured, .. } = *segment;
        let active = sink.active();
        let slides = !segment.motion.auxiliary.is_empty() || moves(v, active);
        let Some(filter) = segment.filter().filter(|_| phi > 0.0 && (active.sensor || slides))
        else {
            return RgbVec::ZERO;
        };
        self.seen(Some(v), arrival.dir, measured, filter, phi, active) * phi
    }

    /// A segment between two points, for a `weight` of light that passes: the geometric term, the Jacobian at v and transmittance. The far
    /// end's sensitivities go to `far`. Returns that of transmittance to the rate of the direction, and what is owed to the far end by the
    /// point of the film from which it is seen along parallel rays.
    #[inline]
    fn end_with_matter<S: AdjointSink>(
        &mut self,
        segment: &Segment<'_>,
        (stretch, v): (&Stretch<'_>, &Vertex),
        weight: Rgb,
        far: &mut SurfaceAdjoint,
        there: &mut SurfaceAdjoint,
        sink: &mut S,
    ) -> (RgbVec, RgbVec) {
        let ray_moves = segment.ray_moves;
        if !segment.parallel {
            let along = self.material_end(stretch, v, ray_moves, weight, far, there, sink);
            return (along, RgbVec::ZERO);
        }
        let mut film = SurfaceAdjoint::default();
        let along = self.material_end(stretch, v, ray_moves, weight, far, &mut film, sink);
        (along, self.by_film(v, film.u, sink.active()))
    }

    /// A ray that turns with the edges beside it: sends them all that its direction is seen by, and a weight of light that multiplies the
    /// divergence of its rate (theory sheet §9, §10, route B). As far as the ray turns so, it does not follow its image point.
    #[inline]
    fn turn_ray<S: AdjointSink>(
        &mut self,
        segment: &Segment<'_>,
        turned: &mut Turned,
        there: &mut SurfaceAdjoint,
        sink: &mut S,
    ) {
        let Some(ray) = segment.motion.ray.filter(|_| !self.edges_at_rest) else { return };
        let Segment { arrival, measured, weight, .. } = *segment;
        let RayTurn { weight: share, gradient, .. } = *ray.turn;
        let mut all = turned.wholly;
        if let Some(filter) = segment.filter() {
            // A direction has no parallax.
            all += self.seen(None, arrival.dir, measured, filter, share, sink.active());
            // What the camera's image point does is replaced.
            turned.at_image_point -= turned.wholly * share + weight.outer(gradient);
        }
        there.u -= ray.send(arrival.dir, &all, weight, sink);
    }
}
