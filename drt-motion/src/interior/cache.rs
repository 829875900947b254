//! Tetrahedra that serve again while the geometry stays what it was.

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_geom::Mesh;
use drt_math::Vec3;

use super::tetrahedra::Tetrahedralizer;
use super::{InteriorError, Surroundings, TetrahedralField};

/// The tetrahedra of one medium, kept from one [plan](Surroundings::plan) to the next. What is taken from
/// here is what would be made anew, to the bit.
#[derive(Debug, Default)]
pub struct TetrahedraCache(Option<Entry>);

/// Tetrahedra and what they were made from.
#[derive(Debug)]
struct Entry {
    surfaces: Vec<Arc<Mesh>>,
    points: Vec<Vec3>,
    maker: Tetrahedralizer,
    field: Arc<TetrahedralField>,
}

impl TetrahedraCache {
    /// The tetrahedra around surfaces and points, made if these are not those of the last time.
    pub(super) fn get(
        &mut self,
        around: &Surroundings<'_>,
        maker: Tetrahedralizer,
    ) -> Result<Arc<TetrahedralField>, InteriorError> {
        let points = around.positions();
        if let Some(known) = &self.0
            && known.maker == maker
            && known.points == points
            && known.surfaces.len() == around.surfaces.len()
            && known.surfaces.iter().zip(&around.surfaces).all(|(a, b)| a.same_triangles(b.mesh))
        {
            return Ok(known.field.clone());
        }
        let field = Arc::new(around.tetrahedra(maker)?);
        let surfaces = around.surfaces.iter().map(|s| Arc::clone(s.mesh)).collect();
        self.0 = Some(Entry { surfaces, points, maker, field: field.clone() });
        Ok(field)
    }
}
