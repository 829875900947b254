//! What a walk carries: radiance, from the camera on, or importance, towards it.
//!
//! Both are the same walk. With light flowing along the path from wi to wo at every vertex, a walk of radiance is
//! given wo and draws wi, connects to emitters and counts the emission that it meets; a walk of importance
//! is given wi and draws wo, and connects to the camera. Weights of the latter follow the area measure on the
//! camera's side: with geometric normals n_g,
//!
//! ```text
//! Wout(x_D → x_S) = Σ over walk vertices  β f(wo, wi) |n_g·wo| / |n_g·wi| σ τ h_P / r²
//! ```
//!
//! (2021 paper, Eq. 35), where f includes the cosine at wi, h_P is the pixel filter over the solid angle, and σ the
//! scattering coefficient of a volume vertex.

use drt_math::{Rgb, Vec3};
use drt_medium::Coefficients;

use crate::model::sensor::Viewpoint;
use crate::model::surface::Given;
use crate::sampling::trace::{Observer, PathState, Tracer};
use crate::world::lights::{LightKind, LightSample, LightTable};
use crate::world::scatter::Scattering;
use crate::world::{Tracking, World};

/// A point in a medium to which vertices are connected at distances chosen for it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ConnectionPoint {
    pub(crate) at: Vec3,
    /// The emitter, and its selection probability; the camera is none, and certain.
    emitter: Option<usize>,
    pmf: f64,
    /// The sum of the selection probabilities of all such points.
    pub(crate) total: f64,
}

/// A transport mode.
pub(crate) trait TransportMode {
    /// The direction that a vertex is given, towards the walk's start.
    const GIVEN: Given;
    /// Emission that is met counts.
    const EMISSION: bool;

    /// The factor of a vertex between two unit directions away from it, per solid angle of the second.
    fn value(scattering: &Scattering<'_>, from: Vec3, to: Vec3) -> Rgb;

    /// Connects a vertex to the other end of paths; `sigma_s` is its scattering coefficient, 1 on surfaces.
    fn connect<O: Observer>(
        tracer: &mut Tracer<'_>,
        stop: &PathState,
        scattering: &Scattering<'_>,
        sigma_s: Rgb,
        observer: &mut O,
    );

    /// Whether such ends are points inside of media.
    fn has_points(world: &World) -> bool;

    /// Chooses one of these.
    fn choose_point(tracer: &mut Tracer<'_>) -> ConnectionPoint;

    /// Connects a vertex that was placed for it.
    fn connect_to_point<O: Observer>(
        tracer: &mut Tracer<'_>,
        stop: &PathState,
        point: &ConnectionPoint,
        observer: &mut O,
    );
}

/// Radiance.
pub(crate) struct RadianceMode;

/// Importance.
pub(crate) struct ImportanceMode;

impl TransportMode for RadianceMode {
    const GIVEN: Given = Given::Wo;
    const EMISSION: bool = true;

    fn value(scattering: &Scattering<'_>, from: Vec3, to: Vec3) -> Rgb {
        scattering.eval(from, to)
    }

    fn connect<O: Observer>(
        tracer: &mut Tracer<'_>,
        stop: &PathState,
        scattering: &Scattering<'_>,
        sigma_s: Rgb,
        observer: &mut O,
    ) {
        let world = tracer.world;
        let Some(light) = world.lights.sample(world, stop.vertex.x, &mut tracer.rng) else {
            return;
        };
        let weight = match light.kind {
            LightKind::Position => free_flight_weight(world, stop, &light),
            LightKind::Direction => 1.0,
            LightKind::Area(_) | LightKind::Environment => {
                let p = scattering.pdf(stop.from, light.w, Given::Wo);
                light.pdf / (light.pdf + p)
            }
        };
        tracer.connect_light(stop, &light, weight, sigma_s, observer);
    }

    fn has_points(world: &World) -> bool {
        !world.lights.inside().0.is_empty()
    }

    fn choose_point(tracer: &mut Tracer<'_>) -> ConnectionPoint {
        let (lights, total) = tracer.world.lights.inside();
        let mut target = tracer.rng.next_f64() * total;
        let last = lights.len() - 1;
        let chosen = lights.iter().position(|l| {
            target -= l.1;
            target < 0.0
        });
        let (emitter, pmf, at) = lights[chosen.unwrap_or(last)];
        ConnectionPoint { at, emitter: Some(emitter), pmf, total }
    }

    fn connect_to_point<O: Observer>(
        tracer: &mut Tracer<'_>,
        stop: &PathState,
        point: &ConnectionPoint,
        observer: &mut O,
    ) {
        let Some(emitter) = point.emitter else { return };
        if let Some(light) = LightTable::delta(tracer.world, emitter, stop.vertex.x, point.pmf) {
            let sigma_s = stop.coefficients.as_ref().map_or(Rgb::ZERO, Coefficients::sigma_s);
            tracer.connect_light(stop, &light, 1.0, sigma_s, observer);
        }
    }
}

impl TransportMode for ImportanceMode {
    const GIVEN: Given = Given::Wi;
    const EMISSION: bool = false;

    fn value(scattering: &Scattering<'_>, from: Vec3, to: Vec3) -> Rgb {
        scattering.eval(to, from) * scattering.adjoint_correction(to, from)
    }

    fn connect<O: Observer>(
        tracer: &mut Tracer<'_>,
        stop: &PathState,
        _: &Scattering<'_>,
        sigma_s: Rgb,
        observer: &mut O,
    ) {
        let eye = tracer.world.camera.position();
        let weight = stop.flight.as_ref().map_or(1.0, |f| f.weight(eye, 1.0));
        let value = stop.throughput * sigma_s * weight;
        tracer.connect_camera(&stop.vertex, stop.from, value, stop.segments + 1, observer);
    }

    // Parallel rays do not crowd anywhere, and those of a lens not in one point.
    fn has_points(world: &World) -> bool {
        matches!(world.camera.viewpoint(), Viewpoint::Point(_))
            && world.camera_medium.is_some_and(|m| world.tracking[m] == Tracking::Vertices)
    }

    fn choose_point(tracer: &mut Tracer<'_>) -> ConnectionPoint {
        let at = tracer.world.camera.position();
        ConnectionPoint { at, emitter: None, pmf: 1.0, total: 1.0 }
    }

    fn connect_to_point<O: Observer>(
        tracer: &mut Tracer<'_>,
        stop: &PathState,
        _: &ConnectionPoint,
        observer: &mut O,
    ) {
        let sigma_s = stop.coefficients.as_ref().map_or(Rgb::ZERO, Coefficients::sigma_s);
        let value = stop.throughput * sigma_s;
        tracer.connect_camera(&stop.vertex, stop.from, value, stop.segments + 1, observer);
    }
}

/// MIS weight of connecting to a point light from a vertex that free flight found.
fn free_flight_weight(world: &World, stop: &PathState, light: &LightSample) -> f64 {
    let (lights, total) = world.lights.inside();
    match &stop.flight {
        Some(flight) if lights.iter().any(|(e, _, _)| *e == light.emitter) => {
            flight.weight(light.y, total)
        }
        _ => 1.0,
    }
}
