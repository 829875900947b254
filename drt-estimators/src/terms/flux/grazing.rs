//! The flux through what the camera sees edge on.
//!
//! Rays meet a surface in proportion to the cosine c of the angle of incidence, and their flux has the factor 1/c:
//! E \[1/c²\] diverges like a logarithm, one sample of a million has what thousands of others have. By area the integral has no such factor,
//!
//! ```text
//! ∫_{c < EDGE_ON} h_P(y) τ(x, y) / r² [Lout(-) - Lout(+)] n·(u_Σ - u) dA,
//! ```
//!
//! x being the eye and h_P the pixel's filter and importance. So where c is small, points are drawn on
//! triangles that may be seen so, in proportion to the angle they would fill if they faced the eye, and camera rays leave
//! those out. Nothing is [warped](crate::derivative::velocity::warp) there. (Of a face in the very plane of the eye, flux, primary edges and
//! what is dimmed depend on each other: none is sampled.)

#[cfg(all(test, feature = "std"))]
mod tests;

use alloc::vec::Vec;

use drt_math::{CdfTable, Real, Vec3};

use crate::derivative::sensitivity::{ActiveInputs, VelocityFunctional, VelocityTerm};
use crate::model::error::Error;
use crate::model::sensor::Viewpoint;
use crate::sampling::importance::{Splat, see};
use crate::sampling::record::Radiance;
use crate::sampling::trace::Tracer;
use crate::terms::boundary_segments::BoundarySink;
use crate::terms::flux::{EDGE_ON, Flux, filled};
use crate::world::lights::triangle_bary;
use crate::world::{SurroundingMedium, World};

/// The triangles with a flux that are seen edge on.
#[derive(Debug)]
pub(crate) struct GrazingFlux {
    triangles: Vec<Triangle>,
    table: CdfTable,
    /// Of the spatial form, where the camera's rays move with it.
    spatial: bool,
}

#[derive(Clone, Copy, Debug)]
struct Triangle {
    prim: u32,
    area: f64,
    /// The medium around its shape, where that is the same everywhere.
    around: SurroundingMedium,
}

/// Cosine below which rounding decides what is seen of a face.
const IN_PLANE: f64 = 1e-9;

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
        let viewpoint = world.camera.viewpoint();
        let (mut triangles, mut weights) = (Vec::new(), Vec::new());
        for (s, shape) in (0..).zip(&world.scene.shapes) {
            if !flux.sweeps(s, active.sensor) {
                continue;
            }
            // What bounds media knows both of them.
            let mut around = shape.boundary.map(|_| SurroundingMedium::Uniform(None));
            for t in 0..shape.mesh.triangles.len() as u32 {
                let corners = shape.mesh.triangle(t);
                let across = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
                let area = 0.5 * across.length();
                let n = across.normalize();
                let (seen, r2) = match viewpoint {
                    Viewpoint::Infinity(forward) => (Real::abs(n.dot(forward)) < EDGE_ON, 1.0),
                    Viewpoint::Point(eye) => grazed_from(corners, n, area, eye, 0.0),
                    Viewpoint::Lens { centre, radius } => {
                        grazed_from(corners, n, area, centre, radius)
                    }
                };
                if area > 0.0 && seen {
                    let around = *around.get_or_insert_with(|| world.medium_around(s as usize));
                    triangles.push(Triangle { prim: world.prim_of(s as usize, t), area, around });
                    weights.push(area / r2);
                }
            }
        }
        if triangles.is_empty() || flux.longest <= 1 {
            return Ok(None);
        }
        let table = CdfTable::new(&weights).map_err(|e| Error::Element {
            element: "triangles seen edge on".into(),
            reason: e.into(),
        })?;
        let spatial = flux.movers.is_some();
        Ok(Some(Self { triangles, table, spatial }))
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
        let chosen = self.table.sample(tracer.rng.next_f64());
        let Triangle { prim, area, around } = self.triangles[chosen.index];
        let (point, x) = world.point(prim, triangle_bary(tracer.rng.next_2d()));
        let lens = world.camera.draw_lens(&mut tracer.rng);
        let camera = &*world.camera.at_lens(lens);
        let eye = camera.eye_of(x);
        let to = eye - x;
        let cosine = point.ng.dot(to) / to.length();
        if !(IN_PLANE..EDGE_ON).contains(&Real::abs(cosine)) {
            return None;
        }
        let inv_pdf = area / chosen.pmf;
        let around = around.at(world, x);
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

/// Whether a triangle with the unit normal `n` may be seen edge on from within a `radius` around the eye, and the square of its
/// distance, which is at least its area.
fn grazed_from(corners: [Vec3; 3], n: Vec3, area: f64, eye: Vec3, radius: f64) -> (bool, f64) {
    let height = Real::abs(n.dot(corners[0] - eye));
    let farthest = corners.iter().map(|c| (*c - eye).length()).fold(0.0, f64::max);
    let middle = (corners[0] + corners[1] + corners[2]) / 3.0 - eye;
    let r2 = f64::max(middle.length_squared(), area);
    (height - radius < EDGE_ON * (farthest + radius), r2)
}
