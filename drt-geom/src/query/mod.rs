//! Ray and distance queries over a flat list of triangles.

use alloc::vec::Vec;
use core::ops::ControlFlow;

use self::block::{Block, Twin, chain};
use self::ends::End;
use self::frame::{BoxFrame, BoxRay};
use self::lanes::{Lanes, Machine, Task};
use self::order::Foremost;
use self::watertight::{Corners, Crossing, ShearedRay};
use self::wide::{Visitor, WideTree};
use crate::Aabb;

mod binary;
mod block;
mod boxes;
mod build;
mod children;
mod collapse;
mod ends;
mod frame;
mod instanced;
mod lanes;
mod nearest;
mod node;
mod order;
#[cfg(feature = "obvhs")]
mod ploc;
mod ray;
mod registers;
#[cfg(test)]
mod tests;
mod watertight;
mod wide;
mod winding;

pub use binary::BvhBuilder;
pub(crate) use boxes::BoxTree;
pub use build::BvhError;
pub use instanced::{InstancePlacement, InstancedBvh};
pub use nearest::{ClosestPoint, nearest_point};
pub use order::coincide;
pub use ray::{Hit, Ray, Skip};
pub(crate) use registers::{Registers, Work};

/// A bounding volume hierarchy over triangles, for rays and nearest points.
///
/// *Watertight*: the triangle test is exact at edges (Woop et al. 2013), boxes are conservative, so
/// a ray never passes between two triangles that share an edge.
///
/// *No epsilons*: a query reports hits with `t` in the open interval (0, `t_max`). Triangles on which
/// the ray starts or ends are excluded by number ([`Skip`]), and their neighbours by a rounding
/// error bound when the ray's end lies on them too (at a shared edge or vertex); see
/// [`Hit::point`] for how to make such origins. Hits on other triangles are never dropped for
/// being near.
///
/// Triangles of zero area have no normal and are never hit. Of hits at equal `t` the one on the
/// triangle with the lower number comes first, so that results do not depend on the tree.
#[derive(Clone, Debug)]
pub struct TriangleBvh {
    tree: Option<WideTree>,
    frame: BoxFrame,
    bounds: Aabb,
    blocks: Vec<Block>,
    twins: Vec<Twin>,
    triangle_count: usize,
    builder: BvhBuilder,
    machine: Machine,
}

/// One query's ray in all its forms.
struct Probe {
    ray: Ray,
    sheared: ShearedRay,
    boxes: BoxRay,
    start: End,
    end: Option<End>,
    skip: Skip,
}

impl TriangleBvh {
    /// The smallest box around all triangles.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// The first hit along a ray.
    #[must_use]
    pub fn closest(&self, ray: &Ray, skip: Skip) -> Option<Hit> {
        self.closest_of(&self.probe(ray, skip)?)
    }

    /// The same of a ray whose ends, start and end, have errors of their own.
    fn closest_from(&self, ray: &Ray, skip: Skip, ends: (End, Option<End>)) -> Option<Hit> {
        self.closest_of(&self.probe(ray, skip)?.with_ends(ends))
    }

    #[inline(always)]
    fn closest_of(&self, probe: &Probe) -> Option<Hit> {
        let mut best: Option<(f64, u32, Crossing)> = None;
        self.visit(probe, |prim, crossing, _| {
            if best.is_none_or(|(t, p, _)| (crossing.t, prim) < (t, p)) {
                best = Some((crossing.t, prim, *crossing));
                return ControlFlow::Continue(probe.boxes.limit(crossing.t));
            }
            ControlFlow::Continue(f32::INFINITY)
        });
        best.map(|(_, prim, crossing)| hit(prim, &crossing))
    }

    /// The first hit along a ray, chosen so that rounding does not decide: among the hits that [coincide] with the nearest one it is
    /// that on the triangle with the lowest number.
    #[must_use]
    pub fn foremost(&self, ray: &Ray, skip: Skip) -> Option<Hit> {
        let probe = self.probe(ray, skip)?;
        let mut best = Foremost::default();
        self.visit(&probe, |prim, crossing, corners| {
            let nearer = best.take(prim, crossing, corners);
            let limit = if nearer { probe.boxes.limit(crossing.t) } else { f32::INFINITY };
            ControlFlow::Continue(limit)
        });
        best.hit(ray)
    }

    /// Whether a triangle that `blocks` meets the ray. `blocks` is asked in no particular order and
    /// no more after it has said yes.
    pub fn any(&self, ray: &Ray, skip: Skip, blocks: impl FnMut(u32) -> bool) -> bool {
        let Some(probe) = self.probe(ray, skip) else { return false };
        self.any_of(&probe, blocks)
    }

    /// The same of a ray whose ends have errors of their own.
    fn any_from(
        &self,
        ray: &Ray,
        skip: Skip,
        ends: (End, Option<End>),
        blocks: impl FnMut(u32) -> bool,
    ) -> bool {
        let Some(probe) = self.probe(ray, skip) else { return false };
        self.any_of(&probe.with_ends(ends), blocks)
    }

    #[inline(always)]
    fn any_of(&self, probe: &Probe, mut blocks: impl FnMut(u32) -> bool) -> bool {
        let mut blocked = false;
        self.visit(probe, |prim, _, _| {
            blocked = blocks(prim);
            if blocked { ControlFlow::Break(()) } else { ControlFlow::Continue(f32::INFINITY) }
        });
        blocked
    }

    /// Calls `visit` with every hit along the ray, in no particular order.
    pub fn all(&self, ray: &Ray, skip: Skip, mut visit: impl FnMut(Hit)) {
        let Some(probe) = self.probe(ray, skip) else { return };
        self.all_of(&probe, &mut visit);
    }

    /// The same of a ray whose ends have errors of their own.
    fn all_from(&self, ray: &Ray, skip: Skip, ends: (End, Option<End>), visit: impl FnMut(Hit)) {
        let Some(probe) = self.probe(ray, skip) else { return };
        self.all_of(&probe.with_ends(ends), visit);
    }

    #[inline(always)]
    fn all_of(&self, probe: &Probe, mut visit: impl FnMut(Hit)) {
        self.visit(probe, |prim, crossing, _| {
            visit(hit(prim, crossing));
            ControlFlow::Continue(f32::INFINITY)
        });
    }

    /// Fills `out` with the hits on triangles that do not block, sorted by `t` and at equal `t` by
    /// triangle. Returns true, with `out` empty, as soon as a triangle that `blocks` is met.
    pub fn crossings(
        &self,
        ray: &Ray,
        skip: Skip,
        blocks: impl Fn(u32) -> bool,
        out: &mut Vec<Hit>,
    ) -> bool {
        out.clear();
        let Some(probe) = self.probe(ray, skip) else { return false };
        let mut blocked = false;
        self.visit(&probe, |prim, crossing, _| {
            blocked = blocks(prim);
            if blocked {
                return ControlFlow::Break(());
            }
            out.push(hit(prim, crossing));
            ControlFlow::Continue(f32::INFINITY)
        });
        if blocked {
            out.clear();
        }
        sort(out);
        blocked
    }

    /// The [foremost](Self::foremost) hit on a triangle that `blocks`, and in `out` the hits on others before it, sorted
    /// as by [`TriangleBvh::crossings`].
    pub fn closest_through(
        &self,
        ray: &Ray,
        skip: Skip,
        blocks: impl Fn(u32) -> bool,
        out: &mut Vec<Hit>,
    ) -> Option<Hit> {
        out.clear();
        let probe = self.probe(ray, skip)?;
        let mut best = Foremost::default();
        self.visit(&probe, |prim, crossing, corners| {
            let limit = if !blocks(prim) {
                out.push(hit(prim, crossing));
                f32::INFINITY
            } else if best.take(prim, crossing, corners) {
                probe.boxes.limit(crossing.t)
            } else {
                f32::INFINITY
            };
            ControlFlow::Continue(limit)
        });
        let best = best.hit(ray);
        if let Some(best) = &best {
            out.retain(|h| h.is_before(best));
        }
        sort(out);
        best
    }

    #[inline(always)]
    fn probe(&self, ray: &Ray, skip: Skip) -> Option<Probe> {
        let boxes = self.frame.clip(ray)?;
        let (origin, dir) = (ray.origin.to_array(), ray.dir.to_array());
        Some(Probe {
            ray: *ray,
            sheared: ShearedRay::new(ray),
            boxes,
            start: End::origin(origin),
            end: (ray.t_max < f64::INFINITY).then(|| End::far(origin, dir, ray.t_max)),
            skip,
        })
    }

    /// The same tree, walked without instructions that not every machine of its kind has. Queries
    /// answer the same, only slower.
    #[must_use]
    pub fn portable(self) -> Self {
        Self { machine: Machine::Portable, ..self }
    }

    /// Calls `found` with every hit of the probe. Its answer is where the ray may be cut off, in the
    /// parameter of the probe's box ray.
    #[inline]
    fn visit(
        &self,
        probe: &Probe,
        found: impl FnMut(u32, &Crossing, &Corners) -> ControlFlow<(), f32>,
    ) {
        let Some(tree) = &self.tree else { return };
        let visitor = Hits { bvh: self, probe, far: probe.boxes.far, found };
        self.machine.run(Walk { tree, query: &probe.boxes, visitor });
    }
}

/// A walk through a tree, by whichever lanes.
struct Walk<'a, Q, V> {
    tree: &'a WideTree,
    query: Q,
    visitor: V,
}

impl<Q: wide::Query, V: Visitor> Task for Walk<'_, Q, V> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self, lanes: L) {
        self.tree.walk(lanes, self.query, &mut self.visitor);
    }
}

/// Finds the hits of a probe.
struct Hits<'a, F> {
    bvh: &'a TriangleBvh,
    probe: &'a Probe,
    far: f32,
    found: F,
}

impl<F: FnMut(u32, &Crossing, &Corners) -> ControlFlow<(), f32>> Visitor for Hits<'_, F> {
    #[inline(always)]
    fn announce<L: Lanes>(&self, lanes: L, index: usize) {
        lanes.prefetch(&self.bvh.blocks[index]);
    }
    #[inline(always)]
    fn block<L: Lanes>(&mut self, lanes: L, index: usize) -> ControlFlow<(), f32> {
        let block = &self.bvh.blocks[index];
        let mut mask = block.crossed(lanes, &self.probe.sheared);
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            self.test(block.prims[lane], &block.triangle(lane))?;
            for twin in chain(&self.bvh.twins, block.twins[lane]) {
                self.test(twin.prim, &twin.corners)?;
            }
        }
        ControlFlow::Continue(self.far)
    }
}

impl<F: FnMut(u32, &Crossing, &Corners) -> ControlFlow<(), f32>> Hits<'_, F> {
    #[inline(always)]
    fn test(&mut self, prim: u32, triangle: &Corners) -> ControlFlow<()> {
        if let Some(crossing) = self.probe.meet(prim, triangle) {
            match (self.found)(prim, &crossing, triangle) {
                ControlFlow::Continue(limit) => self.far = self.far.min(limit),
                ControlFlow::Break(()) => return ControlFlow::Break(()),
            }
        }
        ControlFlow::Continue(())
    }
}

impl Probe {
    /// With ends that may have larger rounding errors than those of a ray made in this space, and are not where it was cut off.
    fn with_ends(self, (start, end): (End, Option<End>)) -> Self {
        Self { start, end, ..self }
    }

    /// The crossing with a triangle, if it is a hit of this query.
    #[inline]
    fn meet(&self, prim: u32, triangle: &Corners) -> Option<Crossing> {
        // The triangle that a ray starts on is among the candidates as a rule.
        if self.skip.contains(prim) {
            return None;
        }
        let crossing = self.sheared.cross(triangle)?;
        if !(crossing.t > 0.0 && crossing.t < self.ray.t_max) {
            return None;
        }
        let dir = self.ray.dir;
        let touched = self.start.lies_on(triangle, dir.to_array())
            || self.end.is_some_and(|e| e.lies_on(triangle, (-dir).to_array()));
        (!touched).then_some(crossing)
    }
}

fn sort(hits: &mut [Hit]) {
    hits.sort_unstable_by(|a, b| a.t.total_cmp(&b.t).then(a.prim.cmp(&b.prim)));
}

fn hit(prim: u32, crossing: &Crossing) -> Hit {
    Hit { t: crossing.t, prim, bary: crossing.bary() }
}
