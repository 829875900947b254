//! From a binary tree to a wide one, at the least expected cost (Ylitie, Karras and Laine 2017,
//! "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", section 3.1).

use alloc::vec::Vec;
use core::ops::Range;

use super::binary::{BinaryTree, BvhBuilder};
use super::children::{LEAF, NO_CHILD, WIDTH};
use super::frame::Box32;

/// Cost of testing a block of triangles, in that of testing a node's boxes.
const BLOCK_COST: f32 = 1.0;

/// A subtree of the binary tree, and what it costs as part of a wide one.
#[derive(Clone)]
struct Subtree {
    /// Its primitives, in the binary tree's order.
    prims: Range<u32>,
    /// Least cost as at most so many children of one node, from 1.
    cost: [f32; WIDTH],
    /// How many of these the left half takes; zero where one child less costs no more. (The last is
    /// for the subtree's own node, which takes what it can.)
    left: [u8; WIDTH],
    /// Whether it is best as one block, where it is one child.
    block: bool,
}

/// A wide tree over some boxes without its own.
pub(super) struct Collapsed {
    /// The children of each node: another node, a block with the mark [`LEAF`], or [`NO_CHILD`]. The
    /// root comes first, children come after their parents.
    pub(super) nodes: Vec<[u32; WIDTH]>,
    /// The numbers of the boxes, those of a block in a row.
    pub(super) order: Vec<u32>,
    /// The boxes of each block, by place in that order.
    pub(super) blocks: Vec<Range<u32>>,
}

/// The wide tree over the boxes (at least one) with up to `block_size` in a block.
pub(super) fn collapse(boxes: &[Box32], block_size: usize, builder: BvhBuilder) -> Collapsed {
    let (tree, order) = BinaryTree::build(boxes, builder);
    let subtrees = costs(&tree, block_size);
    let mut nodes = alloc::vec![[NO_CHILD; WIDTH]];
    let mut blocks = Vec::new();
    let mut open = alloc::vec![(0, 0)];
    let mut children = Vec::with_capacity(WIDTH);
    while let Some((root, index)) = open.pop() {
        if subtrees[root].block {
            children.push(root);
        } else {
            halves(&tree, &subtrees, root, WIDTH, &mut children);
        }
        for (place, child) in children.drain(..).enumerate() {
            let subtree = &subtrees[child];
            nodes[index][place] = if subtree.block {
                blocks.push(subtree.prims.clone());
                (blocks.len() as u32 - 1) | LEAF
            } else {
                open.push((child, nodes.len()));
                nodes.push([NO_CHILD; WIDTH]);
                nodes.len() as u32 - 1
            };
        }
    }
    Collapsed { nodes, order, blocks }
}

/// Eq. 1 to 3 of the paper, from the leaves to the root.
fn costs(tree: &BinaryTree, block_size: usize) -> Vec<Subtree> {
    let empty = Subtree { prims: 0..0, cost: [0.0; WIDTH], left: [0; WIDTH], block: false };
    let mut subtrees = alloc::vec![empty; tree.nodes().len()];
    for (i, node) in tree.nodes().iter().enumerate().rev() {
        let area = node.bounds.half_area();
        let first = node.first as usize;
        if node.count > 0 {
            subtrees[i].prims = node.first..node.first + node.count;
            subtrees[i].cost = [area * BLOCK_COST; WIDTH];
            subtrees[i].block = true;
            continue;
        }
        let [l, r] = [&subtrees[first], &subtrees[first + 1]];
        let prims = l.prims.start..r.prims.end;
        let (mut cost, mut left) = ([0.0; WIDTH], [0; WIDTH]);
        for count in 2..=WIDTH {
            let split = |k: usize| (l.cost[k - 1] + r.cost[count - k - 1], k as u8);
            let best = (1..count).map(split).min_by(|a, b| a.0.total_cmp(&b.0));
            (cost[count - 1], left[count - 1]) = best.unwrap_or_default();
        }
        let node = cost[WIDTH - 1] + area;
        let fits = prims.len() <= block_size;
        let block = fits && area * BLOCK_COST <= node;
        cost[0] = if block { area * BLOCK_COST } else { node };
        for count in 1..WIDTH - 1 {
            if cost[count - 1] <= cost[count] {
                (cost[count], left[count]) = (cost[count - 1], 0);
            }
        }
        subtrees[i] = Subtree { prims, cost, left, block };
    }
    subtrees
}

/// The subtrees that are children where this one gives at most `count`.
fn members(
    tree: &BinaryTree,
    subtrees: &[Subtree],
    root: usize,
    count: usize,
    out: &mut Vec<usize>,
) {
    if count == 1 {
        out.push(root);
    } else if subtrees[root].left[count - 1] == 0 {
        members(tree, subtrees, root, count - 1, out);
    } else {
        halves(tree, subtrees, root, count, out);
    }
}

fn halves(
    tree: &BinaryTree,
    subtrees: &[Subtree],
    root: usize,
    count: usize,
    out: &mut Vec<usize>,
) {
    let first = tree.nodes()[root].first as usize;
    let left = usize::from(subtrees[root].left[count - 1]);
    members(tree, subtrees, first, left, out);
    members(tree, subtrees, first + 1, count - left, out);
}
