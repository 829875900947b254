use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use crate::fm;

/// A scalar that light transport can be written in: `f64`, or a [`Dual`](crate::Dual) over one.
///
/// Comparisons and branches look at the primal part only ([`Real::re`]), so control flow never
/// depends on which scalar is used.
pub trait Real:
    Copy
    + Debug
    + PartialEq
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + From<f64>
    + 'static
{
    /// The value without its derivatives, all nesting levels down.
    fn re(self) -> f64;
    /// True when the value and every derivative are exactly zero.
    fn is_zero(self) -> bool;
    /// Square root. At zero the derivative is infinite, as in calculus, but along directions in
    /// which x does not move it is zero.
    fn sqrt(self) -> Self;
    /// e to the x.
    fn exp(self) -> Self;
    /// e to the x, less one.
    fn exp_m1(self) -> Self;
    /// Natural logarithm.
    fn ln(self) -> Self;
    /// ln(1 + x).
    fn ln_1p(self) -> Self;
    /// Sine and cosine.
    fn sin_cos(self) -> (Self, Self);
    /// Arc tangent.
    fn atan(self) -> Self;
    /// Arc cosine.
    fn acos(self) -> Self;
    /// Absolute value; the derivative at zero is that of +x.
    fn abs(self) -> Self;
    /// x to a constant power.
    fn powf(self, e: f64) -> Self;
    /// x to a constant integer power.
    fn powi(self, e: i32) -> Self;

    /// Zero.
    #[inline]
    fn zero() -> Self {
        Self::from(0.0)
    }
    /// One.
    #[inline]
    fn one() -> Self {
        Self::from(1.0)
    }
    /// Sine.
    #[inline]
    fn sin(self) -> Self {
        self.sin_cos().0
    }
    /// Cosine.
    #[inline]
    fn cos(self) -> Self {
        self.sin_cos().1
    }
    /// x times x.
    #[inline]
    fn squared(self) -> Self {
        self * self
    }
    /// 1/x.
    #[inline]
    fn recip(self) -> Self {
        Self::one() / self
    }
    /// The larger by primal part.
    #[inline]
    fn max(self, other: Self) -> Self {
        if other.re() > self.re() { other } else { self }
    }
    /// The smaller by primal part.
    #[inline]
    fn min(self, other: Self) -> Self {
        if other.re() < self.re() { other } else { self }
    }
}

impl Real for f64 {
    #[inline]
    fn re(self) -> f64 {
        self
    }
    #[inline]
    fn is_zero(self) -> bool {
        self == 0.0
    }
    #[inline]
    fn sqrt(self) -> Self {
        fm::sqrt(self)
    }
    #[inline]
    fn exp(self) -> Self {
        fm::exp(self)
    }
    #[inline]
    fn exp_m1(self) -> Self {
        fm::exp_m1(self)
    }
    #[inline]
    fn ln(self) -> Self {
        fm::ln(self)
    }
    #[inline]
    fn ln_1p(self) -> Self {
        fm::ln_1p(self)
    }
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        fm::sin_cos(self)
    }
    #[inline]
    fn atan(self) -> Self {
        fm::atan(self)
    }
    #[inline]
    fn acos(self) -> Self {
        fm::acos(self)
    }
    #[inline]
    fn abs(self) -> Self {
        Self::abs(self)
    }
    #[inline]
    fn powf(self, e: f64) -> Self {
        fm::powf(self, e)
    }
    #[inline]
    fn powi(self, e: i32) -> Self {
        let mut base = if e < 0 { 1.0 / self } else { self };
        let mut n = e.unsigned_abs();
        let mut acc = 1.0;
        while n > 0 {
            if n & 1 == 1 {
                acc *= base;
            }
            base *= base;
            n >>= 1;
        }
        acc
    }
}
