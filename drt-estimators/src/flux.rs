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
//! medium has this flux: f̂ with D_dot = n·(u_Σ - u) / (n·w) is the same term, less what this surface and the
//! one beyond the medium [tow](crate::transport::tow) along. What of the two cancels for every velocity of the ray,
//! as in a thin layer, is not even traced.
//!
//! A grid ends at its box, where coefficients jump to zero. Faces of the box that lie inside the medium
//! are such surfaces too, with f(+) = 0 and the velocity of the grid for u_Σ.

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_math::{Real, Rgb, Rng, Vec3};
use drt_medium::MediumKind;

use crate::sensitivity::{Functional, Interest, Rate};
use crate::transport::tow::{Met, Stretch, list_met};
use crate::transport::trace::{Leaving, Tracer};
use crate::transport::world::{Tracking, intervals};
use crate::transport::{Radiance, RayPath, SurfacePoint, Vertex, World};

/// What is left of two speeds that cancel.
const ROUNDING: f64 = 1e-12;

/// The surfaces with a flux.
#[derive(Clone, Debug)]
pub(crate) struct Flux {
    /// Of the material form.
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
            shapes: Arc::default(),
            grids,
            longest: longest(world),
            movers: Some(movers),
        })
    }

    /// True when a shape sweeps over the points of a ray, which may itself be `carried`.
    fn sweeps(&self, shape: u32, carried: bool) -> bool {
        (carried && self.movers.is_some()) || self.moves(shape)
    }

    /// The same of a ray at rest.
    fn moves(&self, shape: u32) -> bool {
        self.movers.as_ref().map_or(&self.shapes, |m| &m.shapes)[shape as usize]
    }

    /// The same of the faces of a grid.
    fn sweeps_grid(&self, medium: usize, carried: bool) -> bool {
        let moves = |m: &Movers| carried || m.grids[medium];
        self.grids[medium] && self.movers.as_ref().is_none_or(moves)
    }
}

/// Segments at which a volume vertex can no longer send anything: one that is the path's last sends
/// light only if it emits.
fn longest(world: &World) -> u32 {
    let emissive = world.scene.media.iter().any(|m| m.item.is_emissive());
    world.max_depth.saturating_add(u32::from(emissive))
}

/// A ray of a path whose points surfaces sweep over, in the spatial form. The flux's value times these are the
/// sensitivities of the flux.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Swept {
    /// The record's node that the ray left.
    pub(crate) node: usize,
    /// To the velocity that the ray's origin has.
    pub(crate) origin: Vec3,
    /// To the rate of its direction.
    pub(crate) turn: Vec3,
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
    /// A surface, and what lies before and beyond it.
    Surface(SurfacePoint, [Option<Side>; 2]),
    /// A face of the box of a medium's grid, and its normal out of the box.
    Grid(usize, Vec3),
}

/// The medium on one side of a surface that a ray meets.
#[derive(Clone, Copy, Debug)]
struct Side {
    medium: usize,
    /// It is on the surface's front.
    front: bool,
    /// What of the surface's speed counts, and of that of the one at the medium's other end.
    speeds: [Option<Speed>; 2],
}

/// A share of the speed of a surface along a ray.
#[derive(Clone, Copy, Debug)]
struct Speed {
    point: SurfacePoint,
    /// Distance along the ray.
    t: f64,
    /// Its product with the surface's velocity less the ray's is the share.
    along: Vec3,
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
    /// The surfaces on the present ray, if some have a flux.
    met: Vec<Met>,
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
            met: Vec::new(),
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
        self.met.clear();
        let Some(flux) = self.flux.as_ref() else { return };
        list_met(&mut self.met, ray, dir, |point| flux.sweeps(point.shape, carried));
        let strength = throughput.max_abs();
        if strength == 0.0 || segments + 1 >= flux.longest {
            return;
        }
        let (total, rng) = (&mut self.total, &mut self.rng);
        let (chosen, kept) = (&mut self.chosen, &mut self.part);
        let mut meet = |face: Face, most: f64, x: Vec3, t: f64| {
            let weight = strength * most;
            if weight == 0.0 {
                return;
            }
            *total += weight;
            if rng.next_f64() * *total < weight {
                let segments = segments + 1;
                *chosen =
                    Some(Meeting { node, t, origin, dir, face, x, throughput, segments, weight });
                kept.truncate_from(ray, t);
            }
        };
        let mut before = ray.medium;
        for (i, m) in self.met.iter().enumerate() {
            let around = core::mem::replace(&mut before, m.after);
            if !m.moves {
                continue;
            }
            let others = [i.checked_sub(1).and_then(|i| self.met.get(i)), self.met.get(i + 1)];
            let near = Side::before(world, m, others[0], around);
            let far = world.is_null(m.point.shape).then(|| Side::beyond(world, m, others[1]));
            let sides = [near, far.flatten()];
            // Only what moves by itself, and the camera, moves a ray's points at different velocities.
            let rigid = |side: &Side| {
                let moves = |s: &Speed| flux.moves(s.point.shape);
                node > 0 && !side.speeds.iter().flatten().any(moves)
            };
            let most = sides.iter().flatten().map(|side| side.most(rigid(side)));
            meet(Face::Surface(m.point, sides), most.fold(0.0, f64::max), m.x, m.distance);
        }
        if !flux.grids.contains(&true) {
            return;
        }
        for i in intervals(ray.medium, &ray.crossings, ray.length) {
            let Some(m) = i.medium.filter(|m| flux.sweeps_grid(*m, carried)) else { continue };
            let part = drt_medium::Ray::new(origin + dir * i.start, dir, i.end - i.start);
            world.medium(m).crossings(&part, |c| {
                let cosine = Real::abs(c.normal.dot(dir));
                let most = if cosine == 0.0 { 0.0 } else { 1.0 / cosine };
                meet(Face::Grid(m, c.normal), most, part.at(c.t), i.start + c.t);
            });
        }
    }

    /// The surfaces on the present ray, if some have a flux.
    pub(crate) fn met(&self) -> &[Met] {
        &self.met
    }

    /// Evaluates the chosen meeting; calls `add` with each functional, the ray in the spatial form, and
    /// the weight of both.
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
        let weight = m.throughput * tau * (self.total / m.weight);
        match m.face {
            Face::Grid(medium, n) => {
                let vertex = world.inside_grid(medium, m.x, n);
                let along = n / Real::abs(n.dot(m.dir));
                let rate = Rate::Grid(medium, m.x, along);
                self.send(tracer, &m, vertex, &[Some((rate, along, m.t))], weight, &mut add);
            }
            Face::Surface(point, sides) => {
                for side in sides.iter().flatten() {
                    let vertex = world.touching(point, m.x, side.front, side.medium);
                    let rates = side.speeds.map(|speed| {
                        let Speed { point, t, along } = speed?;
                        Some((Rate::Surface(point.material(), along), along, t))
                    });
                    self.send(tracer, &m, vertex, &rates, weight, &mut add);
                }
            }
        }
    }

    /// Adds what a vertex that is left behind sends back along the path, by the `rates` of what leaves it,
    /// each with its vector and distance along the ray.
    fn send(
        &mut self,
        tracer: &mut Tracer<'_>,
        m: &Meeting,
        vertex: Vertex,
        rates: &[Option<(Rate, Vec3, f64)>],
        weight: Rgb,
        add: &mut impl FnMut(&Functional, Option<Swept>, Rgb),
    ) {
        let mut light = Radiance::default();
        let own = tracer.max_segments;
        tracer.max_segments = own - m.segments;
        tracer.radiance_from(vertex, -m.dir, &mut light);
        tracer.max_segments = own;
        if light.0.is_zero() {
            return;
        }
        let spatial = self.flux.as_ref().is_some_and(|f| f.movers.is_some());
        let mut swept = Swept { node: m.node as usize, origin: Vec3::ZERO, turn: Vec3::ZERO };
        let items = &mut self.functional.items;
        items.clear();
        for (rate, along, t) in rates.iter().flatten() {
            items.push(*rate);
            swept.origin -= *along;
            swept.turn -= *along * *t;
        }
        if let (false, Some(medium)) = (spatial, vertex.medium) {
            items.push(Rate::Volume(medium, m.x, swept.origin));
        }
        add(&self.functional, spatial.then_some(swept), light.0 * weight);
    }
}

impl Side {
    /// The medium before a surface, from the `start` of the stretch on, reached in `around`.
    fn before(world: &World, m: &Met, start: Option<&Met>, around: Option<usize>) -> Option<Self> {
        Self::new(world, m, m.cosine < 0.0, around, [start, Some(m)], 1)
    }

    /// The medium beyond a surface, up to the `end` of the stretch.
    fn beyond(world: &World, m: &Met, end: Option<&Met>) -> Option<Self> {
        Self::new(world, m, m.cosine > 0.0, m.after, [Some(m), end], 0)
    }

    /// One that vertices can be in, `m` being one of the ends of its stretch.
    fn new(
        world: &World,
        m: &Met,
        front: bool,
        around: Option<usize>,
        ends: [Option<&Met>; 2],
        end: usize,
    ) -> Option<Self> {
        let medium = filled(world, &m.point, front, around)?;
        let left = match world.reach(medium) {
            Some(reach) => Stretch::new(ends, reach).left(end),
            None => [1.0, 0.0],
        };
        // The medium begins at one surface, and ends at the other.
        let sign = if end == 1 { 1.0 } else { -1.0 };
        let of = |m: Option<&Met>, left: f64| {
            let m = m.filter(|m| left != 0.0 && m.cosine != 0.0)?;
            let along = m.point.ng * (sign * left / m.cosine);
            Some(Speed { point: m.point, t: m.distance, along })
        };
        let speeds = [of(Some(m), left[0]), of(ends[1 - end], left[1])];
        Some(Self { medium, front, speeds })
    }

    /// What counts at most: of all velocities of the ray alone, if it is `rigid`.
    fn most(&self, rigid: bool) -> f64 {
        let alongs = || self.speeds.iter().flatten().map(|s| s.along);
        let all: f64 = alongs().map(Vec3::length).sum();
        let net = alongs().fold(Vec3::ZERO, |sum, a| sum + a).length();
        match rigid {
            true if net < ROUNDING * all => 0.0,
            true => net,
            false => all,
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
