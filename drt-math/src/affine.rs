use crate::{Mat3, Vec3};

/// The map `x -> linear x + translation`: a placement of an object, or a velocity field.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Affine {
    /// The linear part.
    pub linear: Mat3,
    /// The image of the origin.
    pub translation: Vec3,
}

impl Affine {
    /// The map that changes nothing.
    pub const IDENTITY: Self = Self { linear: Mat3::IDENTITY, translation: Vec3::ZERO };
    /// The map to zero: as a velocity field, rest.
    pub const ZERO: Self = Self { linear: Mat3::ZERO, translation: Vec3::ZERO };

    /// A translation.
    #[must_use]
    pub fn translation(t: impl Into<Vec3>) -> Self {
        Self { linear: Mat3::IDENTITY, translation: t.into() }
    }
    /// A linear map about a fixed point.
    #[must_use]
    pub fn about(linear: impl Into<Mat3>, pivot: impl Into<Vec3>) -> Self {
        let (linear, pivot) = (linear.into(), pivot.into());
        Self { linear, translation: pivot - linear * pivot }
    }
    /// Image of a point.
    #[inline]
    #[must_use]
    pub fn point(&self, p: Vec3) -> Vec3 {
        self.linear * p + self.translation
    }
    /// Image of a difference of points.
    #[inline]
    #[must_use]
    pub fn vector(&self, v: Vec3) -> Vec3 {
        self.linear * v
    }
    /// This map after another: `self ∘ first`.
    #[must_use]
    pub fn after(&self, first: &Self) -> Self {
        Self { linear: self.linear * first.linear, translation: self.point(first.translation) }
    }
    /// The inverse map; not finite when the linear part is singular.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let linear = self.linear.inverse();
        Self { linear, translation: -(linear * self.translation) }
    }
    /// Sum of two fields.
    #[must_use]
    pub fn plus(&self, o: &Self) -> Self {
        Self { linear: self.linear + o.linear, translation: self.translation + o.translation }
    }
    /// A multiple of the field.
    #[must_use]
    pub fn times(&self, s: f64) -> Self {
        Self { linear: self.linear * s, translation: self.translation * s }
    }
    /// True when every coefficient is exactly zero.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        *self == Self::ZERO
    }
    /// True when no coefficient is NaN or infinite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.linear.is_finite() && self.translation.is_finite()
    }
}

impl From<glam::DAffine3> for Affine {
    fn from(a: glam::DAffine3) -> Self {
        Self { linear: a.matrix3.into(), translation: a.translation.into() }
    }
}
impl From<Affine> for glam::DAffine3 {
    fn from(a: Affine) -> Self {
        Self { matrix3: a.linear.into(), translation: a.translation.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vec3;

    fn sample() -> Affine {
        let turn = Mat3::rotation(vec3(1.0, 2.0, -2.0) * (1.0 / 3.0), 0.7);
        Affine {
            linear: turn * Mat3::diagonal(vec3(2.0, 0.5, -1.5)),
            translation: vec3(1.0, -4.0, 0.3),
        }
    }

    #[test]
    fn inverse_undoes() {
        let (a, p) = (sample(), vec3(0.3, 5.0, -2.0));
        assert!((a.inverse().point(a.point(p)) - p).max_abs() < 1e-14);
        let both = a.after(&a.inverse());
        let rest = both.plus(&Affine::IDENTITY.times(-1.0));
        assert!(rest.linear.cols.iter().all(|c| c.max_abs() < 1e-15));
        assert!(rest.translation.max_abs() < 1e-14);
    }

    #[test]
    fn composition_applies_the_first_first() {
        let (a, b, p) = (sample(), Affine::translation(Vec3::Y), vec3(0.3, 5.0, -2.0));
        assert!((a.after(&b).point(p) - a.point(b.point(p))).max_abs() < 1e-14);
        assert!((a.vector(p) - (a.point(p) - a.point(Vec3::ZERO))).max_abs() < 1e-14);
    }

    #[test]
    fn pivot_is_fixed() {
        let pivot = vec3(3.0, -1.0, 2.0);
        let turn = Affine::about(sample().linear, pivot);
        assert!((turn.point(pivot) - pivot).max_abs() < 1e-14);
    }

    #[test]
    fn zero_and_non_finite_fields_are_told_apart() {
        assert!(Affine::ZERO.is_zero() && !Affine::IDENTITY.is_zero());
        assert!(sample().is_finite() && !sample().times(f64::INFINITY).is_finite());
        assert!(!Affine { linear: Mat3::ZERO, translation: Vec3::X }.inverse().is_finite());
    }

    #[test]
    fn glam_agrees() {
        let (a, p) = (sample(), vec3(0.3, 5.0, -2.0));
        let glam = glam::DAffine3::from(a);
        assert!((Vec3::from(glam.transform_point3(p.into())) - a.point(p)).max_abs() < 1e-14);
        assert_eq!(Affine::from(glam), a);
    }
}
