use crate::{Real, Vec3, vec3};

/// A right-handed orthonormal frame around a unit normal.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Frame<T = f64> {
    /// First tangent.
    pub s: Vec3<T>,
    /// Second tangent.
    pub t: Vec3<T>,
    /// Normal.
    pub n: Vec3<T>,
}

impl<T: Real> Frame<T> {
    /// A frame around the unit vector `n`, after Duff et al. 2017, "Building an Orthonormal
    /// Basis, Revisited".
    #[inline]
    pub fn from_normal(n: Vec3<T>) -> Self {
        let sign = if n.z.re().is_sign_negative() { -1.0 } else { 1.0 };
        let a = -(n.z + sign).recip();
        let b = n.x * n.y * a;
        Self {
            s: vec3(n.x * n.x * a * sign + 1.0, b * sign, -n.x * sign),
            t: vec3(b, n.y * n.y * a + sign, -n.y),
            n,
        }
    }
    /// From world coordinates into the frame's.
    #[inline]
    pub fn to_local(&self, v: Vec3<T>) -> Vec3<T> {
        vec3(self.s.dot(v), self.t.dot(v), self.n.dot(v))
    }
    /// From the frame's coordinates into the world's.
    #[inline]
    pub fn to_world(&self, v: Vec3<T>) -> Vec3<T> {
        self.s * v.x + self.t * v.y + self.n * v.z
    }
}
