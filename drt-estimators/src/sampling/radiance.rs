//! Walks of radiance.

use drt_math::{Rgb, Vec3};

use crate::model::sensor::ViewSample;
use crate::sampling::record::Radiance;
use crate::sampling::trace::{Alive, Observer, OutgoingRay, PathState, Pixel, Tracer};
use crate::sampling::transport_mode::RadianceMode;
use crate::world::vertex::{Kind, Vertex};

impl Tracer<'_> {
    /// Traces a camera ray; `weight` is the filter over the density of the image point.
    pub(crate) fn trace_camera<O: Observer>(
        &mut self,
        view: &ViewSample,
        weight: Rgb,
        observer: &mut O,
    ) {
        let leaving = self.camera_ray(view, weight);
        self.radiance_along(&leaving, observer);
    }

    /// The first ray of a path from the camera.
    pub(super) fn camera_ray(&mut self, view: &ViewSample, weight: Rgb) -> OutgoingRay {
        self.counters.paths += 1;
        OutgoingRay::starting(self.world.eye_at(view.origin), view.direction, weight)
    }

    /// Estimates what comes along a ray, times its throughput.
    pub(crate) fn radiance_along<O: Observer>(&mut self, leaving: &OutgoingRay, observer: &mut O) {
        if let Some(stop) = self.follow::<RadianceMode, O>(leaving, observer) {
            self.walk::<RadianceMode, O>(stop, observer);
        }
    }

    /// Estimates what leaves `vertex` along the unit direction `wo`: radiance at a surface, radiance
    /// per length (scattered and emitted) at a volume vertex.
    pub(crate) fn radiance_from<O: Observer>(
        &mut self,
        vertex: Vertex,
        wo: Vec3,
        observer: &mut O,
    ) {
        let coefficients = match &vertex.kind {
            Kind::Surface(s) => {
                let emitted = self.world.emitted(s, wo);
                if !emitted.is_zero() {
                    observer.contribution(Pixel::Own, 0, emitted);
                }
                None
            }
            Kind::Volume(_) => {
                let Some(m) = vertex.medium else { return };
                let c = self.world.coefficients(m, vertex.x, wo);
                observer.contribution(Pixel::Own, 0, c.source());
                Some(c)
            }
            Kind::Point => return,
        };
        let stop = PathState { coefficients, ..starting(vertex, wo) };
        self.walk::<RadianceMode, O>(stop, observer);
    }

    /// Estimates the radiance that a volume vertex scatters into the unit direction `wo` per unit of its scattering coefficient,
    /// which may be zero, as that of a path of so many `segments` so far; `alive` is what Russian roulette takes it to carry.
    pub(crate) fn radiance_scattered(
        &mut self,
        vertex: Vertex,
        wo: Vec3,
        alive: Rgb,
        segments: u32,
    ) -> Rgb {
        let alive = Alive::new(alive);
        let mut radiance = Radiance::default();
        let stop = PathState { alive, segments, ..starting(vertex, wo) };
        self.walk::<RadianceMode, Radiance>(stop, &mut radiance);
        radiance.0
    }

    /// The same over at most `longest` segments.
    pub(crate) fn radiance_within<O: Observer>(
        &mut self,
        longest: u32,
        vertex: Vertex,
        wo: Vec3,
        observer: &mut O,
    ) {
        let own = core::mem::replace(&mut self.max_segments, longest);
        self.radiance_from(vertex, wo, observer);
        self.max_segments = own;
    }
}

/// A path that starts at a vertex, seen along `wo`.
fn starting(vertex: Vertex, wo: Vec3) -> PathState {
    PathState {
        node: 0,
        vertex,
        coefficients: None,
        from: wo,
        throughput: Rgb::ONE,
        arrival: Rgb::ONE,
        alive: Alive::new(Rgb::ONE),
        segments: 0,
        flight: None,
    }
}
