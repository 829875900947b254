//! An eight-wide compressed tree by obvhs (Ylitie, Karras and Laine 2017, "Efficient
//! Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs").
//!
//! obvhs loses rays in three cases: it drops what is nearer than t = 1e-4, mistakes the side of a
//! direction coordinate of -0, and clamps inverse directions at 1.2e-7. None can occur with the
//! rays of [`super::frame`], which bring their own inverse.

use alloc::vec::Vec;
use core::ops::ControlFlow;

use glam::{UVec2, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
use obvhs::cwbvh::{BRANCHING, CwBvh};
use obvhs::ray::Ray;
use obvhs::traverse;

use super::compact::{CompactTree, Node};
use super::frame::{Box32, BoxRay};

/// obvhs's traversal overwrites its stack beyond this depth.
const MAX_DEPTH: usize = 32;

/// The most its node format holds.
const PRIMS_PER_LEAF: u32 = 3;

#[derive(Clone, Debug)]
pub(super) struct WideTree {
    bvh: CwBvh,
}

impl WideTree {
    /// The tree over the boxes with the boxes' numbers in the tree's order, or `None` for boxes that
    /// would make it too deep.
    ///
    /// The binary tree it starts from is our own, whose depth and building time are bounded for any
    /// input: obvhs's builder takes quadratic time, and makes trees as deep as there are boxes, where
    /// many are equal or nested.
    pub(super) fn build(boxes: &[Box32]) -> Option<(Self, Vec<u32>)> {
        let (binary, order) = CompactTree::build(boxes, 1);
        let node = |n: &Node| Bvh2Node::new(aabb(&n.bounds), n.count, n.first);
        let binary = Bvh2 {
            nodes: binary.nodes().iter().map(node).collect(),
            primitive_indices: order,
            ..Bvh2::default()
        };
        let mut bvh = bvh2_to_cwbvh(&binary, PRIMS_PER_LEAF, true, false);
        let order = core::mem::take(&mut bvh.primitive_indices);
        let tree = Self { bvh };
        (tree.depth() <= MAX_DEPTH).then_some((tree, order))
    }

    fn depth(&self) -> usize {
        let mut deepest = 0;
        let mut open = alloc::vec![(0, 1)];
        while let Some((index, depth)) = open.pop() {
            deepest = usize::max(deepest, depth);
            let node = &self.bvh.nodes[index];
            let inner = (0..BRANCHING).filter(|&c| !node.is_leaf(c));
            open.extend(inner.map(|c| (node.child_node_index(c) as usize, depth + 1)));
        }
        deepest
    }

    /// As [`CompactTree::visit`](super::compact::CompactTree::visit).
    #[inline]
    pub(super) fn visit(&self, ray: &BoxRay, mut leaf: impl FnMut(usize) -> ControlFlow<(), f32>) {
        let mut ray = Ray {
            origin: Vec3A::from_array(ray.origin),
            // Only its signs are used; they must be those of the inverse.
            direction: Vec3A::from_array(ray.inverse),
            inv_direction: Vec3A::from_array(ray.inverse),
            tmin: 0.0,
            tmax: ray.far,
        };
        let mut state = self.bvh.new_traversal(ray.direction);
        let mut node;
        'walk: {
            traverse!(self.bvh, node, state, node.intersect_ray(&ray, state.oct_inv4), {
                match leaf(state.primitive_id as usize) {
                    ControlFlow::Continue(limit) => ray.tmax = limit,
                    ControlFlow::Break(()) => break 'walk,
                }
            });
        }
    }

    /// As [`CompactTree::visit_near`](super::compact::CompactTree::visit_near).
    pub(super) fn visit_near(&self, p: [f64; 3], mut leaf: impl FnMut(usize) -> f64) {
        let mut best = f64::INFINITY;
        let mut open = alloc::vec![(0.0, 0)];
        while let Some((d, index)) = open.pop() {
            if d > best {
                continue;
            }
            let node = &self.bvh.nodes[index];
            let mut children: Vec<_> = (0..BRANCHING)
                .filter(|&c| !node.is_child_empty(c))
                .map(|c| {
                    let b = node.child_aabb(c);
                    let b = Box32 { min: b.min.to_array(), max: b.max.to_array() };
                    (b.distance_squared(p), c)
                })
                .collect();
            children.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
            for &(d, c) in children.iter().rev().filter(|(_, c)| node.is_leaf(*c)) {
                if d <= best {
                    let (first, count) = node.child_primitives(c);
                    for i in first..first + count {
                        best = leaf(i as usize);
                    }
                }
            }
            let inner = children.iter().filter(|(d, c)| !node.is_leaf(*c) && *d <= best);
            open.extend(inner.map(|&(d, c)| (d, node.child_node_index(c) as usize)));
        }
    }
}

fn aabb(b: &Box32) -> Aabb {
    Aabb::new(Vec3A::from_array(b.min), Vec3A::from_array(b.max))
}
