//! A binary tree of 32-byte nodes that needs nothing but `alloc`.
//!
//! Built top down by the binned surface area heuristic (Wald 2007, "On fast Construction of
//! SAH-based Bounding Volume Hierarchies").

use alloc::vec::Vec;
use core::ops::ControlFlow;

use super::frame::{Box32, BoxRay};

const BINS: usize = 16;
const LEAF: usize = 4;

/// Below this depth nodes are halved by count, so that no input makes a deep tree: with 2^32
/// primitives the depth stays below [`STACK`].
const SAH_DEPTH: usize = 60;
const STACK: usize = SAH_DEPTH + 34;

#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Box32,
    /// Inner node: index of the first of its two children. Leaf: first primitive.
    first: u32,
    /// Number of primitives; zero marks an inner node.
    count: u32,
}

/// The tree. It numbers the primitives in its own order, that of the leaves from left to right.
#[derive(Clone, Debug)]
pub(super) struct CompactTree {
    nodes: Vec<Node>,
}

impl CompactTree {
    /// Builds the tree over the boxes and returns it with the boxes' numbers in the tree's order.
    pub(super) fn build(boxes: &[Box32]) -> (Self, Vec<u32>) {
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut nodes = Vec::with_capacity(boxes.len());
        nodes.push(Node { bounds: Box32::EMPTY, first: 0, count: boxes.len() as u32 });
        let mut open = alloc::vec![(0, 0)];
        while let Some((index, depth)) = open.pop() {
            let Node { first, count, .. } = nodes[index];
            let range = &mut order[first as usize..(first + count) as usize];
            nodes[index].bounds = union(boxes, range);
            if let Some(left) = split(boxes, range, depth, &nodes[index].bounds) {
                let left = left as u32;
                let child = nodes.len();
                for (first, count) in [(first, left), (first + left, count - left)] {
                    nodes.push(Node { bounds: Box32::EMPTY, first, count });
                }
                nodes[index].first = child as u32;
                nodes[index].count = 0;
                open.extend([(child, depth + 1), (child + 1, depth + 1)]);
            }
        }
        (Self { nodes }, order)
    }

    /// New boxes for the same tree, by primitive in the tree's order.
    pub(super) fn refit(&mut self, primitive: impl Fn(usize) -> Box32) {
        // Children come after their parents.
        for i in (0..self.nodes.len()).rev() {
            let Node { first, count, .. } = self.nodes[i];
            self.nodes[i].bounds = if count == 0 {
                let first = first as usize;
                self.nodes[first].bounds.union(&self.nodes[first + 1].bounds)
            } else {
                (first..first + count).fold(Box32::EMPTY, |b, p| b.union(&primitive(p as usize)))
            };
        }
    }

    /// Calls `leaf` with every primitive whose box the ray meets, nearer boxes first. It answers
    /// with the parameter behind which nothing matters any more, or breaks off.
    #[inline]
    pub(super) fn visit(&self, ray: &BoxRay, mut leaf: impl FnMut(usize) -> ControlFlow<(), f32>) {
        let mut far = ray.far;
        let mut stack = [(0_u32, 0.0_f32); STACK];
        let mut top = 0;
        let Some(entry) = ray.enter(&self.nodes[0].bounds, far) else { return };
        let mut next = Some((0_u32, entry));
        while let Some((index, entry)) = next {
            next = None;
            let node = &self.nodes[index as usize];
            if entry > far {
            } else if node.count > 0 {
                for p in node.first..node.first + node.count {
                    match leaf(p as usize) {
                        ControlFlow::Continue(limit) => far = limit,
                        ControlFlow::Break(()) => return,
                    }
                }
            } else {
                let children = [node.first, node.first + 1];
                let enter = children.map(|c| ray.enter(&self.nodes[c as usize].bounds, far));
                next = match enter {
                    [Some(a), Some(b)] => {
                        let [l, r] = [(children[0], a), (children[1], b)];
                        let (near, later) = if a <= b { (l, r) } else { (r, l) };
                        stack[top] = later;
                        top += 1;
                        Some(near)
                    }
                    [Some(a), None] => Some((children[0], a)),
                    [None, Some(b)] => Some((children[1], b)),
                    [None, None] => None,
                };
            }
            if next.is_none() && top > 0 {
                top -= 1;
                next = Some(stack[top]);
            }
        }
    }

    /// Calls `leaf` with every primitive whose box is nearer to the point than the squared distance
    /// `leaf` last answered, nearer boxes first. Point and distance are in the tree's coordinates.
    pub(super) fn visit_near(&self, p: [f64; 3], mut leaf: impl FnMut(usize) -> f64) {
        let distance = |i: u32| self.nodes[i as usize].bounds.distance_squared(p);
        let mut best = f64::INFINITY;
        let mut stack = alloc::vec![(0_u32, distance(0))];
        while let Some((index, d)) = stack.pop() {
            let node = &self.nodes[index as usize];
            if d > best {
            } else if node.count > 0 {
                for i in node.first..node.first + node.count {
                    best = leaf(i as usize);
                }
            } else {
                let [a, b] = [node.first, node.first + 1].map(|c| (c, distance(c)));
                stack.extend(if a.1 <= b.1 { [b, a] } else { [a, b] });
            }
        }
    }
}

fn union(boxes: &[Box32], range: &[u32]) -> Box32 {
    range.iter().fold(Box32::EMPTY, |b, &i| b.union(&boxes[i as usize]))
}

/// Reorders the primitives of a node and returns how many go left; `None` for a leaf.
fn split(boxes: &[Box32], range: &mut [u32], depth: usize, bounds: &Box32) -> Option<usize> {
    if range.len() <= 1 {
        return None;
    }
    let center = |i: u32, axis: usize| boxes[i as usize].doubled_center()[axis];
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for &i in range.iter() {
        for k in 0..3 {
            low[k] = low[k].min(center(i, k));
            high[k] = high[k].max(center(i, k));
        }
    }
    let bin = |i: u32, axis: usize| {
        let place = (center(i, axis) - low[axis]) / (high[axis] - low[axis]);
        usize::min((place * BINS as f32) as usize, BINS - 1)
    };

    // Cost of each way to split, in units of (primitive tests × area of the node).
    let mut best = (f32::INFINITY, 0, 0);
    for axis in (0..3).filter(|&k| high[k] > low[k] && depth < SAH_DEPTH) {
        let mut bins = [(Box32::EMPTY, 0_u32); BINS];
        for &i in range.iter() {
            let b = &mut bins[bin(i, axis)];
            *b = (b.0.union(&boxes[i as usize]), b.1 + 1);
        }
        let mut right_cost = [0.0; BINS];
        let grow = |sum: &mut (Box32, u32), b: &(Box32, u32)| {
            *sum = (sum.0.union(&b.0), sum.1 + b.1);
            sum.0.half_area() * sum.1 as f32
        };
        let mut sum = (Box32::EMPTY, 0);
        for cut in (1..BINS).rev() {
            right_cost[cut] = grow(&mut sum, &bins[cut]);
        }
        let mut sum = (Box32::EMPTY, 0);
        for cut in 1..BINS {
            let cost = grow(&mut sum, &bins[cut - 1]) + right_cost[cut];
            if cost < best.0 && sum.1 > 0 && (sum.1 as usize) < range.len() {
                best = (cost, axis, cut);
            }
        }
    }

    let (cost, axis, cut) = best;
    let node_cost = (range.len() as f32 - 1.0) * bounds.half_area();
    if cost < node_cost {
        Some(partition(range, |i| bin(i, axis) < cut))
    } else if range.len() <= LEAF {
        None
    } else {
        let longest =
            (0..3).fold(0, |k, j| if high[j] - low[j] > high[k] - low[k] { j } else { k });
        let middle = range.len() / 2;
        range.select_nth_unstable_by(middle, |&a, &b| {
            center(a, longest).total_cmp(&center(b, longest)).then(a.cmp(&b))
        });
        Some(middle)
    }
}

fn partition(range: &mut [u32], left: impl Fn(u32) -> bool) -> usize {
    let mut count = 0;
    for i in 0..range.len() {
        if left(range[i]) {
            range.swap(i, count);
            count += 1;
        }
    }
    count
}
