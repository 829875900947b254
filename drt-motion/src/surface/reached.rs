use alloc::vec::Vec;

use drt_geom::Mesh;

use super::SurfaceMotion;
use crate::lists::Lists;

/// Which of the motions of a mesh can be felt on each of its triangles.
///
/// A motion of few vertices is felt on the triangles around these alone: of ten thousand such motions a point of
/// the surface takes part in a handful.
#[derive(Clone, Debug, Default)]
pub struct ReachedTriangles {
    /// Positions, in the list of motions, of those that are felt on all triangles.
    everywhere: Vec<u32>,
    /// Positions of the others, by triangle; empty without any.
    by_triangle: Option<Lists>,
}

impl ReachedTriangles {
    /// The triangles that each of the motions of a mesh reaches.
    #[must_use]
    pub fn new<'a>(mesh: &Mesh, motions: impl IntoIterator<Item = &'a SurfaceMotion>) -> Self {
        let mut everywhere = Vec::new();
        let mut around: Option<Lists> = None;
        let mut pairs = Vec::new();
        for (n, motion) in (0..).zip(motions) {
            let Some(vertices) = motion.few_vertices() else {
                everywhere.push(n);
                continue;
            };
            let around = around.get_or_insert_with(|| triangles_around(mesh));
            let mut reached: Vec<u32> =
                vertices.flat_map(|v| around.of(v as usize)).copied().collect();
            reached.sort_unstable();
            reached.dedup();
            pairs.extend(reached.into_iter().map(|triangle| (triangle, n)));
        }
        let by_triangle = around.map(|_| Lists::new(mesh.triangles.len(), &pairs));
        Self { everywhere, by_triangle }
    }

    /// Positions, in the list of motions, of those that can be felt on a triangle.
    pub fn on(&self, triangle: u32) -> impl Iterator<Item = usize> {
        let few = self.by_triangle.as_ref().map_or(&[][..], |l| l.of(triangle as usize));
        self.everywhere.iter().chain(few).map(|n| *n as usize)
    }
}

/// The triangles around each vertex of a mesh, ascending.
pub(super) fn triangles_around(mesh: &Mesh) -> Lists {
    let corners = (0..).zip(&mesh.triangles);
    let pairs: Vec<_> = corners.flat_map(|(t, corners)| corners.map(|v| (v, t))).collect();
    Lists::new(mesh.positions.len(), &pairs)
}
