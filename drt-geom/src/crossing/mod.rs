//! Where surfaces run through each other or themselves.

use alloc::vec::Vec;
use core::ops::ControlFlow;

use drt_math::Vec3;

use crate::{Mesh, weld};

mod meet;
mod near;
mod segments;

#[cfg(feature = "tetgen")]
pub(crate) use meet::{has_area, volume_sign};
pub use segments::{CrossingSegment, crossing_segments};

/// Pairs of triangles, each as (surface, triangle), that have more in common than corners and edges
/// of both: what cross, overlap, coincide, or touch with a corner where the other has none.
///
/// At most `most` of them, in ascending order; which ones, where there are more, is always the same.
/// Corners are the same where their positions are equal. Triangles without area, and those with
/// indices out of range or coordinates that are not finite, meet nothing.
///
/// The answer is exact as long as products of three coordinates neither overflow nor underflow. The
/// cost is near linear in the number of triangles, but for corners at which very many of them meet:
/// there all pairs are looked at.
#[must_use]
pub fn crossing_pairs(surfaces: &[&Mesh], most: usize) -> Vec<[(u32, u32); 2]> {
    let positions: Vec<Vec3> = surfaces.iter().flat_map(|s| s.positions.iter().copied()).collect();
    let welded = weld(&positions);
    let (mut triangles, mut names, mut base) = (Vec::new(), Vec::new(), 0);
    for (surface, mesh) in (0..).zip(surfaces) {
        let usable = |v: u32| mesh.positions.get(v as usize).is_some_and(|p| p.is_finite());
        for (triangle, corners) in (0..).zip(&mesh.triangles) {
            if corners.iter().all(|&v| usable(v)) {
                triangles.push(corners.map(|v| welded[base + v as usize]));
                names.push((surface, triangle));
            }
        }
        base += mesh.positions.len();
    }
    let mut pairs: Vec<_> = crossings(&positions, &triangles, most)
        .into_iter()
        .map(|pair| pair.map(|i| names[i as usize]))
        .collect();
    pairs.sort_unstable();
    pairs
}

/// The same for triangles over shared vertices, by index; corners are the same where their index is.
pub(crate) fn crossings(positions: &[Vec3], triangles: &[[u32; 3]], most: usize) -> Vec<[u32; 2]> {
    let mut pairs = Vec::new();
    if most == 0 {
        return pairs;
    }
    let corners = |i: u32| triangles[i as usize].map(|v| positions[v as usize]);
    let prims: Vec<u32> =
        (0..triangles.len() as u32).filter(|&i| meet::has_area(&corners(i))).collect();
    near::pairs(&prims, corners, |i, j| {
        if meet::cross(positions, triangles[i as usize], triangles[j as usize]) {
            pairs.push([i.min(j), i.max(j)]);
        }
        if pairs.len() < most { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    pairs
}
