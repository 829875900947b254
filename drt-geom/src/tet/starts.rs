use alloc::vec::Vec;

use drt_math::{Vec3, fm, vec3};

use crate::{Aabb, NONE};

/// Tetrahedra for each cell; more start nearer to the point, fewer stay in the caches.
const PER_CELL: f64 = 2.0;

/// Most cells along an axis.
const LONGEST: f64 = 256.0;

/// A lattice over the domain that knows for each cell where to begin a walk.
#[derive(Clone, Debug)]
pub(super) struct Starts {
    min: Vec3,
    per_length: Vec3,
    size: [usize; 3],
    places: Vec<u32>,
}

impl Starts {
    /// For so many tetrahedra within `bounds`; `find` gives the place of the one at a point.
    pub(super) fn new(bounds: &Aabb, tets: usize, find: impl Fn(Vec3) -> Option<u32>) -> Self {
        let extent = bounds.extent();
        let volume = extent.x * extent.y * extent.z;
        let edge = fm::cbrt(volume * PER_CELL / tets as f64);
        let cells = |length: f64| {
            let n = length / edge;
            if n >= 1.0 { f64::min(n, LONGEST) as usize } else { 1 }
        };
        let size = [extent.x, extent.y, extent.z].map(cells);
        let cell = |axis: usize| extent[axis] / size[axis] as f64;
        let cell = vec3(cell(0), cell(1), cell(2));
        let inverse = |length: f64| if length > 0.0 { 1.0 / length } else { 0.0 };
        let per_length = vec3(inverse(cell.x), inverse(cell.y), inverse(cell.z));
        let [nx, ny, nz] = size;
        let places = (0..nx * ny * nz).map(|i| {
            let at = vec3((i % nx) as f64, (i / nx % ny) as f64, (i / nx / ny) as f64);
            let middle = at + Vec3::splat(0.5);
            let offset = vec3(middle.x * cell.x, middle.y * cell.y, middle.z * cell.z);
            find(bounds.min + offset).unwrap_or(NONE)
        });
        Self { min: bounds.min, per_length, size, places: places.collect() }
    }

    /// Where to begin, for any point.
    #[inline]
    pub(super) fn near(&self, x: Vec3) -> u32 {
        let off = x - self.min;
        // Negative numbers and NaN become 0.
        let index = |axis: usize| {
            usize::min((off[axis] * self.per_length[axis]) as usize, self.size[axis] - 1)
        };
        let [nx, ny, _] = self.size;
        self.places[index(0) + nx * (index(1) + ny * index(2))]
    }
}
