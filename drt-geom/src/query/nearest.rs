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

/// Weights of vertices 1 and 2 at the point of a triangle nearest to `p`, by the Voronoi region of
/// the feature it lies in (Ericson 2005, "Real-Time Collision Detection", section 5.1.5).
fn nearest_weights([a, b, c]: [Vec3; 3], p: Vec3) -> [f64; 2] {
    let (ab, ac) = (b - a, c - a);
    let (d1, d2) = (ab.dot(p - a), ac.dot(p - a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [0.0, 0.0];
    }
    let (d3, d4) = (ab.dot(p - b), ac.dot(p - b));
    if d3 >= 0.0 && d4 <= d3 {
        return [1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return [d1 / (d1 - d3), 0.0];
    }
    let (d5, d6) = (ab.dot(p - c), ac.dot(p - c));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return [0.0, d2 / (d2 - d6)];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [1.0 - w, w];
    }
    let sum = va + vb + vc;
    [vb / sum, vc / sum]
}
