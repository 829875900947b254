use alloc::vec::Vec;
use core::cmp::Ordering;

use drt_math::Vec3;

/// For each position, the lowest index among the positions equal to it (`-0` equals `0`).
///
/// Files repeat a vertex wherever texture coordinates or shading normals differ; what is connected
/// can only be seen after merging those copies.
#[must_use]
pub fn weld(positions: &[Vec3]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.sort_unstable_by(|&a, &b| {
        lexicographic(positions[a as usize], positions[b as usize]).then(a.cmp(&b))
    });
    let mut representative = alloc::vec![0; positions.len()];
    for run in order.chunk_by(|&a, &b| positions[a as usize] == positions[b as usize]) {
        for &i in run {
            representative[i as usize] = run[0];
        }
    }
    representative
}

/// A total order of points in which equal points (with `-0 == 0`) are neighbours.
pub(crate) fn lexicographic(a: Vec3, b: Vec3) -> Ordering {
    let key = |v: Vec3| v.to_array().map(|c| c + 0.0);
    let (a, b) = (key(a), key(b));
    a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])).then(a[2].total_cmp(&b[2]))
}
