//! The flux term: scattering carried through deforming surfaces around an inside that does not
//! follow them (theory sheet §4.1).
//!
//! For every surface Σ with unit normal n from its back (-) to its front (+) and a medium whose
//! field u does not match the surface's velocity u_Σ,
//!
//! ```text
//! ∫_Σ [f(-) - f(+)] n·(u_Σ - u) dA,
//! ```
//!
//! f being the contribution of paths with a volume vertex on that side of Σ (0 inside an opaque
//! body). Seen from the vertex before it, dA = r² dω / |n·w|: every ray that a camera path follows
//! and that meets Σ gives one term, throughput × τ × Lout / |n·w|. So the term is gathered on the
//! camera's own paths, however small the pixel. To keep the cost linear in path length, one of a
//! path's meetings is chosen in proportion to its throughput over the cosine (weighted reservoir
//! sampling), and Lout traced for it alone.

use alloc::sync::Arc;

use drt_math::{Real, Rgb, Rng, Vec3};

use crate::sensitivity::{Functional, Rate};
use crate::transport::trace::Tracer;
use crate::transport::world::Tracking;
use crate::transport::{Radiance, RayPath, SurfacePoint, Vertex, World};

/// The surfaces with a flux.
#[derive(Clone, Debug)]
pub(crate) struct Flux {
    shapes: Arc<[bool]>,
    /// Segments at which a volume vertex can no longer send anything.
    longest: u32,
}

impl Flux {
    /// `None` when no shape has a flux.
    pub(crate) fn new(world: &World, shapes: &[usize]) -> Option<Self> {
        let flags = (0..world.scene.shapes.len()).map(|s| shapes.contains(&s)).collect();
        // A vertex that is the path's last sends light only if it emits.
        let emissive = world.scene.media.iter().any(|m| m.item.is_emissive());
        let longest = world.max_depth.saturating_add(u32::from(emissive));
        (!shapes.is_empty()).then_some(Self { shapes: flags, longest })
    }
}

/// One of the meetings of a path with surfaces that have a flux.
#[derive(Clone, Copy, Debug)]
struct Meeting {
    origin: Vec3,
    dir: Vec3,
    point: SurfacePoint,
    x: Vec3,
    /// The medium the ray arrived in.
    around: Option<usize>,
    throughput: Rgb,
    /// Segments up to the surface.
    segments: u32,
    weight: f64,
}

/// Chooses one meeting per path.
#[derive(Clone, Debug)]
pub(crate) struct Reservoir {
    flux: Option<Flux>,
    rng: Rng,
    total: f64,
    chosen: Option<Meeting>,
    /// The chosen ray up to the surface.
    part: RayPath,
    functional: Functional,
}

impl Default for Reservoir {
    fn default() -> Self {
        Self {
            flux: None,
            rng: Rng::new(0, 0, 0),
            total: 0.0,
            chosen: None,
            part: RayPath::default(),
            functional: Functional::default(),
        }
    }
}

impl Reservoir {
    pub(crate) fn new(flux: Option<&Flux>) -> Self {
        Self { flux: flux.cloned(), ..Self::default() }
    }

    pub(crate) fn begin(&mut self, rng: Rng) {
        self.rng = rng;
        self.total = 0.0;
        self.chosen = None;
    }

    /// Offers the surfaces that a ray meets.
    pub(crate) fn offer(
        &mut self,
        segments: u32,
        throughput: Rgb,
        origin: Vec3,
        dir: Vec3,
        ray: &RayPath,
    ) {
        let Some(flux) = self.flux.as_ref().filter(|f| segments + 1 < f.longest) else { return };
        let strength = throughput.max_abs();
        if strength == 0.0 {
            return;
        }
        let mut around = ray.medium;
        let crossings = ray.crossings.iter().map(|c| (c.point, c.x, c.t, c.after));
        let end = ray.end.iter().map(|(point, x)| (*point, *x, ray.length, None));
        for (point, x, t, after) in crossings.chain(end) {
            let before = core::mem::replace(&mut around, after);
            let cosine = Real::abs(point.ng.dot(dir));
            if !flux.shapes[point.shape as usize] || cosine == 0.0 {
                continue;
            }
            let weight = strength / cosine;
            self.total += weight;
            if self.rng.next_f64() * self.total < weight {
                let segments = segments + 1;
                let around = before;
                self.chosen =
                    Some(Meeting { origin, dir, point, x, around, throughput, segments, weight });
                self.part.truncate_from(ray, t);
            }
        }
    }

    /// Evaluates the chosen meeting; calls `add` with each functional and its weight.
    pub(crate) fn evaluate(
        &mut self,
        tracer: &mut Tracer<'_>,
        mut add: impl FnMut(&Functional, Rgb),
    ) {
        let Some(m) = self.chosen.take() else { return };
        let world = tracer.world;
        if m.segments > tracer.max_segments {
            return;
        }
        let (rng, counters) = (&mut tracer.rng, &mut tracer.counters);
        let tau = world.transmittance(m.origin, m.dir, &self.part, rng, counters);
        if tau.is_zero() {
            return;
        }
        tracer.counters.flux_samples += 1;
        let cosine = m.point.ng.dot(m.dir);
        let null = world.is_null(m.point.shape);
        let scale = self.total / m.weight / Real::abs(cosine);
        for front in [false, true] {
            // Behind an opaque surface nothing is seen.
            if !null && front == (cosine > 0.0) {
                continue;
            }
            let Some((vertex, medium)) = side(world, &m, front) else { continue };
            let mut light = Radiance::default();
            let own = tracer.max_segments;
            tracer.max_segments = own - m.segments;
            tracer.radiance_from(vertex, -m.dir, &mut light);
            tracer.max_segments = own;
            if light.0.is_zero() {
                continue;
            }
            // The vertex is left behind at n·(u_Σ - u), n from the medium's side across.
            let n = if front { -m.point.ng } else { m.point.ng };
            self.functional.items.clear();
            self.functional.items.push(Rate::Surface(m.point.material(), n));
            self.functional.items.push(Rate::Volume(medium, m.x, -n));
            add(&self.functional, m.throughput * tau * light.0 * scale);
        }
    }
}

/// The volume vertex on one side of the surface, if there is a medium to scatter in.
fn side(world: &World, m: &Meeting, front: bool) -> Option<(Vertex, usize)> {
    let medium = world.medium_on_side(&m.point, front, m.around)?;
    (world.tracking[medium] == Tracking::Vertices)
        .then(|| (world.touching(m.point, m.x, front, medium), medium))
}
