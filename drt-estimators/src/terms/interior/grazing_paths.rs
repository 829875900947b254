//! Paths that begin on what the camera sees [edge on](crate::terms::grazing).
//!
//! Where a ray at rest lands on a surface that moves, the point that it finds moves on the surface in proportion to 1/c, c being the
//! cosine of the angle of incidence; the derivative of the geometric term that matter takes along has 1/c, too. By the
//! solid angle dω = c dA / r² of an area dA at the distance r, the interior term of such paths is
//!
//! ```text
//! ∫_{c < c_S} h_P(y) c / r² ∂(f / p) dA,
//! ```
//!
//! c_S being the cosine below which the camera sees a shape edge on, h_P the pixel's filter and importance, and f / p the contribution of a path over the density with which the walk finds it from
//! the ray on. A point y drawn by area counts for one of the pixels whose filters reach it, so that velocities which depend on the pixel
//! are known. The camera's own rays leave out the interior of [paths that begin so](GrazingTriangles::first_of).

#[cfg(all(test, feature = "std"))]
mod tests;

use alloc::sync::Arc;

use drt_math::{Real, Rgb, Rng};

use crate::derivative::antithetic::AntitheticPairs;
use crate::derivative::velocity::PathVelocities;
use crate::model::sensor::{Sensor, ViewSample};
use crate::sampling::importance::see;
use crate::sampling::record::PathRecord;
use crate::sampling::streams::{
    FLUX_STREAM, LINE_STREAM, PAIR_STREAM, PROBE_STREAM, VELOCITY_STREAM,
};
use crate::sampling::trace::Tracer;
use crate::terms::boundary_segments::BoundarySink;
use crate::terms::grazing::GrazingTriangles;
use crate::terms::interior::component::PathDerivative;
use crate::terms::interior::{PathView, Probes, Recorder};
use crate::terms::selected::Terms;
use crate::world::World;
use crate::world::vertex::{Kind, Vertex};

/// Samples paths that begin on what the camera sees edge on.
pub(crate) struct GrazingPaths<'a> {
    world: &'a World,
    triangles: &'a GrazingTriangles,
    record: PathRecord,
    views: [PathView<'a>; 1],
    derivative: PathDerivative<'a>,
    probes: Option<Probes>,
}

impl<'a> GrazingPaths<'a> {
    /// Paths are traced in the light of `all` emitters; `terms` are of the derivative of the light of those in `world`.
    pub(crate) fn new(
        all: &'a World,
        triangles: &'a GrazingTriangles,
        world: &'a World,
        terms: &Terms,
    ) -> Self {
        let velocities = PathVelocities::new(Arc::clone(&terms.velocity));
        let pairs = AntitheticPairs::new(terms.lobe_pairs);
        let view = PathView::new(world, velocities, pairs, terms.flux.as_ref()).with_probes();
        Self {
            world,
            triangles,
            record: PathRecord::default(),
            views: [view],
            derivative: PathDerivative::new(world),
            probes: all.has_probes().then(Probes::new),
        }
    }

    /// Takes one sample, the one of an `index` in a stream.
    pub(crate) fn sample<R: BoundarySink>(
        &mut self,
        tracer: &mut Tracer<'a>,
        [seed, stream]: [u64; 2],
        index: u32,
        receiver: &mut R,
    ) -> Option<()> {
        let Self { world, triangles, record, views, derivative, probes } = self;
        let seen = triangles.sample(world, &mut tracer.rng)?;
        let camera = &*seen.camera;
        let end = Vertex { x: seen.x, medium: None, kind: Kind::Point };
        let (w, transport) = see(camera, &end)?;
        let point = camera.view(seen.x).pixel;
        let mut view = ViewSample {
            origin: seen.eye,
            direction: -w,
            point,
            weight: transport * Real::abs(seen.cosine) * seen.inv_pdf,
            slope: [0.0; 2],
            lens: seen.lens,
        };
        let pixel = choose_pixel(camera, &mut view, tracer.rng.next_f64())?;
        let numbers = |of: u64| Rng::new(seed, of | stream, index);
        let velocities = || numbers(VELOCITY_STREAM);
        views[0].begin(Some(numbers(PAIR_STREAM)), velocities, || numbers(FLUX_STREAM));
        if let Some(probes) = probes {
            probes.begin(seed, numbers(PROBE_STREAM).next_u32(), index);
        }
        let weight = Rgb::splat(view.weight);
        let mut recorder = Recorder { record, views, camera_ray: None, probes: probes.as_mut() };
        recorder.begin(pixel, &view, weight);
        tracer.trace_camera(&view, weight, &mut recorder);
        let found = triangles.first_of(recorder.record)?;
        // Something else may be in front of it.
        if found.prim != seen.point.prim {
            return None;
        }
        recorder.probe(tracer);
        let all = core::mem::replace(&mut tracer.world, views[0].world);
        let film = [(pixel[1] * camera.film()[0] + pixel[0], 1.0)];
        receiver.spread(&film, |sink| {
            derivative.send(tracer, record, &views[0], view.slope, numbers(LINE_STREAM), sink);
        });
        tracer.world = all;
        Some(())
    }
}

/// Chooses one of the pixels that a view counts for, and gives the view its filter, over the probability.
fn choose_pixel(camera: &Sensor, view: &mut ViewSample, u: f64) -> Option<[u32; 2]> {
    // Where a filter is zero, its slope may not be.
    let footprint = || {
        camera.footprint(view.point).map(|p| {
            let [x, y] = p.gradient;
            (Real::abs(p.weight) + Real::abs(x) + Real::abs(y), p)
        })
    };
    let total: f64 = footprint().map(|(size, _)| size).sum();
    let mut left = u * total;
    let mut chosen = None;
    for (size, p) in footprint().filter(|(size, _)| *size > 0.0) {
        chosen = Some((size, p));
        left -= size;
        if left < 0.0 {
            break;
        }
    }
    let (size, p) = chosen?;
    let by = view.weight * total / size;
    (view.weight, view.slope) = (by * p.weight, p.gradient.map(|g| by * g));
    Some(p.pixel)
}
