use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

use crate::{Real, Vec3};

/// One number per colour channel; products are channel by channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Rgb<T = f64> {
    /// Red.
    pub r: T,
    /// Green.
    pub g: T,
    /// Blue.
    pub b: T,
}

impl Rgb {
    /// Black.
    pub const ZERO: Self = Self { r: 0.0, g: 0.0, b: 0.0 };
    /// One in every channel.
    pub const ONE: Self = Self { r: 1.0, g: 1.0, b: 1.0 };

    /// True when no channel is NaN or infinite.
    #[inline]
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.r.is_finite() && self.g.is_finite() && self.b.is_finite()
    }
    /// True when every channel is exactly zero.
    #[inline]
    #[must_use]
    pub fn is_zero(self) -> bool {
        self.r == 0.0 && self.g == 0.0 && self.b == 0.0
    }
    /// Mean of the channels.
    #[inline]
    #[must_use]
    pub fn mean(self) -> f64 {
        (self.r + self.g + self.b) * (1.0 / 3.0)
    }
    /// Largest channel.
    #[inline]
    #[must_use]
    pub fn max_channel(self) -> f64 {
        f64::max(f64::max(self.r, self.g), self.b)
    }
    /// Channel by channel the larger of two.
    #[inline]
    #[must_use]
    pub fn max(self, o: Self) -> Self {
        Self { r: f64::max(self.r, o.r), g: f64::max(self.g, o.g), b: f64::max(self.b, o.b) }
    }
    /// Largest absolute channel.
    #[inline]
    #[must_use]
    pub fn max_abs(self) -> f64 {
        self.abs().max_channel()
    }
    /// Channel by channel absolute value.
    #[inline]
    #[must_use]
    pub fn abs(self) -> Self {
        self.map(Real::abs)
    }
    /// The outer product with a vector: one vector per channel.
    #[inline]
    #[must_use]
    pub fn outer(self, v: Vec3) -> RgbVec {
        RgbVec { r: v * self.r, g: v * self.g, b: v * self.b }
    }
    /// Quotient where a zero divisor gives zero: for ratios of quantities that vanish together.
    #[inline]
    #[must_use]
    pub fn div_or_zero(self, o: Self) -> Self {
        let q = |a: f64, b: f64| if b == 0.0 { 0.0 } else { a / b };
        Self { r: q(self.r, o.r), g: q(self.g, o.g), b: q(self.b, o.b) }
    }
}

impl<T: Real> Rgb<T> {
    /// From three channels.
    #[inline]
    pub const fn new(r: T, g: T, b: T) -> Self {
        Self { r, g, b }
    }
    /// All channels equal.
    #[inline]
    pub fn splat(v: T) -> Self {
        Self { r: v, g: v, b: v }
    }
    /// A function of each channel.
    #[inline]
    pub fn map<U>(self, f: impl Fn(T) -> U) -> Rgb<U> {
        Rgb { r: f(self.r), g: f(self.g), b: f(self.b) }
    }
    /// Sum over channels of products.
    #[inline]
    pub fn dot(self, o: Self) -> T {
        self.r * o.r + self.g * o.g + self.b * o.b
    }
    /// Sum of the channels.
    #[inline]
    pub fn sum(self) -> T {
        self.r + self.g + self.b
    }
    /// Channels as an array.
    #[inline]
    pub fn to_array(self) -> [T; 3] {
        [self.r, self.g, self.b]
    }
    /// e to each channel.
    #[inline]
    pub fn exp(self) -> Self {
        self.map(Real::exp)
    }
}

impl<T> From<[T; 3]> for Rgb<T> {
    #[inline]
    fn from([r, g, b]: [T; 3]) -> Self {
        Self { r, g, b }
    }
}

macro_rules! channelwise {
    ($R:ident: $($trait:ident $f:ident, $assign:ident $g:ident);* $(;)?) => {$(
        impl<T: Real> $trait for $R<T> {
            type Output = Self;
            #[inline]
            fn $f(self, o: Self) -> Self {
                Self { r: self.r.$f(o.r), g: self.g.$f(o.g), b: self.b.$f(o.b) }
            }
        }
        impl<T: Real> $assign for $R<T> {
            #[inline]
            fn $g(&mut self, o: Self) { *self = (*self).$f(o); }
        }
    )*};
}
channelwise! { Rgb:
    Add add, AddAssign add_assign;
    Sub sub, SubAssign sub_assign;
    Mul mul, MulAssign mul_assign;
}
impl<T: Real> Div for Rgb<T> {
    type Output = Self;
    #[inline]
    fn div(self, o: Self) -> Self {
        Self { r: self.r / o.r, g: self.g / o.g, b: self.b / o.b }
    }
}
impl<T: Real> Mul<T> for Rgb<T> {
    type Output = Self;
    #[inline]
    fn mul(self, s: T) -> Self {
        self.map(|c| c * s)
    }
}
#[expect(clippy::suspicious_arithmetic_impl, reason = "one division for all channels")]
impl<T: Real> Div<T> for Rgb<T> {
    type Output = Self;
    #[inline]
    fn div(self, s: T) -> Self {
        self * s.recip()
    }
}
impl<T: Real> MulAssign<T> for Rgb<T> {
    #[inline]
    fn mul_assign(&mut self, s: T) {
        *self = *self * s;
    }
}
impl<T: Real> Neg for Rgb<T> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        self.map(|c| -c)
    }
}

/// One vector per colour channel: the gradient of a colour with respect to a point or direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RgbVec {
    /// Gradient of the red channel.
    pub r: Vec3,
    /// Gradient of the green channel.
    pub g: Vec3,
    /// Gradient of the blue channel.
    pub b: Vec3,
}

impl RgbVec {
    /// No dependence.
    pub const ZERO: Self = Self { r: Vec3::ZERO, g: Vec3::ZERO, b: Vec3::ZERO };

    /// The rate of change along a velocity.
    #[inline]
    #[must_use]
    pub fn dot(self, v: Vec3) -> Rgb {
        Rgb::new(self.r.dot(v), self.g.dot(v), self.b.dot(v))
    }
    /// Sum over channels, weighted: the transpose of [`RgbVec::dot`].
    #[inline]
    #[must_use]
    pub fn weighted(self, w: Rgb) -> Vec3 {
        self.r * w.r + self.g * w.g + self.b * w.b
    }
    /// A function of each channel's vector.
    #[inline]
    #[must_use]
    pub fn map(self, f: impl Fn(Vec3) -> Vec3) -> Self {
        Self { r: f(self.r), g: f(self.g), b: f(self.b) }
    }
    /// True when no coordinate is NaN or infinite.
    #[inline]
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.r.is_finite() && self.g.is_finite() && self.b.is_finite()
    }
}

impl Add for RgbVec {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        Self { r: self.r + o.r, g: self.g + o.g, b: self.b + o.b }
    }
}
impl Sub for RgbVec {
    type Output = Self;
    #[inline]
    fn sub(self, o: Self) -> Self {
        Self { r: self.r - o.r, g: self.g - o.g, b: self.b - o.b }
    }
}
impl Neg for RgbVec {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        self.map(|v| -v)
    }
}
impl AddAssign for RgbVec {
    #[inline]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}
impl SubAssign for RgbVec {
    #[inline]
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}
impl Mul<Rgb> for RgbVec {
    type Output = Self;
    #[inline]
    fn mul(self, w: Rgb) -> Self {
        Self { r: self.r * w.r, g: self.g * w.g, b: self.b * w.b }
    }
}
impl Mul<f64> for RgbVec {
    type Output = Self;
    #[inline]
    fn mul(self, s: f64) -> Self {
        self.map(|v| v * s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vec3;

    #[test]
    fn channels_do_not_mix() {
        let (a, b) = (Rgb::new(1.0, 2.0, 4.0), Rgb::new(3.0, 0.5, 8.0));
        assert_eq!(a * b, Rgb::new(3.0, 1.0, 32.0));
        assert_eq!(a / b, Rgb::new(1.0 / 3.0, 4.0, 0.5));
        assert_eq!((a - b + b) * 2.0 / 2.0, a);
        assert_eq!((a.sum(), a.dot(b), (-b).max_abs()), (7.0, 36.0, 8.0));
        assert_eq!((-b).max_channel(), -0.5);
        assert!((a.mean() - 7.0 / 3.0).abs() < 1e-15);
        assert_eq!(Rgb::splat(0.0).exp(), Rgb::ONE);
        assert_eq!(Rgb::from(a.to_array()), a);
    }

    #[test]
    fn vanishing_ratios_are_zero() {
        let q = Rgb::new(0.0, 1.0, 6.0).div_or_zero(Rgb::new(0.0, 0.0, 2.0));
        assert_eq!(q, Rgb::new(0.0, 0.0, 3.0));
    }

    #[test]
    fn gradients_contract_both_ways() {
        // <w, G v> = <G^T w, v>.
        let (c, p, v) = (Rgb::new(1.0, -2.0, 0.5), vec3(3.0, 1.0, -1.0), vec3(0.2, 0.4, 0.7));
        let g = c.outer(p) * Rgb::new(2.0, 3.0, 5.0)
            + RgbVec { r: Vec3::X, g: Vec3::Y, b: Vec3::Z } * 0.5;
        let w = Rgb::new(0.3, 0.9, -1.1);
        assert!((g.dot(v).dot(w) - g.weighted(w).dot(v)).abs() < 1e-14);
        assert_eq!(g - g, RgbVec::ZERO);
        assert_eq!((-g).map(|x| -x), g);
    }

    #[test]
    fn non_finite_channels_are_seen() {
        assert!(Rgb::ONE.is_finite() && Rgb::ZERO.is_zero());
        assert!(!Rgb::new(0.0, f64::NAN, 0.0).is_finite());
        assert!(!Rgb::new(0.0, f64::NAN, 0.0).is_zero());
        assert!(!Rgb::ONE.outer(vec3(0.0, f64::INFINITY, 0.0)).is_finite());
    }
}
