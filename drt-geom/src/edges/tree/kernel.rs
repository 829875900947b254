//! The angular speed of a line's points, sampled exactly.
//!
//! A point at t on a line that passes x at the distance d has r^2 = d^2 + t^2, and the line is seen
//! at an angle of sine d / r. The kernel of an edge integral is then
//!
//! ```text
//! sin / r^2 = d / r^3,    ∫ d / r^3 dt = (1/d) t/r = sin(θ) / d,
//! ```
//!
//! θ the angle at x from the line's nearest point: uniform in sin θ, where equiangular sampling
//! (Kulla & Fajardo 2012) is uniform in θ and leaves a factor 1/r. Near sin θ = ±1, which is all
//! there is of a line almost towards x, its distance from there is used:
//! 1 - t/r = d^2 / (r (r + t)).

use drt_math::Real;

/// A part of a line as seen from a point, in distances along it from where the point is nearest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kernel {
    pub(super) near: f64,
    pub(super) far: f64,
    /// How near the line passes.
    d: f64,
}

/// The third power of this is still a normal number.
const SHORTEST: f64 = 1e-100;

impl Kernel {
    /// The part from `near` to `far`, of which the latter should be more. A line that passes nearer
    /// than a 1e-9th of the distance of the part's farther end is taken to pass at that distance:
    /// sampling and density remain a pair, and finite.
    pub(super) fn new(distance: f64, near: f64, far: f64) -> Self {
        let d = distance.max(1e-9 * f64::max(near.abs(), far.abs())).max(SHORTEST);
        Self { near, far, d }
    }

    /// How far the part's nearest point is.
    pub(super) fn distance(&self) -> f64 {
        radius(self.d, f64::min(0.0, self.far).max(self.near))
    }

    /// Integral of d / r^3.
    pub(super) fn mass(&self) -> f64 {
        let Self { near, far, d } = *self;
        if near >= far {
            return 0.0;
        }
        let [r0, r1] = [near, far].map(|t| radius(d, t));
        if near * far < 0.0 {
            return (far / r1 - near / r0) / d;
        }
        // The same without the difference of two numbers near one.
        let [a, b] = [near.abs(), far.abs()];
        d * (far - near) * (a + b) / ((b * r0 + a * r1) * r0 * r1)
    }

    /// The point for a uniform number.
    pub(super) fn sample(&self, u: f64) -> f64 {
        let Self { near, far, d } = *self;
        let t = if near * far < 0.0 {
            let [s0, s1] = [near, far].map(|t| t / radius(d, t));
            let s = s0 + (s1 - s0) * u;
            d * s / Real::sqrt((1.0 - s) * (1.0 + s))
        } else {
            let [q0, q1] = [near, far].map(|t| {
                let (r, t) = (radius(d, t), t.abs());
                d * d / (r * (r + t))
            });
            let q = q0 + (q1 - q0) * u;
            let t = d * (1.0 - q) / Real::sqrt(q * (2.0 - q));
            if far > 0.0 { t } else { -t }
        };
        t.clamp(near, far)
    }

    /// Density per length on the part.
    pub(super) fn pdf(&self, t: f64) -> f64 {
        let r = radius(self.d, t);
        self.d / (r * r * r * self.mass())
    }
}

fn radius(d: f64, t: f64) -> f64 {
    Real::sqrt(d * d + t * t)
}
