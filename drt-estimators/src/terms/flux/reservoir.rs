//! The flux along the rays of a path.

#[cfg(test)]
mod tests;

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_math::{Ray, Real, Rgb, Rng, Vec3};

use crate::derivative::sensitivity::{VelocityFunctional, VelocityTerm};
use crate::derivative::velocity::Spatial;
use crate::derivative::velocity::warp::{Stretch, SurfaceHit, list_hits};
use crate::sampling::record::Radiance;
use crate::sampling::trace::{OutgoingRay, Tracer};
use crate::terms::flux::{Flux, filled};
use crate::world::intervals;
use crate::world::vertex::{MaterialPoint, SurfacePoint, Vertex};
use crate::world::{RayPath, World};

/// What is left of two speeds that cancel.
const ROUNDING: f64 = 1e-12;

/// A ray of a path whose points surfaces sweep over, in the spatial form. The flux's value times these are the
/// sensitivities of the flux.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FluxRay {
    /// The record's node that the ray left.
    pub(crate) node: usize,
    /// To the velocity that the ray's origin has.
    pub(crate) origin: Vec3,
    /// To the rate of its direction.
    pub(crate) turn: Vec3,
    /// Its direction, and which of the path's rays that turn it is.
    pub(crate) dir: Vec3,
    pub(crate) turns: Option<u32>,
}

/// What a path meets.
#[derive(Clone, Copy, Debug)]
enum Face {
    Surface(SurfacePoint),
    /// A face of the box of a medium's grid, and its normal out of the box.
    Grid(usize, Vec3),
}

/// The medium on one side of a surface that a ray meets.
#[derive(Clone, Copy, Debug)]
struct MediumSide {
    medium: usize,
    /// It is on the surface's front.
    front: bool,
    /// How much of it there is, over where it is densest.
    fullness: f64,
    /// What of the surface's speed counts, and of that of the one at the medium's other end.
    speeds: [Option<Speed>; 2],
}

/// A share of the speed of a surface along a ray.
#[derive(Clone, Copy, Debug)]
struct Speed {
    point: MaterialPoint,
    /// Distance along the ray.
    t: f64,
    /// Its product with the surface's velocity less the ray's is the share.
    along: Vec3,
}

/// One of the meetings of a path with surfaces that have a flux.
#[derive(Clone, Copy, Debug)]
struct FluxSample {
    node: u32,
    turns: Option<u32>,
    t: f64,
    origin: Vec3,
    dir: Vec3,
    face: Face,
    /// What lies before and beyond a surface.
    sides: [Option<MediumSide>; 2],
    x: Vec3,
    throughput: Rgb,
    /// Segments up to the surface.
    segments: u32,
    weight: f64,
}

/// Chooses one meeting per path.
#[derive(Clone, Debug)]
pub(crate) struct Reservoir {
    flux: Flux,
    rng: Rng,
    total: f64,
    chosen: Option<FluxSample>,
    /// The chosen ray up to the surface.
    part: RayPath,
    /// The surfaces on the present ray that have one.
    met: Vec<SurfaceHit>,
    functional: VelocityFunctional,
}

impl Reservoir {
    pub(crate) fn new(flux: &Flux) -> Self {
        Self {
            flux: flux.clone(),
            rng: Rng::new(0, 0, 0),
            total: 0.0,
            chosen: None,
            part: RayPath::default(),
            met: Vec::new(),
            functional: VelocityFunctional::default(),
        }
    }

    pub(crate) fn begin(&mut self, rng: Rng) {
        self.rng = rng;
        self.total = 0.0;
        self.chosen = None;
    }

    /// Lists the surfaces that a ray meets along the unit vector `dir`, whose points move or not.
    pub(crate) fn meet(&mut self, ray: &RayPath, dir: Vec3, moves: bool) {
        let flux = &self.flux;
        list_hits(&mut self.met, ray, dir, |point| flux.sweeps(point.shape, moves));
    }

    /// Offers the surfaces that a ray meets, whose origin `moves` or which `turns`.
    pub(crate) fn offer(
        &mut self,
        world: &World,
        leaving: &OutgoingRay,
        moves: bool,
        turns: Option<u32>,
        ray: &RayPath,
    ) {
        let moves = moves || turns.is_some();
        let OutgoingRay { node, throughput, dir, segments, .. } = *leaving;
        let origin = leaving.vertex.x;
        self.meet(ray, dir, moves);
        let flux = &self.flux;
        let strength = throughput.max_abs();
        if strength == 0.0 || segments + 1 >= flux.longest {
            return;
        }
        let (total, rng) = (&mut self.total, &mut self.rng);
        let (chosen, kept) = (&mut self.chosen, &mut self.part);
        let mut meet = |face: Face, sides: [Option<MediumSide>; 2], most: f64, x: Vec3, t: f64| {
            let weight = strength * most;
            if weight == 0.0 {
                return;
            }
            *total += weight;
            if rng.next_f64() * *total < weight {
                let segments = segments + 1;
                *chosen = Some(FluxSample {
                    node,
                    turns,
                    t,
                    origin,
                    dir,
                    face,
                    sides,
                    x,
                    throughput,
                    segments,
                    weight,
                });
                kept.truncate_from(ray, t);
            }
        };
        let mut before = ray.medium;
        for (i, m) in self.met.iter().enumerate() {
            let around = core::mem::replace(&mut before, m.after);
            let left_out = node == 0 && Real::abs(m.cosine) < flux.least_cosine;
            if !m.moves || left_out {
                continue;
            }
            let others = [i.checked_sub(1).and_then(|i| self.met.get(i)), self.met.get(i + 1)];
            let viewer = &leaving.vertex;
            let near = flux.before(world, viewer, m, others[0], around);
            let far =
                world.is_null(m.point.shape).then(|| flux.beyond(world, viewer, m, others[1]));
            let sides = [near, far.flatten()];
            // Only what moves by itself, the camera, and a turn move a ray's points at different velocities.
            let rigid = |side: &MediumSide| {
                let moves = |s: &Speed| flux.moves(s.point.shape);
                node > 0 && turns.is_none() && !side.speeds.iter().flatten().any(moves)
            };
            let most = sides.iter().flatten().map(|side| side.most(rigid(side)));
            meet(Face::Surface(m.point), sides, most.fold(0.0, f64::max), m.x, m.distance);
        }
        if !flux.grids.contains(&true) {
            return;
        }
        for i in intervals(ray.medium, &ray.crossings, ray.length) {
            let Some(m) = i.medium.filter(|m| flux.sweeps_grid(*m, moves)) else { continue };
            let part = Ray::new(origin + dir * i.start, dir).until(i.end - i.start);
            world.medium(m).crossings(&part, |c| {
                let cosine = Real::abs(c.normal.dot(dir));
                let x = part.at(c.t);
                let most = match cosine {
                    0.0 => 0.0,
                    _ => flux.fullness(world, &world.inside_grid(m, x, c.normal)) / cosine,
                };
                meet(Face::Grid(m, c.normal), [None; 2], most, x, i.start + c.t);
            });
        }
    }

    /// The surfaces on the present ray, if any has a flux.
    pub(crate) fn hits(&self) -> &[SurfaceHit] {
        &self.met
    }

    /// Evaluates the chosen meeting; calls `add` with each functional, the ray in the spatial form, and
    /// the weight of both.
    pub(crate) fn evaluate(
        &mut self,
        tracer: &mut Tracer<'_>,
        mut add: impl FnMut(&VelocityFunctional, Option<FluxRay>, Rgb),
    ) {
        let Some(m) = self.chosen.take() else { return };
        let world = tracer.world;
        // What counts for less than a path does is not followed for each.
        let chance = f64::min(self.total / self.flux.followed, 1.0);
        if m.segments > tracer.max_segments || self.rng.next_f64() >= chance {
            return;
        }
        let (rng, counters) = (&mut tracer.rng, &mut tracer.counters);
        let tau = world.transmittance(&Ray::new(m.origin, m.dir), &self.part, rng, counters);
        if tau.is_zero() {
            return;
        }
        tracer.counters.flux_samples += 1;
        let weight = m.throughput * tau * (self.total / (m.weight * chance));
        match m.face {
            Face::Grid(medium, n) => {
                let vertex = world.inside_grid(medium, m.x, n);
                let along = n / Real::abs(n.dot(m.dir));
                let rate = VelocityTerm::Grid(medium, m.x, along);
                self.send(tracer, &m, vertex, &[Some((rate, along, m.t))], weight, &mut add);
            }
            Face::Surface(point) => {
                for side in m.sides.iter().flatten() {
                    let vertex = world.touching(point, m.x, side.front, side.medium);
                    let rates = side.speeds.map(|speed| {
                        let Speed { point, t, along } = speed?;
                        Some((VelocityTerm::Surface(point, along), along, t))
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
        m: &FluxSample,
        vertex: Vertex,
        rates: &[Option<(VelocityTerm, Vec3, f64)>],
        weight: Rgb,
        add: &mut impl FnMut(&VelocityFunctional, Option<FluxRay>, Rgb),
    ) {
        let mut light = Radiance::default();
        let longest = tracer.max_segments - m.segments;
        tracer.radiance_within(longest, vertex, -m.dir, &mut light);
        if light.0.is_zero() {
            return;
        }
        let spatial = self.flux.movers.is_some();
        let mut ray_of_flux = FluxRay {
            node: m.node as usize,
            origin: Vec3::ZERO,
            turn: Vec3::ZERO,
            dir: m.dir,
            turns: m.turns,
        };
        let items = &mut self.functional.items;
        items.clear();
        for (rate, along, t) in rates.iter().flatten() {
            items.push(*rate);
            ray_of_flux.origin -= *along;
            ray_of_flux.turn -= *along * *t;
        }
        if let (false, Some(medium)) = (spatial, vertex.medium) {
            items.push(VelocityTerm::Volume(medium, m.x, ray_of_flux.origin));
        }
        add(&self.functional, spatial.then_some(ray_of_flux), light.0 * weight);
    }
}

impl Flux {
    /// The medium before a surface, from the `start` of the stretch on, reached in `around`.
    fn before(
        &self,
        world: &World,
        viewer: &Vertex,
        m: &SurfaceHit,
        start: Option<&SurfaceHit>,
        around: Option<usize>,
    ) -> Option<MediumSide> {
        self.side(world, viewer, m, m.cosine < 0.0, around, [start, Some(m)], 1)
    }

    /// The medium beyond a surface, up to the `end` of the stretch.
    fn beyond(
        &self,
        world: &World,
        viewer: &Vertex,
        m: &SurfaceHit,
        end: Option<&SurfaceHit>,
    ) -> Option<MediumSide> {
        self.side(world, viewer, m, m.cosine > 0.0, m.after, [Some(m), end], 0)
    }

    /// One that vertices can be in, `m` being one of the ends of its stretch.
    #[allow(clippy::too_many_arguments)]
    fn side(
        &self,
        world: &World,
        viewer: &Vertex,
        m: &SurfaceHit,
        front: bool,
        around: Option<usize>,
        ends: [Option<&SurfaceHit>; 2],
        end: usize,
    ) -> Option<MediumSide> {
        let medium = filled(world, &m.point, front, around)?;
        let fullness = self.fullness(world, &world.touching(m.point, m.x, front, medium));
        if fullness == 0.0 {
            return None;
        }
        let left = match self.spatial.as_ref().and_then(|s| s.free_path(medium)) {
            Some(reach) => Stretch::new(ends, reach).left(end),
            None => [1.0, 0.0],
        };
        // What has a blend weight moves with the surfaces of the medium.
        let blended = |s: &Arc<Spatial>| s.blends.inside(viewer, medium);
        let free = 1.0 - self.spatial.as_ref().map_or(0.0, blended);
        let left = left.map(|left| left * free);
        // The medium begins at one surface, and ends at the other.
        let sign = if end == 1 { 1.0 } else { -1.0 };
        let of = |m: Option<&SurfaceHit>, left: f64| {
            let m = m.filter(|m| left != 0.0 && m.cosine != 0.0)?;
            let along = m.point.ng * (sign * left / m.cosine);
            Some(Speed { point: m.point.material(), t: m.distance, along })
        };
        let speeds = [of(Some(m), left[0]), of(ends[1 - end], left[1])];
        Some(MediumSide { medium, front, fullness, speeds })
    }
}

impl MediumSide {
    /// What counts at most: of all velocities of the ray alone, if it is `rigid`.
    fn most(&self, rigid: bool) -> f64 {
        let alongs = || self.speeds.iter().flatten().map(|s| s.along);
        let all: f64 = alongs().map(Vec3::length).sum();
        let net = alongs().fold(Vec3::ZERO, |sum, a| sum + a).length();
        let fastest = match rigid {
            true if net < ROUNDING * all => 0.0,
            true => net,
            false => all,
        };
        fastest * self.fullness
    }
}
