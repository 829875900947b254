//! Pairs of triangles whose boxes overlap.
//!
//! The tree is not that of the rays: its boxes are padded by a fraction of the whole scene, within
//! which every triangle of a small body is near every other.

use alloc::vec::Vec;
use core::ops::ControlFlow;

use drt_math::Vec3;

use crate::Aabb;

/// A node over a range of the order; leaves hold one triangle, inner nodes their children's indices.
struct Node {
    bounds: Aabb,
    kind: Kind,
}

#[derive(Clone, Copy)]
enum Kind {
    Leaf(u32),
    Inner([usize; 2]),
}

/// Calls `visit` once with every two of the triangles whose boxes have a point in common, until it
/// breaks.
pub(super) fn pairs(
    prims: &[u32],
    corners: impl Fn(u32) -> [Vec3; 3],
    mut visit: impl FnMut(u32, u32) -> ControlFlow<()>,
) {
    if prims.is_empty() {
        return;
    }
    let mut items: Vec<(Aabb, u32)> =
        prims.iter().map(|&i| (Aabb::around(corners(i)), i)).collect();
    let mut nodes = Vec::with_capacity(2 * items.len());
    let root = build(&mut items, &mut nodes);
    let mut open = alloc::vec![(root, root)];
    while let Some((a, b)) = open.pop() {
        if !overlap(&nodes[a].bounds, &nodes[b].bounds) {
            continue;
        }
        match (nodes[a].kind, nodes[b].kind) {
            (Kind::Inner([l, r]), _) if a == b => open.extend([(l, l), (r, r), (l, r)]),
            (Kind::Leaf(_), _) if a == b => {}
            (Kind::Leaf(i), Kind::Leaf(j)) => {
                if visit(i, j).is_break() {
                    return;
                }
            }
            (Kind::Inner([l, r]), Kind::Leaf(_)) => open.extend([(l, b), (r, b)]),
            (Kind::Leaf(_), Kind::Inner([l, r])) => open.extend([(a, l), (a, r)]),
            (Kind::Inner([l, r]), Kind::Inner([m, n])) => {
                open.extend([(l, m), (l, n), (r, m), (r, n)]);
            }
        }
    }
}

/// Halves by the middles of the boxes along the longest side of their bounds; the index of the node.
fn build(items: &mut [(Aabb, u32)], nodes: &mut Vec<Node>) -> usize {
    let bounds = items.iter().fold(Aabb::EMPTY, |b, (o, _)| b.union(o));
    let kind = if let [(_, prim)] = items {
        Kind::Leaf(*prim)
    } else {
        let extent = bounds.extent();
        let axis = (1..3).fold(0, |k, j| if extent[j] > extent[k] { j } else { k });
        let half = items.len() / 2;
        let middle = |b: &Aabb| b.min[axis] * 0.5 + b.max[axis] * 0.5;
        items.select_nth_unstable_by(half, |(a, i), (b, j)| {
            middle(a).total_cmp(&middle(b)).then(i.cmp(j))
        });
        let (left, right) = items.split_at_mut(half);
        Kind::Inner([build(left, nodes), build(right, nodes)])
    };
    nodes.push(Node { bounds, kind });
    nodes.len() - 1
}

fn overlap(a: &Aabb, b: &Aabb) -> bool {
    (0..3).all(|k| a.min[k] <= b.max[k] && b.min[k] <= a.max[k])
}
