//! What a triangle weighs at a point, by closed forms where these keep their digits.

use drt_math::{Mat3, Vec3};

use super::edge::EdgeView;
use super::triangle::{Local, Triangle};
use super::{Kernel, MeanValueWeight, far, plane};

/// A point nearer to a triangle than this, relative to its farthest corner, is on it: what rounding
/// of its coordinates would make of one that is.
const ON_SURFACE: f64 = 1e-13;

/// How often its longest edge a triangle must be away for its integrals to be summed numerically.
const FAR: f64 = 48.0;

/// What a triangle gives to its corners as seen from a point.
pub(super) enum View {
    /// The integrals of the hat functions of its corners.
    Apart([MeanValueWeight; 3]),
    /// The point is on the triangle, with these barycentric weights.
    On([MeanValueWeight; 3]),
}

impl Triangle {
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
