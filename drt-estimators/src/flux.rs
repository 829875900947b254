//! The flux term: scattering carried through moving surfaces around an inside that does not follow
//! them (theory sheet §4.1).
//!
//! For every surface Σ with unit normal n from its back (-) to its front (+) and a medium whose
//! field u does not match the surface's velocity u_Σ,
//!
//! ```text
//! ∫_Σ [f(-) - f(+)] n·(u_Σ - u) dA,
//! ```
//!
//! f being the contribution of paths with a volume vertex on that side of Σ (0 inside an opaque
//! body). Its detector side is the camera itself, or a walk that ends there. The first is sampled
//! along camera rays, where each surface crossed gives one term (this finds it however small the
//! pixel); the second from points drawn on Σ.

use alloc::vec::Vec;

use drt_math::{AliasTable, Rgb, Vec3, warp};

use crate::Error;
use crate::boundary::Receiver;
use crate::sensitivity::{Functional, Rate};
use crate::transport::importance::Splat;
use crate::transport::lights::triangle_bary;
use crate::transport::trace::{Tracer, Travel};
use crate::transport::world::{Tracking, intervals};
use crate::transport::{Kind, Radiance, RadianceBySegments, RayPath, SurfacePoint, Vertex, World};

/// The surfaces with a flux.
#[derive(Debug)]
pub(crate) struct Flux {
    prims: Vec<(u32, f64)>,
    table: AliasTable,
    shapes: Vec<bool>,
}

/// Reusable buffers of a flux worker.
#[derive(Debug, Default)]
pub(crate) struct Buffers {
    pub(crate) functional: Functional,
    light: RadianceBySegments,
    splats: Vec<Splat>,
    ray: RayPath,
    outgoing: RayPath,
}

impl Flux {
    pub(crate) fn new(world: &World, shapes: &[usize]) -> Result<Option<Self>, Error> {
        let mut prims = Vec::new();
        let mut of = alloc::vec![false; world.scene.shapes.len()];
        for &s in shapes {
            of[s] = true;
            let mesh = &world.scene.shapes[s].mesh;
            for t in 0..mesh.triangles.len() as u32 {
                prims.push((world.prim_of(s, t), mesh.area(t)));
            }
        }
        if prims.is_empty() {
            return Ok(None);
        }
        let weights: Vec<f64> = prims.iter().map(|(_, a)| *a).collect();
        let table = AliasTable::new(&weights).map_err(|e| Error::Element {
            element: "moving surfaces".into(),
            reason: alloc::format!("areas cannot be sampled: {e}"),
        })?;
        Ok(Some(Self { prims, table, shapes: of }))
    }

    /// The side's vertex, if there is a medium to sample on it.
    fn side(
        &self,
        world: &World,
        point: SurfacePoint,
        x: Vec3,
        front: bool,
        around: Option<usize>,
    ) -> Option<(Vertex, usize)> {
        let medium = world.medium_on_side(&point, front, around)?;
        (world.tracking[medium] == Tracking::Vertices)
            .then(|| (world.touching(point, x, front, medium), medium))
    }

    /// How the volume vertex is left behind: n·(u_Σ - u), signed by the side.
    fn functional(
        functional: &mut Functional,
        point: SurfacePoint,
        x: Vec3,
        front: bool,
        medium: usize,
    ) {
        let n = if front { -point.ng } else { point.ng };
        functional.items.clear();
        functional.items.push(Rate::Surface(point, n));
        functional.items.push(Rate::Volume(medium, x, -n));
    }

    /// One sample of paths with at least one vertex between the surface and the camera.
    pub(crate) fn sample<R: Receiver>(
        &self,
        tracer: &mut Tracer<'_>,
        b: &mut Buffers,
        receiver: &mut R,
    ) {
        tracer.counters.flux_samples += 1;
        let world = tracer.world;
        if world.max_depth < 3 {
            return;
        }
        let i = self.table.sample(tracer.rng.next_f64()).index;
        let (prim, area) = self.prims[i];
        let (point, x) = world.point(prim, triangle_bary(tracer.rng.next_2d()));
        let inv_pdf = area / self.table.pmf(i);
        let wo = warp::uniform_sphere(tracer.rng.next_2d());
        let inv_pdf = inv_pdf / warp::uniform_sphere_pdf();
        let around = world.medium_around(&point, x);
        for front in [false, true] {
            // A null interface looks the same from both sides but for the medium at the vertex; an
            // opaque one blocks what looks into it, which the contact takes care of.
            let Some((vertex, medium)) = self.side(world, point, x, front, around) else {
                continue;
            };
            Self::functional(&mut b.functional, point, x, front, medium);
            if !receiver.moves(&b.functional) {
                continue;
            }
            world.cast(&vertex, wo, &mut b.outgoing, &mut tracer.counters);
            let (next, weight) = match tracer.travel(x, wo, &b.outgoing, Rgb::ONE) {
                Travel::Volume(v) => (v.vertex, v.arrival),
                Travel::Surface(p, y, weight) => {
                    let medium = b.outgoing.crossings.last().map_or(b.outgoing.medium, |c| c.after);
                    (Vertex { x: y, medium, kind: Kind::Surface(p) }, weight)
                }
                Travel::Escape(_) | Travel::Absorbed => continue,
            };
            b.splats.clear();
            tracer.importance(next, -wo, world.max_depth - 2, None, &mut b.splats);
            if b.splats.is_empty() {
                continue;
            }
            b.light.0.clear();
            let own = tracer.max_segments;
            tracer.max_segments = world.max_depth - 2;
            tracer.from_vertex(vertex, wo, &mut b.light);
            tracer.max_segments = own;
            for s in &b.splats {
                let light = b.light.within(world.max_depth - 1 - s.segments);
                receiver.receive(s.pixel, light * weight * s.value * inv_pdf);
            }
        }
    }

    /// The terms along one camera ray: every surface with a flux it crosses or ends on. Calls `add`
    /// with each functional and its weight.
    pub(crate) fn along_camera_ray(
        &self,
        tracer: &mut Tracer<'_>,
        dir: Vec3,
        b: &mut Buffers,
        mut add: impl FnMut(&Functional, Rgb),
    ) {
        let world = tracer.world;
        if world.max_depth < 1 {
            return;
        }
        let eye = world.eye();
        let mut ray = core::mem::take(&mut b.ray);
        world.cast(&eye, dir, &mut ray, &mut tracer.counters);
        let mut tau = Rgb::ONE;
        for (i, part) in intervals(ray.medium, &ray.crossings, ray.length).enumerate() {
            if let Some(m) = part.medium {
                let start = eye.x + dir * part.start;
                let length = part.end - part.start;
                let mut stats = drt_medium::TrackingStats::default();
                tau *=
                    world.medium(m).transmittance(start, dir, length, &mut tracer.rng, &mut stats);
                tracer.counters.tracking_steps += stats.lookups;
            }
            let hit = match ray.crossings.get(i) {
                Some(c) => Some((c.point, c.x)),
                None => ray.end,
            };
            let Some((point, x)) = hit else { break };
            if tau.is_zero() {
                break;
            }
            if !self.shapes[point.shape as usize] {
                continue;
            }
            tracer.counters.flux_samples += 1;
            let cosine = point.ng.dot(dir);
            let null = world.is_null(point.shape);
            for front in [false, true] {
                // Behind an opaque surface nothing is seen.
                if !null && front == (cosine > 0.0) {
                    continue;
                }
                let Some((vertex, medium)) = self.side(world, point, x, front, part.medium) else {
                    continue;
                };
                let mut light = Radiance::default();
                let own = tracer.max_segments;
                tracer.max_segments = own - 1;
                tracer.from_vertex(vertex, -dir, &mut light);
                tracer.max_segments = own;
                if light.0.is_zero() {
                    continue;
                }
                Self::functional(&mut b.functional, point, x, front, medium);
                add(&b.functional, tau * light.0 * (1.0 / cosine.abs()));
            }
        }
        b.ray = ray;
    }
}
