//! The adjoint walk: importance carried from a vertex towards the camera.
//!
//! Boundary and flux samples split a path in the middle. Their detector side is sampled here:
//! `Wout(x_D → x_S)` of 2021 paper, Eq. 35, as a sum over camera connections along a random walk
//! that starts at x_D and sees light arriving from x_S. Weights follow the area measure on the
//! camera's side: with geometric normals n_g,
//!
//! ```text
//! W = Σ over walk vertices  β f(wo, wi) |n_g·wo| / |n_g·wi| σ τ h_P / r²,
//! ```
//!
//! where f includes the cosine at wi, h_P is the pixel filter over the solid angle, and σ the
//! scattering coefficient of a volume vertex. Vertices of a medium the camera sits in are also
//! placed by equiangular sampling towards it, since 1/r² has no second moment under free flight.

use alloc::vec::Vec;

use drt_math::{Rgb, Vec3, warp};

use super::flight::{Flight, Flown, Travel, medium_span};
use super::trace::Tracer;
use super::vertex::{Kind, Vertex};
use super::world::{RayPath, Tracking};
use crate::surface::Given;

/// Importance that reached a pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Splat {
    pub(crate) pixel: u32,
    /// Segments from the walk's start to the camera.
    pub(crate) segments: u32,
    pub(crate) value: Rgb,
}

impl Tracer<'_> {
    /// Walks from `start`, which light reaches from the unit direction `wi`, and appends what
    /// reaches the film over at most `longest` segments. `flight` tells how a volume start was
    /// found.
    pub(crate) fn importance(
        &mut self,
        start: Vertex,
        wi: Vec3,
        longest: u32,
        flight: Option<Flight>,
        splats: &mut Vec<Splat>,
    ) {
        let world = self.world;
        let (mut vertex, mut wi, mut flight) = (start, wi, flight);
        let mut beta = Rgb::ONE;
        let mut segments = 0;
        loop {
            segments += 1;
            if segments > longest {
                return;
            }
            if let (Kind::Volume(_), Some(m)) = (&vertex.kind, vertex.medium) {
                beta *= world.medium(m).coefficients(vertex.x).sigma_s();
            }
            if beta.is_zero() {
                return;
            }
            let weight = flight.as_ref().map_or(1.0, |f| f.weight(world.camera.position(), 1.0));
            self.splat(&vertex, wi, beta * weight, segments, splats);
            if segments == longest {
                return;
            }
            let Some(scattering) = world.scattering(&vertex) else { return };
            let Some((wo, pdf)) = scattering.sample(wi, Given::Wi, &mut self.rng) else { return };
            if pdf.is_nan() || pdf <= 0.0 {
                return;
            }
            let f = scattering.eval(wo, wi) * scattering.adjoint_correction(wo, wi);
            beta *= f * (1.0 / pdf);
            if segments > world.rr_depth {
                let survival = world.survival(beta);
                if survival <= 0.0 || self.rng.next_f64() >= survival {
                    return;
                }
                beta *= 1.0 / survival;
            }
            if beta.is_zero() {
                return;
            }
            let mut ray = self.ray.take().unwrap_or_default();
            world.cast(&vertex, wo, &mut ray, &mut self.counters);
            let next = self.toward_camera(vertex.x, wo, &ray, beta, segments + 1, splats);
            self.ray = Some(ray);
            let Some((v, arrival, f)) = next else { return };
            beta *= arrival;
            (vertex, wi, flight) = (v, -wo, f);
        }
    }

    /// Follows a ray of importance: splats an equiangular vertex, returns the one free flight found.
    fn toward_camera(
        &mut self,
        origin: Vec3,
        dir: Vec3,
        ray: &RayPath,
        beta: Rgb,
        segments: u32,
        splats: &mut Vec<Splat>,
    ) -> Option<(Vertex, Rgb, Option<Flight>)> {
        let span = self.camera_span(ray);
        if let Some(v) = self.equiangular_to_camera(origin, dir, ray, span) {
            let beta = beta * v.arrival * v.coefficients.sigma_s();
            self.splat(&v.vertex, -dir, beta, segments, splats);
        }
        match self.travel(origin, dir, ray, beta) {
            Travel::Volume(v) => {
                let flight = span.map(|span| v.flight(span, origin, dir));
                Some((v.vertex, v.arrival, flight))
            }
            Travel::Surface(point, x, arrival) => {
                let medium = ray.crossings.last().map_or(ray.medium, |c| c.after);
                Some((Vertex { x, medium, kind: Kind::Surface(point) }, arrival, None))
            }
            Travel::Escape(_) | Travel::Absorbed => None,
        }
    }

    /// The part of a ray that equiangular sampling towards the camera covers, if it is worth it.
    pub(crate) fn camera_span(&self, ray: &RayPath) -> Option<(f64, f64)> {
        let medium = self.world.camera_medium?;
        (self.world.tracking[medium] == Tracking::Vertices).then(|| medium_span(ray)).flatten()
    }

    /// A volume vertex placed by the angle under which the camera sees the ray.
    pub(crate) fn equiangular_to_camera(
        &mut self,
        origin: Vec3,
        dir: Vec3,
        ray: &RayPath,
        span: Option<(f64, f64)>,
    ) -> Option<Flown> {
        let (begin, end) = span?;
        let eye = self.world.camera.position();
        let distances = warp::Equiangular::new(origin, dir, eye, begin, end);
        let t = distances.sample(self.rng.next_f64());
        let mut part = core::mem::take(&mut self.shadow);
        part.truncate_from(ray, t);
        let v = self.place(origin, dir, &part, t, distances.pdf(t));
        self.shadow = part;
        v
    }

    /// Connects a vertex to the camera and spreads what arrives over the pixels that see it. `beta`
    /// contains the scattering coefficient.
    pub(crate) fn splat(
        &mut self,
        v: &Vertex,
        wi: Vec3,
        beta: Rgb,
        segments: u32,
        splats: &mut Vec<Splat>,
    ) {
        let Some(scattering) = self.world.scattering(v) else { return };
        let Some((wo, transport)) = self.see(v) else { return };
        let f = scattering.eval(wo, wi) * scattering.adjoint_correction(wo, wi);
        self.spread(v, beta * f, transport, wo, segments, splats);
    }

    /// Direction from a vertex to the camera, and importance without filter over squared distance;
    /// `None` when no pixel can see the point.
    pub(crate) fn see(&self, v: &Vertex) -> Option<(Vec3, f64)> {
        let camera = &self.world.camera;
        let projection = camera.view(v.x);
        let r = camera.filter().radius();
        let film = camera.film().map(f64::from);
        let inside = |q: f64, n: f64| q > -r && q < n + r;
        let [x, y] = projection.pixel;
        if !(projection.depth > 0.0 && inside(x, film[0]) && inside(y, film[1])) {
            return None;
        }
        let d = camera.position() - v.x;
        let r2 = d.length_squared();
        Some((d.normalize(), projection.importance / r2))
    }

    /// Adds `value · transport · transmittance` to the pixels around a vertex's image.
    pub(crate) fn spread(
        &mut self,
        v: &Vertex,
        value: Rgb,
        transport: f64,
        wo: Vec3,
        segments: u32,
        splats: &mut Vec<Splat>,
    ) {
        if value.is_zero() {
            return;
        }
        let world = self.world;
        let eye = world.camera.position();
        let distance = (eye - v.x).length();
        if !world.connect(v, wo, distance, None, &mut self.shadow, &mut self.counters) {
            return;
        }
        let tau = world.transmittance(v.x, wo, &self.shadow, &mut self.rng, &mut self.counters);
        let value = value * tau * transport;
        let pixel = world.camera.view(v.x).pixel;
        let width = world.camera.film()[0];
        for p in world.camera.footprint(pixel) {
            let [x, y] = p.pixel;
            splats.push(Splat { pixel: y * width + x, segments, value: value * p.weight });
        }
    }
}

impl Flown {
    /// How this vertex was found, for MIS against equiangular sampling over `span`.
    pub(crate) fn flight(&self, span: (f64, f64), origin: Vec3, dir: Vec3) -> Flight {
        Flight { span, origin, dir, t: self.t, density: self.density }
    }
}
