//! Ray and distance queries over a flat list of triangles.

use alloc::vec::Vec;
use core::ops::ControlFlow;

use drt_math::Ray;

use self::block::{Block, Twin};
use self::ends::End;
use self::frame::{BoxFrame, BoxRay};
use self::lanes::{Lanes, Machine, Task};
use self::order::Foremost;
use self::watertight::{Corners, Crossing, ShearedRay};
use self::wide::{Visitor, WideTree};
use crate::Aabb;

mod along;
mod binary;
mod block;
mod boxes;
mod build;
mod children;
mod collapse;
mod ends;
mod frame;
mod hit;
mod instanced;
mod lanes;
mod nearest;
mod node;
mod order;
#[cfg(feature = "obvhs")]
mod ploc;
mod registers;
#[cfg(test)]
mod tests;
mod watertight;
mod wide;
mod winding;

pub use along::AlongSegment;
pub use binary::BvhBuilder;
pub(crate) use boxes::BoxTree;
pub use build::BvhError;
pub use hit::{Hit, Skip};
pub use instanced::{InstancePlacement, InstancedBvh};
pub use nearest::{ClosestPoint, nearest_point};
pub use order::coincide;
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
/// being near. A ray with a NaN, or with a zero or infinite direction, meets nothing.
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
    /// As the tree was built.
    boxes_met: f64,
    builder: BvhBuilder,
    machine: Machine,
}

/// The ends of a ray, start and end, where they have rounding errors of their own.
type Ends = (End, Option<End>);

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
        self.closest_from(ray, skip, None)
    }

    /// The first hit along a ray whose ends may have errors of their own.
    #[inline(always)]
    fn closest_from(&self, ray: &Ray, skip: Skip, ends: Option<Ends>) -> Option<Hit> {
        let mut best: Option<(f64, u32, Crossing)> = None;
        self.visit(ray, skip, ends, |probe, prim, crossing, _| {
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
        let mut best = Foremost::default();
        self.visit(ray, skip, None, |probe, prim, crossing, corners| {
            let nearer = best.take(prim, crossing, corners);
            let limit = if nearer { probe.boxes.limit(crossing.t) } else { f32::INFINITY };
            ControlFlow::Continue(limit)
        });
        best.hit(ray)
    }

    /// Whether a triangle that `blocks` meets the ray. `blocks` is asked in no particular order and
    /// no more after it has said yes.
    pub fn any(&self, ray: &Ray, skip: Skip, blocks: impl FnMut(u32) -> bool) -> bool {
        self.any_from(ray, skip, None, blocks)
    }

    /// Whether a triangle that `blocks` meets a ray whose ends may have errors of their own.
    #[inline(always)]
    fn any_from(
        &self,
        ray: &Ray,
        skip: Skip,
        ends: Option<Ends>,
        mut blocks: impl FnMut(u32) -> bool,
    ) -> bool {
        let mut blocked = false;
        self.visit(ray, skip, ends, |_, prim, _, _| {
            blocked = blocks(prim);
            if blocked { ControlFlow::Break(()) } else { ControlFlow::Continue(f32::INFINITY) }
        });
        blocked
    }

    /// Calls `visit` with every hit along the ray, in no particular order.
    pub fn all(&self, ray: &Ray, skip: Skip, mut visit: impl FnMut(Hit)) {
        self.all_from(ray, skip, None, &mut visit);
    }

    /// Calls `visit` with every hit along a ray whose ends may have errors of their own.
    #[inline(always)]
    fn all_from(&self, ray: &Ray, skip: Skip, ends: Option<Ends>, mut visit: impl FnMut(Hit)) {
        self.visit(ray, skip, ends, |_, prim, crossing, _| {
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
        let mut blocked = false;
        self.visit(ray, skip, None, |_, prim, crossing, _| {
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
        let mut best = Foremost::default();
        self.visit(ray, skip, None, |probe, prim, crossing, corners| {
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

    /// Calls `found` with every hit of a ray, and with the ray in all its forms. Its answer is where the ray may be cut off, in the
    /// parameter of the probe's box ray.
    #[inline]
    fn visit(
        &self,
        ray: &Ray,
        skip: Skip,
        ends: Option<Ends>,
        found: impl FnMut(&Probe, u32, &Crossing, &Corners) -> ControlFlow<(), f32>,
    ) {
        self.machine.run(Search { bvh: self, ray, skip, ends, found });
    }
}

/// A search for the hits of a ray. All of it is compiled for whichever lanes there are, as preparing the ray takes about as
/// long as a walk through a small tree.
struct Search<'a, F> {
    bvh: &'a TriangleBvh,
    ray: &'a Ray,
    skip: Skip,
    ends: Option<Ends>,
    found: F,
}

impl<F: FnMut(&Probe, u32, &Crossing, &Corners) -> ControlFlow<(), f32>> Task for Search<'_, F> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let Self { bvh, ray, skip, ends, found } = self;
        let Some(tree) = &bvh.tree else { return };
        let Some(probe) = bvh.probe(ray, skip) else { return };
        let probe = match ends {
            Some(ends) => probe.with_ends(ends),
            None => probe,
        };
        let mut visitor = Hits { bvh, probe: &probe, far: probe.boxes.far, found };
        tree.walk(lanes, &probe.boxes, &mut visitor);
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

impl<F: FnMut(&Probe, u32, &Crossing, &Corners) -> ControlFlow<(), f32>> Visitor for Hits<'_, F> {
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
            // The triangle, then its twins, in one loop: the test is compiled in place, and once.
            let (mut prim, mut triangle) = (block.prims[lane], block.triangle(lane));
            let mut next = block.twins[lane];
            loop {
                if let Some(crossing) = self.probe.meet(prim, &triangle) {
                    let limit = (self.found)(self.probe, prim, &crossing, &triangle);
                    let ControlFlow::Continue(limit) = limit else {
                        return ControlFlow::Break(());
                    };
                    self.far = self.far.min(limit);
                }
                let Some(twin) = self.bvh.twins.get(next as usize) else { break };
                (prim, triangle, next) = (twin.prim, twin.corners, twin.next);
            }
        }
        ControlFlow::Continue(self.far)
    }
}

impl Probe {
    /// With ends that may have larger rounding errors than those of a ray made in this space, and are not where it was cut off.
    #[inline(always)]
    fn with_ends(self, (start, end): Ends) -> Self {
        Self { start, end, ..self }
    }

    /// The crossing with a triangle, if it is a hit of this query.
    #[inline(always)]
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
