use alloc::string::String;

use drt_geom::{BvhError, MeshError};
use drt_medium::MediumError;
use drt_motion::interior::InteriorError;
use thiserror::Error;

use crate::model::emitter::EmitterError;
use crate::model::surface::SurfaceError;

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
    /// A shape carries an emitter of another kind than area.
    #[error("it carries an emitter of type `{0}`; only those of type `area` belong on shapes")]
    NotAnArea(&'static str),
    /// A smooth surface where something is to be differentiated.
    #[error(
        "its BSDF, {bsdf}, is smooth, and `{parameter}` cannot be differentiated where light may be \
         reflected or refracted by it; make it rough, or use finite differences"
    )]
    Smooth {
        /// Kind of BSDF, by its plugin name.
        bsdf: &'static str,
        /// The parameter, or what else was to be differentiated by.
        parameter: String,
    },
    /// A BSDF that no derivative here knows of.
    #[error(
        "its BSDF, {bsdf}, has no derivatives, nor has light that meets it: `{parameter}` can only be \
         differentiated by finite differences"
    )]
    NoDerivatives {
        /// Kind of BSDF, by its plugin name.
        bsdf: &'static str,
        /// The parameter, or what else was to be differentiated by.
        parameter: String,
    },
    /// A kind of derivative that turns rays, by a camera whose rays are parallel.
    #[error(
        "it is orthographic, and `warped` has no derivatives of what moves in its view: its rays cannot turn; \
         `path-space` and `radiative` have them"
    )]
    ParallelRays,
    /// Derivatives in material form by an orthographic camera whose film is in a medium.
    #[error(
        "its film is in a medium that scatters, and it or the medium's inside moves: `path-space` has no \
         term for what crosses the film; `radiative` needs none, or move the film out of the medium"
    )]
    FilmInMedium,
    /// A surface that an orthographic camera's film cuts in two.
    #[error(
        "the surface `{0}` goes through its film, and something moves: the border of what is before the film \
         has no derivative; move the film back"
    )]
    FilmCut(String),
    /// A discontinuous texture where points slide over its surface.
    #[error(
        "its BSDF has a discontinuous texture, past which `{parameter}` can only be differentiated by the \
         estimator path-space, or by finite differences"
    )]
    DiscontinuousTexture {
        /// The parameter, or what else was to be differentiated by.
        parameter: String,
    },
    /// An environment that differs by direction where rays turn.
    #[error(
        "an environment of an image, under which `{parameter}` can only be differentiated by the estimator \
         path-space, or by finite differences"
    )]
    VaryingSky {
        /// The parameter, or what else was to be differentiated by.
        parameter: String,
    },
    /// A shape's arrays.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A medium's properties.
    #[error(transparent)]
    Medium(#[from] MediumError),
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
