use drt_math::Vec3;

use super::TriangleBvh;

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
        let mut best: Option<(f64, ClosestPoint)> = None;
        let mut squared = f64::INFINITY;
        let per_length = self.frame.scale() * self.frame.scale();
        self.tree.as_ref()?.visit_near(self.frame.local(p), |leaf| {
            for slot in super::chain(&self.slots, leaf) {
                let triangle = slot.corners.map(Vec3::from);
                let bary = nearest_weights(triangle, p);
                let hit = super::Hit { t: 0.0, prim: slot.prim, bary };
                let point = hit.point(triangle);
                let d = (point - p).length_squared();
                if best.is_none_or(|(b, c)| (d, slot.prim) < (b, c.prim)) {
                    squared = d;
                    let prim = slot.prim;
                    best = Some((d, ClosestPoint { point, prim, bary, distance: 0.0 }));
                }
            }
            squared * per_length
        });
        best.map(|(_, c)| ClosestPoint { distance: (c.point - p).length(), ..c })
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
