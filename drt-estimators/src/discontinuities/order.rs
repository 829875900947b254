//! Edges that are alike, next to each other.
//!
//! One number places a point among all edges of a [table](super::edge::EdgeTable). What is learnt about such numbers, and
//! points that are even in them, tell something of neighbours where these are near each other and face alike:
//! then the same light reaches them, and the same viewers see them as silhouettes. So edges are put in the order of the leaves of
//! a kd-tree of six dimensions, the place of the edge's middle and the direction in which its faces lie, as Yan et al. (2022) sort
//! edges for their guiding.

use drt_geom::edges::Wedge;
use drt_math::Vec3;

/// The size of all places to that of all directions.
const PLACES: f64 = 2.0;

/// As many edges are told apart in any order.
const FEW: usize = 256;

/// Puts edges, of which each has a wedge, in the order of a kd-tree's leaves.
pub(super) fn sort_by_likeness<T>(edges: &mut [T], wedge: impl Fn(&T) -> &Wedge) {
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
    split(edges, &|e| place(wedge(e), scale));
}

/// Halves the list where it is widest, and its halves.
fn split<T>(edges: &mut [T], place: &impl Fn(&T) -> [f64; 6]) {
    if edges.len() <= 1 {
        return;
    }
    let (mut low, mut high) = ([f64::INFINITY; 6], [f64::NEG_INFINITY; 6]);
    for e in edges.iter() {
        for (k, c) in place(e).into_iter().enumerate() {
            (low[k], high[k]) = (f64::min(low[k], c), f64::max(high[k], c));
        }
    }
    let wider =
        |best: usize, k: usize| if high[k] - low[k] > high[best] - low[best] { k } else { best };
    let axis = (1..6).fold(0, wider);
    let half = edges.len() / 2;
    edges.select_nth_unstable_by(half, |a, b| place(a)[axis].total_cmp(&place(b)[axis]));
    let (left, right) = edges.split_at_mut(half);
    split(left, place);
    split(right, place);
}

fn place(wedge: &Wedge, scale: f64) -> [f64; 6] {
    let Vec3 { x, y, z } = wedge.at(0.5) * scale;
    let towards = wedge.inward().unwrap_or(Vec3::ZERO);
    [x, y, z, towards.x, towards.y, towards.z]
}
