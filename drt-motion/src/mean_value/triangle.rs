use drt_math::Vec3;

use super::moments::Moments;
use super::{Kernel, MeanValueWeight};

/// Twice the area of a triangle over its squared longest edge below which it is taken for a line.
const LINE: f64 = 1e-15;

/// One triangle of a closed surface, with what does not depend on the point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    pub(super) corners: [Vec3; 3],
    /// The edge opposite to each corner, counter-clockwise.
    pub(super) edges: [Vec3; 3],
    pub(super) normal: Vec3,
    pub(super) double_area: f64,
    pub(super) longest: f64,
}

/// A point as a triangle sees it.
pub(super) struct Local {
    /// From the point to the corners.
    pub(super) d: [Vec3; 3],
    /// Height of the triangle's plane over the point, along the normal.
    pub(super) h: f64,
}

impl Triangle {
    pub(super) fn new(corners: [Vec3; 3]) -> Self {
        let [a, b, c] = corners;
        let edges = [c - b, a - c, b - a];
        let longest = edges.iter().fold(0.0, |l, e| f64::max(l, e.length()));
        // The two shorter edges lose the least.
        let k = (0..3).fold(0, |k, i| if edges[i].length() > edges[k].length() { i } else { k });
        let area = edges[(k + 1) % 3].cross(edges[(k + 2) % 3]);
        let double_area = area.length();
        let is_line = double_area <= LINE * longest * longest;
        let (normal, double_area) =
            if is_line { (Vec3::ZERO, 0.0) } else { (area / double_area, double_area) };
        Self { corners, edges, normal, double_area, longest }
    }

    /// Adds the moments about `middle` of the linear function with given values at the corners.
    pub(super) fn add_moments(
        &self,
        values: [f64; 3],
        middle: Vec3,
        kernel: Kernel,
        moments: &mut Moments,
    ) {
        // A rule of degree 3: the function times two coordinates.
        for (weight, one, others) in [(-27.0, 1.0 / 3.0, 1.0 / 3.0), (25.0, 0.6, 0.2)] {
            let nodes = if weight < 0.0 { 1 } else { 3 };
            for node in 0..nodes {
                let mut lambda = [others; 3];
                lambda[node] = one;
                let (mut place, mut value) = (-middle, 0.0);
                for l in 0..3 {
                    place += self.corners[l] * lambda[l];
                    value += values[l] * lambda[l];
                }
                let amount = weight / 96.0 * self.double_area * value;
                match kernel {
                    Kernel::MeanValue => moments.add(self.normal * amount, place),
                    Kernel::InverseDistance => moments.add_scalar(amount, place),
                }
            }
        }
    }

    /// Barycentric weights of the origin where it is within `tolerance` of the triangle, in whose
    /// plane it is; their gradients are those within the triangle.
    pub(super) fn on(&self, local: &Local, tolerance: f64) -> Option<[MeanValueWeight; 3]> {
        let gradients = self.barycentric_gradients();
        let weights = |values: [f64; 3]| {
            [0, 1, 2].map(|l| MeanValueWeight { value: values[l], gradient: gradients[l] })
        };
        for (k, e) in self.edges.into_iter().enumerate() {
            let [i, j] = [(k + 1) % 3, (k + 2) % 3];
            let length_squared = e.length_squared();
            let t = if length_squared > 0.0 { -local.d[i].dot(e) / length_squared } else { 0.0 };
            let t = t.clamp(0.0, 1.0);
            if (local.d[i] * (1.0 - t) + local.d[j] * t).length() <= tolerance {
                let mut values = [0.0; 3];
                (values[i], values[j]) = (1.0 - t, t);
                return Some(weights(values));
            }
        }
        let values = self.barycentric(&local.d);
        let inside = self.double_area > 0.0 && values.iter().all(|v| *v >= 0.0);
        inside.then(|| weights(values))
    }

    /// Barycentric weights of the projection of the origin on the plane.
    fn barycentric(&self, d: &[Vec3; 3]) -> [f64; 3] {
        [0, 1, 2].map(|k| self.normal.dot(d[(k + 1) % 3].cross(d[(k + 2) % 3])) / self.double_area)
    }

    pub(super) fn barycentric_gradients(&self) -> [Vec3; 3] {
        if self.double_area == 0.0 {
            return [Vec3::ZERO; 3];
        }
        self.edges.map(|e| self.normal.cross(e) / self.double_area)
    }
}
