//! Velocity and divergence at points of a volume.

use drt_math::{Affine, Vec3};

/// The velocity field inside a medium for one parameter, at the parameters' current values.
///
/// Volume vertices move with it; which field is used cannot matter as long as it has the normal
/// velocity of every surface that bounds the medium, or the flux through those surfaces is added.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum VolumeMotion {
    /// Rest.
    #[default]
    Static,
    /// One affine field, a function of the moved position.
    Affine(Affine),
}

/// Velocity and volume change at a point of a medium.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VolumeJet {
    /// Velocity of the material point.
    pub u: Vec3,
    /// Rate of the volume Jacobian: div u.
    pub j_dot: f64,
}

/// What multiplies each entry of a [`VolumeJet`] in a derivative.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VolumeAdjoint {
    /// Multiplies the velocity.
    pub u: Vec3,
    /// Multiplies the rate of the volume Jacobian.
    pub j: f64,
}

impl VolumeMotion {
    /// True for a field that is zero everywhere.
    #[must_use]
    pub fn is_rest(&self) -> bool {
        match self {
            Self::Static => true,
            Self::Affine(field) => field.is_zero(),
        }
    }

    /// Velocity at a point.
    #[inline]
    #[must_use]
    pub fn velocity(&self, x: Vec3) -> Vec3 {
        match self {
            Self::Static => Vec3::ZERO,
            Self::Affine(field) => field.point(x),
        }
    }

    /// Divergence of the velocity at a point: the rate of the volume Jacobian.
    #[inline]
    #[must_use]
    pub fn divergence(&self, _x: Vec3) -> f64 {
        match self {
            Self::Static => 0.0,
            Self::Affine(field) => field.linear.trace(),
        }
    }

    /// Velocity and divergence together.
    #[inline]
    #[must_use]
    pub fn jet(&self, x: Vec3) -> VolumeJet {
        VolumeJet { u: self.velocity(x), j_dot: self.divergence(x) }
    }
}
