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
//!
//! A grid ends at its box, where coefficients jump to zero. Faces of the box that lie inside the medium
//! are such surfaces too, with f(+) = 0 and the velocity of the grid for u_Σ.

use alloc::sync::Arc;

use drt_math::{Real, Rgb, Rng, Vec3};
use drt_medium::MediumKind;

use crate::sensitivity::{Functional, Interest, Rate};
use crate::transport::trace::Tracer;
use crate::transport::world::{Tracking, intervals};
use crate::transport::{Radiance, RayPath, SurfacePoint, Vertex, World};

/// The surfaces with a flux.
#[derive(Clone, Debug)]
pub(crate) struct Flux {
    shapes: Arc<[bool]>,
    /// Media in which the faces of a grid's box have a flux.
    grids: Arc<[bool]>,
    /// Segments at which a volume vertex can no longer send anything.
    longest: u32,
}

impl Flux {
    /// `None` when nothing has a flux.
    pub(crate) fn new(world: &World, shapes: &[usize], interest: &Interest) -> Option<Self> {
        let flags = (0..world.scene.shapes.len()).map(|s| shapes.contains(&s)).collect();
        // A vertex that is the path's last sends light only if it emits.
        let emissive = world.scene.media.iter().any(|m| m.item.is_emissive());
        let longest = world.max_depth.saturating_add(u32::from(emissive));
        let moves = |m: usize| {
            let of = |list: &[bool]| list.get(m).copied().unwrap_or(false);
            (of(&interest.grids) || of(&interest.volumes))
                && world.tracking[m] == Tracking::Vertices
                && ends_inside(world, m)
        };
        let grids: Arc<[bool]> = (0..world.scene.media.len()).map(moves).collect();
        let any = !shapes.is_empty() || grids.contains(&true);
        any.then_some(Self { shapes: flags, grids, longest })
    }
}

/// Whether a medium's grid may end inside of it: not all around the medium is in the grid's box.
fn ends_inside(world: &World, medium: usize) -> bool {
    let grid = match &world.medium(medium).kind {
        MediumKind::Grid(grid) => grid.density(),
        MediumKind::Deformed(_) => return true,
        MediumKind::Homogeneous(_) | MediumKind::Custom(_) => return false,
    };
    let shapes = &world.scene.shapes;
    let mut around =
        shapes.iter().filter(|s| s.boundary.is_some_and(|b| b.interior == Some(medium))).peekable();
    let beyond = |x: &Vec3| (grid.from_world().point(*x) - Vec3::splat(0.5)).max_abs() > 0.5 + 1e-9;
    around.peek().is_none() || around.any(|s| s.mesh.positions.iter().any(beyond))
}

/// What a path meets.
#[derive(Clone, Copy, Debug)]
enum Face {
    Surface(SurfacePoint),
    /// A face of the box of a medium's grid, and its normal out of the box.
    Grid(usize, Vec3),
}

/// One of the meetings of a path with surfaces that have a flux.
#[derive(Clone, Copy, Debug)]
struct Meeting {
    origin: Vec3,
    dir: Vec3,
    face: Face,
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
        world: &World,
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
        let (shapes, grids) = (&flux.shapes, &flux.grids);
        let (total, rng) = (&mut self.total, &mut self.rng);
        let (chosen, kept) = (&mut self.chosen, &mut self.part);
        let mut meet = |face: Face, normal: Vec3, x: Vec3, t: f64, around: Option<usize>| {
            let cosine = Real::abs(normal.dot(dir));
            if cosine == 0.0 {
                return;
            }
            let weight = strength / cosine;
            *total += weight;
            if rng.next_f64() * *total < weight {
                let segments = segments + 1;
                *chosen =
                    Some(Meeting { origin, dir, face, x, around, throughput, segments, weight });
                kept.truncate_from(ray, t);
            }
        };
        let mut around = ray.medium;
        let crossings = ray.crossings.iter().map(|c| (c.point, c.x, c.t, c.after));
        let end = ray.end.iter().map(|(point, x)| (*point, *x, ray.length, None));
        for (point, x, t, after) in crossings.chain(end) {
            let before = core::mem::replace(&mut around, after);
            if shapes[point.shape as usize] {
                meet(Face::Surface(point), point.ng, x, t, before);
            }
        }
        if !grids.contains(&true) {
            return;
        }
        for i in intervals(ray.medium, &ray.crossings, ray.length) {
            let Some(m) = i.medium.filter(|m| grids[*m]) else { continue };
            let part = drt_medium::Ray::new(origin + dir * i.start, dir, i.end - i.start);
            world.medium(m).crossings(&part, |c| {
                meet(Face::Grid(m, c.normal), c.normal, part.at(c.t), i.start + c.t, Some(m));
            });
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
        match m.face {
            Face::Grid(medium, n) => {
                let vertex = world.inside_grid(medium, m.x, n);
                let scale = self.total / m.weight / Real::abs(n.dot(m.dir));
                let rates = [Rate::Grid(medium, m.x, n), Rate::Volume(medium, m.x, -n)];
                self.send(tracer, &m, vertex, rates, tau * scale, &mut add);
            }
            Face::Surface(point) => {
                let cosine = point.ng.dot(m.dir);
                let null = world.is_null(point.shape);
                let scale = self.total / m.weight / Real::abs(cosine);
                for front in [false, true] {
                    // Behind an opaque surface nothing is seen.
                    if !null && front == (cosine > 0.0) {
                        continue;
                    }
                    let Some((vertex, medium)) = side(world, &m, point, front) else { continue };
                    // The vertex is left behind at n·(u_Σ - u), n from the medium's side across.
                    let n = if front { -point.ng } else { point.ng };
                    let rates = [Rate::Surface(point.material(), n), Rate::Volume(medium, m.x, -n)];
                    self.send(tracer, &m, vertex, rates, tau * scale, &mut add);
                }
            }
        }
    }

    /// Adds what a vertex that is left behind sends back along the path, at some rates.
    fn send(
        &mut self,
        tracer: &mut Tracer<'_>,
        m: &Meeting,
        vertex: Vertex,
        rates: [Rate; 2],
        weight: Rgb,
        add: &mut impl FnMut(&Functional, Rgb),
    ) {
        let mut light = Radiance::default();
        let own = tracer.max_segments;
        tracer.max_segments = own - m.segments;
        tracer.radiance_from(vertex, -m.dir, &mut light);
        tracer.max_segments = own;
        if !light.0.is_zero() {
            self.functional.items.clear();
            self.functional.items.extend(rates);
            add(&self.functional, m.throughput * light.0 * weight);
        }
    }
}

/// The volume vertex on one side of the surface, if there is a medium to scatter in.
fn side(world: &World, m: &Meeting, point: SurfacePoint, front: bool) -> Option<(Vertex, usize)> {
    let medium = world.medium_on_side(&point, front, m.around)?;
    (world.tracking[medium] == Tracking::Vertices)
        .then(|| (world.touching(point, m.x, front, medium), medium))
}
