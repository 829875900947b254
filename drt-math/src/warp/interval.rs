use core::f64::consts::{FRAC_2_PI, PI};

use crate::fm;

/// A number from the tent filter of the given (positive) radius: density falling linearly from 0 to both
/// ends of [-radius, radius].
#[inline]
#[must_use]
pub fn tent(u: f64, radius: f64) -> f64 {
    let x = if u < 0.5 { fm::sqrt(2.0 * u) - 1.0 } else { 1.0 - fm::sqrt(2.0 - 2.0 * u) };
    x * radius
}

/// Density of [`tent`]: `max(0, 1 - |x| / radius) / radius`.
#[inline]
#[must_use]
pub fn tent_pdf(x: f64, radius: f64) -> f64 {
    (1.0 - x.abs() / radius).max(0.0) / radius
}

/// A polar angle in [0, pi] with density proportional to `sin^2`: how directions are spread over an
/// edge, whose apparent length and whose emission pattern each bring one sine.
#[inline]
#[must_use]
pub fn sin_squared_polar(u: f64) -> f64 {
    // With x = 2 theta the CDF is (x - sin x) / (2 pi), symmetric about u = 1/2.
    if u <= 0.5 { 0.5 * unsubtract_sine(2.0 * PI * u) } else { PI - sin_squared_polar(1.0 - u) }
}

/// Density of [`sin_squared_polar`] in the angle: `(2 / pi) sin^2(theta)` on [0, pi].
#[inline]
#[must_use]
pub fn sin_squared_polar_pdf(theta: f64) -> f64 {
    if !(0.0..=PI).contains(&theta) {
        return 0.0;
    }
    let s = fm::sin(theta);
    FRAC_2_PI * s * s
}

/// The `x` in [0, pi] with `x - sin(x) = m`, for `m` in [0, pi]: Kepler's equation at
/// eccentricity one.
fn unsubtract_sine(m: f64) -> f64 {
    // The inverse of the power series x^3/6 - x^5/120 + ..., in powers of the cube root of 6 m.
    let s = fm::cbrt(6.0 * m);
    let s2 = s * s;
    let mut x = s * (1.0 + s2 * (1.0 / 60.0 + s2 * (1.0 / 1400.0 + s2 / 25_200.0)));
    let (mut low, mut high) = (0.0, PI);
    // The left-hand side is convex, so Newton converges from any side; the bracket guards it
    // against rounding where the slope vanishes.
    for _ in 0..MAX_STEPS {
        if !(low..=high).contains(&x) {
            x = 0.5 * (low + high);
        }
        let error = x_minus_sin(x) - m;
        if error > 0.0 {
            high = x;
        } else {
            low = x;
        }
        let half = fm::sin(0.5 * x);
        let slope = 2.0 * half * half;
        if slope == 0.0 {
            break;
        }
        let step = error / slope;
        x -= step;
        if step.abs() <= f64::EPSILON * x.abs() {
            break;
        }
    }
    x.clamp(low, high)
}

/// Bisection alone, the worst case, reaches the last bit in as many.
const MAX_STEPS: u32 = 53;

/// `x - sin(x)` without cancellation near zero.
fn x_minus_sin(x: f64) -> f64 {
    if x > 1.0 {
        return x - fm::sin(x);
    }
    // x^3/3! - x^5/5! + ...: the next term left out is below 1/19! < 1e-17.
    let x2 = x * x;
    let mut sum = 0.0;
    for k in [17.0, 15.0, 13.0, 11.0, 9.0, 7.0, 5.0] {
        sum = x2 / (k * (k - 1.0)) * (1.0 - sum);
    }
    x * x2 / 6.0 * (1.0 - sum)
}
