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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::{Dual, Rng, warp};

    fn assert_orthonormal(n: Vec3) {
        let f = Frame::from_normal(n);
        assert_eq!(f.n, n);
        for (a, b, expected) in
            [(f.s, f.s, 1.0), (f.t, f.t, 1.0), (f.s, f.t, 0.0), (f.s, n, 0.0), (f.t, n, 0.0)]
        {
            assert!((a.dot(b) - expected).abs() < 1e-15 + 2.0 * (n.length() - 1.0).abs(), "{n:?}");
        }
        assert!((f.s.cross(f.t) - n).max_abs() < 1e-15, "right-handed: {n:?}");
        let v = vec3(0.3, -2.0, 0.7);
        assert!((f.to_world(f.to_local(v)) - v).max_abs() < 4e-15);
    }

    #[test]
    fn poles_and_equator() {
        for n in [Vec3::Z, -Vec3::Z, Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y] {
            assert_orthonormal(n);
        }
        assert_orthonormal(vec3(1.0, 0.0, -0.0));
        for tilt in [1e-4, 1e-8, 1e-12, 1e-20] {
            assert_orthonormal(vec3(tilt, -tilt, -1.0).normalize());
        }
    }

    #[test]
    fn whole_sphere() {
        let mut rng = Rng::new(1, 0, 0);
        for _ in 0..10_000 {
            assert_orthonormal(warp::uniform_sphere(rng.next_2d()).normalize());
        }
    }

    proptest! {
        #![proptest_config(crate::fixed_cases())]

        #[test]
        fn derivatives_are_those_of_an_orthonormal_frame(u in 0.0..1.0_f64, v in 0.0..1.0_f64, w in -1.0..1.0_f64) {
            for n in [warp::uniform_sphere([u, v]).normalize(), -Vec3::Z, Vec3::Z] {
                let moved = Frame::from_normal(n).to_world(vec3(w, 1.0 - w, 0.0));
                let n: [Dual<f64, 1>; 3] = core::array::from_fn(|i| Dual::new(n[i], [moved[i]]));
                let f = Frame::from_normal(Vec3::from(n));
                for (a, b) in [(f.s, f.s), (f.t, f.t), (f.s, f.t), (f.s, f.n), (f.t, f.n)] {
                    let [rate] = a.dot(b).eps;
                    prop_assert!(rate.abs() < 1e-14, "products stay as they are: {}", rate);
                }
            }
        }
    }
}
