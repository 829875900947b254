//! What a preparation can take from an earlier one of nearly the same scene.

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_motion::interior::TetrahedraCache;

use crate::model::error::Error;
use crate::model::scene::Scene;
use crate::world::geometry::Geometry;

/// Things that depend only on geometry and on which shapes emit, and cost more to make than to compare or to update: trees of
/// triangles, and tetrahedra inside media. What is taken from here answers as what would be made anew, to the bit; it is kept
/// for one scene at a time.
#[derive(Debug, Default)]
pub struct PreparedCache {
    geometry: Option<Arc<Geometry>>,
    /// Per medium.
    tetrahedra: Vec<TetrahedraCache>,
}

impl PreparedCache {
    /// The surfaces of a scene, prepared for ray queries.
    pub(crate) fn geometry(&mut self, scene: &Scene) -> Result<Arc<Geometry>, Error> {
        let geometry = Geometry::new(scene, self.geometry.as_ref())?;
        self.geometry = Some(geometry.clone());
        Ok(geometry)
    }

    /// The tetrahedra of a medium.
    pub(crate) fn tetrahedra(&mut self, medium: usize) -> &mut TetrahedraCache {
        if self.tetrahedra.len() <= medium {
            self.tetrahedra.resize_with(medium + 1, TetrahedraCache::default);
        }
        &mut self.tetrahedra[medium]
    }
}
