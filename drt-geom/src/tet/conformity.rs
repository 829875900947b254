use alloc::vec::Vec;
use core::ops::ControlFlow;

use drt_math::Vec3;

use super::{TetMesh, TetMeshError};
use crate::query::BoxTree;
use crate::{Aabb, BvhError, Mesh, TriangleBvh, nearest_point};

/// Distance, relative to the surface's largest extent, up to which a point is on the surface.
const ON_SURFACE: f64 = 1e-9;

/// The material point of a surface that a vertex of a tetrahedral mesh lies on.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SurfacePlace {
    /// Index of the triangle.
    pub triangle: u32,
    /// Barycentric weights of its second and third corner; the first has the rest.
    pub bary: [f64; 2],
}

/// Why a tetrahedral mesh does not follow a surface.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConformityError {
    /// The surface's triangles cannot be searched.
    #[error("the surface: {0}")]
    Surface(#[from] BvhError),
    /// The tetrahedra are no mesh.
    #[error(transparent)]
    Mesh(#[from] TetMeshError),
    /// A face on the surface lies in no single triangle of it.
    #[error(
        "the face of vertices {face:?} of tetrahedron {tet} lies on the surface across the edges of \
         triangle {triangle} (all from 0): a face must lie in one triangle"
    )]
    FaceStraddles {
        /// A tetrahedron with that face.
        tet: u32,
        /// The face's vertices.
        face: [u32; 3],
        /// A triangle it lies in with a part.
        triangle: u32,
    },
    /// Not all of a triangle is a face of tetrahedra.
    #[error(
        "triangle {triangle} (from 0) of the surface is covered by faces of tetrahedra for a \
         fraction {covered} of its area"
    )]
    NotCovered {
        /// Which triangle.
        triangle: u32,
        /// The fraction.
        covered: f64,
    },
}

impl TetMesh {
    /// Checks that the faces of tetrahedra follow a surface, at the domain's boundary or inside of
    /// it, and returns the vertices on the surface with their places there, in ascending order.
    ///
    /// A point within 1e-9 of the surface's largest extent is on it. A face with its middle and all
    /// vertices on the surface must have the vertices on one triangle; and the areas of the faces on
    /// a triangle must sum to the triangle's. Then the surface is a union of faces, velocities that
    /// are linear in its triangles are linear in the faces, and vertices added on the surface take
    /// them from their places.
    ///
    /// # Errors
    /// For the first face that lies in several triangles, and the first triangle that is not covered.
    pub fn conformity(&self, surface: &Mesh) -> Result<Vec<(u32, SurfacePlace)>, ConformityError> {
        self.check_arrays()?;
        let bvh = TriangleBvh::of(surface)?;
        let bounds = surface.bounds();
        let tolerance =
            if surface.triangles.is_empty() { 0.0 } else { ON_SURFACE * bounds.extent().max_abs() };
        let mut places = Vec::new();
        let mut on_surface = alloc::vec![false; self.positions.len()];
        for (vertex, p) in (0..).zip(&self.positions) {
            if let Some(c) = bvh.closest_point(*p).filter(|c| c.distance <= tolerance) {
                places.push((vertex, SurfacePlace { triangle: c.prim, bary: c.bary }));
                on_surface[vertex as usize] = true;
            }
        }
        let covered = self.covered_areas(surface, &on_surface, tolerance)?;
        for (triangle, covered) in (0..).zip(covered) {
            let [a, b, c] = surface.triangle(triangle);
            let (area, rim) = (surface.area(triangle), (b - a).length() + (c - b).length());
            // Within the tolerance of its rim faces may miss the triangle, or leave it.
            if (covered - area).abs() > 4.0 * tolerance * rim {
                return Err(ConformityError::NotCovered { triangle, covered: covered / area });
            }
        }
        Ok(places)
    }

    /// For each triangle of the surface, the area of the faces that lie in it.
    fn covered_areas(
        &self,
        surface: &Mesh,
        on_surface: &[bool],
        tolerance: f64,
    ) -> Result<Vec<f64>, ConformityError> {
        let count = surface.triangles.len() as u32;
        let (tree, order) = BoxTree::build(&surface.bounds(), count, |i| surface.triangle(i));
        let mut covered = alloc::vec![0.0; count as usize];
        for (tet, k) in self.distinct_faces()? {
            let face = self.face(tet, k);
            if !face.iter().all(|v| on_surface[*v as usize]) {
                continue;
            }
            let corners = face.map(|v| self.positions[v as usize]);
            let [a, b, c] = corners;
            let middle = (a + b + c) / 3.0;
            let is_on = |triangle: u32, p: Vec3| {
                (nearest_point(surface.triangle(triangle), p) - p).length() <= tolerance
            };
            let mut whole = false;
            let mut touched = None;
            let reach = Vec3::splat(tolerance);
            let window = Aabb { min: middle - reach, max: middle + reach };
            tree.near(&window, |places| {
                for &triangle in &order[places] {
                    if corners.iter().all(|p| is_on(triangle, *p)) {
                        whole = true;
                        covered[triangle as usize] += 0.5 * (b - a).cross(c - a).length();
                    } else if is_on(triangle, middle) {
                        touched = Some(touched.map_or(triangle, |t: u32| t.min(triangle)));
                    }
                }
                ControlFlow::Continue(())
            });
            if let (false, Some(triangle)) = (whole, touched) {
                return Err(ConformityError::FaceStraddles { tet, face, triangle });
            }
        }
        Ok(covered)
    }

    /// Every face once: a tetrahedron that has it, and the corner opposite to it.
    fn distinct_faces(&self) -> Result<impl Iterator<Item = (u32, usize)>, TetMeshError> {
        let neighbours = self.neighbours()?;
        // A face of the boundary has no number, which is the largest.
        Ok((0..).zip(neighbours).flat_map(|(tet, across)| {
            (0..4).filter(move |k| tet < across[*k]).map(move |k| (tet, k))
        }))
    }
}
