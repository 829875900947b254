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
    pub fn translation(t: Vec3) -> Self {
        Self { linear: Mat3::IDENTITY, translation: t }
    }
    /// A linear map about a fixed point.
    #[must_use]
    pub fn about(linear: Mat3, pivot: Vec3) -> Self {
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
