/// Why tetrahedra are no mesh of a domain.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TetMeshError {
    /// More vertices or tetrahedra than 32-bit indices can name.
    #[error("{count} {what} are too many: at most 1073741823 can be indexed")]
    TooLarge {
        /// Vertices or tetrahedra.
        what: &'static str,
        /// How many there are.
        count: usize,
    },
    /// A coordinate is NaN, infinite or beyond 1e100.
    #[error("vertex {vertex} (from 0) has a coordinate that is not a number below 1e100")]
    BadPosition {
        /// Which vertex.
        vertex: u32,
    },
    /// A tetrahedron names a vertex that does not exist.
    #[error("tetrahedron {tet} (from 0) names vertex {index}, but there are only {count}")]
    IndexOutOfRange {
        /// Which tetrahedron.
        tet: u32,
        /// The index it names.
        index: u32,
        /// How many vertices there are.
        count: usize,
    },
    /// A tetrahedron names a vertex twice.
    #[error("tetrahedron {tet} (from 0) names vertex {vertex} more than once")]
    RepeatedVertex {
        /// Which tetrahedron.
        tet: u32,
        /// The vertex.
        vertex: u32,
    },
    /// A tetrahedron's vertices are listed the other way round.
    #[error(
        "tetrahedron {tet} (from 0) is inverted: swap two of its vertices (`TetMesh::orient` does \
         for all), or move one back to its side"
    )]
    Inverted {
        /// Which tetrahedron.
        tet: u32,
    },
    /// The vertices of a tetrahedron lie in one plane.
    #[error("tetrahedron {tet} (from 0) has no volume: leave it out, or move a vertex")]
    Flat {
        /// Which tetrahedron.
        tet: u32,
    },
    /// Three tetrahedra or more have one face.
    #[error(
        "the face of vertices {face:?} belongs to tetrahedra {tets:?} (all from 0); at most two \
         can share one"
    )]
    FaceSharedByThree {
        /// The face's vertices, ascending.
        face: [u32; 3],
        /// The first three of the tetrahedra.
        tets: [u32; 3],
    },
    /// Two tetrahedra lie over one another.
    #[error("tetrahedra {} and {} (from 0) overlap", tets[0], tets[1])]
    Overlap {
        /// The two.
        tets: [u32; 2],
    },
    /// Two tetrahedra touch in a face, but have different vertices there.
    #[error(
        "tetrahedra {} and {} (from 0) meet in a face but share no vertices there: merge vertices \
         at equal positions",
        tets[0], tets[1]
    )]
    Crack {
        /// The two.
        tets: [u32; 2],
    },
    /// A vertex of no tetrahedron.
    #[error("vertex {vertex} (from 0) belongs to no tetrahedron: leave it out")]
    UnreferencedVertex {
        /// Which vertex.
        vertex: u32,
    },
}
