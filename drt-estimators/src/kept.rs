//! What a preparation can take from an earlier one of nearly the same scene.

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_geom::Mesh;
use drt_math::Vec3;
use drt_motion::interior::TetrahedralField;

use crate::Error;
use crate::scene::Scene;
use crate::transport::Geometry;

/// Things that depend on geometry alone and cost more to make than to compare. What is taken from here
/// is what would be made anew, to the bit.
#[derive(Debug, Default)]
pub(crate) struct Kept {
    geometry: Option<Arc<Geometry>>,
    /// Per medium.
    tetrahedra: Vec<Option<Tetrahedra>>,
}

/// Tetrahedra and what they were made from.
#[derive(Debug)]
struct Tetrahedra {
    surfaces: Vec<Arc<Mesh>>,
    points: Vec<Vec3>,
    field: Arc<TetrahedralField>,
}

impl Kept {
    /// The surfaces of a scene, prepared for ray queries.
    pub(crate) fn geometry(&mut self, scene: &Scene) -> Result<Arc<Geometry>, Error> {
        let geometry = Geometry::new(scene, self.geometry.as_ref())?;
        self.geometry = Some(geometry.clone());
        Ok(geometry)
    }

    /// The tetrahedra of a medium between some shapes, and with vertices at some points.
    pub(crate) fn tetrahedra(
        &mut self,
        medium: usize,
        scene: &Scene,
        shapes: &[usize],
        points: &[Vec3],
        make: impl FnOnce() -> Result<TetrahedralField, Error>,
    ) -> Result<Arc<TetrahedralField>, Error> {
        let surfaces: Vec<Arc<Mesh>> =
            shapes.iter().map(|s| scene.shapes[*s].mesh.clone()).collect();
        if self.tetrahedra.len() <= medium {
            self.tetrahedra.resize_with(medium + 1, || None);
        }
        if let Some(known) = &self.tetrahedra[medium]
            && known.points == points
            && known.surfaces.len() == surfaces.len()
            && known.surfaces.iter().zip(&surfaces).all(|(a, b)| same_triangles(a, b))
        {
            return Ok(known.field.clone());
        }
        let field = Arc::new(make()?);
        let points = points.to_vec();
        self.tetrahedra[medium] = Some(Tetrahedra { surfaces, points, field: field.clone() });
        Ok(field)
    }
}

/// Whether two meshes are the same but for their normals.
pub(crate) fn same_triangles(a: &Arc<Mesh>, b: &Arc<Mesh>) -> bool {
    Arc::ptr_eq(a, b) || (a.triangles == b.triangles && a.positions == b.positions)
}
