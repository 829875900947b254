use alloc::string::String;

use drt_geom::{TetMeshError, TetrahedralizeError};
use drt_medium::MediumError;
use drt_motion::Cause;
use drt_motion::deformation::DeformationError;
use thiserror::Error;

use crate::model::emitter::EmitterError;
use crate::model::sensor::SensorError;
use crate::model::surface::SurfaceError;
use crate::model::texture::TexelError;

/// Why an effect does not apply to its target.
#[derive(Clone, Debug, Error)]
#[non_exhaustive]
pub enum EffectError {
    /// Geometry of a scattering model.
    #[error("a bsdf does not move")]
    NotMovable,
    /// Radiance of a shape without an emitter.
    #[error("the shape does not emit")]
    NotEmitting,
    /// Geometry of an area or constant emitter.
    #[error("this emitter has no place of its own; move its shape")]
    NoPlace,
    /// Voxels of anything but a medium.
    #[error("only the grids of a medium have voxels")]
    NoVoxels,
    /// Texels of what has no textures.
    #[error("only textures of BSDFs and emitters have texels")]
    NoTexels,
    /// Texels that cannot change.
    #[error(transparent)]
    Texels(#[from] TexelError),
    /// A medium that follows more than one shape that deforms.
    #[error("it follows two shapes that deform; it can follow one")]
    TwoLeaders,
    /// A property that media do not have.
    #[error(
        "a medium has no property `{0}`; it has sigma_t, albedo, emission, g, weight, sggx_diagonal and sggx_off_diagonal"
    )]
    MediumProperty(String),
    /// A grid cannot follow a shape that no tetrahedra surround.
    #[error("no tetrahedra fill the space around the shape that it follows: {0}")]
    Surroundings(#[source] TetrahedralizeError),
    /// Those around it cannot be used.
    #[error("no tetrahedra fill the space around the shape that it follows: {0}")]
    Tetrahedra(#[from] TetMeshError),
    /// A grid cannot follow a shape that deforms too far.
    #[error(
        "the shape that it follows deforms too far: around ({:.3}, {:.3}, {:.3}) space would be \
         turned inside out; choose a value nearer to zero",
        .at[0], .at[1], .at[2]
    )]
    TurnedOver {
        /// Where, in world space.
        at: [f64; 3],
    },
    /// A grid cannot follow a shape otherwise.
    #[error(transparent)]
    Deformation(DeformationError),
    /// A change that cannot be made.
    #[error(transparent)]
    Motion(#[from] Cause),
    /// A property of a scattering model.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// A property or place of an emitter.
    #[error(transparent)]
    Emitter(#[from] EmitterError),
    /// A property or place of a sensor.
    #[error(transparent)]
    Sensor(#[from] SensorError),
    /// A property or place of a medium.
    #[error(transparent)]
    Medium(#[from] MediumError),
}

impl EffectError {
    /// True where a nearer value of the parameter would do.
    pub(crate) fn is_out_of_range(&self) -> bool {
        fn of_surface(e: &SurfaceError) -> bool {
            match e {
                SurfaceError::OutOfRange { .. } | SurfaceError::Texels(TexelError::NotFinite) => {
                    true
                }
                SurfaceError::Texture { reason, .. } => of_surface(reason),
                _ => false,
            }
        }
        match self {
            Self::Surface(e) => of_surface(e),
            Self::Emitter(e) => {
                matches!(e, EmitterError::Negative { .. } | EmitterError::Cone { .. })
            }
            Self::Sensor(e) => {
                matches!(e, SensorError::FieldOfView(_) | SensorError::Aperture { .. })
            }
            Self::Medium(e) => {
                matches!(e, MediumError::OutOfRange { .. } | MediumError::PhaseFunction { .. })
            }
            Self::Texels(TexelError::NotFinite) => true,
            _ => false,
        }
    }
}

impl From<DeformationError> for EffectError {
    fn from(e: DeformationError) -> Self {
        match e {
            DeformationError::TurnedOver { at, .. } => Self::TurnedOver { at },
            other => Self::Deformation(other),
        }
    }
}
