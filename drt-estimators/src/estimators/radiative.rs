//! The 2019 estimator: the derivative of radiance itself, along the rays that carry it.
//!
//! Radiance L(x, w) is differentiated for a ray whose origin and direction move (2019 paper, Eqs.
//! 16–32, in the corrected form of theory sheet §3). Every integral over directions and distances is
//! differentiated at fixed directions and distances, so the record of an ordinary path is enough for
//! the part without jumps: [`Spatial`] sweeps it backwards. Wherever the
//! integrand jumps, and the jump moves relative to the ray, Reynolds' theorem adds a term:
//!
//! * in distance, at surfaces beside media: D_dot σ_s L^ins of D19.16 and D19.20, on both sides of
//!   interfaces that do not scatter. That is the [flux](crate::terms::flux), against rays that move. In
//!   homogeneous media most of it is taken in by vertices that surfaces [warped](crate::derivative::velocity::warp);
//! * in direction, at [edges](crate::terms::edge_queries) that vertices see (D19.23).
//!
//! The camera finds few points of what it sees [edge on](crate::terms::grazing), and these move far on their surfaces: paths that begin
//! there are sampled by area.
//!
//! Cost is linear in path length: of all vertices of a path one queries an edge, and of all surfaces met one
//! is asked for its flux; each traces side paths that
//! branch no more. (The paper does both at every vertex, at a cost that is quadratic;
//! [`every_vertex`](crate::Settings::every_vertex) does so with edges.)
//!
//! Light from points and directions does not fit this form: its shadows make radiance jump along lines
//! on surfaces, which would be edges of the vertex before. A [`Session`](crate::Session) leaves such lights to
//! the path-space estimator and adds the two.

use alloc::sync::Arc;

use crate::derivative::medium_motion::Insides;
use crate::derivative::velocity::Spatial;
use crate::derivative::velocity::warp::GRAZED;
use crate::discontinuities::speeds::speeds;
use crate::estimators::{Changes, Estimator};
use crate::model::error::Error;
use crate::model::refusals::Sliding;
use crate::model::scene::Scene;
use crate::model::settings::Settings;
use crate::terms::boundary_source::BoundarySource;
use crate::terms::edge_queries::{QueryRate, SeenEdges};
use crate::terms::flux::Flux;
use crate::terms::grazing::GrazingTriangles;
use crate::terms::selected::Terms;
use crate::world::World;

/// The cosine of the angle of incidence below which points that the camera sees are drawn by area, over the cosine below which they have
/// a blend weight. Facets have the first, and interpolated normals the second, which differs from it by the angles between facets.
const BLENDED: f64 = 1.5;

/// The largest such cosine, for shapes that are small in the image.
const MOST: f64 = 0.1;

/// Vertices move with the rays that find them, and ask for the edges that they see.
pub(crate) struct Radiative;

impl Estimator for Radiative {
    fn name(&self) -> &'static str {
        "radiative"
    }

    fn insides(&self) -> Insides {
        Insides::Affine
    }

    fn slides(&self, _: &Settings) -> Sliding {
        Sliding::Continuously
    }

    fn takes_delta_lights(&self, _: &Scene, _: &Settings) -> bool {
        false
    }

    fn terms(&self, world: &World, changes: &Changes<'_>) -> Result<Terms, Error> {
        let spatial = Arc::new(Spatial::new(world, changes.active));
        terms_of(world, changes, spatial)
    }
}

/// The terms for vertices that move with the rays that find them, or with their matter as far as they are blended to that.
pub(crate) fn terms_of(
    world: &World,
    changes: &Changes<'_>,
    spatial: Arc<Spatial>,
) -> Result<Terms, Error> {
    let Changes { active, settings, motion, .. } = *changes;
    // Grids that move sweep over what stands still.
    let sweeps = active.moves_geometry() || active.grids.contains(&true);
    let flux = sweeps.then(|| Flux::spatial(world, active, &spatial)).flatten();
    let mut terms = Terms::interior(Arc::clone(&spatial) as _);
    let below = |s: u32| match active.sensor || active.shapes[s as usize] {
        true => f64::clamp(BLENDED * spatial.blends.cosine_in_view(s), GRAZED, MOST),
        false => 0.0,
    };
    terms.grazing = GrazingTriangles::new(world, below)?;
    let edges = match motion {
        Some(motion) => SeenEdges::new(world, active, spatial, speeds(motion, world))?,
        None => SeenEdges::new(world, active, spatial, |_| 1.0)?,
    };
    if edges.has_primary_edges() {
        terms.sources.push(BoundarySource::PrimaryEdges);
    }
    let has_edges = edges.has_edges(world);
    let queries = has_edges && !settings.every_vertex;
    terms.share_samples(settings, terms.sources.len() + usize::from(queries));
    terms.queries = match settings.every_vertex {
        _ if !has_edges => QueryRate::default(),
        true => QueryRate::EveryVertex,
        false => QueryRate::Average(terms.boundary_ratio),
    };
    terms.edge_count = edges.count;
    terms.edges = Some(edges);
    terms.lobe_pairs = settings.antithetic;
    terms.add_flux(world, flux, active)?;
    terms.sources.extend(terms.grazing.as_ref().map(|_| BoundarySource::GrazingPaths));
    Ok(terms)
}
