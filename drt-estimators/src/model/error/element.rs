use alloc::string::String;
use alloc::vec::Vec;

use drt_geom::{BvhError, MeshError};
use drt_medium::MediumError;
use drt_motion::interior::InteriorError;
use thiserror::Error;

use crate::model::emitter::EmitterError;
use crate::model::surface::{Property, SurfaceError};

/// What is wrong with an element of a scene.
#[derive(Clone, Debug, Error)]
#[non_exhaustive]
pub enum ElementError {
    /// A shape names something that no element is called.
    #[error("no {kind} is called `{name}`; known are: {}", listed(known))]
    UnknownPart {
        /// What kind of element it has to be.
        kind: &'static str,
        /// The id.
        name: String,
        /// The ids of elements of this kind.
        known: Vec<String>,
    },
    /// Two elements of a scene that was built by ids have the same one.
    #[error("another element has the same id")]
    SameId,
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
    /// Two shapes that emit and overlap in one plane.
    #[error(
        "it emits and lies in the plane of the emitter `{0}`, which it overlaps: which of the two is seen is not known; move one of them by a \
         little, or let it end where the other begins"
    )]
    OverlappingLamp(String),
    /// A shape carries an emitter of another kind than area.
    #[error("it carries an emitter of type `{0}`; only those of type `area` belong on shapes")]
    NotAnArea(&'static str),
    /// A point or directional emitter where something that moves is to be differentiated past a smooth surface, beside media or by paths
    /// from both ends.
    #[error(
        "its light comes from a point or a direction, and `{parameter}` moves something: beside media and null interfaces, and by paths \
         from both ends, the shadows that are seen past the smooth surface `{surface}` cannot be differentiated; give the light a size, make \
         the surface rough, or use finite differences"
    )]
    DeltaLightPastSmooth {
        /// The parameter, or what else was to be differentiated by.
        parameter: String,
        /// The first smooth surface.
        surface: String,
    },
    /// A smooth surface that emits, where something that moves is to be differentiated.
    #[error(
        "it emits and is smooth, and `{parameter}` moves something: what it emits and what it reflects move apart; let another \
         shape emit, make it rough, or use finite differences"
    )]
    SmoothEmitter {
        /// The parameter, or what else was to be differentiated by.
        parameter: String,
    },
    /// A BSDF past which nothing that moves is differentiated.
    #[error(
        "its BSDF, {bsdf}, has no derivatives by what moves, nor has light that meets it: `{parameter}` can only be \
         differentiated by finite differences"
    )]
    NoDerivatives {
        /// Kind of BSDF, by its plugin name.
        bsdf: &'static str,
        /// The parameter, or what else was to be differentiated by.
        parameter: String,
    },
    /// A surface whose BSDF tells directions along it apart, without coordinates to tell them by.
    #[error(
        "its BSDF follows texture coordinates, which its mesh does not have: `{parameter}` can only be \
         differentiated by finite differences"
    )]
    NoCoordinates {
        /// The parameter, or what else was to be differentiated by.
        parameter: String,
    },
    /// A kind of derivative that turns rays, by a camera whose rays are parallel.
    #[error(
        "it is orthographic, and `warped` has no derivatives of what moves in its view: its rays cannot turn; \
         `path-space` and `radiative` have them"
    )]
    ParallelRays,
    /// An instance of a shape that does not exist.
    #[error("its shape does not exist")]
    NoShape,
    /// Instances that are not in the order of their shapes, or two of one shape.
    #[error("it is an instance twice, or instances are not in the order of shapes")]
    InstanceOrder,
    /// An instance in a plane, a line or a point, or nowhere.
    #[error("its instance is placed by a map that flattens it or is not finite")]
    FlatInstance,
    /// An instance that is an emitter.
    #[error("it is an instance, which cannot emit")]
    GlowingInstance,
    /// Too many instances to be copied.
    #[error(
        "derivatives copy the triangles of instances, and all instances together have {count}; at most {most} fit"
    )]
    Copies {
        /// Triangles of all instances.
        count: u64,
        /// How many may be copied.
        most: u64,
    },
    /// A light that jumps, where something moves in it.
    #[error(
        "its light is discontinuous, and `{parameter}` moves it or what may be in it; only finite differences follow its \
         edges, or let it fall off (a spot by a `beam_width` below its `cutoff_angle`, a projector by a black border of its bitmap)"
    )]
    Rim {
        /// The parameter, or what else was to be differentiated by.
        parameter: String,
    },
    /// Light of points and directions that the warped estimator leaves to another one, as in media, where something moves and the camera does
    /// not see other emitters.
    #[error(
        "its light is left to an estimator that does not know what `hide_emitters` hides, and `{parameter}` moves something; \
         only finite differences have this derivative"
    )]
    HiddenEmitters {
        /// The parameter, or what else was to be differentiated by.
        parameter: String,
    },
    /// An edge along a border of pixels, where the camera does not see emitters.
    #[error(
        "`hide_emitters` is true, and an edge of the scene lies exactly along a border of pixels; move the camera a little, or \
         take a continuous reconstruction filter"
    )]
    HiddenAtBorder,
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
        "it has a discontinuous texture, over which points of the estimator slide: differentiate `{parameter}` by path-space, by \
         warped (which has no derivative of bump maps, nor of textures of smooth surfaces with interpolated normals), or by finite \
         differences"
    )]
    DiscontinuousTexture {
        /// The parameter, or what else was to be differentiated by.
        parameter: String,
    },
    /// A texture that jumps along a border of pixels, as the camera sees it.
    #[error(
        "its texture is discontinuous along a line that the camera sees exactly along a border of pixels, across which no ray of the \
         estimator warped turns: move the camera a little, use another filter, the estimator path-space, or finite differences"
    )]
    TextureAtBorder,
    /// A texture without derivatives where points slide over its surface.
    #[error(
        "a texture stands for its `{property}`, which has no derivative: past it `{parameter}` can only be \
         differentiated by the estimator path-space, or by finite differences"
    )]
    UndifferentiatedTexture {
        /// What it stands for.
        property: Property,
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

fn listed(ids: &[String]) -> String {
    if ids.is_empty() { "none".into() } else { ids.join(", ") }
}
