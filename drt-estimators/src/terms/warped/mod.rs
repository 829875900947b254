//! The warped estimator: no edge is sampled, vertices move with them.

mod auxiliary;
mod beside;
mod edges;
#[cfg(all(test, feature = "std"))]
mod tests;
mod turning;

use alloc::sync::Arc;

use crate::derivative::sensitivity::ActiveInputs;
use crate::derivative::velocity::{Spatial, VelocityField};
use crate::edges::discontinuities::DiscontinuityEdges;
use crate::model::error::{Error, SettingError};
use crate::model::settings::{Settings, Warp};
use crate::terms::warped::auxiliary::directions::AuxiliaryDirections;
use crate::terms::warped::auxiliary::points::AuxiliaryPoints;
use crate::terms::warped::edges::TurningEdges;
use crate::terms::warped::turning::EdgeTurns;
use crate::world::World;

/// The velocity field of a scene whose edges are not sampled.
#[derive(Debug)]
pub(crate) struct Warped {
    pub(crate) field: Arc<dyn VelocityField>,
    /// Set in the spatial form.
    pub(crate) spatial: Option<Arc<Spatial>>,
    /// Edges that move vertices, and edges in all.
    pub(crate) count: [u64; 2],
}

impl Warped {
    /// As asked for by the settings.
    pub(crate) fn new(
        world: &World,
        active: &ActiveInputs,
        settings: &Settings,
    ) -> Result<Self, Error> {
        let any = active.sensor || active.shapes.contains(&true);
        let found = if any {
            DiscontinuityEdges::collect(world, &active.shapes)
        } else {
            DiscontinuityEdges::default()
        };
        let count = [found.list.len() as u64, found.all];
        let edges = TurningEdges::new(&found, |shape| active.shapes[shape as usize]);
        let spatial = || {
            let mut spatial = Spatial::new(world, active);
            spatial.blends.leave_media();
            Arc::new(spatial)
        };
        let refused = |reason| Err(Error::Setting { setting: "warp", reason });
        let surfaces_only = !(world.has_media() || world.any_null);
        match settings.warp {
            Warp::Edges => {
                let spatial = spatial();
                let field = EdgeTurns::new(world, active, Arc::clone(&spatial), edges);
                Ok(Self { field: Arc::new(field), spatial: Some(spatial), count })
            }
            Warp::Points(_) | Warp::Directions(_) if !surfaces_only => {
                refused(SettingError::SurfacesOnly)
            }
            Warp::Directions(_) if world.camera.has_borders() => {
                refused(SettingError::JumpingFilter)
            }
            Warp::Points(samples) => {
                let field = AuxiliaryPoints::new(world, active, edges, samples);
                Ok(Self { field: Arc::new(field), spatial: None, count })
            }
            Warp::Directions(samples) => {
                let spatial = spatial();
                let field = AuxiliaryDirections::new(world, Arc::clone(&spatial), edges, samples);
                Ok(Self { field: Arc::new(field), spatial: Some(spatial), count })
            }
        }
    }
}
