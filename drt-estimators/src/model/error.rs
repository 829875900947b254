//! What can be wrong with a scene or a request.

use alloc::string::String;
use alloc::vec::Vec;

use drt_geom::{BvhError, TetMeshError, TetrahedralizeError};
use drt_medium::MediumError;
use drt_motion::Cause;
use drt_motion::deformation::DeformationError;
use drt_motion::interior::InteriorError;
use thiserror::Error;

use crate::model::emitter::EmitterError;
use crate::model::sensor::SensorError;
use crate::model::surface::SurfaceError;

/// A scene or request that cannot be used; the message names the item and what was expected.
#[derive(Clone, Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// No item has this name.
    #[error("no element is called `{name}`; known ids: {}", known.join(", "))]
    UnknownTarget {
        /// The name asked for.
        name: String,
        /// Names that exist.
        known: Vec<String>,
    },
    /// More than one item has this name.
    #[error(
        "more than one element is called `{name}`; address it by kind and order, such as shape[0]"
    )]
    AmbiguousTarget {
        /// The name asked for.
        name: String,
    },
    /// An effect does not apply to its target.
    #[error("parameter `{parameter}`, effect on `{target_name}`: {reason}")]
    Effect {
        /// The parameter.
        parameter: String,
        /// The effect's target.
        target_name: String,
        /// Why it does not apply.
        reason: EffectError,
    },
    /// An element of the scene is unusable.
    #[error("{element}: {reason}")]
    Element {
        /// Id, or kind and order, of the element.
        element: String,
        /// What is wrong.
        reason: ElementError,
    },
    /// A setting is unusable.
    #[error("setting `{setting}`: {reason}")]
    Setting {
        /// The setting.
        setting: &'static str,
        /// What is wrong.
        reason: SettingError,
    },
}

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
    /// A medium that follows more than one shape that deforms.
    #[error("it follows two shapes that deform; it can follow one")]
    TwoLeaders,
    /// A property that media do not have.
    #[error("a medium has no property `{0}`; it has sigma_t, albedo, emission and g")]
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

impl From<DeformationError> for EffectError {
    fn from(e: DeformationError) -> Self {
        match e {
            DeformationError::TurnedOver { at, .. } => Self::TurnedOver { at },
            other => Self::Deformation(other),
        }
    }
}

/// What is wrong with an element of a scene.
#[derive(Clone, Debug, Error)]
#[non_exhaustive]
pub enum ElementError {
    /// A shape's scattering model does not exist.
    #[error("there is no bsdf {0}")]
    NoBsdf(usize),
    /// A shape's emitter does not exist.
    #[error("its emitter does not exist")]
    NoEmitter,
    /// A medium of a shape, emitter or sensor does not exist.
    #[error("one of its media does not exist")]
    NoMedium,
    /// A shape that emits and has no area.
    #[error("it emits but has no area")]
    NoArea,
    /// A scattering model's properties.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// An emitter's properties.
    #[error(transparent)]
    Emitter(#[from] EmitterError),
    /// Triangles that cannot be searched.
    #[error(transparent)]
    Geometry(#[from] BvhError),
    /// Powers, areas or edges that make no distribution.
    #[error("cannot be sampled: {0}")]
    Distribution(#[from] drt_math::WeightsError),
    /// A medium's inside cannot move as asked for.
    #[error("{message}")]
    Interior {
        /// Why not; surfaces and parameters by their indices.
        error: InteriorError,
        /// The same with names.
        message: String,
    },
}

/// What is wrong with a setting.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum SettingError {
    /// A number that must be positive and finite.
    #[error("is {0}; expected a positive number")]
    NotPositive(f64),
    /// A sensor that does not exist.
    #[error("there is no sensor {index}; the scene has {count}")]
    NoSensor {
        /// The one asked for.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// Finite differences where a session is asked for.
    #[error("finite differences have no session; call `finite_differences`")]
    NoSession,
    /// A list of pixels of the wrong length.
    #[error("has {found} pixels; expected {}x{}", .expected[0], .expected[1])]
    PixelCount {
        /// Its length.
        found: usize,
        /// Width and height.
        expected: [u32; 2],
    },
    /// An image of another size than the film.
    #[error(
        "has {}x{} pixels; the film of its sensor has {}x{}",
        .found[0], .found[1], .film[0], .film[1]
    )]
    FilmSize {
        /// Width and height of the image.
        found: [u32; 2],
        /// Width and height of the film.
        film: [u32; 2],
    },
    /// No target to fit to.
    #[error("is missing: there is nothing to fit to")]
    NoTarget,
    /// Values that are not one per parameter.
    #[error("has {found} numbers; there are {parameters} parameters")]
    ValueCount {
        /// Numbers given.
        found: usize,
        /// Parameters.
        parameters: usize,
    },
    /// A pixel that is NaN or infinite.
    #[error("the pixel in column {column}, row {row} is not finite")]
    PixelNotFinite {
        /// From the left.
        column: u32,
        /// From the top.
        row: u32,
    },
    /// A mask's pixel that is negative or not finite.
    #[error("the pixel in column {column}, row {row} is {value}; expected 0 or more")]
    MaskPixel {
        /// From the left.
        column: u32,
        /// From the top.
        row: u32,
        /// What it holds.
        value: f64,
    },
    /// A negative pixel of a target where differences are relative.
    #[error("the pixel in column {column}, row {row} of the target is negative")]
    NegativePixel {
        /// From the left.
        column: u32,
        /// From the top.
        row: u32,
    },
    /// A mask of zeros.
    #[error("is zero everywhere, which leaves nothing to fit")]
    EmptyMask,
    /// A black target where differences are relative.
    #[error("has no meaning for a black target")]
    BlackTarget,
    /// An image that cannot be reduced by a factor.
    #[error("{}x{} pixels cannot be divided by {factor}", .size[0], .size[1])]
    Indivisible {
        /// Width and height.
        size: [u32; 2],
        /// The factor.
        factor: u32,
    },
    /// A pyramid without levels.
    #[error("has 0 levels; expected at least 1")]
    NoLevels,
    /// A weight that is not positive and finite.
    #[error("has weight {0}; expected a positive number")]
    Weight(f64),
}
