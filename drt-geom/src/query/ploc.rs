//! Subtrees by `obvhs`: agglomerative clustering in Morton order (Meister and Bittner 2018, "Parallel
//! Locally-Ordered Clustering for Bounding Volume Hierarchy Construction"), then reinsertion of nodes
//! (the same authors and year, "Parallel Reinsertion for Bounding Volume Hierarchy Optimization").
//!
//! Clustering merges boxes that are each other's best partners, in passes over what is left. Where
//! all costs tie (coincident boxes) or grow along the order (stacked plates, a strip of triangles
//! each larger than the last), a pass finds one pair, and the time is quadratic. So it is given at
//! most [`MOST`] boxes at a time, and nothing more after the first set that took many passes.
//!
//! Boxes here are finite, within [-1, 1] and nowhere flat, which keeps from `obvhs` what it cannot
//! take. Only its nodes are used, none of its rays or walks.

use alloc::vec::Vec;

use ::obvhs::Boundable;
use ::obvhs::aabb::Aabb;
use ::obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use ::obvhs::bvh2::{Bvh2, DEFAULT_MAX_STACK_DEPTH};
use ::obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use super::frame::Box32;
use super::node::Node;

/// Most boxes of a set. Trees over fewer are no worse: what is cut first is cut well.
const MOST: usize = 1024;

/// How much of a tree is tried in other places, of its nodes.
const REINSERTED: f32 = 0.1;

/// Builds subtrees, as long as that is fast.
pub(super) struct Ploc {
    clustering: PlocBuilder,
    reinsertion: ReinsertionOptimizer,
    slow: bool,
}

impl Boundable for Box32 {
    fn aabb(&self) -> Aabb {
        Aabb::new(self.min.into(), self.max.into())
    }
}

impl Ploc {
    pub(super) fn new() -> Self {
        let (clustering, reinsertion) = (PlocBuilder::new(), ReinsertionOptimizer::default());
        Self { clustering, reinsertion, slow: false }
    }

    /// Gives a node that has those primitives the tree over them and brings them in its order; false
    /// where that might take long, and nothing is changed.
    pub(super) fn grow(
        &mut self,
        nodes: &mut Vec<Node>,
        root: usize,
        boxes: &[Box32],
        prims: &mut [u32],
    ) -> bool {
        let Some(tree) = self.build(boxes, prims) else { return false };
        let unordered = prims.to_vec();
        let begin = nodes[root].first;
        let mut placed = 0;
        let mut open = alloc::vec![(0, root)];
        while let Some((from, to)) = open.pop() {
            let node = &tree.nodes[from];
            let first = node.first_index as usize;
            if node.is_leaf() {
                let prim = unordered[first];
                prims[placed] = prim;
                let first = begin + placed as u32;
                nodes[to] = Node { bounds: boxes[prim as usize], first, count: 1 };
                placed += 1;
            } else {
                let aabb = node.aabb();
                let bounds = Box32 { min: aabb.min.into(), max: aabb.max.into() };
                let child = nodes.len();
                nodes[to] = Node { bounds, first: child as u32, count: 0 };
                nodes.extend([nodes[to]; 2]);
                open.extend([(first + 1, child + 1), (first, child)]);
            }
        }
        true
    }

    /// The tree over some of the boxes, one to a leaf, which it names by place among their numbers.
    fn build(&mut self, boxes: &[Box32], numbers: &[u32]) -> Option<Bvh2> {
        if self.slow || numbers.len() > MOST {
            return None;
        }
        let boxes: Vec<_> = numbers.iter().map(|&i| boxes[i as usize]).collect();
        let places = (0..boxes.len() as u32).collect();
        let (distance, sort) = (PlocSearchDistance::Medium, SortPrecision::U64);
        let mut tree = self.clustering.build(distance, &boxes, places, sort, 0);
        // The number of passes, where it is more than obvhs's own stacks are made for.
        self.slow = tree.max_depth > DEFAULT_MAX_STACK_DEPTH;
        if self.slow {
            return None;
        }
        self.reinsertion.run(&mut tree, REINSERTED, None);
        Some(tree)
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use super::{MOST, Ploc};
    use crate::query::frame::Box32;

    fn numbers(count: usize) -> Vec<u32> {
        (0..count as u32).collect()
    }

    fn cube(center: f32, half: f32) -> Box32 {
        Box32 { min: [center - half; 3], max: [center + half; 3] }
    }

    #[test]
    fn ordinary_sets_are_taken_up_to_the_limit() {
        let row: Vec<_> = (0..=MOST).map(|i| cube(i as f32 * 1e-3 - 0.5, 1e-3)).collect();
        let mut ploc = Ploc::new();
        for count in [2, 3, 4, 5, 6, 7, 17, 100, MOST] {
            let tree = ploc.build(&row, &numbers(count)).unwrap();
            let mut leaves: Vec<_> = tree
                .nodes
                .iter()
                .filter(|n| n.is_leaf())
                .map(|n| (n.prim_count, n.first_index))
                .collect();
            leaves.sort_unstable();
            assert_eq!(leaves, numbers(count).into_iter().map(|i| (1, i)).collect::<Vec<_>>());
        }
        assert!(ploc.build(&row, &numbers(MOST + 1)).is_none() && !ploc.slow);
    }

    #[test]
    fn sets_that_would_take_long_end_it() {
        let coincident = alloc::vec![cube(0.0, 0.5); MOST];
        let concentric: Vec<_> = (1..=MOST).map(|i| cube(0.0, i as f32 / MOST as f32)).collect();
        let plates: Vec<_> = (0..MOST)
            .map(|i| i as f32 / MOST as f32)
            .map(|z| Box32 { min: [-1.0, -1.0, z], max: [1.0, 1.0, z + 1e-5] })
            .collect();
        for boxes in [coincident, concentric, plates] {
            let mut ploc = Ploc::new();
            assert!(ploc.build(&boxes, &numbers(MOST)).is_none());
            assert!(ploc.build(&boxes, &numbers(2)).is_none());
        }
    }
}
