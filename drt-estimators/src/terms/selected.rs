//! The terms of a derivative that an estimator has chosen to sample.

use alloc::sync::Arc;
use alloc::vec::Vec;

use crate::derivative::velocity::VelocityField;
use crate::model::rendering::Term;
use crate::sampling::bidirectional::EmissionSampler;
use crate::terms::boundary_segments::Boundary;
use crate::terms::boundary_source::BoundarySource;
use crate::terms::edge_queries::{QueryRate, SeenEdges};
use crate::terms::flux::{Flux, GrazingFlux};
use crate::terms::grazing::GrazingTriangles;

/// A velocity of the vertices of paths, and the terms that go with it. The interior term is always there; each of the others
/// is prepared where it can contribute.
#[derive(Debug)]
pub(crate) struct Terms {
    /// The velocity of the vertices of paths.
    pub(crate) velocity: Arc<dyn VelocityField>,
    /// Boundary segments by edges, with both ends free (2021 paper).
    pub(crate) boundary: Boundary,
    /// Edges that vertices of paths, and the camera, see (2019 paper).
    pub(crate) edges: Option<SeenEdges>,
    /// How often paths query those.
    pub(crate) queries: QueryRate,
    /// What sweeps over the insides of media that do not follow it.
    pub(crate) flux: Option<Flux>,
    /// The flux through what the camera sees edge on.
    pub(crate) grazing_flux: Option<GrazingFlux>,
    /// What the camera sees edge on, if the interior of paths that begin there is sampled apart.
    pub(crate) grazing: Option<GrazingTriangles>,
    /// Where light paths start, if there are any.
    pub(crate) emission: Option<EmissionSampler>,
    /// What is sampled apart from the paths of pixels.
    pub(crate) sources: Vec<BoundarySource>,
    /// Image points come in mirrored pairs.
    pub(crate) antithetic: bool,
    /// Rays in narrow lobes come in pairs, which tell how these turn.
    pub(crate) lobe_pairs: bool,
    /// Boundary samples of each kind to each sample of a pixel, by the settings alone.
    pub(crate) boundary_ratio: f64,
    /// Edges at which light may jump as something changes, and edges in all.
    pub(crate) edge_count: [u64; 2],
}

impl Terms {
    /// The interior term alone, for vertices of some velocity.
    pub(crate) fn interior(velocity: Arc<dyn VelocityField>) -> Self {
        Self {
            velocity,
            boundary: Boundary::default(),
            edges: None,
            queries: QueryRate::default(),
            flux: None,
            grazing_flux: None,
            grazing: None,
            emission: None,
            sources: Vec::new(),
            antithetic: false,
            lobe_pairs: false,
            boundary_ratio: 1.0,
            edge_count: [0; 2],
        }
    }

    /// Those found along paths with so many edge queries, but for the interior, in the order of their layers where terms are kept
    /// apart.
    pub(crate) fn along_paths(&self, queries: QueryRate) -> impl Iterator<Item = Term> + use<> {
        let warp = self.velocity.follows_edges().then_some(Term::Warp);
        let flux = self.flux.as_ref().map(|_| Term::Flux);
        let shadows = self.boundary.shadows.as_ref().map(|_| Term::Direct);
        let edges = if queries.any() { &[Term::Direct, Term::Indirect][..] } else { &[] };
        warp.into_iter().chain(flux).chain(shadows).chain(edges.iter().copied())
    }
}
