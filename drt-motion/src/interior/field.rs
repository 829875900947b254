//! Fields inside a medium: for each medium one basis that all parameters share, for each parameter its
//! coefficients.

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_math::{Affine, Vec3};

use super::{
    Blend, Interpolation, InterpolationValues, InterpolationVelocities, SiteWeight, TetVelocities,
    TetrahedralField, TetrahedralPlace, blend_jet,
};
use crate::volume::{VolumeJet, VolumeMotion};

/// The velocity field inside a medium for one parameter.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum InteriorVelocity {
    /// One affine field; it needs no basis.
    Affine(Affine),
    /// The affine fields of the sites of a [`Blend`] that move.
    Blend(Vec<(usize, Affine)>),
    /// Velocities at the vertices of a [`TetrahedralField`].
    Tetrahedral(TetVelocities),
    /// Velocities of the surfaces and points of an [`Interpolation`].
    MeanValue(InterpolationVelocities),
}

/// What the velocity fields of all parameters share.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum InteriorBasis {
    /// Weights of the affine fields around the medium.
    Blend(Blend),
    /// Barycentric weights in tetrahedra.
    Tetrahedral(Arc<TetrahedralField>),
    /// Mean value coordinates of all surfaces.
    MeanValue(Interpolation),
}

/// The functions of an [`InteriorBasis`] at a point, with their gradients. Reused from point to point.
#[derive(Clone, Debug, Default)]
pub struct BasisValues {
    blend: Vec<SiteWeight>,
    tetrahedral: TetrahedralPlace,
    mean_value: InterpolationValues,
}

impl InteriorBasis {
    /// Replaces `values` by those at `x`.
    pub fn evaluate(&self, x: Vec3, values: &mut BasisValues) {
        match self {
            Self::Blend(blend) => blend.weights(x, &mut values.blend),
            Self::Tetrahedral(tetrahedra) => values.tetrahedral = tetrahedra.place(x),
            Self::MeanValue(field) => field.evaluate(x, &mut values.mean_value),
        }
    }
}

impl InteriorVelocity {
    /// Velocity and divergence at `x`, where the medium's basis has these values.
    ///
    /// # Panics
    /// When the values are of another basis.
    #[must_use]
    pub fn jet(&self, x: Vec3, values: &BasisValues) -> VolumeJet {
        match self {
            Self::Affine(field) => VolumeMotion::Affine(*field).jet(x),
            Self::Blend(fields) => blend_jet(&values.blend, fields, x),
            Self::Tetrahedral(velocities) => values.tetrahedral.jet(velocities),
            Self::MeanValue(velocities) => velocities.jet(&values.mean_value),
        }
    }

    /// What kind of field it is, in a word or two.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Affine(_) => "affine",
            Self::Blend(_) => "blend",
            Self::Tetrahedral(_) => "tetrahedral",
            Self::MeanValue(_) => "mean value",
        }
    }
}
