//! The flux through what the camera sees edge on.
//!
//! Rays meet a surface in proportion to the cosine c of the angle of incidence, and their flux has the factor 1/c. By area the
//! integral has no such factor,
//!
//! ```text
//! ∫_{c < EDGE_ON} h_P(y) τ(x, y) / r² [Lout(-) - Lout(+)] n·(u_Σ - u) dA,
//! ```
//!
//! x being the eye and h_P the pixel's filter and importance. So it is sampled on [triangles](GrazingTriangles) that may be seen
//! so, and camera rays leave it out where c is small. Nothing is [warped](crate::derivative::velocity::warp) there. (Of a face in the very
//! plane of the eye, flux, primary edges and what is dimmed depend on each other: none is sampled.)

#[cfg(all(test, feature = "std"))]
mod tests;

use alloc::vec::Vec;

use crate::derivative::sensitivity::{ActiveInputs, VelocityFunctional, VelocityTerm};
use crate::model::error::Error;
use crate::model::scene::Shape;
use crate::sampling::importance::{Splat, see};
use crate::sampling::record::Radiance;
use crate::sampling::trace::Tracer;
use crate::terms::boundary_segments::BoundarySink;
use crate::terms::flux::{EDGE_ON, Flux, filled};
use crate::terms::grazing::{GrazingPoint, GrazingTriangles};
use crate::world::{SurroundingMedium, World};

/// The triangles with a flux that are seen edge on.
#[derive(Debug)]
pub(crate) struct GrazingFlux {
    triangles: GrazingTriangles,
    /// The media around the shapes, where these are the same everywhere; `None` of shapes without a flux.
    around: Vec<Option<SurroundingMedium>>,
    /// Of the spatial form, where the camera's rays move with it.
    spatial: bool,
}

/// Buffers of a sample.
#[derive(Debug, Default)]
pub(crate) struct Buffers {
    functional: VelocityFunctional,
    splats: Vec<Splat>,
}

impl GrazingFlux {
    /// `None` where nothing is seen so.
    pub(crate) fn new(
        world: &World,
        flux: &Flux,
        active: &ActiveInputs,
    ) -> Result<Option<Self>, Error> {
        if flux.longest <= 1 {
            return Ok(None);
        }
        let sweeps = |s: u32| flux.sweeps(s, active.sensor);
        let below = |s: u32| if sweeps(s) { EDGE_ON } else { 0.0 };
        let Some(triangles) = GrazingTriangles::new(world, below)? else { return Ok(None) };
        let around = |(s, shape): (u32, &Shape)| {
            // What bounds media knows both of them.
            let known = shape.boundary.map(|_| SurroundingMedium::Uniform(None));
            sweeps(s).then(|| known.unwrap_or_else(|| world.medium_around(s as usize)))
        };
        let around = (0..).zip(&world.scene.shapes).map(around).collect();
        Ok(Some(Self { triangles, around, spatial: flux.movers.is_some() }))
    }

    /// Takes one sample.
    pub(crate) fn sample<R: BoundarySink>(
        &self,
        tracer: &mut Tracer<'_>,
        b: &mut Buffers,
        receiver: &mut R,
    ) -> Option<()> {
        tracer.counters.flux_samples += 1;
        let world = tracer.world;
        let seen = self.triangles.sample(world, &mut tracer.rng)?;
        let GrazingPoint { point, x, lens, camera, eye, cosine, inv_pdf } = seen;
        let camera = &*camera;
        let to = eye - x;
        let around = self.around[point.shape as usize]?.at(world, x);
        let longest = tracer.max_segments.checked_sub(1)?;
        for front in [true, false] {
            let faces = (cosine > 0.0) == front;
            let Some(medium) = filled(world, &point, front, around) else { continue };
            if !faces && !world.is_null(point.shape) {
                continue;
            }
            // From the medium's side across.
            let n = if front { -point.ng } else { point.ng };
            let vertex = world.touching(point, x, front, medium);
            let Some((w, transport)) = see(camera, &vertex) else { continue };
            b.functional.items.clear();
            b.functional.items.push(VelocityTerm::Surface(point.material(), n));
            if self.spatial {
                let gradient = camera.ray_gradient(eye, -w, -n, n * -to.length());
                let gradient = world.camera.lens_gradient(lens, gradient);
                b.functional.items.push(VelocityTerm::Sensor(gradient));
            } else {
                b.functional.items.push(VelocityTerm::Volume(medium, x, -n));
            }
            if !receiver.moves(&b.functional) {
                continue;
            }
            let mut light = Radiance::default();
            tracer.radiance_within(longest, vertex, w, &mut light);
            b.splats.clear();
            tracer.spread(camera, &vertex, light.0 * inv_pdf, transport, w, 1, &mut b.splats);
            for splat in &b.splats {
                receiver.receive(splat.pixel, splat.value);
            }
        }
        Some(())
    }
}
