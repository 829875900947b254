use alloc::vec::Vec;

use drt_math::{Vec3, fm};

use super::{Mesh, direction};
use crate::weld;

impl Mesh {
    /// The same mesh with smooth shading normals: at each position, the mean of the normals of the
    /// triangles around it, weighted by their angles there (Thürmer and Wüthrich 1998, "Computing
    /// vertex normals from polygonal facets"), so that the result does not depend on how flat parts
    /// are cut into triangles. Vertices at the same position share their normal.
    #[must_use]
    pub fn with_smooth_normals(mut self) -> Self {
        let welded = weld(&self.positions);
        let mut sums = alloc::vec![Vec3::ZERO; self.positions.len()];
        // Where the sum cancels (both sides of a sheet), any face's normal is as good.
        let mut fallback = alloc::vec![Vec3::Z; self.positions.len()];
        for (i, corners) in self.triangles.iter().enumerate() {
            let n = self.normal(i as u32);
            if n == Vec3::ZERO {
                continue;
            }
            for k in 0..3 {
                let [v, next, last] =
                    [0, 1, 2].map(|j| self.positions[corners[(k + j) % 3] as usize]);
                let at = welded[corners[k] as usize] as usize;
                sums[at] += n * angle(next - v, last - v);
                fallback[at] = n;
            }
        }
        let normals: Vec<Vec3> = welded
            .iter()
            .map(|&w| direction(sums[w as usize]).unwrap_or(fallback[w as usize]))
            .collect();
        self.normals = Some(normals);
        self
    }
}

/// Angle between two vectors, accurate also near 0 and pi.
fn angle(a: Vec3, b: Vec3) -> f64 {
    fm::atan2(a.cross(b).length(), a.dot(b))
}
