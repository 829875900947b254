use core::ops::ControlFlow;

use drt_math::{Vec3, vec3};

use super::block::{BLOCK, chain};
use super::lanes::{Array, Lanes, Vector};
use super::watertight::Corners;
use super::wide::Visitor;
use super::{TriangleBvh, Walk};
use crate::NONE;

/// The point of a surface nearest to a given one.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ClosestPoint {
    /// The point on the surface.
    pub point: Vec3,
    /// The triangle it lies on; the lowest-numbered of several.
    pub prim: u32,
    /// Weights of the triangle's vertices 1 and 2.
    pub bary: [f64; 2],
    /// Its distance from the given point.
    pub distance: f64,
}

impl TriangleBvh {
    /// The point of the surface nearest to `p`; `None` without triangles or for a `p` that is not
    /// finite.
    #[must_use]
    pub fn closest_point(&self, p: impl Into<Vec3>) -> Option<ClosestPoint> {
        self.closest_point_within(p, f64::INFINITY)
    }

    /// [`TriangleBvh::closest_point`] if its distance is less than `radius`: the less, the faster.
    #[must_use]
    pub fn closest_point_within(&self, p: impl Into<Vec3>, radius: f64) -> Option<ClosestPoint> {
        self.nearest(p.into(), radius)
    }

    fn nearest(&self, p: Vec3, radius: f64) -> Option<ClosestPoint> {
        if !p.is_finite() || radius.is_nan() {
            return None;
        }
        let tree = self.tree.as_ref()?;
        let squared = radius * radius;
        let mut best = ClosestPoint { point: p, prim: NONE, bary: [0.0; 2], distance: 0.0 };
        let visitor = Nearest { bvh: self, p, squared, best: &mut best };
        self.machine.run(Walk { tree, query: self.frame.point(p, squared), visitor });
        best.distance = (best.point - p).length();
        (best.prim != NONE).then_some(best)
    }
}

/// Finds the nearest point.
struct Nearest<'a> {
    bvh: &'a TriangleBvh,
    p: Vec3,
    /// The squared distance of the best point, which lacks its distance.
    squared: f64,
    best: &'a mut ClosestPoint,
}

impl Visitor for Nearest<'_> {
    #[inline(always)]
    fn announce<L: Lanes>(&self, lanes: L, index: usize) {
        lanes.prefetch(&self.bvh.blocks[index]);
    }
    #[inline(always)]
    fn block<L: Lanes>(&mut self, lanes: L, index: usize) -> ControlFlow<(), f32> {
        let block = &self.bvh.blocks[index];
        let p = [lanes.double(self.p.x), lanes.double(self.p.y), lanes.double(self.p.z)];
        let units = [lanes.double(0.0), lanes.double(1.0)];
        let Foot { bary, point, squared } = foot(units, &block.corners(lanes), p);
        let mut mask = squared.le(lanes.double(self.squared));
        if mask != 0 {
            let squared = squared.array();
            let bary = [bary[0].array(), bary[1].array()];
            let point = [point[0].array(), point[1].array(), point[2].array()];
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize % BLOCK;
                mask &= mask - 1;
                let point = vec3(point[0][lane], point[1][lane], point[2][lane]);
                let bary = [bary[0][lane], bary[1][lane]];
                self.compare(block.prims[lane], bary, point, squared[lane]);
            }
        }
        if !self.bvh.twins.is_empty() {
            for twin in block.twins.iter().flat_map(|first| chain(&self.bvh.twins, *first)) {
                let Foot { bary, point, squared } = foot_of(twin.corners, self.p);
                self.compare(twin.prim, bary.map(one), point.map(one).into(), one(squared));
            }
        }
        ControlFlow::Continue(self.bvh.frame.squared(self.squared))
    }
}

impl Nearest<'_> {
    #[inline]
    fn compare(&mut self, prim: u32, bary: [f64; 2], point: Vec3, squared: f64) {
        if (squared, prim) < (self.squared, self.best.prim) {
            self.squared = squared;
            *self.best = ClosestPoint { point, prim, bary, distance: 0.0 };
        }
    }
}

/// The point of a triangle nearest to `p`.
#[must_use]
pub fn nearest_point(triangle: [impl Into<Vec3>; 3], p: impl Into<Vec3>) -> Vec3 {
    foot_of(triangle.map(|v| v.into().to_array()), p.into()).point.map(one).into()
}

/// The point of a triangle nearest to another.
struct Foot<V> {
    /// Weights of vertices 1 and 2.
    bary: [V; 2],
    /// The point, as [`Hit::point`](super::Hit::point) has it.
    point: [V; 3],
    /// Its squared distance.
    squared: V,
}

/// [`foot`] of one triangle.
fn foot_of(triangle: Corners, p: Vec3) -> Foot<Array<f64, 1>> {
    let number = |x| Array([x]);
    let units = [0.0, 1.0].map(number);
    foot(units, &triangle.map(|v| v.map(number)), p.to_array().map(number))
}

fn one(x: Array<f64, 1>) -> f64 {
    x.array()[0]
}

/// The points of triangles nearest to `p`: the foot of the perpendicular where that lies inside, else
/// the nearest point of the three edges. `zero` and `one` are the numbers.
#[inline(always)]
fn foot<V: Vector<f64, N>, const N: usize>(
    [zero, one]: [V; 2],
    [a, b, c]: &[[V; 3]; 3],
    p: [V; 3],
) -> Foot<V> {
    let (ab, ac, ap) = (sub(*b, *a), sub(*c, *a), sub(p, *a));
    let n = cross(ab, ac);
    let nn = dot(n, n);
    let (u, v) = (dot(cross(ap, ac), n) / nn, dot(cross(ab, ap), n) / nn);
    // The least weight; NaN if any is, and then not positive.
    let inside = u.min(v).min(one - (u + v));

    let s = clamp(zero, one, dot(ap, ab) / dot(ab, ab));
    let r = clamp(zero, one, dot(ap, ac) / dot(ac, ac));
    let bc = sub(*c, *b);
    let t = clamp(zero, one, dot(sub(p, *b), bc) / dot(bc, bc));
    let (mut best, mut least) = ([s, zero], offset([s, zero], ab, ac, ap));
    for on_edge in [[one - t, t], [zero, r]] {
        let d = offset(on_edge, ab, ac, ap);
        best = [d.less(least, on_edge[0], best[0]), d.less(least, on_edge[1], best[1])];
        least = d.less(least, d, least);
    }
    let bary = [zero.less(inside, u, best[0]), zero.less(inside, v, best[1])];

    let rest = one - bary[0] - bary[1];
    let x = a[0] * rest + b[0] * bary[0] + c[0] * bary[1];
    let y = a[1] * rest + b[1] * bary[0] + c[1] * bary[1];
    let z = a[2] * rest + b[2] * bary[0] + c[2] * bary[1];
    let point = [x, y, z];
    let away = sub(point, p);
    Foot { bary, point, squared: dot(away, away) }
}

/// Squared distance of the point of the given weights from the one at `ap`.
#[inline(always)]
fn offset<V: Vector<f64, N>, const N: usize>(
    [u, v]: [V; 2],
    ab: [V; 3],
    ac: [V; 3],
    ap: [V; 3],
) -> V {
    let x = ab[0] * u + ac[0] * v - ap[0];
    let y = ab[1] * u + ac[1] * v - ap[1];
    let z = ab[2] * u + ac[2] * v - ap[2];
    dot([x, y, z], [x, y, z])
}

#[inline(always)]
fn clamp<V: Vector<f64, N>, const N: usize>(zero: V, one: V, x: V) -> V {
    x.max(zero).min(one)
}

#[inline(always)]
pub(super) fn sub<V: Vector<f64, N>, const N: usize>(a: [V; 3], b: [V; 3]) -> [V; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(super) fn dot<V: Vector<f64, N>, const N: usize>(a: [V; 3], b: [V; 3]) -> V {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(super) fn cross<V: Vector<f64, N>, const N: usize>(a: [V; 3], b: [V; 3]) -> [V; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
