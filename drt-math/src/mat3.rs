use core::ops::{Add, Mul};

use crate::{Real, Vec3, vec3};

/// A 3×3 matrix, stored by columns.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Mat3<T = f64> {
    /// The columns.
    pub cols: [Vec3<T>; 3],
}

impl Mat3 {
    /// The zero matrix.
    pub const ZERO: Self = Self { cols: [Vec3::ZERO; 3] };
    /// The unit matrix.
    pub const IDENTITY: Self = Self { cols: [Vec3::X, Vec3::Y, Vec3::Z] };

    /// The matrix of `v -> w × v`.
    #[must_use]
    pub fn skew(w: Vec3) -> Self {
        Self { cols: [vec3(0.0, w.z, -w.y), vec3(-w.z, 0.0, w.x), vec3(w.y, -w.x, 0.0)] }
    }

    /// Rotation by `angle` radians about the unit vector `axis`, right-handed.
    #[must_use]
    pub fn rotation(axis: Vec3, angle: f64) -> Self {
        let (s, c) = crate::fm::sin_cos(angle);
        let k = Self::skew(axis);
        let kk = k * k;
        Self::IDENTITY + k * s + kk * (1.0 - c)
    }

    /// True when no entry is NaN or infinite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.cols.iter().all(|c| c.is_finite())
    }
}

impl<T: Real> Mat3<T> {
    /// From rows.
    #[inline]
    pub fn from_rows(a: Vec3<T>, b: Vec3<T>, c: Vec3<T>) -> Self {
        Self { cols: [vec3(a.x, b.x, c.x), vec3(a.y, b.y, c.y), vec3(a.z, b.z, c.z)] }
    }
    /// Diagonal matrix.
    #[inline]
    pub fn diagonal(d: Vec3<T>) -> Self {
        let z = T::zero();
        Self { cols: [vec3(d.x, z, z), vec3(z, d.y, z), vec3(z, z, d.z)] }
    }
    /// Transpose.
    #[inline]
    #[must_use]
    pub fn transpose(&self) -> Self {
        Self::from_rows(self.cols[0], self.cols[1], self.cols[2])
    }
    /// Product of the transpose with a vector.
    #[inline]
    pub fn transpose_mul(&self, v: Vec3<T>) -> Vec3<T> {
        vec3(self.cols[0].dot(v), self.cols[1].dot(v), self.cols[2].dot(v))
    }
    /// Determinant.
    #[inline]
    pub fn determinant(&self) -> T {
        self.cols[0].dot(self.cols[1].cross(self.cols[2]))
    }
    /// Trace.
    #[inline]
    pub fn trace(&self) -> T {
        self.cols[0].x + self.cols[1].y + self.cols[2].z
    }
    /// Inverse; not finite for a singular matrix.
    #[inline]
    #[must_use]
    pub fn inverse(&self) -> Self {
        let [a, b, c] = self.cols;
        let d = self.determinant().recip();
        Self::from_rows(b.cross(c) * d, c.cross(a) * d, a.cross(b) * d)
    }
}

impl<T: Real> Mul<Vec3<T>> for Mat3<T> {
    type Output = Vec3<T>;
    #[inline]
    fn mul(self, v: Vec3<T>) -> Vec3<T> {
        self.cols[0] * v.x + self.cols[1] * v.y + self.cols[2] * v.z
    }
}
impl<T: Real> Mul for Mat3<T> {
    type Output = Self;
    #[inline]
    fn mul(self, o: Self) -> Self {
        Self { cols: o.cols.map(|c| self * c) }
    }
}
impl<T: Real> Mul<T> for Mat3<T> {
    type Output = Self;
    #[inline]
    fn mul(self, s: T) -> Self {
        Self { cols: self.cols.map(|c| c * s) }
    }
}
impl<T: Real> Add for Mat3<T> {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        Self { cols: core::array::from_fn(|i| self.cols[i] + o.cols[i]) }
    }
}
impl From<glam::DMat3> for Mat3 {
    fn from(m: glam::DMat3) -> Self {
        Self { cols: [m.x_axis.into(), m.y_axis.into(), m.z_axis.into()] }
    }
}
impl From<Mat3> for glam::DMat3 {
    fn from(m: Mat3) -> Self {
        glam::DMat3::from_cols(m.cols[0].into(), m.cols[1].into(), m.cols[2].into())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::Dual;

    fn distance(a: Mat3, b: Mat3) -> f64 {
        (a + b * -1.0).cols.iter().map(|c| c.max_abs()).fold(0.0, f64::max)
    }

    fn matrix() -> impl Strategy<Value = Mat3> {
        prop::array::uniform3(prop::array::uniform3(-2.0..2.0_f64))
            .prop_map(|cols| Mat3 { cols: cols.map(Vec3::from) })
    }

    proptest! {
        #![proptest_config(crate::fixed_cases())]

        #[test]
        fn algebra(a in matrix(), b in matrix(), v in prop::array::uniform3(-2.0..2.0_f64)) {
            let v = Vec3::from(v);
            prop_assert!(((a * b) * v - a * (b * v)).max_abs() < 1e-13);
            prop_assert!((a.transpose() * v - a.transpose_mul(v)).max_abs() < 1e-14);
            prop_assert!(((a * b).determinant() - a.determinant() * b.determinant()).abs() < 1e-12);
            prop_assert!((a + b).trace() - a.trace() - b.trace() < 1e-14);
            if a.determinant().abs() > 0.01 {
                prop_assert!(distance(a * a.inverse(), Mat3::IDENTITY) < 1e-11);
            }
        }

        #[test]
        fn determinant_changes_by_the_trace(a in matrix(), v in matrix()) {
            // Jacobi: d det(A) = det(A) tr(A^-1 dA), the rate of a volume under a motion.
            prop_assume!(a.determinant().abs() > 0.05);
            let moving = Mat3 {
                cols: core::array::from_fn(|j| Vec3::from(core::array::from_fn::<_, 3, _>(|i| {
                    Dual::<f64, 1>::new(a.cols[j][i], [v.cols[j][i]])
                }))),
            };
            let rate = a.determinant() * (a.inverse() * v).trace();
            let [dual] = moving.determinant().eps;
            prop_assert!((dual - rate).abs() < 1e-11 * (1.0 + rate.abs()));
            let [back] = (moving * moving.inverse()).determinant().eps;
            prop_assert!(back.abs() < 1e-9);
        }

        #[test]
        fn rotations(axis in prop::array::uniform3(-1.0..1.0_f64), angle in -7.0..7.0_f64) {
            let axis = Vec3::from(axis);
            prop_assume!(axis.length() > 0.1);
            let axis = axis.normalize();
            let r = Mat3::rotation(axis, angle);
            prop_assert!(distance(r * r.transpose(), Mat3::IDENTITY) < 1e-14);
            prop_assert!((r.determinant() - 1.0).abs() < 1e-14);
            prop_assert!((r * axis - axis).max_abs() < 1e-15);
            prop_assert!((r.trace() - 1.0 - 2.0 * crate::fm::cos(angle)).abs() < 1e-14);
            let half = Mat3::rotation(axis, 0.5 * angle);
            prop_assert!(distance(half * half, r) < 1e-14);
        }
    }

    #[test]
    fn conventions() {
        let quarter = Mat3::rotation(Vec3::Z, core::f64::consts::FRAC_PI_2);
        assert!((quarter * Vec3::X - Vec3::Y).max_abs() < 1e-15, "right-handed");
        assert_eq!(Mat3::skew(Vec3::X) * Vec3::Y, Vec3::Z);
        let m = Mat3::from_rows(vec3(1.0, 2.0, 3.0), vec3(4.0, 5.0, 6.0), vec3(7.0, 8.0, 10.0));
        assert_eq!(m * Vec3::X, vec3(1.0, 4.0, 7.0));
        assert_eq!((m.determinant(), m.trace()), (-3.0, 16.0));
        assert_eq!(Mat3::diagonal(vec3(1.0, 2.0, 3.0)) * Vec3::splat(1.0), vec3(1.0, 2.0, 3.0));
        assert!(m.is_finite() && !Mat3::ZERO.inverse().is_finite());
    }

    #[test]
    fn glam_agrees() {
        let m = Mat3::from_rows(vec3(1.0, 2.0, 3.0), vec3(4.0, 5.0, 6.0), vec3(7.0, 8.0, 10.0));
        let g = glam::DMat3::from(m);
        assert_eq!(Vec3::from(g * glam::DVec3::Y), m * Vec3::Y);
        assert_eq!(g.determinant(), m.determinant());
        assert_eq!(Mat3::from(g), m);
    }
}
