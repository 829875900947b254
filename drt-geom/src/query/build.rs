use alloc::vec::Vec;

use drt_math::Vec3;

use super::frame::{Box32, BoxFrame};
use super::tree::Tree;
use super::watertight::corners;
use super::{Slot, TriangleBvh, chain};
use crate::weld::lexicographic;
use crate::{Aabb, Mesh, NONE};

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

impl TriangleBvh {
    /// Builds the tree over triangles, which queries name by their place in the slice: an
    /// eight-wide compressed tree by obvhs where that feature is on, else (and for scenes obvhs
    /// makes too deep a tree of) the compact tree.
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

    /// Builds the compact binary tree also where obvhs is available: slower to trace, and the only
    /// one that [`TriangleBvh::refit`] fits in place. Answers are the same.
    ///
    /// # Errors
    /// As [`TriangleBvh::build`].
    pub fn build_compact(triangles: &[[Vec3; 3]]) -> Result<Self, BvhError> {
        Self::build_with(triangles, Tree::build_compact)
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
        let (tree, order) = if leaves.is_empty() {
            (None, Vec::new())
        } else {
            let boxes: Vec<_> =
                leaves.iter().map(|&i| frame.enclose(&triangles[i as usize])).collect();
            let (tree, order) = build(&boxes);
            (Some(tree), order)
        };

        let slot =
            |prim: u32| Slot { corners: corners(&triangles[prim as usize]), prim, twin: NONE };
        let mut slots: Vec<_> = order.iter().map(|&leaf| slot(leaves[leaf as usize])).collect();
        if !twins.is_empty() {
            let mut place = alloc::vec![0; triangles.len()];
            for (index, s) in slots.iter().enumerate() {
                place[s.prim as usize] = index;
            }
            for (first, prim) in twins {
                let index = slots.len() as u32;
                let twin = core::mem::replace(&mut slots[place[first as usize]].twin, index);
                slots.push(Slot { twin, ..slot(prim) });
            }
        }
        Ok(Self { tree, frame, bounds, slots, triangle_count: triangles.len() })
    }

    /// Follows triangles that moved, keeping their numbers. The compact tree keeps its shape, and
    /// serves less well the further they moved; the wide one is built anew.
    ///
    /// # Errors
    /// As [`TriangleBvh::build`], or when the number of triangles changed. The tree is then as
    /// before.
    pub fn refit(&mut self, triangles: &[[Vec3; 3]]) -> Result<(), BvhError> {
        if triangles.len() != self.triangle_count {
            let (expected, found) = (self.triangle_count, triangles.len());
            return Err(BvhError::CountChanged { expected, found });
        }
        // Triangles that had no area are not in the tree.
        let same_set = self.slots.len() == triangles.len() && triangles.iter().all(has_area);
        let (true, Some(Tree::Compact(tree))) = (same_set, &mut self.tree) else {
            *self = match self.tree {
                Some(Tree::Compact(_)) => Self::build_compact(triangles)?,
                _ => Self::build(triangles)?,
            };
            return Ok(());
        };
        self.bounds = usable_bounds(triangles)?;
        self.frame = BoxFrame::new(&self.bounds);
        for slot in &mut self.slots {
            slot.corners = corners(&triangles[slot.prim as usize]);
        }
        let (slots, frame) = (&self.slots, &self.frame);
        // Twins may have parted, so a leaf's box is that of its whole chain.
        tree.refit(|leaf| {
            chain(slots, leaf)
                .map(|s| frame.enclose(&triangles[s.prim as usize]))
                .fold(Box32::EMPTY, |b, o| b.union(&o))
        });
        Ok(())
    }
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
    let mut keyed: Vec<([Vec3; 3], u32)> = Vec::with_capacity(triangles.len());
    for (t, prim) in triangles.iter().zip(0..).filter(|(t, _)| has_area(t)) {
        let mut key = *t;
        key.sort_unstable_by(|a, b| lexicographic(*a, *b));
        keyed.push((key, prim));
    }
    keyed.sort_unstable_by(|(a, i), (b, j)| {
        let corner = |k: usize| lexicographic(a[k], b[k]);
        corner(0).then_with(|| corner(1)).then_with(|| corner(2)).then(i.cmp(j))
    });
    let (mut leaves, mut twins) = (Vec::with_capacity(keyed.len()), Vec::new());
    for run in keyed.chunk_by(|(a, _), (b, _)| a == b) {
        let first = run[0].1;
        leaves.push(first);
        twins.extend(run[1..].iter().map(|(_, prim)| (first, *prim)));
    }
    leaves.sort_unstable();
    (leaves, twins)
}
