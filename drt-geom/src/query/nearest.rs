use core::ops::ControlFlow;

use drt_math::Vec3;

use super::block::chain;
use super::lanes::Lanes;
use super::watertight::Corners;
use super::wide::Visitor;
use super::{Hit, TriangleBvh, Walk};

/// The point of a surface nearest to a given one.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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
    pub fn closest_point(&self, p: Vec3) -> Option<ClosestPoint> {
        if !p.is_finite() {
            return None;
        }
        let tree = self.tree.as_ref()?;
        let mut best = None;
        let visitor = Nearest { bvh: self, p, squared: f64::INFINITY, best: &mut best };
        self.machine.run(Walk { tree, query: self.frame.point(p), visitor });
        best.map(|c| ClosestPoint { distance: (c.point - p).length(), ..c })
    }
}

/// Finds the nearest point.
struct Nearest<'a> {
    bvh: &'a TriangleBvh,
    p: Vec3,
    /// The squared distance of the best point, which lacks its distance.
    squared: f64,
    best: &'a mut Option<ClosestPoint>,
}

impl Visitor for Nearest<'_> {
    #[inline(always)]
    fn announce<L: Lanes>(&self, lanes: L, index: usize) {
        lanes.prefetch(&self.bvh.blocks[index]);
    }
    #[inline(always)]
    fn block<L: Lanes>(&mut self, _lanes: L, index: usize) -> ControlFlow<(), f32> {
        let block = &self.bvh.blocks[index];
        for lane in 0..block.len() {
            self.test(block.prims[lane], &block.triangle(lane));
            for twin in chain(&self.bvh.twins, block.twins[lane]) {
                self.test(twin.prim, &twin.corners);
            }
        }
        let scale = self.bvh.frame.scale();
        // Never as far as boxes that are not there, whatever the arithmetic of absurd triangles gave.
        ControlFlow::Continue((self.squared * (scale * scale)).min(f32::MAX.into()) as f32)
    }
}

impl Nearest<'_> {
    fn test(&mut self, prim: u32, triangle: &Corners) {
        let triangle = triangle.map(Vec3::from);
        let bary = nearest_weights(triangle, self.p);
        let point = Hit { t: 0.0, prim, bary }.point(triangle);
        let d = (point - self.p).length_squared();
        if self.best.is_none_or(|c| (d, prim) < (self.squared, c.prim)) {
            self.squared = d;
            *self.best = Some(ClosestPoint { point, prim, bary, distance: 0.0 });
        }
    }
}

/// The point of a triangle nearest to `p`.
#[must_use]
pub fn nearest_point(triangle: [Vec3; 3], p: Vec3) -> Vec3 {
    let [u, v] = nearest_weights(triangle, p);
    let [a, b, c] = triangle;
    a * (1.0 - u - v) + b * u + c * v
}

/// Weights of vertices 1 and 2 at the point of a triangle nearest to `p`: the foot of the
/// perpendicular where that lies inside, else the nearest point of the three edges.
fn nearest_weights([a, b, c]: [Vec3; 3], p: Vec3) -> [f64; 2] {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let n = ab.cross(ac);
    let [u, v] = [ap.cross(ac).dot(n), ab.cross(ap).dot(n)].map(|x| x / n.length_squared());
    if u > 0.0 && v > 0.0 && u + v < 1.0 {
        return [u, v];
    }
    let along = |from: Vec3, to: Vec3| {
        let edge = to - from;
        ((p - from).dot(edge) / edge.length_squared()).clamp(0.0, 1.0)
    };
    let (s, t, r) = (along(a, b), along(b, c), along(a, c));
    let on_edges = [[s, 0.0], [1.0 - t, t], [0.0, r]];
    let distance = |[u, v]: [f64; 2]| (ab * u + ac * v - ap).length_squared();
    let nearer = |x, y| if distance(y) < distance(x) { y } else { x };
    nearer(nearer(on_edges[0], on_edges[1]), on_edges[2])
}
