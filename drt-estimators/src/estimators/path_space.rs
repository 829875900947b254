//! The 2021 estimator: material-form path integrals.
//!
//! Every vertex of a path is a material point and moves with its matter: surfaces by the velocity of their triangles, insides of
//! media by [fields](crate::derivative::medium_motion) that follow what is around them. A path integral over material points has a
//! domain that does not depend on the parameters (2021 paper, Eq. 14), so that its derivative is
//!
//! ```text
//! d/dθ ∫ f dp = ∫ ∂f dp + ∫ Δf V dl,
//! ```
//!
//! with an interior term, whose integrand has the factors' rates and the divergence of the velocity, and a boundary term
//! over [segments](crate::terms::boundary_segments) that touch an edge, V being the normal velocity of the jump against the
//! vertices (2021 paper, Eq. 19; theory sheet §4.2). The image points of paths move, too: where a filter jumps, the borders of its support are boundaries as well.
//!
//! A medium whose inside does not follow all that is around it has the [flux](crate::terms::flux) through what is left behind
//! (theory sheet §4.1).

use alloc::sync::Arc;

use crate::derivative::medium_motion::Insides;
use crate::derivative::velocity::{Material, Movers};
use crate::estimators::orthographic_refusals::{self, Film};
use crate::estimators::{Changes, Estimator, mirrors};
use crate::model::error::Error;
use crate::model::refusals::Sliding;
use crate::model::scene::Scene;
use crate::model::settings::Settings;
use crate::terms::boundary_segments::{Boundary, Strategy};
use crate::terms::boundary_source::BoundarySource;
use crate::terms::flux::Flux;
use crate::terms::selected::Terms;
use crate::world::World;

/// Vertices move with their matter, and edges are sampled by segments that touch them.
pub(crate) struct PathSpace;

impl Estimator for PathSpace {
    fn name(&self) -> &'static str {
        "path-space"
    }

    fn insides(&self) -> Insides {
        Insides::Follow
    }

    fn slides(&self, _: &Settings) -> Sliding {
        Sliding::Nowhere
    }

    fn takes_delta_lights(&self, _: &Scene, _: &Settings) -> bool {
        true
    }

    fn terms(&self, world: &World, changes: &Changes<'_>) -> Result<Terms, Error> {
        let Changes { active, flux_shapes, settings, .. } = *changes;
        orthographic_refusals::refuse(world, changes, Film::InMedium)?;
        let mut terms = Terms::interior(Arc::new(Material::new(Movers::new(active))));
        if active.moves_geometry() {
            terms.boundary = Boundary::new(world, active)?;
            for strategy in [Strategy::Primary, Strategy::Direct, Strategy::Indirect] {
                if terms.boundary.offers(world, strategy) {
                    terms.sources.push(BoundarySource::Edges(strategy));
                }
            }
            if world.camera.has_borders() {
                terms.sources.push(BoundarySource::Borders);
            }
        }
        terms.edge_count = terms.boundary.count;
        terms.share_samples(settings, terms.sources.len());
        terms.add_flux(world, Flux::new(world, flux_shapes, active), active)?;
        terms.antithetic = mirrors(world, changes);
        terms.add_light_paths(world, changes);
        Ok(terms)
    }
}
