use alloc::format;
use alloc::string::{String, ToString};

use drt_geom::{BvhError, ConformityError, SurfaceTriangle, TetMeshError, TetrahedralizeError};
use thiserror::Error;

use crate::error::Cause;

/// Why the inside of a medium cannot move as asked for.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum InteriorError {
    /// An affine field was asked for where there is none.
    #[error(
        "its inside cannot move affinely with parameter {parameter} (from 0): not everything around it moves by the \
         same affine map"
    )]
    NotAffine {
        /// Index of the parameter.
        parameter: usize,
    },
    /// Its surfaces cannot be filled with tetrahedra.
    #[error("no tetrahedra fill it: {0}")]
    Unfilled(#[source] TetrahedralizeError),
    /// TetGen does not fill its surfaces with tetrahedra, for the reason that is given.
    #[error("TetGen does not fill it: {0}")]
    Tetgen(String),
    /// TetGen was asked for in a program without it.
    #[error(
        "TetGen is not in this program; expected it to be built with the feature `tetgen`, which is under the AGPL"
    )]
    NoTetgen,
    /// Tetrahedra are no mesh of a domain.
    #[error(transparent)]
    Tetrahedra(#[from] TetMeshError),
    /// Tetrahedra that were given do not follow a surface.
    #[error("its tetrahedra and surface {surface} (from 0): {error}")]
    Conformity {
        /// Index of the surface.
        surface: usize,
        /// How they do not.
        error: ConformityError,
    },
    /// Velocities that were given are not those of all vertices.
    #[error("{found} velocities for a mesh of {expected} vertices")]
    VelocityCount {
        /// Velocities given.
        found: usize,
        /// Vertices of the tetrahedra.
        expected: usize,
    },
    /// A velocity that was given is NaN or infinite.
    #[error("velocity {vertex} is not finite")]
    VelocityNotFinite {
        /// Index of the vertex.
        vertex: usize,
    },
    /// Its surfaces have no mean value coordinates.
    #[error("mean value coordinates around it: {0}")]
    MeanValue(#[source] Cause),
    /// Velocities of its surfaces are not finite.
    #[error(transparent)]
    Velocities(Cause),
    /// The surfaces' triangles cannot be searched.
    #[error(transparent)]
    Surface(#[from] BvhError),
}

impl InteriorError {
    /// The message with names in the place of indices.
    #[must_use]
    pub fn with_names(
        &self,
        surface: impl Fn(usize) -> String,
        parameter: impl Fn(usize) -> String,
    ) -> String {
        let named = |t: SurfaceTriangle| {
            format!("triangle {} of {}", t.triangle, surface(t.surface as usize))
        };
        match *self {
            Self::NotAffine { parameter: p } => format!(
                "its inside cannot move affinely with parameter `{}`: not everything around it \
                 moves by the same affine map",
                parameter(p)
            ),
            Self::Unfilled(TetrahedralizeError::Intersection { first, second }) => {
                format!("no tetrahedra fill it: {} and {} intersect", named(first), named(second))
            }
            Self::Unfilled(TetrahedralizeError::Unrecovered { triangle }) => format!(
                "no tetrahedra fill it: {} is too thin, or too near to others",
                named(triangle)
            ),
            Self::Conformity { surface: s, error } => {
                format!("its tetrahedra and {}: {error}", surface(s))
            }
            _ => self.to_string(),
        }
    }
}
