//! The distance from a surface where nobody needs it exactly: interpolated on a lattice.

use alloc::vec::Vec;

use drt_geom::TriangleBvh;
use drt_math::{Vec3, fm, vec3};

/// Distances from a surface at the nodes of a lattice of cubes around it.
#[derive(Clone, Debug)]
pub(crate) struct Distances {
    /// The first node.
    origin: Vec3,
    /// Edge length of the cubes, and one over it.
    width: f64,
    per_width: f64,
    /// Nodes per axis, x fastest.
    count: [usize; 3],
    /// The last node, in cubes from the first.
    last: Vec3,
    values: Vec<f32>,
}

/// An interpolated distance, which differs from the true one by less than [`Distances::error`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interpolated {
    pub(crate) distance: f64,
    pub(crate) gradient: Vec3,
}

impl Distances {
    /// Nodes at most: prepared in a few milliseconds.
    const MOST_NODES: f64 = 16384.0;
    /// Cubes along the longest side at most.
    const MOST_CUBES: f64 = 64.0;
    /// Cubes around the box of the surface on each side.
    const MARGIN: f64 = 3.0;

    /// `None` for a surface without extent.
    pub(crate) fn new(bvh: &TriangleBvh) -> Option<Self> {
        let bounds = bvh.bounds();
        let extent = bounds.extent();
        let mut width = extent.max_abs() / Self::MOST_CUBES;
        if width.is_nan() || width <= 0.0 || width.is_infinite() {
            return None;
        }
        let nodes =
            |width: f64| extent.to_array().map(|e| fm::ceil(e / width) + 2.0 * Self::MARGIN + 1.0);
        while nodes(width).into_iter().product::<f64>() > Self::MOST_NODES {
            width *= 1.1;
        }
        let count = nodes(width).map(|n| n as usize);
        let origin = bounds.min - Vec3::splat(Self::MARGIN * width);
        let mut values = Vec::with_capacity(count.into_iter().product());
        for k in 0..count[2] {
            for j in 0..count[1] {
                let mut near = f64::INFINITY;
                for i in 0..count[0] {
                    let p = origin + vec3(i as f64, j as f64, k as f64) * width;
                    // No node is farther than its neighbour by more than what is between them.
                    near = bvh.closest_point_within(p, 1.001 * (near + width))?.distance;
                    values.push(near as f32);
                }
            }
        }
        let last = Vec3::from(count.map(|n| (n - 1) as f64));
        Some(Self { origin, width, per_width: 1.0 / width, count, last, values })
    }

    /// Edge length of the lattice's cubes.
    pub(crate) fn width(&self) -> f64 {
        self.width
    }

    /// What interpolation can be off by: a distance changes no faster than one goes, and the nodes
    /// are on average no farther away than those of the middle of a cube.
    pub(crate) fn error(&self) -> f64 {
        0.87 * self.width
    }

    /// The distance of `x`, continuous everywhere. Beyond the lattice, that of its nearest point and the
    /// way there.
    pub(crate) fn at(&self, x: Vec3) -> Interpolated {
        let from = (x - self.origin) * self.per_width;
        let on = from.max(Vec3::ZERO).min(self.last);
        let [nx, ny, nz] = self.count;
        let ((i, u), (j, v), (k, w)) = (cube(on.x, nx), cube(on.y, ny), cube(on.z, nz));
        let row = |j: usize, k: usize| {
            let at = (k * ny + j) * nx + i;
            let (a, b) = (f64::from(self.values[at]), f64::from(self.values[at + 1]));
            (a + (b - a) * u, b - a)
        };
        let ((d00, x00), (d10, x10)) = (row(j, k), row(j + 1, k));
        let ((d01, x01), (d11, x11)) = (row(j, k + 1), row(j + 1, k + 1));
        let mix = |a: f64, b: f64, s: f64| a + (b - a) * s;
        let (low, high) = (mix(d00, d10, v), mix(d01, d11, v));
        let slope = vec3(
            mix(mix(x00, x10, v), mix(x01, x11, v), w),
            mix(d10 - d00, d11 - d01, w),
            high - low,
        );
        let (mut distance, mut gradient) = (mix(low, high, w), slope * self.per_width);
        if from != on {
            let off = (from - on) * self.width;
            let beyond = off.length();
            // Where the nearest point of the lattice stays, so does its distance.
            let along = |o: f64, g: f64| if o == 0.0 { g } else { 0.0 };
            let g =
                vec3(along(off.x, gradient.x), along(off.y, gradient.y), along(off.z, gradient.z));
            distance += beyond;
            gradient = g + off / beyond;
        }
        Interpolated { distance, gradient }
    }
}

/// The cube of an axis with `n` nodes in which a coordinate lies, and where in it.
#[inline(always)]
fn cube(q: f64, n: usize) -> (usize, f64) {
    let base = usize::min(q as usize, n - 2);
    (base, q - base as f64)
}

#[cfg(test)]
mod tests {
    use drt_geom::procedural;
    use drt_math::Rng;

    use super::*;

    #[test]
    fn distances_are_off_by_less_than_a_cube() {
        for mesh in [procedural::icosphere(2), procedural::rectangle(), procedural::cube()] {
            let bvh = TriangleBvh::of(&mesh).unwrap();
            let d = Distances::new(&bvh).unwrap();
            assert!(d.values.len() as f64 <= Distances::MOST_NODES && d.width < 0.15);
            let mut rng = Rng::new(1, 0, 0);
            for _ in 0..5_000 {
                let c = [0; 3].map(|_| 4.0 * rng.next_f64() - 2.0);
                let x = Vec3::from(c);
                let at = d.at(x);
                let exact = bvh.closest_point(x).unwrap().distance;
                let beyond = (x - x.max(bvh.bounds().min).min(bvh.bounds().max)).length();
                assert!(at.distance <= exact + d.error() + 2.0 * beyond, "{x:?}");
                assert!(beyond > 0.0 || (at.distance - exact).abs() < d.error(), "{x:?}");
                let h = 1e-7;
                for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
                    let [a, b] = [h, -h].map(|h| d.at(x + axis * h).distance);
                    let fd = (a - b) / (2.0 * h);
                    assert!((fd - at.gradient.dot(axis)).abs() < 1e-6, "{x:?}");
                }
            }
        }
    }
}
