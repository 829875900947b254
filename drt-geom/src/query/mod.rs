//! Ray and distance queries over a flat list of triangles.

use alloc::vec::Vec;
use core::ops::ControlFlow;

use self::ends::End;
use self::frame::{BoxFrame, BoxRay};
use self::tree::Tree;
use self::watertight::{Corners, Crossing, ShearedRay};
use crate::Aabb;

mod build;
mod compact;
mod ends;
mod frame;
mod nearest;
mod ray;
mod tree;
mod watertight;
#[cfg(feature = "obvhs")]
mod wide;
mod winding;

pub use build::BvhError;
pub use nearest::{ClosestPoint, nearest_point};
pub use ray::{Hit, Ray, Skip};

/// A triangle in the tree's order.
#[derive(Clone, Copy, Debug)]
struct Slot {
    corners: Corners,
    prim: u32,
    /// The next slot with the same three corner positions, or [`NONE`](crate::NONE). Only the first of such a
    /// chain is a leaf of the tree: coincident boxes would make trees deep and their building slow.
    twin: u32,
}

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
    tree: Option<Tree>,
    frame: BoxFrame,
    bounds: Aabb,
    slots: Vec<Slot>,
    triangle_count: usize,
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
        let probe = self.probe(ray, skip)?;
        let mut best: Option<(f64, u32, Crossing)> = None;
        self.visit(&probe, |prim, crossing| {
            if best.is_none_or(|(t, p, _)| (crossing.t, prim) < (t, p)) {
                best = Some((crossing.t, prim, *crossing));
                return ControlFlow::Continue(probe.boxes.limit(crossing.t));
            }
            ControlFlow::Continue(f32::INFINITY)
        });
        best.map(|(_, prim, crossing)| hit(prim, &crossing))
    }

    /// Whether a triangle that `blocks` meets the ray. `blocks` is asked in no particular order and
    /// no more after it has said yes.
    pub fn any(&self, ray: &Ray, skip: Skip, mut blocks: impl FnMut(u32) -> bool) -> bool {
        let Some(probe) = self.probe(ray, skip) else { return false };
        let mut blocked = false;
        self.visit(&probe, |prim, _| {
            blocked = blocks(prim);
            if blocked { ControlFlow::Break(()) } else { ControlFlow::Continue(f32::INFINITY) }
        });
        blocked
    }

    /// Calls `visit` with every hit along the ray, in no particular order.
    pub fn all(&self, ray: &Ray, skip: Skip, mut visit: impl FnMut(Hit)) {
        let Some(probe) = self.probe(ray, skip) else { return };
        self.visit(&probe, |prim, crossing| {
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
        self.visit(&probe, |prim, crossing| {
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
        out.sort_unstable_by(|a, b| a.t.total_cmp(&b.t).then(a.prim.cmp(&b.prim)));
        blocked
    }

    #[inline]
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

    /// Calls `found` with every hit of the probe. Its answer is where the ray may be cut off, in the
    /// parameter of the probe's box ray.
    #[inline]
    fn visit(&self, probe: &Probe, mut found: impl FnMut(u32, &Crossing) -> ControlFlow<(), f32>) {
        let Some(tree) = &self.tree else { return };
        let mut far = probe.boxes.far;
        tree.visit(&probe.boxes, |leaf| {
            for slot in chain(&self.slots, leaf) {
                if let Some(crossing) = probe.meet(slot) {
                    far = far.min(found(slot.prim, &crossing)?);
                }
            }
            ControlFlow::Continue(far)
        });
    }
}

impl Probe {
    /// The crossing with a triangle, if it is a hit of this query.
    #[inline]
    fn meet(&self, slot: &Slot) -> Option<Crossing> {
        let crossing = self.sheared.cross(&slot.corners)?;
        if !(crossing.t > 0.0 && crossing.t < self.ray.t_max) || self.skip.contains(slot.prim) {
            return None;
        }
        let dir = self.ray.dir;
        let touched = self.start.lies_on(&slot.corners, dir.to_array())
            || self.end.is_some_and(|e| e.lies_on(&slot.corners, (-dir).to_array()));
        (!touched).then_some(crossing)
    }
}

fn hit(prim: u32, crossing: &Crossing) -> Hit {
    Hit { t: crossing.t, prim, bary: crossing.bary() }
}

/// The slot of a leaf and those of its twins.
fn chain(slots: &[Slot], leaf: usize) -> impl Iterator<Item = &Slot> {
    let next = |s: &&Slot| slots.get(s.twin as usize);
    core::iter::successors(Some(&slots[leaf]), next)
}
