//! Ray and distance queries over a flat list of triangles.

use alloc::vec::Vec;
use core::ops::ControlFlow;

use drt_math::Vec3;

use self::ends::End;
use self::frame::{Box32, BoxFrame, BoxRay};
use self::tree::Tree;
use self::watertight::{Corners, Crossing, ShearedRay, corners};
use crate::{Aabb, Mesh, NONE};

mod compact;
mod ends;
mod frame;
mod nearest;
mod ray;
mod tree;
mod watertight;
mod winding;

pub use nearest::ClosestPoint;
pub use ray::{Hit, Ray, Skip};

/// Largest coordinate a scene may have: products of three stay in the range of `f64`.
const LARGEST: f64 = 1e100;

/// Why a tree cannot be built.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BvhError {
    /// A coordinate is NaN, infinite or beyond 1e100.
    #[error("triangle {prim} (from 0) has a coordinate that is not a number below 1e100")]
    BadCoordinate {
        /// Which triangle.
        prim: u32,
    },
    /// More triangles than 32-bit indices can name.
    #[error("{count} triangles are too many: at most 4294967294 can be indexed")]
    TooMany {
        /// How many there are.
        count: usize,
    },
    /// A refit with another number of triangles than the tree was built over.
    #[error("the tree was built over {expected} triangles and cannot be refitted to {found}")]
    CountChanged {
        /// How many the tree has.
        expected: usize,
        /// How many were given.
        found: usize,
    },
}

/// A triangle in the tree's order.
#[derive(Clone, Copy, Debug)]
struct Slot {
    corners: Corners,
    prim: u32,
    /// The next slot with the same three corner positions, or [`NONE`]. Only the first of such a
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
    /// Builds the tree over triangles, which queries name by their place in the slice.
    ///
    /// # Errors
    /// When a coordinate is not finite or beyond 1e100, or there are too many triangles.
    pub fn build(triangles: &[[Vec3; 3]]) -> Result<Self, BvhError> {
        Self::build_with(triangles, Tree::build)
    }

    /// Builds the tree over the triangles of a mesh.
    ///
    /// # Errors
    /// As [`TriangleBvh::build`].
    pub fn of(mesh: &Mesh) -> Result<Self, BvhError> {
        Self::build(&mesh.soup())
    }

    fn build_with(
        triangles: &[[Vec3; 3]],
        build: impl Fn(&[Box32]) -> (Tree, Vec<u32>),
    ) -> Result<Self, BvhError> {
        if triangles.len() >= NONE as usize {
            return Err(BvhError::TooMany { count: triangles.len() });
        }
        let bounds = usable_bounds(triangles)?;
        let frame = BoxFrame::new(&bounds);
        let (leaves, twins) = group_twins(triangles);
        let mut bvh = Self {
            tree: None,
            frame,
            bounds,
            slots: Vec::with_capacity(leaves.len() + twins.len()),
            triangle_count: triangles.len(),
        };
        if leaves.is_empty() {
            return Ok(bvh);
        }
        let boxes: Vec<_> = leaves.iter().map(|&i| frame.enclose(&triangles[i as usize])).collect();
        let (tree, order) = build(&boxes);
        bvh.tree = Some(tree);
        let slot =
            |prim: u32| Slot { corners: corners(&triangles[prim as usize]), prim, twin: NONE };
        let mut place = alloc::vec![NONE; triangles.len()];
        for leaf in order {
            let prim = leaves[leaf as usize];
            place[prim as usize] = bvh.slots.len() as u32;
            bvh.slots.push(slot(prim));
        }
        for (first, prim) in twins {
            let index = bvh.slots.len() as u32;
            let head = &mut bvh.slots[place[first as usize] as usize];
            let twin = core::mem::replace(&mut head.twin, index);
            bvh.slots.push(Slot { twin, ..slot(prim) });
        }
        Ok(bvh)
    }

    /// Follows triangles that moved, keeping their numbers.
    ///
    /// # Errors
    /// As [`TriangleBvh::build`], or when the number of triangles changed.
    pub fn refit(&mut self, triangles: &[[Vec3; 3]]) -> Result<(), BvhError> {
        if triangles.len() != self.triangle_count {
            let (expected, found) = (self.triangle_count, triangles.len());
            return Err(BvhError::CountChanged { expected, found });
        }
        let whole = self.slots.len() == triangles.len() && triangles.iter().all(has_area);
        let (true, Some(tree)) = (whole, &mut self.tree) else {
            *self = Self::build(triangles)?;
            return Ok(());
        };
        self.bounds = usable_bounds(triangles)?;
        self.frame = BoxFrame::new(&self.bounds);
        for slot in &mut self.slots {
            slot.corners = corners(&triangles[slot.prim as usize]);
        }
        let (slots, frame) = (&self.slots, &self.frame);
        // Twins may have parted.
        tree.refit(|leaf| {
            chain(slots, leaf)
                .map(|s| frame.enclose(&triangles[s.prim as usize]))
                .fold(Box32::EMPTY, |b, o| b.union(&o))
        });
        Ok(())
    }

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

fn usable_bounds(triangles: &[[Vec3; 3]]) -> Result<Aabb, BvhError> {
    let usable = |t: &[Vec3; 3]| t.iter().all(|v| v.is_finite() && v.max_abs() <= LARGEST);
    match triangles.iter().position(|t| !usable(t)) {
        Some(prim) => Err(BvhError::BadCoordinate { prim: prim as u32 }),
        None => Ok(Aabb::around(triangles.iter().flatten().copied())),
    }
}

fn has_area(t: &[Vec3; 3]) -> bool {
    (t[1] - t[0]).cross(t[2] - t[0]) != Vec3::ZERO
}

/// The triangles with an area, without repetitions; and the repetitions, each with the triangle it
/// repeats (the same three positions in whatever order).
fn group_twins(triangles: &[[Vec3; 3]]) -> (Vec<u32>, Vec<(u32, u32)>) {
    let key = |i: u32| {
        let mut t = triangles[i as usize];
        t.sort_unstable_by(|a, b| crate::weld::lexicographic(*a, *b));
        t
    };
    let mut order: Vec<(u32, [Vec3; 3])> = (0..triangles.len() as u32)
        .filter(|&i| has_area(&triangles[i as usize]))
        .map(|i| (i, key(i)))
        .collect();
    order.sort_unstable_by(|(i, a), (j, b)| {
        let by_position =
            a.iter().zip(b).map(|(p, q)| crate::weld::lexicographic(*p, *q)).find(|o| o.is_ne());
        by_position.unwrap_or_else(|| i.cmp(j))
    });
    let mut twins = Vec::new();
    let mut leaves = Vec::new();
    for run in order.chunk_by(|(_, a), (_, b)| a == b) {
        leaves.push(run[0].0);
        twins.extend(run[1..].iter().map(|(prim, _)| (run[0].0, *prim)));
    }
    leaves.sort_unstable();
    (leaves, twins)
}
