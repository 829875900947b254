use thiserror::Error;

/// A change that cannot be applied: which parameter, which change, and why.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("parameter {parameter}, `{change}`: {cause}")]
#[non_exhaustive]
pub struct MotionError {
    /// Index of the parameter in the list of all parameters.
    pub parameter: usize,
    /// The kind of change, as job files spell it.
    pub change: &'static str,
    /// What is wrong with it.
    pub cause: Cause,
}

/// Why a change cannot be applied.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum Cause {
    /// A list of velocities does not fit the mesh's file.
    #[error(
        "expected {expected} velocities, one per vertex of the mesh file in its order, found {found}"
    )]
    VertexCount {
        /// Vertices in the file.
        expected: usize,
        /// Velocities given.
        found: usize,
    },
    /// A vertex normal and what is added to it cancel.
    #[error("a vertex normal would have no length")]
    NoDirection,
    /// Normals are to turn of a mesh that has none.
    #[error("the mesh has no vertex normals to turn")]
    NoNormals,
    /// Normals are to turn of a mesh whose vertices other changes move.
    #[error(
        "other changes move single vertices of the mesh, so that its normals follow from their positions"
    )]
    DeformedNormals,
    /// A [motion](crate::SurfaceMotion) of another mesh.
    #[error("expected {expected} vectors, one per mesh vertex, found {found}")]
    MotionLength {
        /// Vertices of the mesh.
        expected: usize,
        /// Vectors given.
        found: usize,
    },
    /// Velocities of a [field](crate::mean_value::MeanValueField) with other surfaces.
    #[error("expected the velocities of {expected} triangles' corners, found {found}")]
    TriangleCount {
        /// Triangles of the field.
        expected: usize,
        /// Triangles given.
        found: usize,
    },
    /// A vertex that the mesh does not have.
    #[error("vertex {index} does not exist: the mesh file has {count} vertices, counted from 0")]
    VertexIndex {
        /// The vertex asked for.
        index: u32,
        /// Vertices in the file.
        count: usize,
    },
    /// A vertex that the cage does not have.
    #[error("vertex {index} does not exist: the cage has {count} vertices, counted from 0")]
    CageVertexIndex {
        /// The vertex asked for.
        index: u32,
        /// Vertices in the cage's file.
        count: usize,
    },
    /// A surface with a hole, where mean value coordinates need an inside.
    #[error(
        "the surface is not closed: the edge from vertex {} to vertex {} has an odd number of faces",
        vertices[0],
        vertices[1]
    )]
    OpenSurface {
        /// Ends of an edge on the rim, in the order of the mesh's file; of a list of triangles,
        /// corner k of triangle i is 3 i + k.
        vertices: [u32; 2],
    },
    /// A surface like a Klein bottle.
    #[error("the surface has one side only; its faces cannot be turned to point outward")]
    OneSidedSurface,
    /// A surface without an inside.
    #[error("a closed part of the surface encloses no volume")]
    FlatSurface,
    /// A rotation about nothing.
    #[error("the rotation axis is the zero vector; give a direction, of any length")]
    ZeroAxis,
    /// A NaN or infinity, given or arising.
    #[error("{what} is not finite")]
    NotFinite {
        /// The offending item.
        what: &'static str,
    },
    /// The map at this value of the parameter flattens space or mirrors it.
    #[error(
        "at theta = {theta} the map collapses or mirrors space (determinant {determinant}); \
         choose a value nearer to zero"
    )]
    Collapsed {
        /// The parameter's value.
        theta: f64,
        /// Determinant of the linear part there.
        determinant: f64,
    },
    /// A deformation of something that has no vertices.
    #[error("its target is placed as a whole and has no vertices to move; use an affine change")]
    NotAffine,
    /// The parameter's index is outside the number of parameters announced.
    #[error("there are only {count} parameters")]
    ParameterIndex {
        /// Number of parameters.
        count: usize,
    },
    /// Targets that follow each other.
    #[error("targets follow each other in a circle; let one of them carry the motion itself")]
    FollowCycle,
}

pub(crate) fn finite(ok: bool, what: &'static str) -> Result<(), Cause> {
    if ok { Ok(()) } else { Err(Cause::NotFinite { what }) }
}
