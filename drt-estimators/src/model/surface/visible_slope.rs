//! Beckmann slopes as seen from a direction.
//!
//! Heitz & d'Eon 2014, "Importance Sampling Microfacet-Based BSDFs using the Distribution of Visible
//! Normals": at roughness one, the slope `p` towards a direction of cosine `c` and sine `s` is seen
//! with density proportional to `(s p + c)⁺ exp(-p²)`, and the other slope is Gaussian.

use core::f64::consts::FRAC_PI_4;

use drt_math::fm;

/// sqrt(pi)
pub(super) const SQRT_PI: f64 = 1.772_453_850_905_516;

/// `exp(x²) erfc(x)` for x >= 0, with a relative error below 2e-9.
///
/// In t = 1 / (1 + x/2) the quotient by t is smooth on [0, 1]; the coefficients interpolate it at
/// Chebyshev points.
#[inline]
pub(super) fn erfc_scaled(x: f64) -> f64 {
    const EVEN: [f64; 7] = [
        0.282_094_792_003_41,
        0.246_836_833_531_86,
        0.084_285_718_457_183,
        -0.065_777_222_750_475,
        -0.280_041_871_516_06,
        -0.510_431_760_187_28,
        -0.036_053_648_791_38,
    ];
    const ODD: [f64; 6] = [
        0.282_094_715_536_09,
        0.176_238_997_142_94,
        -0.005_591_836_963_112_5,
        0.024_762_004_543_429,
        0.587_850_698_713_58,
        0.213_732_579_472_36,
    ];
    let t = 1.0 / (1.0 + 0.5 * x);
    let t2 = t * t;
    // Two chains of half the length run side by side.
    let horner = |c: &[f64]| c.iter().rev().fold(0.0, |acc, c| acc * t2 + c);
    t * (horner(&EVEN) + t * horner(&ODD))
}

/// Draws the slope towards the direction of cosine `cos` and sine `sin`, both at least 0; `cos = 1`
/// gives a Gaussian of variance 1/2.
///
/// Solves `Q(p) = u Q(-inf)` for `Q(p)`, the integral of the density from `p` on, by Newton's method
/// on functions whose concavity makes it monotone, after at most one step: it needs no bracket.
pub(super) fn visible_slope(cos: f64, sin: f64, u: f64) -> f64 {
    let tail = 0.5 * SQRT_PI * cos;
    let at_zero = 0.5 * sin + tail;
    let target = u * visible_area(cos, sin) * SQRT_PI;
    if target < at_zero {
        // For p >= 0, ln Q = ln(scaled(p)) - p².
        let scaled = |p: f64| 0.5 * sin + tail * erfc_scaled(p);
        let level = fm::ln(target);
        let grazing = 0.5 * sin / at_zero;
        let mut p = grazing * fm::sqrt((fm::ln(at_zero) - level).max(0.0))
            + (1.0 - grazing) * erfc_inverse_guess(target / at_zero);
        for _ in 0..MAX_STEPS {
            let q = scaled(p);
            let step = (fm::ln(q) - p * p - level) * q / (sin * p + cos);
            p = (p + step).max(0.0);
            if step.abs() < TOLERANCE {
                break;
            }
        }
        p
    } else {
        // At p = -t the integral from 0 to t is concave in t, up to the horizon t = cos / sin. With
        // `cos` for the density's first factor the start is short of the root.
        let wanted = target - at_zero;
        let mut t = erfc_inverse_guess((1.0 - wanted / tail).max(f64::EPSILON));
        for _ in 0..MAX_STEPS {
            let e = fm::exp(-t * t);
            let have = tail - 0.5 * sin + e * (0.5 * sin - tail * erfc_scaled(t));
            let step = (wanted - have) / ((cos - sin * t) * e);
            // At the horizon the quotient is all rounding.
            if step.is_nan() || step < 0.0 {
                break;
            }
            t += step;
            if step < TOLERANCE {
                break;
            }
        }
        -t
    }
}

/// Newton's steps end below this; convergence is quadratic.
const TOLERANCE: f64 = 1e-4;
const MAX_STEPS: usize = 64;

/// A bound from below, within 12 %, of the x >= 0 whose erfc is `v`, from
/// `erf(x)² <= 1 - exp(-4 x² / pi)` (Pólya 1945).
fn erfc_inverse_guess(v: f64) -> f64 {
    fm::sqrt((-FRAC_PI_4 * fm::ln(v * (2.0 - v))).max(0.0))
}

/// The area a direction sees of the microfacets over its own projection's, times its cosine: `cos / G1`,
/// Smith's masking without approximation. At roughness one; not below `cos`.
pub(super) fn visible_area(cos: f64, sin: f64) -> f64 {
    let cot = cos / sin;
    if cot > 26.0 || sin == 0.0 {
        return cos;
    }
    let e = fm::exp(-cot * cot);
    0.5 * cos * (2.0 - e * erfc_scaled(cot)) + 0.5 * sin * e / SQRT_PI
}
