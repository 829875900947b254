//! A binary tree of 32-byte nodes that needs nothing but `alloc`.
//!
//! Built top down by the binned surface area heuristic (Wald 2007, "On fast Construction of
//! SAH-based Bounding Volume Hierarchies").

use alloc::vec::Vec;
use core::ops::ControlFlow;

use super::frame::{Box32, BoxRay};

const BINS: usize = 16;

/// Below this depth nodes are halved by count, so that no input makes a deep tree: with 2^32
/// primitives the depth stays below [`STACK`].
const SAH_DEPTH: usize = 60;
const STACK: usize = SAH_DEPTH + 34;

#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) bounds: Box32,
    /// Inner node: index of the first of its two children. Leaf: first primitive.
    pub(super) first: u32,
    /// Number of primitives; zero marks an inner node.
    pub(super) count: u32,
}

/// The tree. It numbers the primitives in its own order, that of the leaves from left to right.
#[derive(Clone, Debug)]
pub(super) struct CompactTree {
    nodes: Vec<Node>,
}

impl CompactTree {
    /// Builds the tree over the boxes, with at most `leaf_size` in a leaf, and returns it with the
    /// boxes' numbers in the tree's order.
    pub(super) fn build(boxes: &[Box32], leaf_size: usize) -> (Self, Vec<u32>) {
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let centers: Vec<_> = boxes.iter().map(Box32::doubled_center).collect();
        let mut nodes = Vec::with_capacity(boxes.len());
        nodes.push(Node { bounds: Box32::EMPTY, first: 0, count: boxes.len() as u32 });
        let mut open = alloc::vec![(0, 0)];
        while let Some((index, depth)) = open.pop() {
            let Node { first, count, .. } = nodes[index];
            let range = &mut order[first as usize..(first + count) as usize];
            nodes[index].bounds = union(boxes, range);
            let node_area = nodes[index].bounds.half_area();
            if let Some(left) = split(boxes, &centers, range, depth, leaf_size, node_area) {
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

    /// The nodes, the root first and children after their parents.
    #[cfg(feature = "obvhs")]
    pub(super) fn nodes(&self) -> &[Node] {
        &self.nodes
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
fn split(
    boxes: &[Box32],
    centers: &[[f32; 3]],
    range: &mut [u32],
    depth: usize,
    leaf_size: usize,
    node_area: f32,
) -> Option<usize> {
    let count = range.len();
    if count <= 1 {
        return None;
    }
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for &i in range.iter() {
        let c = centers[i as usize];
        for k in 0..3 {
            low[k] = low[k].min(c[k]);
            high[k] = high[k].max(c[k]);
        }
    }
    let extent = [0, 1, 2].map(|k| high[k] - low[k]);
    let bin = |i: u32, axis: usize| {
        let place = (centers[i as usize][axis] - low[axis]) * (BINS as f32 / extent[axis]);
        usize::min(place as usize, BINS - 1)
    };

    let mut bins = [[Bin::EMPTY; BINS]; 3];
    let axes = (0..3).filter(|&k| extent[k] > 0.0 && depth < SAH_DEPTH);
    for &i in range.iter() {
        for axis in axes.clone() {
            bins[axis][bin(i, axis)].add(&Bin { bounds: boxes[i as usize], count: 1 });
        }
    }
    let best = axes
        .filter_map(|axis| best_cut(&bins[axis], count).map(|(cost, cut)| (cost, axis, cut)))
        .min_by(|a, b| a.0.total_cmp(&b.0));

    // Visiting a node costs about one primitive test.
    let leaf_cost = (count as f32 - 1.0) * node_area;
    match best {
        Some((cost, axis, cut)) if cost < leaf_cost || count > leaf_size => {
            Some(partition(range, |i| bin(i, axis) < cut))
        }
        _ if count <= leaf_size => None,
        _ => {
            let longest = (0..3).fold(0, |k, j| if extent[j] > extent[k] { j } else { k });
            range.select_nth_unstable_by(count / 2, |&a, &b| {
                let center = |i: u32| centers[i as usize][longest];
                center(a).total_cmp(&center(b)).then(a.cmp(&b))
            });
            Some(count / 2)
        }
    }
}

/// Some primitives of a node.
#[derive(Clone, Copy)]
struct Bin {
    bounds: Box32,
    count: u32,
}

impl Bin {
    const EMPTY: Self = Self { bounds: Box32::EMPTY, count: 0 };

    fn add(&mut self, o: &Self) {
        *self = Self { bounds: self.bounds.union(&o.bounds), count: self.count + o.count };
    }
    /// Expected primitive tests, times the area of the parent node.
    fn cost(&self) -> f32 {
        self.bounds.half_area() * self.count as f32
    }
}

/// The cheapest way to cut a row of bins in two that each hold something: cost, and how many bins go
/// left.
fn best_cut(bins: &[Bin; BINS], count: usize) -> Option<(f32, usize)> {
    let mut right_cost = [0.0; BINS];
    let mut right = Bin::EMPTY;
    for cut in (1..BINS).rev() {
        right.add(&bins[cut]);
        right_cost[cut] = right.cost();
    }
    let mut left = Bin::EMPTY;
    let mut best = None;
    for cut in 1..BINS {
        left.add(&bins[cut - 1]);
        let cost = left.cost() + right_cost[cut];
        let parts = left.count > 0 && (left.count as usize) < count;
        if parts && best.is_none_or(|(least, _)| cost < least) {
            best = Some((cost, cut));
        }
    }
    best
}

/// Brings those that go left to the front and returns their number.
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
