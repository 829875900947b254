//! Edges that are alike, next to each other.
//!
//! One number places a point among all edges of a [table](super::edge::EdgeTable). What is learnt about such numbers, and
//! points that are even in them, tell something of neighbours where these are near each other and face alike:
//! then the same light reaches them, and the same viewers see them as silhouettes. So edges are put in the order of the leaves of
//! a kd-tree of six dimensions, the place of the edge's middle and the direction in which its faces lie, as Yan et al. (2022) sort
//! edges for their guiding.

use alloc::vec::Vec;

use drt_geom::edges::Wedge;
use drt_math::Vec3;

/// The size of all places to that of all directions.
const PLACES: f64 = 2.0;

/// As many edges are told apart in any order.
const FEW: usize = 256;

/// Puts edges, of which each has a wedge, in the order of a kd-tree's leaves.
pub(super) fn sort_by_likeness<T: Copy>(edges: &mut [T], wedge: impl Fn(&T) -> &Wedge) {
    if edges.len() <= FEW {
        return;
    }
    let (mut low, mut high) = (Vec3::splat(f64::INFINITY), Vec3::splat(f64::NEG_INFINITY));
    for e in edges.iter() {
        let middle = wedge(e).at(0.5);
        (low, high) = (low.min(middle), high.max(middle));
    }
    let size = (high - low).max_abs();
    let scale = if size > 0.0 { PLACES / size } else { 0.0 };
    let mut leaves: Vec<Leaf> =
        (0..).zip(edges.iter()).map(|(i, e)| (place(wedge(e), scale), i)).collect();
    split(&mut leaves);
    let sorted: Vec<T> = leaves.iter().map(|(_, i)| edges[*i]).collect();
    edges.copy_from_slice(&sorted);
}

/// The place of an edge in the tree's six dimensions, and its number.
type Leaf = ([f64; 6], usize);

/// Halves the list where it is widest, and its halves.
fn split(leaves: &mut [Leaf]) {
    if leaves.len() <= 1 {
        return;
    }
    let (mut low, mut high) = ([f64::INFINITY; 6], [f64::NEG_INFINITY; 6]);
    for (place, _) in leaves.iter() {
        for (k, c) in place.iter().enumerate() {
            (low[k], high[k]) = (f64::min(low[k], *c), f64::max(high[k], *c));
        }
    }
    let wider =
        |best: usize, k: usize| if high[k] - low[k] > high[best] - low[best] { k } else { best };
    let axis = (1..6).fold(0, wider);
    let half = leaves.len() / 2;
    leaves
        .select_nth_unstable_by(half, |(a, i), (b, j)| a[axis].total_cmp(&b[axis]).then(i.cmp(j)));
    let (left, right) = leaves.split_at_mut(half);
    split(left);
    split(right);
}

fn place(wedge: &Wedge, scale: f64) -> [f64; 6] {
    let Vec3 { x, y, z } = wedge.at(0.5) * scale;
    let towards = wedge.inward().unwrap_or(Vec3::ZERO);
    [x, y, z, towards.x, towards.y, towards.z]
}
