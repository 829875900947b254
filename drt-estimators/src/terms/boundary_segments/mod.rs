//! The boundary term: visibility jumps where a segment of a path grazes an edge.
//!
//! With both ends free, one kernel serves all kinds of ends (theory sheet §4.2, from 2021
//! paper, Eqs. 35–44). Let x_B be a point on an edge, t the edge's tangent, w the unit direction from the source end S
//! to the detector end D, N the unit normal of plane(t, w) on the side of the faces,
//! and l = |x_B - x_S| / |x_D - x_S|. With velocities u, transmittance τ, and Lout and Wout the radiance and the
//! importance that leave the ends, the term is
//!
//! ```text
//! ∫ dl(x_B) ∫ dσ(w) [dr_S] [dr_D] τ(x_S, x_D) |t×w| N·(u_B - (1-l) u_S - l u_D) Lout(S→D) Wout(D→S)
//! ```
//!
//! The kernel is linear in the velocities, so a sample is a [`VelocityFunctional`] times light. The integrals over r
//! are for ends in a volume. A delta end (camera, point or directional light) replaces dσ by 1/r² and has no dr. The
//! strategies are:
//!
//! | strategy | edge | direction | S | D |
//! |---|---|---|---|---|
//! | [`primary`](Strategy::Primary) | silhouette from the camera | to the camera | behind the edge | camera |
//! | [`direct`](Strategy::Direct) | any, or silhouette from the light | from a sampled light | the light | beyond |
//! | [`indirect`](Strategy::Indirect) | any | drawn around the edge | traced | traced |
//!
//! For edges that rest on a surface, and lines along which surfaces intersect, `primary` and `indirect` take the
//! [limit](contact). Both `direct` and `indirect` find area lights, and are combined by the balance heuristic. Shadows
//! in media that are directly lit and directly seen are left to [`shadow`] in scenes with few edges.

mod areas;
pub(crate) mod border;
mod contact;
pub(crate) mod shadow;

use alloc::vec::Vec;

use drt_math::{Ray, Rgb, Vec3};

use crate::discontinuities::collect::{Edges, collect};
use crate::discontinuities::contact::Contact;
use crate::discontinuities::edge::{Edge, EdgePoint, EdgeTable, merge_coincident};
use crate::discontinuities::movers::Movers;
use crate::terms::boundary_segments::areas::AreaWeights;
use crate::terms::boundary_segments::shadow::Shadows;

use crate::derivative::sensitivity::{ActiveInputs, AdjointSink, VelocityFunctional, VelocityTerm};
use crate::model::emitter::{Emitter, EmitterGradient};
use crate::model::error::Error;
use crate::model::sensor::{Sensor, SensorGradient};
use crate::sampling::flight::Travel;
use crate::sampling::importance::{Splat, see};
use crate::sampling::record::RadianceBySegments;
use crate::sampling::trace::{Flight, Tracer};
use crate::world::lights::{LightKind, LightTable};
use crate::world::vertex::{Kind, SurfacePoint, Vertex};
use crate::world::{RayPath, SurroundingMedium, World};

/// How a boundary segment is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Strategy {
    /// Between the camera and what lies behind an edge.
    Primary,
    /// Between an emitter and what it lights past an edge.
    Direct,
    /// Between any two vertices.
    Indirect,
}

/// The edges of a scene, grouped by the vertices that see them.
#[derive(Debug, Default)]
pub(crate) struct Boundary {
    /// All edges.
    general: Option<EdgeTable>,
    /// Edges of meshes, weighted by how area lights light them.
    areas: Option<EdgeTable>,
    /// Silhouettes from the camera, and lines along which surfaces intersect.
    camera: Option<EdgeTable>,
    /// Silhouettes from each delta light, by emitter.
    lights: Vec<Option<EdgeTable>>,
    /// Shadow boundaries in media that are found along camera rays instead.
    pub(crate) shadows: Option<Shadows>,
    /// Edges at which visibility can change, and edges in all.
    pub(crate) count: [u64; 2],
}

/// The receiver of a sample's value.
pub(crate) trait BoundarySink {
    /// Where sensitivities go.
    type Sink: AdjointSink;
    /// Evaluates the velocity functional of the sample; false when nothing of the sample moves, which ends the sample.
    fn moves(&mut self, functional: &VelocityFunctional) -> bool;
    /// Adds the last functional times `value` to `pixel`.
    fn receive(&mut self, pixel: u32, value: Rgb);
    /// Adds what `send` sends to each of these pixels, times its weight; false when it is not finite.
    fn spread(&mut self, pixels: &[(u32, f64)], send: impl FnOnce(&mut Self::Sink)) -> bool;
}

/// Where a segment's rays start.
#[derive(Clone, Copy, Debug)]
struct Start {
    x: Vec3,
    /// The faces it lies on.
    faces: [u32; 2],
    medium: SurroundingMedium,
}

/// One end of a boundary segment.
struct End {
    /// `None` when the ray escaped.
    vertex: Option<Vertex>,
    distance: f64,
    weight: Rgb,
    flight: Option<Flight>,
}

/// Reusable buffers of a boundary worker.
#[derive(Debug, Default)]
pub(crate) struct Buffers {
    functional: VelocityFunctional,
    light: RadianceBySegments,
    splats: Vec<Splat>,
    ray: RayPath,
}

impl Boundary {
    /// The edges at which visibility can change with some parameter.
    pub(crate) fn new(world: &World, active: &ActiveInputs) -> Result<Self, Error> {
        let movers = Movers::new(world, active);
        let Edges { of_meshes, intersections, all } = collect(world);
        let mut edges = merge_coincident(of_meshes, |e| movers.moves(e));
        edges.extend(intersections);
        edges.retain(|e| movers.matter_to(e));
        let around: Vec<_> =
            (0..world.scene.shapes.len()).map(|s| world.medium_around(s)).collect();
        for e in &mut edges {
            e.settle_medium(world, around[e.shape as usize]);
            e.may_rest = !e.is_intersection() && Contact::anywhere(world, e);
        }
        let general = EdgeTable::new(&edges, |e| movers.pass(e), EdgeTable::general_weight)?;
        let has_areas = world.max_depth >= 2 && world.lights.has_areas();
        // Lines along which surfaces intersect come last, and are grazed nowhere.
        let grazed = edges.partition_point(|e| !e.is_intersection());
        let grazed = &edges[..grazed];
        let lit = general.as_ref().filter(|_| has_areas);
        let areas = lit.map(|general| {
            let weights = AreaWeights::new(world, grazed);
            general.reweighted(|e| if e.is_intersection() { 0.0 } else { weights.of(e) })
        });
        let areas = areas.transpose()?.flatten();
        let camera = &world.camera;
        let in_view = |e: &Edge| e.in_view(camera);
        let camera = EdgeTable::new(&edges, |e| movers.pass_camera(e, camera), in_view)?;
        let light = |i: usize, emitter: &Emitter| match *emitter {
            Emitter::Point { position, .. }
            | Emitter::Spot { position, .. }
            | Emitter::Projector { position, .. } => EdgeTable::new(
                grazed,
                |e| movers.pass_emitter(e, i, |x| x - position),
                |e| e.wedge.subtended_angle(position),
            ),
            Emitter::Directional { direction, .. } => EdgeTable::new(
                grazed,
                |e| movers.pass_emitter(e, i, |_| direction),
                |e| e.wedge.projected_length(direction),
            ),
            _ => Ok(None),
        };
        let emitters = world.scene.emitters.iter().enumerate();
        let lights = emitters.map(|(i, e)| light(i, &e.item.emitter)).collect::<Result<_, _>>()?;
        let lit = grazed.iter().filter(|e| movers.pass_lights(world, e)).copied().collect();
        let shadows = Shadows::new(world, lit);
        Ok(Self { count: [edges.len() as u64, all], general, areas, camera, lights, shadows })
    }

    /// True when a strategy can find anything.
    pub(crate) fn offers(&self, world: &World, strategy: Strategy) -> bool {
        match strategy {
            Strategy::Primary => self.camera.is_some(),
            // One scattering vertex beyond the light, at least.
            Strategy::Direct => {
                world.max_depth >= 2
                    && (self.lights.iter().any(Option::is_some) || self.areas.is_some())
            }
            Strategy::Indirect => world.max_depth >= 2 && self.general.is_some(),
        }
    }

    /// Takes one sample.
    pub(crate) fn sample<R: BoundarySink>(
        &self,
        strategy: Strategy,
        tracer: &mut Tracer<'_>,
        buffers: &mut Buffers,
        receiver: &mut R,
    ) {
        tracer.counters.boundary_samples += 1;
        let mut s = Sampler { boundary: self, tracer, b: buffers, receiver };
        match strategy {
            Strategy::Primary => s.primary(),
            Strategy::Direct => s.direct(),
            Strategy::Indirect => s.indirect(),
        };
    }
}

impl Start {
    /// On an edge that nothing touches.
    fn on(at: &EdgePoint<'_>) -> Self {
        Self { x: at.x, faces: at.edge.wedge.faces, medium: at.edge.surrounding() }
    }

    /// Follows a ray to the first surface that scatters.
    fn cast(&self, tracer: &mut Tracer<'_>, w: Vec3, ray: &mut RayPath) {
        let medium = self.medium.toward(tracer.world, self.x, w);
        tracer.world.cast_past(self.x, self.faces, medium, w, ray, &mut tracer.counters);
    }
}

/// A camera's importance at a point per area across the segment, where the point is seen.
fn seen(camera: &Sensor, start: &Start) -> Option<f64> {
    let view = Vertex { x: start.x, medium: None, kind: Kind::Point };
    Some(see(camera, &view)?.1)
}

struct Sampler<'s, 'w, R> {
    boundary: &'s Boundary,
    tracer: &'s mut Tracer<'w>,
    b: &'s mut Buffers,
    receiver: &'s mut R,
}

impl<'w, R: BoundarySink> Sampler<'_, 'w, R> {
    /// Camera segments: D is the pinhole, or the point of an [orthographic](crate::model::sensor) camera's film.
    fn primary(&mut self) -> Option<()> {
        let world = self.tracer.world;
        let at = self.boundary.camera.as_ref()?.sample(&mut self.tracer.rng);
        let lens = world.camera.draw_lens(&mut self.tracer.rng);
        let camera = &*world.camera.at_lens(lens);
        if let Some(sheets) = at.edge.intersecting_sheets(world) {
            return self.intersection_with_camera(camera, &at, &sheets);
        }
        if let Some(contact) = Contact::at(world, &at) {
            return self.contact_with_camera(camera, &at, &contact);
        }
        let d = camera.eye_of(at.x) - at.x;
        let distance = d.length();
        let w = d / distance;
        let n = at.edge.wedge.occluded_side(w)?;
        let start = Start::on(&at);
        let transport = seen(camera, &start)?;
        // The camera's side must be open.
        let tau = self.open(&start, w, distance)?;
        let s = self.end(&start, -w, Rgb::ONE).filter(|s| !self.is_dark(s))?;
        self.b.functional.items.clear();
        self.edge_rate(&at, n);
        let gradient = if camera.viewpoint().is_at_infinity() {
            self.end_rate(&s, -n);
            match s.vertex {
                Some(_) => SensorGradient { forward: n * s.distance, ..SensorGradient::default() },
                None => camera.ray_gradient(at.x + d, -w, -n, n * -distance),
            }
        } else {
            let l = self.share(&s, distance);
            self.end_rate(&s, n * -(1.0 - l));
            SensorGradient { position: n * -l, ..SensorGradient::default() }
        };
        let gradient = world.camera.lens_gradient(lens, gradient);
        self.b.functional.items.push(VelocityTerm::Sensor(gradient));
        if !self.receiver.moves(&self.b.functional) {
            return None;
        }
        let light = self.light_from(&s, w, world.max_depth.checked_sub(1)?);
        let value = light * s.weight * tau * (at.edge.wedge.sine(w) * at.inv_pdf * transport);
        self.show(camera, at.x, value);
        Some(())
    }

    /// Hands a value to the pixels around the image of `x`.
    fn show(&mut self, camera: &Sensor, x: Vec3, value: Rgb) {
        if value.is_zero() {
            return;
        }
        let pixel = camera.view(x).pixel;
        let width = camera.film()[0];
        for p in camera.footprint(pixel) {
            self.receiver.receive(p.pixel[1] * width + p.pixel[0], value * p.weight);
        }
    }

    /// Segments that start on a sampled light.
    fn direct(&mut self) -> Option<()> {
        let world = self.tracer.world;
        let choice = world.lights.choose(&mut self.tracer.rng)?;
        if let Some(emitter) = choice.delta {
            return self.delta(emitter, choice.pmf);
        }
        let at = self.boundary.areas.as_ref()?.sample(&mut self.tracer.rng);
        if Contact::at(world, &at).is_some() {
            return None;
        }
        let light = world.lights.sample_area(world, &choice, at.x, &mut self.tracer.rng)?;
        let LightKind::Area(emitting) = light.kind else { return None };
        let w = -light.w;
        let n = at.edge.wedge.occluded_side(w)?;
        let start = Start::on(&at);
        let tau = self.open_to(&start, light.w, &emitting)?;
        let vertex = Vertex { x: light.y, medium: None, kind: Kind::Surface(emitting) };
        let mis = light.pdf / (light.pdf + at.edge.wedge.direction_pdf(w));
        let s = End {
            vertex: Some(vertex),
            distance: light.distance,
            weight: tau * (mis * light.inv_pdf),
            flight: None,
        };
        self.b.light.0.clear();
        self.b.light.0.push(world.emitted(&emitting, w));
        let scale = at.edge.wedge.sine(w) * at.inv_pdf;
        self.detector(&at, &start, w, n, &s, scale)
    }

    /// Segments that start on a point, spot or directional light.
    fn delta(&mut self, emitter: usize, pmf: f64) -> Option<()> {
        let world = self.tracer.world;
        let table = self.boundary.lights.get(emitter)?.as_ref()?;
        let at = table.sample(&mut self.tracer.rng);
        if Contact::at(world, &at).is_some() {
            return None;
        }
        let light = LightTable::delta(world, emitter, at.x, pmf)?;
        let w = -light.w;
        let n = at.edge.wedge.occluded_side(w)?;
        let start = Start::on(&at);
        let tau = self.open(&start, light.w, light.distance)?;
        let s = End {
            vertex: None,
            distance: light.distance,
            weight: tau * light.inv_pdf,
            flight: None,
        };
        self.b.light.0.clear();
        self.b.light.0.push(light.value);
        let scale = at.edge.wedge.sine(w) * at.inv_pdf;
        let beyond = self.beyond(&start, w, s.weight);
        for d in beyond.into_iter().flatten() {
            let l = self.share(&s, d.0.distance);
            self.b.functional.items.clear();
            self.edge_rate(&at, n);
            let gradient = match light.kind {
                LightKind::Position => {
                    EmitterGradient { position: n * -(1.0 - l), ..EmitterGradient::default() }
                }
                _ => EmitterGradient { direction: n * d.0.distance, ..EmitterGradient::default() },
            };
            self.b.functional.items.push(VelocityTerm::Emitter(emitter, gradient));
            self.end_rate(&d.0, n * -l);
            self.deliver(&d.0, d.1, true, w, s.weight * scale);
        }
        Some(())
    }

    /// Segments in a drawn direction.
    fn indirect(&mut self) -> Option<()> {
        let world = self.tracer.world;
        let at = self.boundary.general.as_ref()?.sample(&mut self.tracer.rng);
        if let Some(sheets) = at.edge.intersecting_sheets(world) {
            return self.intersection_with_others(&at, &sheets);
        }
        if let Some(contact) = Contact::at(world, &at) {
            return self.contact_with_others(&at, &contact);
        }
        let u = [self.tracer.rng.next_f64(), self.tracer.rng.next_f64()];
        let (w, inv_pdf) = at.edge.wedge.sample_direction(u);
        let n = at.edge.wedge.occluded_side(w)?;
        let start = Start::on(&at);
        let s = self.end(&start, -w, Rgb::ONE).filter(|s| !self.is_dark(s))?;
        let scale = at.edge.wedge.sine(w) * at.inv_pdf * inv_pdf;
        let mut lit = false;
        let beyond = self.beyond(&start, w, s.weight);
        for (d, only_camera) in beyond.into_iter().flatten() {
            let l = self.share(&s, d.distance);
            self.b.functional.items.clear();
            self.edge_rate(&at, n);
            self.end_rate(&s, n * -(1.0 - l));
            self.end_rate(&d, n * -l);
            if !self.receiver.moves(&self.b.functional) {
                continue;
            }
            if !lit {
                self.light_from(&s, w, world.max_depth.checked_sub(2)?);
                if self.b.light.is_dark() {
                    return None;
                }
                self.share_emission(&s, w, 1.0 / inv_pdf);
                lit = true;
            }
            let emits = s.vertex.as_ref().is_some_and(|v| v.surface().is_some());
            self.deliver(&d, only_camera, emits, w, s.weight * scale);
        }
        Some(())
    }

    /// True when no light can come from S: it is the sky, and there is none.
    fn is_dark(&self, s: &End) -> bool {
        s.vertex.is_none() && self.tracer.world.lights.environment().is_none()
    }

    /// Takes from the emission of S what light sampling finds as well.
    fn share_emission(&mut self, s: &End, w: Vec3, pdf: f64) {
        let world = self.tracer.world;
        if let Some(Vertex { kind: Kind::Surface(point), .. }) = &s.vertex
            && let Some(emitted) = self.b.light.0.first_mut()
        {
            let other = world.lights.area_pdf(point, -w, s.distance);
            *emitted *= pdf / (pdf + other);
        }
    }

    /// The detector's end for an area light: one kernel, however D is found.
    fn detector(
        &mut self,
        at: &EdgePoint<'_>,
        start: &Start,
        w: Vec3,
        n: Vec3,
        s: &End,
        scale: f64,
    ) -> Option<()> {
        let beyond = self.beyond(start, w, s.weight);
        for (d, only_camera) in beyond.into_iter().flatten() {
            let l = self.share(s, d.distance);
            self.b.functional.items.clear();
            self.edge_rate(at, n);
            self.end_rate(s, n * -(1.0 - l));
            self.end_rate(&d, n * -l);
            self.deliver(&d, only_camera, true, w, s.weight * scale);
        }
        Some(())
    }

    /// Detector ends: where free flight stops on a vertex, and a point placed towards a camera in the
    /// medium, which is connected to the camera alone.
    fn beyond(&mut self, start: &Start, w: Vec3, channels: Rgb) -> [Option<(End, bool)>; 2] {
        let mut ray = core::mem::take(&mut self.b.ray);
        start.cast(self.tracer, w, &mut ray);
        let span = self.tracer.camera_span(&ray);
        let placed = self.tracer.equiangular_to_camera(start.x, w, &ray, span).map(|v| {
            let end =
                End { vertex: Some(v.vertex), distance: v.t, weight: v.arrival, flight: None };
            (end, true)
        });
        let flown = self.arrive(start, w, &ray, channels, span);
        let flown = flown.filter(|end| end.vertex.is_some()).map(|end| (end, false));
        self.b.ray = ray;
        [flown, placed]
    }

    /// Follows a ray from the edge and stops by free flight.
    fn end(&mut self, start: &Start, w: Vec3, channels: Rgb) -> Option<End> {
        let mut ray = core::mem::take(&mut self.b.ray);
        start.cast(self.tracer, w, &mut ray);
        let end = self.arrive(start, w, &ray, channels, None);
        self.b.ray = ray;
        end
    }

    fn arrive(
        &mut self,
        start: &Start,
        w: Vec3,
        ray: &RayPath,
        channels: Rgb,
        span: Option<(f64, f64)>,
    ) -> Option<End> {
        match self.tracer.travel(start.x, w, ray, channels) {
            Travel::Volume(v) => Some(End {
                vertex: Some(v.vertex),
                distance: v.t,
                weight: v.arrival,
                flight: span.map(|span| v.flight(span, start.x, w)),
            }),
            Travel::Surface(vertex, weight) => {
                Some(End { vertex: Some(vertex), distance: ray.length, weight, flight: None })
            }
            Travel::Escape(weight) => {
                Some(End { vertex: None, distance: f64::INFINITY, weight, flight: None })
            }
            Travel::Absorbed => None,
        }
    }

    /// Transmittance from the edge to a point at `distance`, if nothing blocks.
    fn open(&mut self, start: &Start, w: Vec3, distance: f64) -> Option<Rgb> {
        let mut ray = core::mem::take(&mut self.b.ray);
        let Tracer { world, rng, counters, .. } = &mut *self.tracer;
        let (x, faces, medium) = (start.x, start.faces, start.medium.toward(world, start.x, w));
        let open = world.connect_past(x, faces, medium, w, distance, &mut ray, counters);
        let tau = open.then(|| world.transmittance(&Ray::new(x, w), &ray, rng, counters));
        self.b.ray = ray;
        tau
    }

    /// Transmittance from the edge to a surface point, if that is what the ray meets.
    fn open_to(&mut self, start: &Start, w: Vec3, target: &SurfacePoint) -> Option<Rgb> {
        let mut ray = core::mem::take(&mut self.b.ray);
        let world = self.tracer.world;
        start.cast(self.tracer, w, &mut ray);
        let mut tau = None;
        if ray.end.as_ref().is_some_and(|(p, _)| p.prim == target.prim) {
            let tracer = &mut *self.tracer;
            tau = Some(world.transmittance(
                &Ray::new(start.x, w),
                &ray,
                &mut tracer.rng,
                &mut tracer.counters,
            ));
        }
        self.b.ray = ray;
        tau
    }

    /// l = |x_B - x_S| / |x_D - x_S|; 1 when S is a direction.
    fn share(&self, s: &End, to_detector: f64) -> f64 {
        if s.distance.is_finite() { s.distance / (s.distance + to_detector) } else { 1.0 }
    }

    fn edge_rate(&mut self, at: &EdgePoint<'_>, n: Vec3) {
        let terms = at.edge.velocity_terms(self.tracer.world, at.along, n);
        self.b.functional.items.extend(terms);
    }

    fn end_rate(&mut self, end: &End, n: Vec3) {
        let Some(v) = &end.vertex else { return };
        match (&v.kind, v.medium) {
            (Kind::Surface(p), _) => {
                self.b.functional.items.push(VelocityTerm::Surface(p.material(), n))
            }
            (Kind::Volume(_), Some(m)) => {
                self.b.functional.items.push(VelocityTerm::Volume(m, v.x, n))
            }
            _ => {}
        }
    }

    /// Light that leaves S along `w` over at most `longest` segments, kept by segments.
    fn light_from(&mut self, s: &End, w: Vec3, longest: u32) -> Rgb {
        self.b.light.0.clear();
        match s.vertex {
            Some(vertex) => {
                let longest = u32::min(self.tracer.max_segments, longest);
                self.tracer.radiance_within(longest, vertex, w, &mut self.b.light);
            }
            None => {
                let sky = self.tracer.world.lights.environment();
                self.b.light.0.push(sky.map_or(Rgb::ZERO, |sky| sky.radiance(-w)));
            }
        }
        self.b.light.within(longest)
    }

    /// True when [`shadow`] has the paths on which the emission of S lights a volume vertex that the
    /// camera sees.
    fn left_to_shadows(&self, s_emits: bool, d: &Vertex, segments: u32) -> bool {
        s_emits
            && segments == 1
            && matches!(d.kind, Kind::Volume(_))
            && self.boundary.shadows.is_some()
    }

    /// Walks from D to the camera and hands on what arrives. `s_emits` tells that the light over no
    /// segments is an emitter's.
    fn deliver(&mut self, d: &End, only_camera: bool, s_emits: bool, w: Vec3, value: Rgb) {
        let Some(vertex) = d.vertex else { return };
        let world = self.tracer.world;
        let only_emission = self.b.light.0.len() == 1;
        if only_camera && only_emission && self.left_to_shadows(s_emits, &vertex, 1) {
            return;
        }
        if !self.receiver.moves(&self.b.functional) {
            return;
        }
        // Camera segments beyond D, with one more for the boundary segment itself, and what the light
        // takes at least.
        let Some(least) = self.b.light.fewest_segments() else { return };
        let longest = world.max_depth - 1 - least;
        let longest = if only_camera { u32::min(longest, 1) } else { longest };
        self.b.splats.clear();
        self.tracer.importance(vertex, -w, longest, d.flight, &mut self.b.splats);
        for s in &self.b.splats {
            let mut light = self.b.light.within(world.max_depth - 1 - s.segments);
            if self.left_to_shadows(s_emits, &vertex, s.segments) {
                light -= self.b.light.within(0);
            }
            let v = value * d.weight * light * s.value;
            if !v.is_zero() {
                self.receiver.receive(s.pixel, v);
            }
        }
    }
}
