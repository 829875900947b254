use core::array::from_fn;
use core::cmp::Ordering;
use core::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use crate::Real;

/// A forward-mode dual number: a value and its derivatives along `N` directions at once.
///
/// `Dual<Dual<f64, 1>, 1>` nests to second derivatives.
///
/// Equality and order compare values only, as [`Real`] demands: two duals may be equal and differ
/// in their derivatives.
///
/// ```
/// use drt_math::{Dual, Real};
/// let x = Dual::<f64, 2>::variable(3.0, 0);
/// let y = Dual::<f64, 2>::variable(2.0, 1);
/// let f = x * x * y;
/// assert_eq!((f.re, f.eps), (18.0, [12.0, 9.0]));
/// ```
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Dual<T, const N: usize> {
    /// The value.
    pub re: T,
    /// The derivatives.
    #[cfg_attr(feature = "serde", serde(with = "lanes"))]
    pub eps: [T; N],
}

impl<T: Real, const N: usize> Dual<T, N> {
    /// A value with given derivatives.
    #[inline]
    pub const fn new(re: T, eps: [T; N]) -> Self {
        Self { re, eps }
    }

    /// The independent variable number `lane`: derivative one along it, zero along the others.
    #[inline]
    pub fn variable(re: T, lane: usize) -> Self {
        Self { re, eps: from_fn(|i| if i == lane { T::one() } else { T::zero() }) }
    }

    #[inline]
    fn chain(self, value: T, slope: T) -> Self {
        Self { re: value, eps: self.eps.map(|e| e * slope) }
    }

    /// [`Dual::chain`] for functions with an infinite slope somewhere: a lane along which the
    /// argument does not move stays zero there, rather than 0 * inf.
    #[inline]
    fn chain_steep(self, value: T, slope: T) -> Self {
        let moved = |e: T| if e.is_zero() { e } else { e * slope };
        Self { re: value, eps: self.eps.map(moved) }
    }
}

impl<T: Real, const N: usize> From<f64> for Dual<T, N> {
    #[inline]
    fn from(x: f64) -> Self {
        Self { re: T::from(x), eps: [T::zero(); N] }
    }
}

impl<T: Real, const N: usize> PartialEq for Dual<T, N> {
    #[inline]
    fn eq(&self, other: &Self) -> bool {
        self.re == other.re
    }
}

impl<T: Real, const N: usize> PartialOrd for Dual<T, N> {
    #[inline]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.re.partial_cmp(&other.re)
    }
}

impl<T: Real, const N: usize> Neg for Dual<T, N> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self { re: -self.re, eps: self.eps.map(|e| -e) }
    }
}

impl<T: Real, const N: usize> Add for Dual<T, N> {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        Self { re: self.re + o.re, eps: from_fn(|i| self.eps[i] + o.eps[i]) }
    }
}

impl<T: Real, const N: usize> Sub for Dual<T, N> {
    type Output = Self;
    #[inline]
    fn sub(self, o: Self) -> Self {
        Self { re: self.re - o.re, eps: from_fn(|i| self.eps[i] - o.eps[i]) }
    }
}

#[expect(clippy::suspicious_arithmetic_impl, reason = "the product rule adds")]
impl<T: Real, const N: usize> Mul for Dual<T, N> {
    type Output = Self;
    #[inline]
    fn mul(self, o: Self) -> Self {
        Self { re: self.re * o.re, eps: from_fn(|i| self.eps[i] * o.re + self.re * o.eps[i]) }
    }
}

#[expect(clippy::suspicious_arithmetic_impl, reason = "one division for all lanes")]
impl<T: Real, const N: usize> Div for Dual<T, N> {
    type Output = Self;
    #[inline]
    fn div(self, o: Self) -> Self {
        let (q, inverse) = (self.re / o.re, o.re.recip());
        Self { re: q, eps: from_fn(|i| (self.eps[i] - q * o.eps[i]) * inverse) }
    }
}

// A constant has no lanes to carry along.
impl<T: Real, const N: usize> Add<f64> for Dual<T, N> {
    type Output = Self;
    #[inline]
    fn add(self, o: f64) -> Self {
        Self { re: self.re + o, ..self }
    }
}

impl<T: Real, const N: usize> Sub<f64> for Dual<T, N> {
    type Output = Self;
    #[inline]
    fn sub(self, o: f64) -> Self {
        Self { re: self.re - o, ..self }
    }
}

impl<T: Real, const N: usize> Mul<f64> for Dual<T, N> {
    type Output = Self;
    #[inline]
    fn mul(self, o: f64) -> Self {
        Self { re: self.re * o, eps: self.eps.map(|e| e * o) }
    }
}

impl<T: Real, const N: usize> Div<f64> for Dual<T, N> {
    type Output = Self;
    #[inline]
    fn div(self, o: f64) -> Self {
        Self { re: self.re / o, eps: self.eps.map(|e| e / o) }
    }
}

macro_rules! assigning {
    ($($trait:ident $f:ident $op:tt);* $(;)?) => {$(
        impl<T: Real, const N: usize> $trait for Dual<T, N> {
            #[inline]
            fn $f(&mut self, o: Self) { *self = *self $op o; }
        }
    )*};
}
assigning! { AddAssign add_assign +; SubAssign sub_assign -; MulAssign mul_assign *; DivAssign div_assign / }

impl<T: Real, const N: usize> Real for Dual<T, N> {
    #[inline]
    fn re(self) -> f64 {
        self.re.re()
    }
    #[inline]
    fn is_zero(self) -> bool {
        self.re.is_zero() && self.eps.iter().all(|e| e.is_zero())
    }
    #[inline]
    fn sqrt(self) -> Self {
        let s = self.re.sqrt();
        self.chain_steep(s, T::from(0.5) / s)
    }
    #[inline]
    fn recip(self) -> Self {
        let r = self.re.recip();
        self.chain(r, -(r * r))
    }
    #[inline]
    fn exp(self) -> Self {
        let e = self.re.exp();
        self.chain(e, e)
    }
    #[inline]
    fn exp_m1(self) -> Self {
        self.chain(self.re.exp_m1(), self.re.exp())
    }
    #[inline]
    fn ln(self) -> Self {
        self.chain_steep(self.re.ln(), self.re.recip())
    }
    #[inline]
    fn ln_1p(self) -> Self {
        self.chain(self.re.ln_1p(), (self.re + 1.0).recip())
    }
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = self.re.sin_cos();
        (self.chain(s, c), self.chain(c, -s))
    }
    #[inline]
    fn atan(self) -> Self {
        self.chain(self.re.atan(), (self.re.squared() + 1.0).recip())
    }
    #[inline]
    fn acos(self) -> Self {
        self.chain_steep(self.re.acos(), -(T::one() - self.re.squared()).sqrt().recip())
    }
    #[inline]
    fn abs(self) -> Self {
        if self.re.re() < 0.0 { -self } else { self }
    }
    #[inline]
    fn powf(self, e: f64) -> Self {
        if e == 0.0 {
            return Self::one();
        }
        self.chain_steep(self.re.powf(e), self.re.powf(e - 1.0) * e)
    }
    #[inline]
    fn powi(self, e: i32) -> Self {
        if e == 0 {
            return Self::one();
        }
        self.chain_steep(self.re.powi(e), self.re.powi(e.saturating_sub(1)) * f64::from(e))
    }
}

/// Arrays of any length as sequences; serde itself stops at a fixed list of lengths.
#[cfg(feature = "serde")]
mod lanes {
    use alloc::vec::Vec;

    use serde::de::{Deserialize, Deserializer, Error};
    use serde::{Serialize, Serializer};

    pub(super) fn serialize<T: Serialize, S: Serializer, const N: usize>(
        lanes: &[T; N],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        lanes.as_slice().serialize(serializer)
    }

    pub(super) fn deserialize<'de, T: Deserialize<'de>, D: Deserializer<'de>, const N: usize>(
        deserializer: D,
    ) -> Result<[T; N], D::Error> {
        let lanes = Vec::deserialize(deserializer)?;
        let found = lanes.len();
        let wrong = || D::Error::custom(format_args!("{found} derivatives where {N} belong"));
        lanes.try_into().map_err(|_| wrong())
    }
}

#[cfg(test)]
mod tests;
