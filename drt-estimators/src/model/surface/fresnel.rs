//! Fresnel's equations for unpolarised light.

use core::ops::Mul;

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
    let Some([a, b]) = inner_cosine(sin2, eta, k) else { return T::one() };
    let (even, odd) = (a.squared() + b.squared() + cos2, a * cos * 2.0);
    let s = (even - odd) / (even + odd);
    let (even, odd) = ((even - cos2) * cos2 + sin2.squared(), odd * sin2);
    let p = s * (even - odd) / (even + odd);
    (s + p) * 0.5
}

/// Real and imaginary part, neither negative, of `w = sqrt((eta + i k)² - sin²)`: the index times
/// the complex cosine of refraction. None where it is zero.
#[inline]
fn inner_cosine<T: Real>(sin2: T, eta: T, k: T) -> Option<[T; 2]> {
    let square = eta.squared() - k.squared() - sin2;
    let product = eta * k;
    let modulus2 = square.squared() + product.squared() * 4.0;
    if modulus2.re() <= 0.0 {
        return None;
    }
    let modulus = modulus2.sqrt();
    // The larger part has no cancellation; the other one follows from their product.
    Some(if square.re() >= 0.0 {
        let a = ((modulus + square) * 0.5).sqrt();
        [a, product / a]
    } else {
        let b = ((modulus - square) * 0.5).sqrt();
        [product / b, b]
    })
}

/// Derivatives of [`conductor_reflected`] with respect to `cos`, `eta` and `k`.
///
/// With `z = eta + i k` both amplitudes are `r = (x - w) / (x + w)`, `x = cos` or `x = z² cos`, and
/// analytic in `z`. Zero at a non-absorbing medium's critical angle, where there are none.
#[inline]
pub(super) fn conductor_slopes(cos: f64, eta: f64, k: f64) -> [f64; 3] {
    let Some([a, b]) = inner_cosine(1.0 - cos * cos, eta, k) else { return [0.0; 3] };
    let (z, w) = (Complex(eta, k), Complex(a, b));
    let z2 = z * z;
    let contrast = Complex(z2.0 - 1.0, z2.1);
    let mut slopes = [0.0; 3];
    let mut add = |x: Complex, by_cos: Complex, by_z: Complex| {
        // dr = 2 (w dx - x dw) / (x + w)²; the numerators come as multiples of 1 / w.
        let sum = Complex(x.0 + w.0, x.1 + w.1);
        let conjugate_of_difference = Complex(x.0 - w.0, w.1 - x.1);
        let divisor = w * sum;
        let weight = conjugate_of_difference
            * Complex(divisor.0, -divisor.1)
            * Complex(2.0 / (sum.norm2() * divisor.norm2()), 0.0);
        slopes[0] += (weight * by_cos).0;
        let by_z = weight * by_z;
        slopes[1] += by_z.0;
        slopes[2] -= by_z.1;
    };
    add(Complex(cos, 0.0), contrast, Complex(-cos * eta, -cos * k));
    // 2 w² - z² = z² - 2 sin²
    let bend = Complex(z2.0 - 2.0 * (1.0 - cos * cos), z2.1);
    add(Complex(z2.0 * cos, z2.1 * cos), z2 * contrast, z * bend * Complex(cos, 0.0));
    slopes
}

#[derive(Clone, Copy)]
struct Complex(f64, f64);

impl Complex {
    #[inline]
    fn norm2(self) -> f64 {
        self.0 * self.0 + self.1 * self.1
    }
}

impl Mul for Complex {
    type Output = Self;
    #[inline]
    fn mul(self, o: Self) -> Self {
        Self(self.0 * o.0 - self.1 * o.1, self.0 * o.1 + self.1 * o.0)
    }
}
