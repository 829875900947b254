use drt_math::{Affine, Vec3};

use crate::SurfaceMotion;

/// The velocity field inside a medium for one parameter, at the parameters' current values.
///
/// Volume vertices ride on it; which field is used cannot matter as long as it has the normal
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

/// How the inside of a medium follows its boundary, for one parameter.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InsideMotion {
    /// The field inside.
    pub motion: VolumeMotion,
    /// Whether the flux through the boundary must be added: the integral over every moving surface
    /// of \[f(-) - f(+)\] n·(u_surface - u_inside), n from side - to side +.
    pub flux: bool,
}

/// Chooses the motion inside a medium from the motions of *all* the surfaces that bound it: those
/// around it, those immersed in it, and [`SurfaceMotion::Rest`] for an outer boundary that stays.
///
/// Surfaces that move by one and the same affine field carry the inside with them, with no flux.
/// Surfaces at rest leave it at rest. In every other case the inside stays and the flux through the
/// moving surfaces makes up for it, which is always right.
#[must_use]
pub fn inside_motion(boundary: &[&SurfaceMotion]) -> InsideMotion {
    if boundary.iter().all(|m| m.is_rest()) {
        return InsideMotion::default();
    }
    match boundary {
        [SurfaceMotion::Affine(field), rest @ ..]
            if rest.iter().all(|m| matches!(m, SurfaceMotion::Affine(f) if f == field)) =>
        {
            InsideMotion { motion: VolumeMotion::Affine(*field), flux: false }
        }
        _ => InsideMotion { motion: VolumeMotion::Static, flux: true },
    }
}
