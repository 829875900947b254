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
//! In the spatial form (2019 paper, Eq. 16 and 20; theory sheet §3, §6) volume vertices stand at fixed
//! distances of their rays, u is the velocity of the ray's point at Σ, and every surface beside a
//! medium has this flux: f̂ with D_dot = n·(u_Σ - u) / (n·w) is the same term, less what surfaces
//! [tow](crate::transport::tow) along.
//!
//! A grid ends at its box, where coefficients jump to zero. Faces of the box that lie inside the medium
//! are such surfaces too, with f(+) = 0 and the velocity of the grid for u_Σ.

use alloc::sync::Arc;

use drt_math::{Real, Rgb, Rng, Vec3};
use drt_medium::MediumKind;

use crate::sensitivity::{Functional, Interest, Rate};
use crate::transport::trace::{Leaving, Tracer};
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
    /// In the spatial form: where there is a flux even if the ray stands still.
    movers: Option<Movers>,
}

/// What moves by itself.
#[derive(Clone, Debug)]
struct Movers {
    shapes: Arc<[bool]>,
    grids: Arc<[bool]>,
}

impl Flux {
    /// Of the material form; `None` when nothing has a flux.
    pub(crate) fn new(world: &World, shapes: &[usize], interest: &Interest) -> Option<Self> {
        let flags = (0..world.scene.shapes.len()).map(|s| shapes.contains(&s)).collect();
        let moves = |m: usize| {
            let of = |list: &[bool]| list.get(m).copied().unwrap_or(false);
            (of(&interest.grids) || of(&interest.volumes))
                && world.tracking[m] == Tracking::Vertices
                && ends_inside(world, m)
        };
        let grids: Arc<[bool]> = (0..world.scene.media.len()).map(moves).collect();
        let any = !shapes.is_empty() || grids.contains(&true);
        any.then_some(Self { shapes: flags, grids, longest: longest(world), movers: None })
    }

    /// Of the spatial form; `None` when no medium has vertices.
    pub(crate) fn spatial(world: &World, interest: &Interest) -> Option<Self> {
        let media = 0..world.scene.media.len();
        let tracked = |m: usize| world.tracking[m] == Tracking::Vertices;
        let grids = media.clone().map(|m| tracked(m) && ends_inside(world, m)).collect();
        let movers = Movers {
            shapes: interest.shapes.as_slice().into(),
            grids: interest.grids.as_slice().into(),
        };
        media.clone().any(tracked).then(|| Self {
            shapes: alloc::vec![true; world.scene.shapes.len()].into(),
            grids,
            longest: longest(world),
            movers: Some(movers),
        })
    }
}

/// Segments at which a volume vertex can no longer send anything: one that is the path's last sends
/// light only if it emits.
fn longest(world: &World) -> u32 {
    let emissive = world.scene.media.iter().any(|m| m.item.is_emissive());
    world.max_depth.saturating_add(u32::from(emissive))
}

/// A point of a path's ray that a surface sweeps over, in the spatial form: the sensitivity to its
/// velocity is the flux's value times `normal`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Swept {
    /// The record's node that the ray left.
    pub(crate) node: usize,
    /// Distance along the ray.
    pub(crate) t: f64,
    pub(crate) normal: Vec3,
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
    node: u32,
    t: f64,
    origin: Vec3,
    dir: Vec3,
    face: Face,
    x: Vec3,
    /// The medium the ray arrived in.
    around: Option<usize>,
    throughput: Rgb,
    /// What surfaces that [tow](crate::transport::tow) leave to the flux, before and beyond the face.
    left: [f64; 2],
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
    pub(crate) fn offer(&mut self, world: &World, leaving: &Leaving, carried: bool, ray: &RayPath) {
        let Leaving { node, throughput, dir, segments, .. } = *leaving;
        let origin = leaving.vertex.x;
        let Some(flux) = self.flux.as_ref().filter(|f| segments + 1 < f.longest) else { return };
        let strength = throughput.max_abs();
        if strength == 0.0 {
            return;
        }
        let (shapes, grids) = (&flux.shapes, &flux.grids);
        let sweeps = |shape: u32| match &flux.movers {
            Some(movers) => carried || movers.shapes[shape as usize],
            None => shapes[shape as usize],
        };
        let grid_sweeps = |m: usize| match &flux.movers {
            Some(movers) => grids[m] && (carried || movers.grids[m]),
            None => grids[m],
        };
        let (total, rng) = (&mut self.total, &mut self.rng);
        let (chosen, kept) = (&mut self.chosen, &mut self.part);
        let mut meet =
            |face: Face, normal: Vec3, x: Vec3, t: f64, around: Option<usize>, left: [f64; 2]| {
                let cosine = Real::abs(normal.dot(dir));
                let most = f64::max(left[0], left[1]);
                if cosine == 0.0 || most == 0.0 {
                    return;
                }
                let weight = strength * most / cosine;
                *total += weight;
                if rng.next_f64() * *total < weight {
                    let segments = segments + 1;
                    *chosen = Some(Meeting {
                        node,
                        t,
                        origin,
                        dir,
                        face,
                        x,
                        around,
                        throughput,
                        left,
                        segments,
                        weight,
                    });
                    kept.truncate_from(ray, t);
                }
            };
        let mut around = ray.medium;
        let mut start = 0.0;
        let crossings = ray.crossings.iter().map(|c| (c.point, c.x, c.t, c.after));
        let end = ray.end.iter().map(|(point, x)| (*point, *x, ray.length, None));
        let mut surfaces = crossings.chain(end).peekable();
        while let Some((point, x, t, after)) = surfaces.next() {
            let before = core::mem::replace(&mut around, after);
            let stretches = [t - start, surfaces.peek().map_or(f64::INFINITY, |next| next.2) - t];
            start = t;
            if !sweeps(point.shape) {
                continue;
            }
            let cosine = point.ng.dot(dir);
            let near = cosine < 0.0;
            let left = |front: bool, length: f64| {
                let medium = filled(world, &point, front, before);
                medium.map_or(0.0, |m| 1.0 - world.grip(m, cosine, length))
            };
            let beyond = world.is_null(point.shape).then(|| left(!near, stretches[1]));
            let left = [left(near, stretches[0]), beyond.unwrap_or(0.0)];
            meet(Face::Surface(point), point.ng, x, t, before, left);
        }
        if !grids.contains(&true) {
            return;
        }
        for i in intervals(ray.medium, &ray.crossings, ray.length) {
            let Some(m) = i.medium.filter(|m| grid_sweeps(*m)) else { continue };
            let part = drt_medium::Ray::new(origin + dir * i.start, dir, i.end - i.start);
            world.medium(m).crossings(&part, |c| {
                meet(
                    Face::Grid(m, c.normal),
                    c.normal,
                    part.at(c.t),
                    i.start + c.t,
                    Some(m),
                    [1.0; 2],
                );
            });
        }
    }

    /// Evaluates the chosen meeting; calls `add` with each functional, the point of the ray in the
    /// spatial form, and the weight of both.
    pub(crate) fn evaluate(
        &mut self,
        tracer: &mut Tracer<'_>,
        mut add: impl FnMut(&Functional, Option<Swept>, Rgb),
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
                self.send(tracer, &m, vertex, Rate::Grid(medium, m.x, n), n, tau * scale, &mut add);
            }
            Face::Surface(point) => {
                let cosine = point.ng.dot(m.dir);
                let scale = self.total / m.weight / Real::abs(cosine);
                let near = cosine < 0.0;
                for (front, left) in [(near, m.left[0]), (!near, m.left[1])] {
                    let Some(medium) = filled(world, &point, front, m.around) else { continue };
                    if left == 0.0 {
                        continue;
                    }
                    let vertex = world.touching(point, m.x, front, medium);
                    // The vertex is left behind at n·(u_Σ - u), n from the medium's side across.
                    let n = if front { -point.ng } else { point.ng };
                    let rate = Rate::Surface(point.material(), n);
                    self.send(tracer, &m, vertex, rate, n, tau * (scale * left), &mut add);
                }
            }
        }
    }

    /// Adds what a vertex that is left behind sends back along the path, by the rate of what leaves it
    /// along the normal `n`.
    #[allow(clippy::too_many_arguments)]
    fn send(
        &mut self,
        tracer: &mut Tracer<'_>,
        m: &Meeting,
        vertex: Vertex,
        rate: Rate,
        n: Vec3,
        weight: Rgb,
        add: &mut impl FnMut(&Functional, Option<Swept>, Rgb),
    ) {
        let mut light = Radiance::default();
        let own = tracer.max_segments;
        tracer.max_segments = own - m.segments;
        tracer.radiance_from(vertex, -m.dir, &mut light);
        tracer.max_segments = own;
        if !light.0.is_zero() {
            let spatial = self.flux.as_ref().is_some_and(|f| f.movers.is_some());
            self.functional.items.clear();
            self.functional.items.push(rate);
            if let (false, Some(medium)) = (spatial, vertex.medium) {
                self.functional.items.push(Rate::Volume(medium, m.x, -n));
            }
            let swept = Swept { node: m.node as usize, t: m.t, normal: -n };
            add(&self.functional, spatial.then_some(swept), m.throughput * light.0 * weight);
        }
    }
}

/// The medium on one side of a surface, if paths have vertices in it.
fn filled(
    world: &World,
    point: &SurfacePoint,
    front: bool,
    around: Option<usize>,
) -> Option<usize> {
    let medium = world.medium_on_side(point, front, around)?;
    (world.tracking[medium] == Tracking::Vertices).then_some(medium)
}
