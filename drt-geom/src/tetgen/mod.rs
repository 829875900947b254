//! Tetrahedralization by TetGen.

use alloc::vec::Vec;
use core::fmt;
use std::collections::HashSet;
use std::time::Duration;

use drt_math::Vec3;

use self::facets::Facets;
use crate::crossing::{crossings, volume_sign};
use crate::{
    MeshError, TetMesh, TetVertexOrigin, Tetrahedralization, TetrahedralizeInput, TriangleBvh,
};

mod facets;

/// Most faces that an error names.
const NAMED: usize = 8;

/// Nearer than this to a face, in units of the box's diagonal, a point is on it for the library.
const NEAR: f64 = 1e-8;

/// Why TetGen makes no tetrahedra of an input. Faces are (surface, triangle), both from 0.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TetgenError {
    /// A surface's arrays are not right.
    #[error("surface {surface} (from 0): {source}")]
    BadSurface {
        /// Which surface.
        surface: usize,
        /// What is wrong.
        source: MeshError,
    },
    /// A point is not finite.
    #[error("point {point} (from 0) has a coordinate that is not a finite number")]
    BadPoint {
        /// Which point.
        point: usize,
    },
    /// No triangle with an area, no point.
    #[error("there is neither a triangle with an area nor a point to make tetrahedra of")]
    Empty,
    /// The box does not enclose the rest.
    #[error(
        "a margin of {margin} makes no box around everything; it must be positive, finite, and \
         more than rounding, and the input more than one point"
    )]
    BadMargin {
        /// The margin.
        margin: f64,
    },
    /// Two triangles of a surface have the same corners.
    #[error(
        "triangles {} and {} (from 0) of surface {surface} have the same corners; drop one, as \
         Mesh::drop_degenerate does where they also face the same way",
        triangles[0],
        triangles[1]
    )]
    Repeated {
        /// Which surface.
        surface: u32,
        /// The triangles.
        triangles: [u32; 2],
    },
    /// Faces have more in common than corners and edges of both.
    #[error("faces cross, overlap or touch: {}; {source}", Named(pairs))]
    Crossing {
        /// The first few pairs.
        pairs: Vec<[(u32, u32); 2]>,
        /// How the library failed.
        source: tetgen_sys::Error,
    },
    /// A point lies on a face, or too near it.
    #[error("point {point} (from 0) lies on a face: {}; {source}", Named(&[[*face]]))]
    OnFace {
        /// Which point.
        point: u32,
        /// The face.
        face: (u32, u32),
        /// How the library failed.
        source: tetgen_sys::Error,
    },
    /// The result has not all faces of the input.
    #[error("TetGen lost {count} faces of the input: {}", Named(faces.as_chunks::<1>().0))]
    Lost {
        /// The first few of them.
        faces: Vec<(u32, u32)>,
        /// How many there are.
        count: usize,
    },
    /// The result has tetrahedra without volume.
    #[error("TetGen made {count} tetrahedra without volume, the first at {at:?}")]
    Flat {
        /// A corner of the first.
        at: Vec3,
        /// How many there are.
        count: usize,
    },
    /// The library failed, and no face of the input is to blame.
    #[error(transparent)]
    Library(#[from] tetgen_sys::Error),
}

/// Fills the box around surfaces and points with tetrahedra by TetGen, which keeps every triangle
/// as a face of the mesh, without new vertices on it.
///
/// The vertices are those of the surfaces' triangles, the points, the eight corners of the box, and
/// at last, seldom many, those that TetGen added in between. Equal positions are one vertex.
/// Triangles of zero area are left out; where different surfaces touch in equal triangles, they are one
/// face.
///
/// TetGen runs in a process of its own (see the crate tetgen-sys, which is under the AGPL), so that
/// nothing it meets can harm this one. It is stopped after `limit`. 70 000 triangles take two seconds
/// or so.
///
/// # Errors
/// When the input is not finite, names vertices that do not exist, or is empty; when the margin makes no
/// box; when triangles repeat, cross, overlap, or touch other than in common corners and edges; when
/// TetGen cannot run, fails, or is not done in time.
pub fn tetrahedralize_tetgen(
    input: &TetrahedralizeInput<'_>,
    limit: Duration,
) -> Result<Tetrahedralization, TetgenError> {
    let facets = Facets::new(input)?;
    let points: Vec<_> = facets.positions.iter().map(|p| p.to_array()).collect();
    let made = tetgen_sys::tetrahedralize(&points, &facets.triangles, limit)
        .map_err(|error| blame(&facets, error))?;
    let mut positions = facets.positions;
    positions.extend(made.points.iter().skip(positions.len()).map(|p| Vec3::from(*p)));
    let mesh = TetMesh { positions, tets: made.tets };
    expect_faces(&mesh, &facets.triangles, &facets.names)?;
    expect_volumes(&mesh)?;
    let mut origins = facets.origins;
    origins.resize(mesh.positions.len(), TetVertexOrigin::Inside);
    Ok(Tetrahedralization { mesh, origins, shared: facets.shared })
}

/// Finds what in the input made the library fail.
fn blame(facets: &Facets, source: tetgen_sys::Error) -> TetgenError {
    use tetgen_sys::Error::{Ended, Refused, TimedOut};
    if !matches!(source, Refused { .. } | Ended { .. } | TimedOut { .. }) {
        return source.into();
    }
    // The box, whose faces have no names, is far from everything.
    let named = &facets.triangles[..facets.names.len()];
    let mut pairs: Vec<_> = crossings(&facets.positions, named, NAMED)
        .into_iter()
        .map(|pair| pair.map(|i| facets.names[i as usize]))
        .collect();
    if !pairs.is_empty() {
        pairs.sort_unstable();
        return TetgenError::Crossing { pairs, source };
    }
    match point_on_face(facets, named) {
        Some((point, face)) => TetgenError::OnFace { point, face, source },
        None => source.into(),
    }
}

fn point_on_face(facets: &Facets, named: &[[u32; 3]]) -> Option<(u32, (u32, u32))> {
    let corners = |t: &[u32; 3]| t.map(|v| facets.positions[v as usize]);
    let soup: Vec<_> = named.iter().map(corners).collect();
    let bvh = TriangleBvh::build(&soup).ok()?;
    let near = NEAR * bvh.bounds().extent().length();
    facets.positions.iter().zip(&facets.origins).find_map(|(p, origin)| {
        let TetVertexOrigin::Point(point) = *origin else { return None };
        let nearest = bvh.closest_point(*p).filter(|nearest| nearest.distance <= near)?;
        Some((point, facets.names[nearest.prim as usize]))
    })
}

/// Every triangle of the input must be a face of a tetrahedron.
fn expect_faces(
    mesh: &TetMesh,
    triangles: &[[u32; 3]],
    names: &[(u32, u32)],
) -> Result<(), TetgenError> {
    let sorted = |mut t: [u32; 3]| {
        t.sort_unstable();
        t
    };
    let mut missing: HashSet<[u32; 3]> =
        triangles[..names.len()].iter().map(|t| sorted(*t)).collect();
    for &[a, b, c, d] in &mesh.tets {
        for face in [[a, b, c], [a, b, d], [a, c, d], [b, c, d]] {
            missing.remove(&sorted(face));
        }
    }
    if missing.is_empty() {
        return Ok(());
    }
    let lost = triangles.iter().zip(names).filter(|(t, _)| missing.contains(&sorted(**t)));
    let faces = lost.map(|(_, name)| *name).take(NAMED).collect();
    Err(TetgenError::Lost { faces, count: missing.len() })
}

fn expect_volumes(mesh: &TetMesh) -> Result<(), TetgenError> {
    let corners = |t: &[u32; 4]| t.map(|v| mesh.positions[v as usize]);
    let mut flat = mesh.tets.iter().filter(|t| volume_sign(corners(t)) <= 0.0);
    match flat.next() {
        None => Ok(()),
        Some(first) => Err(TetgenError::Flat { at: corners(first)[0], count: 1 + flat.count() }),
    }
}

/// Faces, or pairs of them, as a sentence names them.
struct Named<'a, const N: usize>(&'a [[(u32, u32); N]]);

impl<const N: usize> fmt::Display for Named<'_, N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, group) in self.0.iter().enumerate() {
            for (k, (surface, triangle)) in group.iter().enumerate() {
                let joint = ["", ", ", " and "][if k > 0 { 2 } else { usize::from(i > 0) }];
                write!(f, "{joint}triangle {triangle} of surface {surface}")?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use drt_math::vec3;

    use super::{TetMesh, TetgenError, Vec, expect_faces, expect_volumes};

    /// Two tetrahedra on a common face.
    fn pair() -> TetMesh {
        let tip = |z| vec3(0.25, 0.25, z);
        let positions = [vec3(0.0, 0.0, 0.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0)];
        let positions: Vec<_> = positions.into_iter().chain([tip(1.0), tip(-1.0)]).collect();
        TetMesh { positions, tets: vec![[0, 1, 2, 3], [1, 0, 2, 4]] }
    }

    #[test]
    fn lost_faces_are_named() {
        let triangles = [[2, 1, 0], [3, 4, 0], [4, 2, 1], [1, 3, 4], [0, 3, 4]];
        let names = [(0, 7), (1, 5), (1, 6), (2, 9)];
        let error = expect_faces(&pair(), &triangles, &names).unwrap_err();
        let TetgenError::Lost { faces, count: 2 } = &error else { panic!("{error}") };
        assert_eq!(*faces, [(1, 5), (2, 9)]);
        let text =
            "TetGen lost 2 faces of the input: triangle 5 of surface 1, triangle 9 of surface 2";
        assert_eq!(error.to_string(), text);
        assert!(expect_faces(&pair(), &triangles, &names[..1]).is_ok());
    }

    #[test]
    fn tetrahedra_without_volume_are_found() {
        let mut mesh = pair();
        assert!(expect_volumes(&mesh).is_ok());
        mesh.tets.push([0, 1, 2, 4]);
        mesh.positions[3].z = 0.0;
        let error = expect_volumes(&mesh).unwrap_err();
        assert!(matches!(error, TetgenError::Flat { count: 2, .. }), "{error}");
    }
}
