//! Differentiating a recorded path once: the gradient of its value with respect to every local
//! quantity, in one backward sweep.
//!
//! With the symbols of [`trace`](crate::sampling::trace), let R_k be the radiance that reaches vertex k per unit of
//! throughput, and Q_k the radiance that its scattering collects:
//!
//! ```text
//! Q_k = NEE_k + s_k C_k,   C_k = sum over children c of a_c R_c,   R_k = e_k + σ_k Q_k
//! ```
//!
//! The path's value is R_0. In the material form (2021 paper, Eqs. 23–30; theory sheet
//! §4) its factors are the geometric term, Jacobian and transmittance of each segment, the scattering functions
//! and the coefficients. The derivative with respect to a segment's factors is Θ_c R_c times their logarithmic
//! gradient; with respect to a scattering function it is Θ_k σ_k C_k / p times the function's gradient; with respect to
//! σ_k it is Θ_k Q_k. The sweep never divides by a factor that can vanish. Its cost is linear in the number of
//! vertices.
//!
//! Where paths from the camera are [connected](light) with light paths, several nodes have the same children.
//!
//! A node of the walk is swept in two steps: what it [receives](Differentiator::sweep), and the segment by which the walk
//! [arrived](arrival) there. Vertices move with a [`velocity`](super::velocity) field. A vertex's velocity is a weighted sum
//! of other velocities, and its sensitivities are [propagated](propagation) to these with the same weights.

mod antithetic;
mod arrival;
mod chain;
mod connections;
mod emission;
mod emitters;
mod light;
mod probe;
mod propagation;
mod segment;
mod shadows;
mod turning;

use alloc::borrow::Cow;
use alloc::vec::Vec;

use drt_math::{Rgb, RgbVec, Rng, Vec3};
use drt_medium::Coefficients;

use crate::derivative::adjoint::antithetic::Apart;
use crate::derivative::adjoint::emitters::{area, surroundings};
use crate::derivative::adjoint::turning::RayMotion;
use crate::derivative::recorded_path::RecordedPath;
use crate::derivative::sensitivity::{
    ActiveInputs, AdjointSink, CoefficientAdjoint, Scaled, SurfaceAdjoint, TextureUse,
};
use crate::derivative::velocity::{Auxiliary, Probe, TurnPart, TurnParts, VertexVelocity};
use crate::model::sensor::{Sensor, SensorGradient};
use crate::model::surface::BsdfParams;
use crate::sampling::record::Role;
use crate::sampling::streams::VELOCITY_STREAM;
use crate::sampling::trace::Endpoint;
use crate::world::World;
use crate::world::lights::EmitterMask;
use crate::world::vertex::{Kind, MaterialPoint, SurfacePoint, Vertex};

/// Derivatives that have been collected for a vertex while its neighbours are processed, except those with respect to
/// its own velocity and normals.
#[derive(Clone, Copy, Debug, Default)]
struct Local {
    /// With respect to the velocity of the matter that it is on.
    matter: RgbVec,
    /// C_k, the value of the children per unit of scattering.
    children: Rgb,
    /// What scattering into connections with a light path collects.
    joined: Rgb,
    /// a_k R_k, its part of the parent's C.
    incoming: Rgb,
    /// With respect to the rate of the direction of the ray that found the vertex, through the scattering at the
    /// vertex.
    turn: RgbVec,
}

/// The segment by which a walk arrived at a node.
#[derive(Clone, Copy, Debug)]
struct Behind {
    node: usize,
    parent: usize,
    distance: f64,
    /// φ of the node, the part of its motion that turns the segment.
    weight: f64,
}

/// How a node moves, and the ray that found it.
#[derive(Clone, Copy)]
struct NodeMotion<'a> {
    velocity: &'a VertexVelocity,
    auxiliary: &'a [Auxiliary],
    ray: Option<RayMotion<'a>>,
}

impl<'p> RecordedPath<'p> {
    /// A ray that turns, by its index.
    fn ray_motion(&self, turn: Option<u32>) -> Option<RayMotion<'p>> {
        let turn = self.velocities.turn(turn)?;
        let parts = self.velocities.turn_parts(turn);
        let chain = self.velocities.chain_parts(turn);
        Some(RayMotion { turn, parts, chain, shadows: &[], light: None })
    }

    #[inline]
    fn motion(&self, node: usize) -> NodeMotion<'p> {
        let velocity = self.velocities.of(node);
        let auxiliary = self.velocities.auxiliary(velocity);
        NodeMotion { velocity, auxiliary, ray: self.ray_motion(velocity.turn) }
    }
}

/// The backward sweep and its buffers.
pub(crate) struct Differentiator<'w> {
    world: &'w World,
    /// The camera, at the path's point of its lens.
    camera: Cow<'w, Sensor>,
    /// When true, rays do not turn and vertices do not move with what auxiliary rays find, to find the contribution of
    /// these motions.
    pub(crate) edges_at_rest: bool,
    /// The [level](crate::terms::level) of the pixel.
    pub(crate) level: Rgb,
    locals: Vec<Local>,
    /// Derivatives with respect to the velocity and normals of each vertex.
    ends: Vec<SurfaceAdjoint>,
    points: Vec<(f64, f64)>,
    rng: Rng,
    /// The filter's gradient with respect to the pixel position, over the density.
    filter: [f64; 2],
    /// Derivative with respect to the rate of the camera ray's direction.
    turn: RgbVec,
    /// What the next segment's line integrals take for light that does not come back along it.
    control: Rgb,
    /// Derivative with respect to the velocity of the point where an orthographic camera's ray starts, at its image
    /// point.
    origin: RgbVec,
    /// Gradients of the camera's importance and filter, per channel.
    sensor: [SensorGradient; 3],
    /// Summands of the turns of rays to lights, and of the velocities of points on these.
    parts: Vec<TurnPart>,
    auxiliary: Vec<Auxiliary>,
    /// Summands of the turns of rays that turn with shadows.
    with_shadows: TurnParts,
    probe: Probe,
}

impl<'w> Differentiator<'w> {
    pub(crate) fn new(world: &'w World) -> Self {
        Self {
            world,
            camera: Cow::Borrowed(&world.camera),
            edges_at_rest: false,
            level: Rgb::ZERO,
            locals: Vec::new(),
            ends: Vec::new(),
            points: Vec::new(),
            rng: Rng::new(0, 0, 0),
            filter: [0.0; 2],
            turn: RgbVec::ZERO,
            control: Rgb::ZERO,
            origin: RgbVec::ZERO,
            sensor: [SensorGradient::default(); 3],
            parts: Vec::new(),
            auxiliary: Vec::new(),
            with_shadows: TurnParts::default(),
            probe: Probe::new(Rng::new(0, 0, 0)),
        }
    }

    /// What has been looked at for the velocities of emitters.
    pub(crate) fn probe(&self) -> &Probe {
        &self.probe
    }

    /// Sends the gradient of the record's value to `sink`. `filter` holds the gradient by the pixel
    /// position of the filter over the density; `rng` serves line integrals through grids and must be
    /// independent of the walk's.
    pub(crate) fn differentiate<S: AdjointSink>(
        &mut self,
        path: &RecordedPath<'_>,
        filter: [f64; 2],
        rng: Rng,
        sink: &mut S,
    ) {
        let nodes = path.record.nodes.len();
        // What fields look at has numbers of its own.
        if path.velocities.field().is_random() {
            let mut name = rng.clone();
            self.probe.rng = Rng::new(u64::from(name.next_u32()), VELOCITY_STREAM, name.next_u32());
        }
        self.rng = rng;
        self.filter = filter;
        self.camera = self.world.camera.at_lens(path.record.camera_ray.lens);
        (self.turn, self.origin) = (RgbVec::ZERO, RgbVec::ZERO);
        self.sensor = [SensorGradient::default(); 3];
        self.locals.clear();
        self.locals.resize(nodes, Local::default());
        let mut ends = core::mem::take(&mut self.ends);
        ends.clear();
        ends.resize(nodes, SurfaceAdjoint::default());
        for k in (1..nodes).rev() {
            self.node(path, k, &mut ends, sink);
        }
        let origin = ends[0].u + self.locals[0].matter + self.origin;
        self.ends = ends;
        self.camera_ray(path.record, origin, self.turn, &self.sensor, sink);
    }

    fn node<S: AdjointSink>(
        &mut self,
        path: &RecordedPath<'_>,
        k: usize,
        ends: &mut [SurfaceAdjoint],
        sink: &mut S,
    ) {
        match path.record.nodes[k].role {
            Role::Walked | Role::Joined(_) => self.sweep(path, k, ends, sink),
            Role::OfLight { passed } => self.sweep(path, k, ends, &mut Scaled { sink, by: passed }),
            Role::LastOfLight => {}
            Role::Probe => self.probed(path, k, ends, sink),
        }
    }

    fn sweep<S: AdjointSink>(
        &mut self,
        path: &RecordedPath<'_>,
        k: usize,
        ends: &mut [SurfaceAdjoint],
        sink: &mut S,
    ) {
        let RecordedPath { record, lit, .. } = *path;
        let node = &record.nodes[k];
        let Some(arrival) = &node.arrival else { return };
        let world = self.world;
        let theta = arrival.throughput;
        let control = path.control(k);
        let from_camera = arrival.parent == 0 && matches!(node.role, Role::Walked);
        let level = if from_camera { self.level } else { Rgb::ZERO };
        let mut of_joint;
        let (mut collected, here, before) = match node.role {
            Role::Walked => {
                let Local { children, joined, .. } = self.locals[k];
                let Some((here, before)) = ends[..=k].split_last_mut() else { return };
                (node.value * node.inv_pdf * children + joined, here, before)
            }
            _ => {
                let collected;
                (collected, of_joint) = self.behind_joint(path, k, ends, sink);
                (collected, &mut of_joint, &mut ends[..k])
            }
        };
        let received = match &arrival.end {
            Endpoint::Environment => {
                match world.lights.environment().filter(|_| lit.by_surroundings()) {
                    Some(environment) => {
                        let seen = theta * arrival.emission_weight;
                        surroundings(environment, arrival.dir, seen, sink);
                        environment.radiance(arrival.dir) * arrival.emission_weight
                    }
                    None if level.is_zero() => return,
                    None => Rgb::ZERO,
                }
            }
            Endpoint::Surface(vertex) => {
                collected += self.connections(path, k, vertex, theta, here, before, sink);
                let Kind::Surface(point) = &vertex.kind else { return };
                let mut emitted = Rgb::ZERO;
                if let Some(e) = world.scene.shapes[point.shape as usize].emitter
                    && lit.by_surroundings()
                    && arrival.emission_weight > 0.0
                    && point.ng.dot(arrival.dir) < 0.0
                {
                    emitted = world.emitted(point, -arrival.dir) * arrival.emission_weight;
                    let adjoint = theta * arrival.emission_weight;
                    area(world, e, point, adjoint, &mut here.slide, sink);
                    if self.emit_apart(path, k, point, emitted, before, sink) {
                        emitted = Rgb::ZERO;
                    }
                }
                emitted + collected
            }
            Endpoint::Volume(vertex, c) => {
                let c = &lit_by(lit, c);
                let theta_s = theta * c.sigma_s();
                collected += self.connections(path, k, vertex, theta_s, here, before, sink);
                let moving = path.velocities.moves(k);
                let weight = arrival.emission_weight;
                let share = match path.probed {
                    Some(_) => world.share_of_vertices(vertex, c),
                    None => 1.0,
                };
                let area = self.area_along(vertex, arrival.dir);
                let adjoint = by_coefficients(c, lit, theta * share, collected, weight, area);
                self.coefficients(vertex, &adjoint, moving, here, sink);
                let source = theta * c.source() * weight;
                self.emission_along(path, k, vertex, source, here, before, sink);
                self.control_at(vertex, arrival.dir, theta * control * share, sink);
                c.source() * arrival.emission_weight + c.sigma_s() * collected
            }
        };
        let passes = match &arrival.end {
            Endpoint::Volume(v, c) => c.sigma_t * self.area_along(v, arrival.dir),
            _ => Rgb::ONE,
        };
        self.control = theta * passes * control;
        self.arrive(path, k, &path.motion(k), received, level, here, before, sink);
        self.control_alone(path, k, sink);
    }

    /// Sensitivities of a scattering function, `adjoint` multiplying its value: by the positions
    /// behind `wo`, by normals and by materials, but for what is `paired`. Returns that by the direction `wi`,
    /// which is the caller's. Unless something of this is `moving`, only the material counts. `before` is what nodes
    /// before it have collected.
    #[allow(clippy::too_many_arguments)]
    fn scattering<S: AdjointSink>(
        &mut self,
        v: &Vertex,
        wo: Vec3,
        wi: Vec3,
        paired: Option<Apart<'_>>,
        adjoint: Rgb,
        behind: Option<Behind>,
        moving: bool,
        here: &mut SurfaceAdjoint,
        before: &mut [SurfaceAdjoint],
        sink: &mut S,
    ) -> Option<RgbVec> {
        let world = self.world;
        let active = sink.active();
        let material = match &v.kind {
            Kind::Surface(s) => active.bsdfs[world.scene.shapes[s.shape as usize].bsdf],
            _ => v.medium.is_some_and(|m| active.media[m]),
        };
        if adjoint.is_zero() || !(material || moving) {
            return None;
        }
        let turns = v
            .surface()
            .is_some_and(|s| active.shapes[s.shape as usize] && world.is_oriented(s.shape));
        let mut d = world.scattering(v)?.gradient(wo, wi);
        if let Some(apart) = paired {
            apart.take_from(&mut d);
        }
        match &v.kind {
            Kind::Surface(s) => {
                here.ns += d.ns * adjoint;
                here.n += d.ng * adjoint;
                here.slide += d.slide * adjoint;
                if turns {
                    let corners = world.scattering(v)?.corners(wo, wi, &d);
                    send_frame(s, corners, adjoint, sink);
                }
                if material && let Some(params) = d.params {
                    send_material(world, s, &params, adjoint, sink);
                }
            }
            _ => {
                if let (Some(m), Some(gradient)) = (v.medium, d.phase) {
                    if material {
                        sink.phase(m, v.x, &gradient, adjoint);
                    }
                    here.u += adjoint.outer(gradient.place);
                }
            }
        }
        if let Some(b) = behind {
            self.turned_back(&b, wo, d.wo * adjoint, before);
        }
        Some(d.wi * adjoint)
    }

    /// Sensitivities to the unit direction `wo` from a vertex to what it was seen from, which moves with both.
    fn turned_back(&mut self, b: &Behind, wo: Vec3, to_wo: RgbVec, before: &mut [SurfaceAdjoint]) {
        let g = turn(&(to_wo * b.weight), wo, b.distance);
        before[b.parent].u += g;
        self.locals[b.node].matter -= g;
        self.locals[b.node].turn -= to_wo;
        // Only the camera's ray turns by itself.
        if b.parent == 0 {
            self.turn -= to_wo * (1.0 - b.weight);
        }
    }

    /// What the extinction along the unit direction `w` at a volume vertex is over that of its coefficients.
    #[inline]
    fn area_along(&self, v: &Vertex, w: Vec3) -> f64 {
        v.medium.map_or(1.0, |m| self.world.medium(m).projected_area(v.x, w))
    }

    /// Sensitivities of what a volume vertex emits, by the area that its microflakes show to where it is seen from.
    #[allow(clippy::too_many_arguments)]
    fn emission_along<S: AdjointSink>(
        &mut self,
        path: &RecordedPath<'_>,
        k: usize,
        v: &Vertex,
        source: Rgb,
        here: &mut SurfaceAdjoint,
        before: &mut [SurfaceAdjoint],
        sink: &mut S,
    ) {
        let Some(m) = v.medium.filter(|_| !source.is_zero()) else { return };
        let (Some(b), medium) = (self.behind(path, k), self.world.medium(m)) else { return };
        let Some(arrival) = path.record.nodes[k].arrival.as_ref() else { return };
        if medium.phase.sggx().is_none() {
            return;
        }
        let wo = -arrival.dir;
        let gradient = medium.area_gradient(v.x, wo);
        // Nothing is emitted where the area is zero.
        let adjoint = source * (1.0 / medium.projected_area(v.x, wo));
        if sink.active().media[m] {
            sink.phase(m, v.x, &gradient, adjoint);
        }
        here.u += adjoint.outer(gradient.place);
        self.turned_back(&b, wo, adjoint.outer(gradient.wo), before);
    }

    /// Sensitivities of the coefficients at a volume vertex, which may move against the medium's grids.
    fn coefficients<S: AdjointSink>(
        &mut self,
        vertex: &Vertex,
        adjoint: &CoefficientAdjoint,
        moving: bool,
        here: &mut SurfaceAdjoint,
        sink: &mut S,
    ) {
        let Some(m) = vertex.medium else { return };
        if sink.active().media[m] {
            sink.medium(m, vertex.x, adjoint);
        }
        if moving {
            let g = self.world.medium(m).gradients(vertex.x);
            here.u += g.sigma_t * adjoint.sigma_t
                + g.albedo * adjoint.albedo
                + g.emission * adjoint.emission;
        }
    }

    /// The camera's importance and filter towards a vertex, or the environment, that `value` reaches it
    /// from per unit of the filter's weight: what they owe to the place of the vertex. A `share` of what they owe to
    /// the camera is added to that of others.
    fn seen(
        &mut self,
        vertex: Option<&Vertex>,
        dir: Vec3,
        value: Rgb,
        weight: Rgb,
        share: f64,
        active: &ActiveInputs,
    ) -> RgbVec {
        let camera = &*self.camera;
        let x = vertex.map_or(camera.position() + dir, |v| v.x);
        let projection = camera.view(x);
        let (value, total) = (value.to_array(), (value * weight).to_array());
        let mut place = [Vec3::ZERO; 3];
        for (c, sum) in self.sensor.iter_mut().enumerate() {
            let filter = self.filter.map(|f| f * value[c]);
            let (at, mut gradient) = camera.view_gradient(&projection, filter, total[c]);
            place[c] = at;
            if active.sensor {
                if vertex.is_none() {
                    // A direction has no parallax.
                    gradient.position = Vec3::ZERO;
                }
                *sum += gradient.scaled(share);
            }
        }
        RgbVec { r: place[0], g: place[1], b: place[2] }
    }

    /// What the velocity of the film's point from which an orthographic camera sees a vertex owes to the vertex; its
    /// debt to the camera is added to that.
    fn by_film(&mut self, vertex: &Vertex, film: RgbVec, active: &ActiveInputs) -> RgbVec {
        if film == RgbVec::ZERO {
            return film;
        }
        let camera = &self.world.camera;
        let seen = camera.view(vertex.x);
        let [r, g, b] = [film.r, film.g, film.b].map(|g| camera.film_gradient(&seen, g));
        if active.sensor {
            for (sum, gradient) in self.sensor.iter_mut().zip([r.1, g.1, b.1]) {
                *sum += gradient;
            }
        }
        RgbVec { r: r.0, g: g.0, b: b.0 }
    }

    /// The segment by which a walk arrived at a node; `None` at the camera.
    fn behind(&self, path: &RecordedPath<'_>, node: usize) -> Option<Behind> {
        behind(path, node, self.world.camera.viewpoint().is_at_infinity())
    }
}

/// Coefficients with the emission that counts.
fn lit_by(lit: EmitterMask, c: &Coefficients) -> Coefficients {
    Coefficients { emission: if lit.by_surroundings() { c.emission } else { Rgb::ZERO }, ..*c }
}

/// Sensitivities of the coefficients at a volume vertex: R = σ_t albedo Q + σ_t (1 - albedo) e, Q being what it has `collected`, and
/// e the emission times the projected `area` of the medium there.
fn by_coefficients(
    c: &Coefficients,
    lit: EmitterMask,
    theta: Rgb,
    collected: Rgb,
    emission_weight: f64,
    area: f64,
) -> CoefficientAdjoint {
    let emission = c.emission * emission_weight;
    CoefficientAdjoint {
        sigma_t: theta * (c.albedo * collected + (Rgb::ONE - c.albedo) * emission),
        albedo: theta * c.sigma_t * (collected - emission),
        emission: if lit.by_surroundings() {
            theta * c.sigma_a() * (emission_weight * area)
        } else {
            Rgb::ZERO
        },
    }
}

/// The segment by which a walk arrived at a node; `None` at the camera. Where its rays are `parallel`, nothing that it
/// sees turns them.
fn behind(path: &RecordedPath<'_>, node: usize, parallel: bool) -> Option<Behind> {
    let arrival = path.record.nodes[node].arrival.as_ref()?;
    let (parent, distance) = (arrival.parent as usize, arrival.distance);
    let turned = !(parallel && parent == 0);
    let weight = if turned { path.velocities.of(node).blend.weight } else { 0.0 };
    Some(Behind { node, parent, distance, weight })
}

/// Gradient by the far end of a segment, from that by its unit direction `w`.
fn turn(g: &RgbVec, w: Vec3, distance: f64) -> RgbVec {
    g.map(|g| g.reject(w) / distance)
}

fn moves(v: &Vertex, active: &ActiveInputs) -> bool {
    match &v.kind {
        Kind::Surface(s) => active.shapes[s.shape as usize],
        Kind::Volume(_) => v.medium.is_some_and(|m| active.volumes[m]),
        Kind::Point => false,
    }
}

/// Sends what a material owes at a point: to its numbers, and to the texels that stand for them there.
fn send_material<S: AdjointSink>(
    world: &World,
    point: &SurfacePoint,
    params: &BsdfParams,
    adjoint: Rgb,
    sink: &mut S,
) {
    let bsdf = world.scene.shapes[point.shape as usize].bsdf;
    sink.bsdf(bsdf, params, adjoint);
    let item = &world.scene.bsdfs[bsdf].item;
    if item.textured_part().is_none() {
        return;
    }
    item.lookups(&world.texture_point(point), |property, footprint| {
        let adjoint = params.get(property) * adjoint;
        if !adjoint.is_zero() {
            sink.texels(TextureUse::Bsdf(bsdf, property), footprint, adjoint);
        }
    });
}

/// Sends what a value owes to the corners of its triangle.
#[cold]
fn send_frame<S: AdjointSink>(
    point: &SurfacePoint,
    corners: [RgbVec; 3],
    adjoint: Rgb,
    sink: &mut S,
) {
    for (by_corner, bary) in corners.into_iter().zip([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]) {
        let at = drt_motion::SurfacePoint { triangle: point.triangle, bary };
        let corner = MaterialPoint { shape: point.shape, at };
        sink.surface(&corner, &SurfaceAdjoint::of_place(by_corner * adjoint));
    }
}

/// Sends what a vertex collected.
fn send<S: AdjointSink>(v: &Vertex, adjoint: &SurfaceAdjoint, sink: &mut S) {
    match (&v.kind, v.medium) {
        // Nothing reaches the vertex: where it would go needs no looking up.
        _ if adjoint.is_zero() => {}
        (Kind::Surface(s), _) if sink.active().shapes[s.shape as usize] => {
            sink.surface(&s.material(), adjoint);
        }
        (Kind::Volume(_), Some(m)) if sink.active().volumes[m] => {
            sink.volume(m, v.x, &adjoint.u, adjoint.j);
        }
        _ => {}
    }
}
