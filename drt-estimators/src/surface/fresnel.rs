//! Fresnel's equations for unpolarised light.

use drt_math::Real;

/// Part of the power a dielectric interface reflects.
///
/// `cos_i` in (0, 1] is the cosine on the incident side, `eta` the index beyond the interface over
/// the index on the incident side. One beyond the critical angle.
#[inline]
pub(super) fn dielectric_reflected<T: Real>(cos_i: T, eta: T) -> T {
    let cos2_t = T::one() - (T::one() - cos_i.squared()) / eta.squared();
    if cos2_t.re() <= 0.0 {
        return T::one();
    }
    let cos_t = cos2_t.sqrt();
    let s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    (s.squared() + p.squared()) * 0.5
}

/// Part of the power a dielectric interface lets through, `1 - F`, from both cosines.
///
/// The cosines obey Snell's law and may carry a common factor. Without the square root of Snell's
/// law, and without the cancellation of `1 - F`, this is smooth up to the critical angle.
#[inline]
pub(super) fn dielectric_transmitted<T: Real>(cos_i: T, cos_t: T, eta: T) -> T {
    let s = (cos_i + eta * cos_t).squared().recip();
    let p = (eta * cos_i + cos_t).squared().recip();
    eta * cos_i * cos_t * (s + p) * 2.0
}

/// Part of the power a conductor of index `eta + i k` (relative to the outside) reflects.
///
/// `cos` in (0, 1]; `eta` and `k` are not negative and not both zero.
#[inline]
pub(super) fn conductor_reflected<T: Real>(cos: T, eta: T, k: T) -> T {
    let cos2 = cos.squared();
    let sin2 = T::one() - cos2;
    // a + i b is the square root of (eta + i k)² - sin², with a, b >= 0.
    let square = eta.squared() - k.squared() - sin2;
    let ab = eta * k;
    let modulus2 = square.squared() + ab.squared() * 4.0;
    if modulus2.re() <= 0.0 {
        return T::one();
    }
    let modulus = modulus2.sqrt();
    // The larger of a and b has no cancellation; the other one follows from their product.
    let a = if square.re() >= 0.0 {
        ((modulus + square) * 0.5).sqrt()
    } else {
        ab / ((modulus - square) * 0.5).sqrt()
    };
    let (even, odd) = (modulus + cos2, a * cos * 2.0);
    let s = (even - odd) / (even + odd);
    let (even, odd) = (modulus * cos2 + sin2.squared(), odd * sin2);
    let p = s * (even - odd) / (even + odd);
    (s + p) * 0.5
}
