use core::array::from_fn;
use core::cmp::Ordering;
use core::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use crate::Real;

/// A forward-mode dual number: a value and its derivatives along `N` directions at once.
///
/// `Dual<Dual<f64, 1>, 1>` nests to second derivatives.
///
/// ```
/// use drt_math::{Dual, Real};
/// let x = Dual::<f64, 2>::variable(3.0, 0);
/// let y = Dual::<f64, 2>::variable(2.0, 1);
/// let f = x * x * y;
/// assert_eq!((f.re, f.eps), (18.0, [12.0, 9.0]));
/// ```
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Dual<T, const N: usize> {
    /// The value.
    pub re: T,
    /// The derivatives.
    #[cfg_attr(feature = "serde", serde(skip))]
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

impl<T: Real, const N: usize> Mul for Dual<T, N> {
    type Output = Self;
    #[inline]
    fn mul(self, o: Self) -> Self {
        Self { re: self.re * o.re, eps: from_fn(|i| self.eps[i] * o.re + self.re * o.eps[i]) }
    }
}

impl<T: Real, const N: usize> Div for Dual<T, N> {
    type Output = Self;
    #[inline]
    fn div(self, o: Self) -> Self {
        let q = self.re / o.re;
        Self { re: q, eps: from_fn(|i| (self.eps[i] - q * o.eps[i]) / o.re) }
    }
}

macro_rules! mixed {
    ($($trait:ident $f:ident, $assign:ident $g:ident);* $(;)?) => {$(
        impl<T: Real, const N: usize> $trait<f64> for Dual<T, N> {
            type Output = Self;
            #[inline]
            fn $f(self, o: f64) -> Self { self.$f(Self::from(o)) }
        }
        impl<T: Real, const N: usize> $assign for Dual<T, N> {
            #[inline]
            fn $g(&mut self, o: Self) { *self = (*self).$f(o); }
        }
    )*};
}
mixed! {
    Add add, AddAssign add_assign;
    Sub sub, SubAssign sub_assign;
    Mul mul, MulAssign mul_assign;
    Div div, DivAssign div_assign;
}

impl<T: Real, const N: usize> Real for Dual<T, N> {
    #[inline]
    fn re(self) -> f64 {
        self.re.re()
    }
    #[inline]
    fn sqrt(self) -> Self {
        let s = self.re.sqrt();
        self.chain(s, T::from(0.5) / s)
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
        self.chain(self.re.ln(), self.re.recip())
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
        self.chain(self.re.acos(), -(T::one() - self.re.squared()).sqrt().recip())
    }
    #[inline]
    fn abs(self) -> Self {
        if self.re.re() < 0.0 { -self } else { self }
    }
    #[inline]
    fn powf(self, e: f64) -> Self {
        self.chain(self.re.powf(e), self.re.powf(e - 1.0) * e)
    }
    #[inline]
    fn powi(self, e: i32) -> Self {
        self.chain(self.re.powi(e), self.re.powi(e - 1) * f64::from(e))
    }
}
