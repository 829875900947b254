use alloc::vec;
use alloc::vec::Vec;
use core::ops::Range;

use drt_geom::Aabb;
use drt_math::Vec3;

use super::Kernel;

/// Triangles in a cluster that is not divided.
const LEAF: usize = 4;

/// A ball around some triangles.
#[derive(Clone, Debug)]
pub(super) struct Cluster {
    pub(super) middle: Vec3,
    pub(super) radius: f64,
    /// Its triangles, in the order of the hierarchy.
    pub(super) triangles: Range<u32>,
    /// The first of its two parts, which follow each other; none for an undivided cluster.
    pub(super) parts: Option<u32>,
}

/// Clusters from the whole down, and the triangles in their order.
pub(super) fn build(triangles: &[[Vec3; 3]], kernel: Kernel) -> (Vec<Cluster>, Vec<u32>) {
    let centers: Vec<Vec3> = triangles.iter().map(|[a, b, c]| (*a + *b + *c) / 3.0).collect();
    let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
    let mut clusters = vec![cluster(triangles, &order, 0..triangles.len(), kernel)];
    let mut next = 0;
    while let Some(c) = clusters.get(next) {
        let range = c.triangles.start as usize..c.triangles.end as usize;
        if range.len() > LEAF {
            let inside = &mut order[range.clone()];
            let extent = Aabb::around(inside.iter().map(|&i| centers[i as usize])).extent();
            let axis = (0..3).fold(0, |k, i| if extent[i] > extent[k] { i } else { k });
            let half = inside.len() / 2;
            let along = |i: &u32| centers[*i as usize][axis];
            inside
                .select_nth_unstable_by(half, |a, b| along(a).total_cmp(&along(b)).then(a.cmp(b)));
            let middle = range.start + half;
            let parts = [range.start..middle, middle..range.end];
            let first = clusters.len() as u32;
            clusters.extend(parts.map(|r| cluster(triangles, &order, r, kernel)));
            clusters[next].parts = Some(first);
        }
        next += 1;
    }
    (clusters, order)
}

fn cluster(triangles: &[[Vec3; 3]], order: &[u32], range: Range<usize>, kernel: Kernel) -> Cluster {
    let all = || order[range.clone()].iter().map(|&i| triangles[i as usize]);
    let corners = || all().flatten();
    let middle = match kernel {
        Kernel::MeanValue => Aabb::around(corners()).center(),
        // About its centroid the area has no moment of first order, which could have either sign.
        Kernel::InverseDistance => {
            let (mut area, mut sum) = (0.0, Vec3::ZERO);
            for [a, b, c] in all() {
                let double = (b - a).cross(c - a).length();
                area += double;
                sum += (a + b + c) * (double / 3.0);
            }
            if area > 0.0 { sum / area } else { Aabb::around(corners()).center() }
        }
    };
    let radius = corners().map(|p| (p - middle).length()).fold(0.0, f64::max);
    Cluster { middle, radius, triangles: range.start as u32..range.end as u32, parts: None }
}
