//! A binary tree over boxes, one to a leaf, from which the wide tree is made.
//!
//! Built top down by the binned surface area heuristic (Wald 2007, "On fast Construction of
//! SAH-based Bounding Volume Hierarchies"); with `obvhs` only down to sets small enough for it.

use alloc::vec::Vec;

use super::frame::Box32;
use super::node::Node;
#[cfg(feature = "obvhs")]
use super::ploc::Ploc;

const BINS: usize = 16;

/// Below this depth nodes are halved by count, so that no input makes a deep tree.
const SAH_DEPTH: usize = 60;

/// What builds a tree. Queries give the same hits, bit for bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum BvhBuilder {
    /// Top down by the binned surface area heuristic; needs no `std`.
    #[cfg_attr(not(feature = "obvhs"), default)]
    Binned,
    /// As [`BvhBuilder::Binned`] down to sets of at most 1024 triangles, each then built by `obvhs`
    /// bottom up, by clustering and reinsertion. From the first set on over which `obvhs` is slow, as
    /// it is where many boxes coincide or are stacked, it is `Binned` all the way down.
    #[cfg(feature = "obvhs")]
    #[default]
    Obvhs,
}

/// The tree. It numbers the primitives in its own order, that of the leaves from left to right.
#[derive(Clone, Debug)]
pub(super) struct BinaryTree {
    nodes: Vec<Node>,
}

impl BinaryTree {
    /// Builds the tree over the boxes and returns it with the boxes' numbers in the tree's order.
    pub(super) fn build(boxes: &[Box32], builder: BvhBuilder) -> (Self, Vec<u32>) {
        #[cfg(feature = "obvhs")]
        let mut ploc = (builder == BvhBuilder::Obvhs).then(Ploc::new);
        #[cfg(not(feature = "obvhs"))]
        let BvhBuilder::Binned = builder;

        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let centers: Vec<_> = boxes.iter().map(Box32::doubled_center).collect();
        let mut nodes = Vec::with_capacity(boxes.len());
        nodes.push(Node { bounds: Box32::EMPTY, first: 0, count: boxes.len() as u32 });
        let mut open = alloc::vec![(0, 0)];
        while let Some((index, depth)) = open.pop() {
            let Node { first, count, .. } = nodes[index];
            let range = &mut order[first as usize..(first + count) as usize];
            nodes[index].bounds = union(boxes, range);
            if count > 1 {
                #[cfg(feature = "obvhs")]
                if ploc.as_mut().is_some_and(|p| p.grow(&mut nodes, index, boxes, range)) {
                    continue;
                }
                let left = split(boxes, &centers, range, depth) as u32;
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
    pub(super) fn nodes(&self) -> &[Node] {
        &self.nodes
    }
}

fn union(boxes: &[Box32], range: &[u32]) -> Box32 {
    range.iter().fold(Box32::EMPTY, |b, &i| b.union(&boxes[i as usize]))
}

/// Reorders the primitives of a node (at least two) and returns how many go left.
fn split(boxes: &[Box32], centers: &[[f32; 3]], range: &mut [u32], depth: usize) -> usize {
    let count = range.len();
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
    if let Some((_, axis, cut)) = best {
        return partition(range, |i| bin(i, axis) < cut);
    }
    let longest = (0..3).fold(0, |k, j| if extent[j] > extent[k] { j } else { k });
    range.select_nth_unstable_by(count / 2, |&a, &b| {
        let center = |i: u32| centers[i as usize][longest];
        center(a).total_cmp(&center(b)).then(a.cmp(&b))
    });
    count / 2
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
