use drt_math::{Mat3, Vec3};

use super::edge::EdgeView;
use super::moments::Moments;
use super::{Kernel, MeanValueWeight, far, plane};

/// A point nearer to a triangle than this, relative to its farthest corner, is on it: what rounding
/// of its coordinates would make of one that is.
const ON_SURFACE: f64 = 1e-13;

/// How often its longest edge a triangle must be away for its integrals to be summed numerically.
const FAR: f64 = 48.0;

/// Twice the area of a triangle over its squared longest edge below which it is taken for a line.
const LINE: f64 = 1e-15;

/// One triangle of a closed surface, with what does not depend on the point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    corners: [Vec3; 3],
    /// The edge opposite to each corner, counter-clockwise.
    pub(super) edges: [Vec3; 3],
    pub(super) normal: Vec3,
    pub(super) double_area: f64,
    longest: f64,
}

/// What a triangle gives to its corners as seen from a point.
pub(super) enum View {
    /// The integrals of the hat functions of its corners.
    Apart([MeanValueWeight; 3]),
    /// The point is on the triangle, with these barycentric weights.
    On([MeanValueWeight; 3]),
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

    /// The triangle from `x`: for each corner
    ///
    /// ```text
    /// w = ∫ φ n·(y - x) / |y - x|⁴ dA(y),   φ = 1 at this corner, 0 at the others, linear,
    /// ```
    ///
    /// or the same without the factor n·(y - x), by the kernel.
    pub(super) fn view(&self, x: Vec3, kernel: Kernel) -> View {
        let zero = [MeanValueWeight::default(); 3];
        let d = self.corners.map(|p| p - x);
        let lengths = d.map(Vec3::length);
        let nearest = (0..3).fold(0, |k, i| if lengths[i] < lengths[k] { i } else { k });
        let farthest = lengths.into_iter().fold(0.0, f64::max);
        let local = Local { d, h: self.normal.dot(d[nearest]) };
        let tolerance = ON_SURFACE * farthest;
        if local.h.abs() <= tolerance
            && let Some(on) = self.on(&local, tolerance)
        {
            return View::On(on);
        }
        if self.double_area == 0.0 {
            return View::Apart(zero);
        }
        if lengths[nearest] > FAR * self.longest {
            return View::Apart(far::weights(self, &local, kernel));
        }
        View::Apart(self.weights(&local, lengths[nearest], kernel))
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
    fn on(&self, local: &Local, tolerance: f64) -> Option<[MeanValueWeight; 3]> {
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

    /// With d_i = h n + q_i split along the normal, and g = θ / |d_i × d_j| of each edge,
    ///
    /// ```text
    /// w_l = λ_l D + h (e_l · Σ_k g_k e_k) / 4A,   D = ∫ h / r⁴ dA = Σ_k g_k a_k / 2h,
    /// ```
    ///
    /// where e_l is the edge opposite to corner l, λ_l the barycentric weight of the projected point
    /// and a_l = 2A λ_l. This is the solution of Σ w_l d_l = m by Ju, Schaefer and Warren 2005 (§3.2)
    /// written so that nothing but D loses digits near the plane. As h is the same all over the triangle,
    /// the weights without it in the kernel are
    ///
    /// ```text
    /// w_l / h = λ_l I + (e_l · Σ_k g_k e_k) / 4A,   I = ∫ 1 / r⁴ dA = Σ_k g_k a_k / 2h².
    /// ```
    fn weights(&self, local: &Local, nearest: f64, kernel: Kernel) -> [MeanValueWeight; 3] {
        let (d, h) = (&local.d, local.h);
        let n = self.normal;
        let views = [0, 1, 2].map(|k| EdgeView::new(d[(k + 1) % 3], d[(k + 2) % 3]));
        let signed = matches!(kernel, Kernel::MeanValue);
        let beside = plane::integral(self, local, nearest).map(|i| {
            if signed {
                MeanValueWeight { value: h * i.value, gradient: i.gradient * h - n * i.value }
            } else {
                i
            }
        });
        let whole = beside.unwrap_or_else(|| {
            let mut sum = 0.0;
            let mut gradient = Vec3::ZERO;
            for (v, e) in views.iter().zip(self.edges) {
                let a = n.dot(v.cross);
                sum += v.g * a;
                gradient += v.gradient * a + n.cross(e) * v.g;
            }
            let half = 0.5 / h;
            if signed {
                MeanValueWeight { value: sum * half, gradient: (gradient + n * (sum / h)) * half }
            } else {
                let gradient = (gradient + n * (2.0 * sum / h)) * (half / h);
                MeanValueWeight { value: sum * half / h, gradient }
            }
        });
        // Summed before it is projected on the edges: only so do the errors of a needle's weights
        // cancel in linear functions.
        let mut turn = Vec3::ZERO;
        let mut turn_gradient = Mat3::ZERO;
        for (v, e) in views.iter().zip(self.edges) {
            turn += e * v.g;
            for k in 0..3 {
                turn_gradient.cols[k] += v.gradient * e[k];
            }
        }
        let inverse = 1.0 / self.double_area;
        [0, 1, 2].map(|l| {
            let opposite = self.edges[l];
            let lambda = n.dot(views[l].cross) * inverse;
            let (turned, turned_gradient) = if signed {
                let value = 0.5 * h * turn.dot(opposite) * inverse;
                let gradient = turn_gradient * opposite * h - n * turn.dot(opposite);
                (value, gradient * (0.5 * inverse))
            } else {
                let value = 0.5 * turn.dot(opposite) * inverse;
                (value, turn_gradient * opposite * (0.5 * inverse))
            };
            let value = lambda * whole.value + turned;
            let gradient = whole.gradient * lambda
                + n.cross(opposite) * (whole.value * inverse)
                + turned_gradient;
            MeanValueWeight { value, gradient }
        })
    }
}
