use super::lanes::{Lanes, Vector};
use super::watertight::{Corners, ShearedRay};
use crate::NONE;

/// Triangles in a block: as many as are tested together.
pub(super) const BLOCK: usize = 4;

/// Up to four neighbouring triangles, a leaf of the tree.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Block {
    /// By corner, axis and triangle; NaN in places that are empty, so that nothing is found there.
    corners: [[[f64; BLOCK]; 3]; 3],
    /// The triangles' numbers.
    pub(super) prims: [u32; BLOCK],
    /// The first of the twins of each (see [`Twin`]), or [`NONE`].
    pub(super) twins: [u32; BLOCK],
}

/// A triangle with the same three corner positions as one that is in a block, in whatever order.
/// Twins are no leaves of their own: coincident boxes would make trees deep and useless.
#[derive(Clone, Copy, Debug)]
pub(super) struct Twin {
    pub(super) corners: Corners,
    pub(super) prim: u32,
    /// The next twin of the same triangle, or [`NONE`].
    pub(super) next: u32,
}

impl Block {
    pub(super) const EMPTY: Self =
        Self { corners: [[[f64::NAN; BLOCK]; 3]; 3], prims: [NONE; BLOCK], twins: [NONE; BLOCK] };

    /// Puts a triangle in a place.
    pub(super) fn set(&mut self, lane: usize, prim: u32, triangle: &Corners) {
        self.prims[lane] = prim;
        for (rows, corner) in self.corners.iter_mut().zip(triangle) {
            for (row, x) in rows.iter_mut().zip(corner) {
                row[lane] = *x;
            }
        }
    }

    /// The triangle in a place.
    #[inline(always)]
    pub(super) fn triangle(&self, lane: usize) -> Corners {
        let mut triangle = [[0.0; 3]; 3];
        for (corner, rows) in triangle.iter_mut().zip(&self.corners) {
            for (x, row) in corner.iter_mut().zip(rows) {
                *x = row[lane];
            }
        }
        triangle
    }

    /// How many places are taken, from the first.
    pub(super) fn len(&self) -> usize {
        self.prims.iter().take_while(|p| **p != NONE).count()
    }

    /// The triangles' corners, for lanes.
    #[inline(always)]
    pub(super) fn corners<L: Lanes>(&self, lanes: L) -> [[L::Doubles; 3]; 3] {
        let [a, b, c] = &self.corners;
        [load(lanes, a), load(lanes, b), load(lanes, c)]
    }

    /// The places, as bits, whose triangles the ray's line may cross: all for which
    /// [`ShearedRay::cross`] says so, and hardly any else.
    #[inline(always)]
    pub(super) fn crossed<L: Lanes>(&self, lanes: L, ray: &ShearedRay) -> u32 {
        let [a, b, c] = &self.corners;
        let (a, b, c) = (project(lanes, ray, a), project(lanes, ray, b), project(lanes, ray, c));
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        let zero = lanes.double(0.0);
        zero.le(u.min(v).min(w)) | u.max(v).max(w).le(zero)
    }
}

#[inline(always)]
fn load<L: Lanes>(lanes: L, [x, y, z]: &[[f64; BLOCK]; 3]) -> [L::Doubles; 3] {
    [lanes.doubles(x), lanes.doubles(y), lanes.doubles(z)]
}

/// Corners seen along the ray, as in [`ShearedRay::cross`]. (A function, because what a closure
/// does with lanes is not always compiled in place.)
#[inline(always)]
fn project<L: Lanes>(lanes: L, ray: &ShearedRay, corner: &[[f64; BLOCK]; 3]) -> [L::Doubles; 2] {
    let [x, y, z] = ray.axes;
    let h = lanes.doubles(&corner[z]) - lanes.double(ray.origin[z]);
    let px = lanes.doubles(&corner[x]) - lanes.double(ray.origin[x]);
    let py = lanes.doubles(&corner[y]) - lanes.double(ray.origin[y]);
    [px - lanes.double(ray.shear[0]) * h, py - lanes.double(ray.shear[1]) * h]
}

/// The twins from one on.
pub(super) fn chain(twins: &[Twin], first: u32) -> impl Iterator<Item = &Twin> {
    let next = |twin: &&Twin| twins.get(twin.next as usize);
    core::iter::successors(twins.get(first as usize), next)
}

#[cfg(test)]
mod tests {
    use drt_math::{Ray, Rng, vec3};

    use super::{BLOCK, Block};
    use crate::query::lanes::{Lanes, Machine, Task};
    use crate::query::watertight::ShearedRay;

    struct Crossed<'a>(&'a Block, &'a ShearedRay, &'a mut u32);

    impl Task for Crossed<'_> {
        type Output = ();

        fn run<L: Lanes>(self, lanes: L) {
            *self.2 = self.0.crossed(lanes, self.1);
        }
    }

    #[test]
    fn no_crossing_is_lost_in_a_block() {
        let mut rng = Rng::new(1, 0, 0);
        let (mut crossings, mut more) = (0, 0);
        for i in 0..100_000 {
            // Coordinates that are often the same make ties.
            let mut point = || {
                let mut x = || match i % 2 {
                    0 => f64::from(rng.next_u32() % 5) - 2.0,
                    _ => rng.next_f64() * 4.0 - 2.0,
                };
                [x(), x(), x()]
            };
            let [ox, oy, oz] = point();
            let [dx, dy, dz] = point();
            let ray = Ray::new(vec3(ox, oy, oz), vec3(dx, dy, dz + 0.25));
            let ray = ShearedRay::new(&ray);
            let mut block = Block::EMPTY;
            for lane in 0..i % (BLOCK + 1) {
                block.set(lane, lane as u32, &[point(), point(), point()]);
            }
            let mut expected = 0;
            for lane in 0..block.len() {
                expected |= u32::from(ray.cross(&block.triangle(lane)).is_some()) << lane;
            }
            for machine in [Machine::Portable, Machine::detect()] {
                let mut mask = 0;
                machine.run(Crossed(&block, &ray, &mut mask));
                assert_eq!(mask & expected, expected);
                assert!(mask < 1 << block.len());
                more += (mask & !expected).count_ones();
            }
            crossings += expected.count_ones();
        }
        assert!(crossings > 10_000 && more < crossings, "{crossings} {more}");
    }
}
