//! Connections to the camera, and walks of importance.
//!
//! Boundary and flux samples split a path in the middle. Their detector side is sampled here:
//! `Wout(x_D → x_S)` of 2021 paper, Eq. 35, as a sum over camera connections along a random walk
//! that starts at x_D and sees light arriving from x_S. Vertices of a medium the camera sits in are also
//! placed by equiangular sampling towards it, since 1/r² has no second moment under free flight.

use alloc::vec::Vec;

use drt_math::{Ray, Rgb, Vec3};

use crate::model::sensor::Sensor;
use crate::sampling::flight::{Flown, medium_span};
use crate::sampling::trace::{Alive, Flight, Observer, PathState, Pixel, Tracer};
use crate::sampling::transport_mode::{ImportanceMode, TransportMode};
use crate::world::RayPath;
use crate::world::vertex::{Kind, Vertex};

/// Importance that reached a pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Splat {
    pub(crate) pixel: u32,
    /// Segments from the walk's start to the camera.
    pub(crate) segments: u32,
    pub(crate) value: Rgb,
}

impl Observer for Vec<Splat> {
    const RECORDS: bool = false;

    fn contribution(&mut self, to: Pixel, segments: u32, value: Rgb) {
        if let Pixel::At(pixel) = to {
            self.push(Splat { pixel, segments, value });
        }
    }
}

/// Direction from a vertex to the camera, and importance without filter over squared distance;
/// `None` when no pixel can see the point.
pub(crate) fn see(camera: &Sensor, v: &Vertex) -> Option<(Vec3, f64)> {
    let projection = camera.view(v.x);
    let r = camera.filter().radius();
    let film = camera.film().map(f64::from);
    let inside = |q: f64, n: f64| q > -r && q < n + r;
    let [x, y] = projection.pixel;
    if !(projection.depth > 0.0 && inside(x, film[0]) && inside(y, film[1])) {
        return None;
    }
    let d = camera.eye_of(v.x) - v.x;
    let r2 = d.length_squared();
    Some((d.normalize(), projection.importance / r2))
}

impl Tracer<'_> {
    /// Walks from `start`, which light reaches from the unit direction `wi`, and tells what
    /// reaches the film over at most `longest` segments. `flight` tells how a volume start was
    /// found.
    pub(crate) fn importance<O: Observer>(
        &mut self,
        start: Vertex,
        wi: Vec3,
        longest: u32,
        flight: Option<Flight>,
        observer: &mut O,
    ) {
        let coefficients = match (&start.kind, start.medium) {
            (Kind::Volume(_), Some(m)) => Some(self.world.medium(m).coefficients(start.x)),
            _ => None,
        };
        let stop = PathState {
            node: 0,
            vertex: start,
            coefficients,
            from: wi,
            throughput: Rgb::ONE,
            arrival: Rgb::ONE,
            alive: Alive::new(Rgb::ONE),
            segments: 0,
            flight,
        };
        let own = core::mem::replace(&mut self.max_segments, longest);
        self.walk::<ImportanceMode, O>(stop, observer);
        self.max_segments = own;
    }

    /// The part of a ray that equiangular sampling towards the camera covers, if that pays.
    pub(crate) fn camera_span(&self, ray: &RayPath) -> Option<(f64, f64)> {
        if ImportanceMode::has_points(self.world) { medium_span(ray) } else { None }
    }

    /// A volume vertex placed by the angle under which the camera sees the ray.
    pub(crate) fn equiangular_to_camera(
        &mut self,
        origin: Vec3,
        dir: Vec3,
        ray: &RayPath,
        span: Option<(f64, f64)>,
    ) -> Option<Flown> {
        self.place_towards(origin, dir, ray, span?, self.world.camera.position(), 1.0)
    }

    /// Connects a vertex, which light reaches from the unit direction `wi`, to the camera, and spreads what
    /// arrives over the pixels that see it. `value` contains the scattering coefficient.
    pub(super) fn connect_camera<O: Observer>(
        &mut self,
        v: &Vertex,
        wi: Vec3,
        value: Rgb,
        segments: u32,
        observer: &mut O,
    ) {
        let Some(scattering) = self.world.scattering(v) else { return };
        let world = self.world;
        let lens = world.camera.draw_lens(&mut self.rng);
        let camera = &*world.camera.at_lens(lens);
        let Some((wo, transport)) = see(camera, v) else { return };
        let f = ImportanceMode::value(&scattering, wi, wo);
        self.spread(camera, v, value * f, transport, wo, segments, observer);
    }

    /// Adds `value · transport · transmittance` to the pixels around a vertex's image by the camera, or the pinhole that it
    /// is at a point of its lens.
    #[allow(clippy::too_many_arguments)]
    pub(crate) fn spread<O: Observer>(
        &mut self,
        camera: &Sensor,
        v: &Vertex,
        value: Rgb,
        transport: f64,
        wo: Vec3,
        segments: u32,
        observer: &mut O,
    ) {
        if value.is_zero() {
            return;
        }
        let world = self.world;
        let eye = camera.eye_of(v.x);
        let distance = (eye - v.x).length();
        if !world.connect(v, wo, distance, None, &mut self.shadow, &mut self.counters) {
            return;
        }
        let tau = world.transmittance(
            &Ray::new(v.x, wo),
            &self.shadow,
            &mut self.rng,
            &mut self.counters,
        );
        let value = value * tau * transport;
        let pixel = camera.view(v.x).pixel;
        let width = camera.film()[0];
        for p in camera.footprint(pixel) {
            let [x, y] = p.pixel;
            observer.contribution(Pixel::At(y * width + x), segments, value * p.weight);
        }
    }
}
