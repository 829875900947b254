//! Weights of auxiliary samples.

use drt_math::{Real, Vec3, fm};

use crate::model::settings::WarpKernel;

/// σ_0 of the 2023 paper, over half the diagonal of the scene's box.
pub(super) const SIGMA: f64 = 0.006;

/// Standard deviation in radians of samples for the distance of 2020, which knows no length.
pub(super) const WIDE: f64 = 0.05;

/// A distance between a vertex and a sample, D, and its gradient by the vertex or the direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Distance {
    pub(super) value: f64,
    pub(super) gradient: Vec3,
}

impl Distance {
    /// (1 - exp(-s)) times `scale`, s and `scale` with their gradients (2023 paper, Eqs. 16 and 17, without the exponent).
    pub(super) fn saturating((s, ds): (f64, Vec3), (scale, dscale): (f64, Vec3)) -> Self {
        let e = fm::exp(-s);
        Self { value: (1.0 - e) * scale, gradient: ds * (e * scale) + dscale * (1.0 - e) }
    }

    /// exp(1 - c) - 1, c being the cosine of the angle between two directions (2023 paper, Eq. 57).
    pub(super) fn of_cosine(c: f64, dc: Vec3) -> Self {
        let e = fm::exp(1.0 - c);
        Self { value: e - 1.0, gradient: dc * -e }
    }
}

/// w = (D + B)^-γ and its gradient; B is the boundary test.
pub(super) fn weight(kernel: WarpKernel, d: Distance, boundary: f64) -> (f64, Vec3) {
    let power = |d: Distance, n: i32| Distance {
        value: Real::powi(d.value, n),
        gradient: d.gradient * (f64::from(n) * Real::powi(d.value, n - 1)),
    };
    let d = if kernel == WarpKernel::Year2023 { power(d, 3) } else { d };
    let gamma = if kernel == WarpKernel::Corrected { 3 } else { 1 };
    // A sample on a boundary under the vertex itself counts as good as alone.
    let sum = f64::max(d.value + boundary, 1e-60);
    let w = 1.0 / Real::powi(sum, gamma);
    (w, d.gradient * (-f64::from(gamma) * w / sum))
}
