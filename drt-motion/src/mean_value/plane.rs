//! A triangle seen from near its plane but beside it, where the closed form of
//! D = ∫ h / r⁴ dA is a difference of numbers of order one that is of order h².

use drt_math::{Vec3, fm};

use super::MeanValueWeight;
use super::edge::EdgeView;
use super::quadrature::GAUSS_12;
use super::triangle::{Local, Triangle};

/// Height over distance, within the plane, below which the closed form is avoided.
const FLAT: f64 = 0.01;

/// I = D / h and its gradient where the closed form would lose digits.
///
/// In polar coordinates (ρ, φ) around the projected point, with f = 1 / (ρ² + h²) on the triangle's
/// outline, the integrals over ρ are elementary and
///
/// ```text
/// ∫ dA / r⁴ = -½ ∮ f dφ,   ∂/∂h of it = h ∮ f² dφ.
/// ```
pub(super) fn integral(t: &Triangle, local: &Local, nearest: f64) -> Option<MeanValueWeight> {
    let (h, n) = (local.h, t.normal);
    // A corner that is not far enough away spares looking at the edges.
    if h.abs() >= FLAT * nearest {
        return None;
    }
    let q = local.d.map(|d| d - n * h);
    let areas = [0, 1, 2].map(|k| n.dot(q[(k + 1) % 3].cross(q[(k + 2) % 3])));
    let outside = areas.iter().any(|a| *a < 0.0);
    let beside = [0, 1, 2].iter().all(|&k| {
        let (start, e) = (q[(k + 1) % 3], t.edges[k]);
        let s = f64::clamp(-start.dot(e) / e.length_squared(), 0.0, 1.0);
        h.abs() < FLAT * (start + e * s).length()
    });
    if !(outside && beside) {
        return None;
    }
    let (mut i4, mut rate, mut across) = (0.0, 0.0, Vec3::ZERO);
    for k in 0..3 {
        let (qi, qj) = (q[(k + 1) % 3], q[(k + 2) % 3]);
        let edge = Outline::new(qi, qj, h);
        i4 -= 0.5 * areas[k] * edge.f;
        rate += areas[k] * edge.f_squared;
        // The flux of 1 / r⁴ through the edge: outward is e × n.
        across += n.cross(t.edges[k]) * edge.length;
    }
    Some(MeanValueWeight { value: i4, gradient: across - n * (h * rate) })
}

/// Integrals along an edge, with dφ divided by the signed doubled area it spans with the projected
/// point.
struct Outline {
    /// Of f.
    f: f64,
    /// Of f².
    f_squared: f64,
    /// Of ρ² f²: that of dl / r⁴ over the edge's length.
    length: f64,
}

impl Outline {
    fn new(qi: Vec3, qj: Vec3, h: f64) -> Self {
        let view = EdgeView::new(qi, qj);
        let angle = view.g * view.cross.length();
        let (ri, rj) = (qi.length(), qj.length());
        let mut sums = Self { f: 0.0, f_squared: 0.0, length: 0.0 };
        for (tau, weight) in GAUSS_12 {
            let part = |s: f64, r: f64| s * r * sinc(s * angle);
            // 1/ρ is a sine of φ.
            let inverse = view.g * (part(1.0 - tau, rj) + part(tau, ri));
            let c = inverse * inverse;
            let f = c / (1.0 + h * h * c);
            sums.f += weight * f;
            sums.f_squared += weight * f * f;
            sums.length += weight * f * f / c;
        }
        let Self { f, f_squared, length } = sums;
        Self { f: f * view.g, f_squared: f_squared * view.g, length: length * view.g }
    }
}

fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-4 { 1.0 - x * x / 6.0 } else { fm::sin(x) / x }
}
