use core::ops::{Add, AddAssign, Div, Index, Mul, MulAssign, Neg, Sub, SubAssign};

use crate::Real;

/// A vector, point or direction in space.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Vec3<T = f64> {
    /// First coordinate.
    pub x: T,
    /// Second coordinate.
    pub y: T,
    /// Third coordinate.
    pub z: T,
}

/// A vector from its coordinates.
#[inline]
pub const fn vec3<T>(x: T, y: T, z: T) -> Vec3<T> {
    Vec3 { x, y, z }
}

impl Vec3 {
    /// The origin.
    pub const ZERO: Self = vec3(0.0, 0.0, 0.0);
    /// First unit vector.
    pub const X: Self = vec3(1.0, 0.0, 0.0);
    /// Second unit vector.
    pub const Y: Self = vec3(0.0, 1.0, 0.0);
    /// Third unit vector.
    pub const Z: Self = vec3(0.0, 0.0, 1.0);

    /// True when no coordinate is NaN or infinite.
    #[inline]
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.z.is_finite()
    }

    /// The same vector over another scalar, with zero derivatives.
    #[inline]
    #[must_use]
    pub fn lift<T: Real>(self) -> Vec3<T> {
        vec3(T::from(self.x), T::from(self.y), T::from(self.z))
    }

    /// Largest absolute coordinate.
    #[inline]
    #[must_use]
    pub fn max_abs(self) -> f64 {
        f64::max(f64::max(Real::abs(self.x), Real::abs(self.y)), Real::abs(self.z))
    }

    /// Coordinate-wise minimum.
    #[inline]
    #[must_use]
    pub fn min(self, o: Self) -> Self {
        vec3(f64::min(self.x, o.x), f64::min(self.y, o.y), f64::min(self.z, o.z))
    }

    /// Coordinate-wise maximum.
    #[inline]
    #[must_use]
    pub fn max(self, o: Self) -> Self {
        vec3(f64::max(self.x, o.x), f64::max(self.y, o.y), f64::max(self.z, o.z))
    }
}

impl<T: Real> Vec3<T> {
    /// All coordinates equal.
    #[inline]
    pub fn splat(v: T) -> Self {
        vec3(v, v, v)
    }
    /// The zero vector of this scalar.
    #[inline]
    pub fn zero() -> Self {
        Self::splat(T::zero())
    }
    /// Scalar product.
    #[inline]
    pub fn dot(self, o: Self) -> T {
        self.x * o.x + self.y * o.y + self.z * o.z
    }
    /// Vector product.
    #[inline]
    pub fn cross(self, o: Self) -> Self {
        vec3(self.y * o.z - self.z * o.y, self.z * o.x - self.x * o.z, self.x * o.y - self.y * o.x)
    }
    /// Squared length.
    #[inline]
    pub fn length_squared(self) -> T {
        self.dot(self)
    }
    /// Length.
    #[inline]
    pub fn length(self) -> T {
        self.length_squared().sqrt()
    }
    /// The unit vector along this one; not finite for the zero vector.
    #[inline]
    pub fn normalize(self) -> Self {
        self * self.length().recip()
    }
    /// (1 - s) self + s other.
    #[inline]
    pub fn lerp(self, o: Self, s: T) -> Self {
        self + (o - self) * s
    }
    /// The value without derivatives.
    #[inline]
    pub fn re(self) -> Vec3 {
        vec3(self.x.re(), self.y.re(), self.z.re())
    }
    /// This vector without its component along the unit vector `n`.
    #[inline]
    pub fn reject(self, n: Self) -> Self {
        self - n * self.dot(n)
    }
    /// Coordinates as an array.
    #[inline]
    pub fn to_array(self) -> [T; 3] {
        [self.x, self.y, self.z]
    }
}

impl<T> From<[T; 3]> for Vec3<T> {
    #[inline]
    fn from([x, y, z]: [T; 3]) -> Self {
        vec3(x, y, z)
    }
}
impl From<glam::DVec3> for Vec3 {
    #[inline]
    fn from(v: glam::DVec3) -> Self {
        vec3(v.x, v.y, v.z)
    }
}
impl From<Vec3> for glam::DVec3 {
    #[inline]
    fn from(v: Vec3) -> Self {
        glam::DVec3::new(v.x, v.y, v.z)
    }
}

impl<T> Index<usize> for Vec3<T> {
    type Output = T;
    #[inline]
    fn index(&self, i: usize) -> &T {
        match i {
            0 => &self.x,
            1 => &self.y,
            _ => &self.z,
        }
    }
}

impl<T: Real> Add for Vec3<T> {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        vec3(self.x + o.x, self.y + o.y, self.z + o.z)
    }
}
impl<T: Real> Sub for Vec3<T> {
    type Output = Self;
    #[inline]
    fn sub(self, o: Self) -> Self {
        vec3(self.x - o.x, self.y - o.y, self.z - o.z)
    }
}
impl<T: Real> Neg for Vec3<T> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        vec3(-self.x, -self.y, -self.z)
    }
}
impl<T: Real> Mul<T> for Vec3<T> {
    type Output = Self;
    #[inline]
    fn mul(self, s: T) -> Self {
        vec3(self.x * s, self.y * s, self.z * s)
    }
}
#[expect(clippy::suspicious_arithmetic_impl, reason = "one division for all coordinates")]
impl<T: Real> Div<T> for Vec3<T> {
    type Output = Self;
    #[inline]
    fn div(self, s: T) -> Self {
        self * s.recip()
    }
}
impl<T: Real> AddAssign for Vec3<T> {
    #[inline]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}
impl<T: Real> SubAssign for Vec3<T> {
    #[inline]
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}
impl<T: Real> MulAssign<T> for Vec3<T> {
    #[inline]
    fn mul_assign(&mut self, s: T) {
        *self = *self * s;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::Dual;

    fn vector() -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-3.0..3.0_f64).prop_map(Vec3::from)
    }

    proptest! {
        #![proptest_config(crate::fixed_cases())]

        #[test]
        fn products(a in vector(), b in vector(), c in vector()) {
            let n = a.cross(b);
            prop_assert!(n.dot(a).abs() < 1e-14 * 81.0 && n.dot(b).abs() < 1e-14 * 81.0);
            prop_assert!((n.dot(c) - a.dot(b.cross(c))).abs() < 1e-13);
            let lagrange = a.length_squared() * b.length_squared() - a.dot(b) * a.dot(b);
            prop_assert!((n.length_squared() - lagrange).abs() < 1e-11);
            prop_assert!((a.lerp(b, 0.25) - (a * 0.75 + b / 4.0)).max_abs() < 1e-14);
            prop_assert_eq!(a.min(b) + a.max(b), a + b);
        }

        #[test]
        fn unit_vectors_move_at_right_angles(a in vector(), v in vector()) {
            prop_assume!(a.length() > 0.1);
            let moving = Vec3::from(core::array::from_fn::<_, 3, _>(|i| {
                Dual::<f64, 1>::new(a[i], [v[i]])
            }));
            let n = moving.normalize();
            let rate = vec3(n.x.eps[0], n.y.eps[0], n.z.eps[0]);
            let expected = v.reject(n.re()) / a.length();
            prop_assert!((rate - expected).max_abs() < 1e-12 * (1.0 + expected.max_abs()));
        }
    }

    #[test]
    fn axes_and_arrays() {
        assert_eq!(Vec3::X.cross(Vec3::Y), Vec3::Z);
        let mut v = vec3(1.0, -5.0, 3.0);
        assert_eq!((v[0], v[1], v[2], v.max_abs()), (1.0, -5.0, 3.0, 5.0));
        v += Vec3::X;
        v -= Vec3::Y;
        v *= 2.0;
        assert_eq!(v.to_array(), [4.0, -12.0, 6.0]);
        assert_eq!(v.lift::<Dual<f64, 2>>().x.eps, [0.0; 2]);
        assert!(v.is_finite() && !Vec3::ZERO.normalize().is_finite());
    }

    #[test]
    fn glam_agrees() {
        let (a, b) = (vec3(1.0, 2.0, -3.0), vec3(0.5, 4.0, 1.0));
        let (g, h) = (glam::DVec3::from(a), glam::DVec3::from(b));
        assert_eq!(Vec3::from(g.cross(h)), a.cross(b));
        assert_eq!((g.dot(h), g.length()), (a.dot(b), a.length()));
    }
}
