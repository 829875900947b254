//! Edges at which radiance jumps, as a vertex or the camera sees them.
//!
//! Where radiance is differentiated along rays of fixed directions, the directions at which it jumps move when
//! something moves. For an edge point y seen from a vertex x along d = (y - x)/r,
//! with the edge's tangent t and N = t × (-d) / |t × d|, Reynolds' theorem adds the boundary term (2019 paper, Eq. 23)
//!
//! ```text
//! ∫ f(x, d) τ(x, y) [L(-N) - L(+N)] N·(y_dot - x_dot) |t × d| / r²  dl(y),
//! ```
//!
//! where f is the scattering function and τ the transmittance. L(±N) is the radiance that leaves y towards x just
//! beside the edge on either side, or that comes from behind the edge where that side is open (D19.52–53). Silhouettes,
//! borders and creases are handled alike: on either side, the face is the first one within half a turn around the edge
//! from the direction of x, and the side is open if there is none. At the camera f is the filter times the importance,
//! and d turns with the image point.
//!
//! One vertex of each path queries an edge, so that the cost is linear in path length. The vertex is chosen mostly in
//! proportion to its throughput times an estimate of the contribution of edges seen from it.

mod difference;
mod edge_sampler;
mod primary;
mod rate;
mod reservoir;
mod vertices;

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_math::{CdfTable, Rng};

use crate::discontinuities::discontinuity_edge::{DiscontinuityEdge, DiscontinuityEdges};
use crate::terms::edge_queries::edge_sampler::EdgeSampler;
pub(crate) use crate::terms::edge_queries::rate::QueryRate;
pub(crate) use crate::terms::edge_queries::vertices::EdgeContribution;

use crate::derivative::sensitivity::ActiveInputs;
use crate::derivative::velocity::Spatial;
use crate::discontinuities::edge::Edge;
use crate::model::error::Error;
use crate::world::World;

/// The edges at which radiance jumps, grouped by the vertices that see them.
#[derive(Debug)]
pub(crate) struct SeenEdges {
    /// How the vertices of paths move.
    pub(crate) spatial: Arc<Spatial>,
    discontinuities: DiscontinuityEdges,
    /// Seen from the camera.
    camera: Option<PrimaryEdges>,
    /// Seen from a vertex that stands still.
    moving: Option<EdgeSampler>,
    /// Seen from a vertex that moves.
    all: Option<EdgeSampler>,
    /// At rest, before something that moves and whose vertices have a blend weight: this counts for a vertex that
    /// stands still, too.
    resting: Option<EdgeSampler>,
    /// Edges that can be chosen, and edges in all.
    pub(crate) count: [u64; 2],
}

/// A choice of edges by how much of them the camera sees, and of points on them by length.
#[derive(Debug)]
struct PrimaryEdges {
    discontinuities: Vec<u32>,
    table: CdfTable,
}

/// How much an edge at rest matters before something that moves, to what stands still, compared to one
/// that moves; and the part of queries for such.
const AT_REST: f64 = 0.1;

/// How much more edges matter to a vertex that moves: it moves faster than what it lands on where it
/// grazes, and what moves with its matter it sees wholly.
const CARRIED: f64 = 4.0;

/// The part of choices among vertices by throughput alone, in case edges matter more to one
/// than it seems.
const BY_THROUGHPUT: f64 = 0.2;

/// Uniform numbers of an edge query.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeQuery {
    /// For the vertex.
    vertex: f64,
    /// For the direction.
    way: f64,
    /// For the edge, and the point on it.
    point: [f64; 2],
}

impl EdgeQuery {
    /// How many numbers it takes.
    const NUMBERS: u32 = 4;

    /// The generator of a query to be made later, if at all.
    pub(crate) fn reserve(rng: &mut Rng) -> Rng {
        let reserved = rng.clone();
        rng.skip(Self::NUMBERS);
        reserved
    }

    pub(crate) fn new(rng: &mut Rng) -> Self {
        Self { vertex: rng.next_f64(), way: rng.next_f64(), point: rng.next_2d() }
    }
}

/// A point on an edge.
struct Chosen<'a> {
    discontinuity: &'a DiscontinuityEdge,
    /// How far along the edge.
    along: f64,
    /// 1 over the density per length.
    inv_pdf: f64,
}

impl PrimaryEdges {
    /// A table of all edges with their weights.
    fn new(weights: impl Iterator<Item = f64>) -> Result<Option<Self>, Error> {
        let weighed = (0..).zip(weights);
        let (indices, weights): (Vec<u32>, Vec<f64>) = weighed.filter(|(_, w)| *w > 0.0).unzip();
        if indices.is_empty() {
            return Ok(None);
        }
        let table = CdfTable::new(&weights)
            .map_err(|e| Error::Element { element: "edges".into(), reason: e.into() })?;
        Ok(Some(Self { discontinuities: indices, table }))
    }

    fn sample<'a>(&self, discontinuities: &'a DiscontinuityEdges, rng: &mut Rng) -> Chosen<'a> {
        // Monotone: one number places the point among all edges.
        let s = self.table.sample(rng.next_f64());
        let discontinuity = &discontinuities.list[self.discontinuities[s.index] as usize];
        Chosen { discontinuity, along: s.residual, inv_pdf: discontinuity.length() / s.pmf }
    }
}

impl SeenEdges {
    /// The edges at which something can change of what is of interest, which move with some relative
    /// `speed`.
    pub(crate) fn new(
        world: &World,
        active: &ActiveInputs,
        spatial: Arc<Spatial>,
        speed: impl Fn(&Edge) -> f64,
    ) -> Result<Self, Error> {
        // From a vertex on what moves, everything seems to; else no edge is even looked for.
        let any = active.sensor || active.shapes.contains(&true);
        let discontinuities = if any {
            DiscontinuityEdges::collect(world, &active.shapes)
        } else {
            DiscontinuityEdges::default()
        };
        let moves = |j: &DiscontinuityEdge| {
            if j.moves(&active.shapes) { speed(&j.edge) } else { 0.0 }
        };
        let moving_shapes = (0..).zip(&active.shapes).filter(|(_, moves)| **moves);
        let holding: Vec<u32> =
            moving_shapes.map(|(s, _)| s).filter(|s| spatial.blends.acts_on(world, *s)).collect();
        let at_rest = !holding.is_empty();
        let at_rest_in_view = holding.iter().any(|s| spatial.blends.acts_in_view_on(*s));
        let speeds: Vec<f64> = discontinuities.list.iter().map(moves).collect();
        let fastest = speeds.iter().copied().fold(0.0, f64::max);
        let relative = |speed: f64| match (active.sensor, at_rest_in_view) {
            (true, _) => 1.0,
            (_, true) => f64::max(speed, AT_REST * fastest),
            _ => speed,
        };
        let seen = discontinuities
            .list
            .iter()
            .zip(&speeds)
            .map(|(j, s)| relative(*s) * discontinuities.seen_from(j, &world.camera));
        let camera = PrimaryEdges::new(seen)?;
        let views = |matter: &dyn Fn(&DiscontinuityEdge) -> f64| {
            EdgeSampler::new(world, &discontinuities, matter)
        };
        let moving = views(&|j| if fastest > 0.0 { moves(j) / fastest } else { 0.0 });
        let resting = at_rest.then(|| views(&|j| if moves(j) > 0.0 { 0.0 } else { 1.0 })).flatten();
        let resting = resting.map(|views| views.before(world, &holding));
        let all = views(&|_| 1.0);
        let count = [discontinuities.list.len() as u64, discontinuities.all];
        Ok(Self { spatial, discontinuities, camera, moving, all, resting, count })
    }

    /// Some edges as the camera alone sees them; `None` where it sees none.
    pub(crate) fn in_view(
        world: &World,
        discontinuities: DiscontinuityEdges,
        spatial: Arc<Spatial>,
        counts: impl Fn(&DiscontinuityEdge) -> bool,
    ) -> Result<Option<Self>, Error> {
        let size = |j: &DiscontinuityEdge| match counts(j) {
            true => discontinuities.seen_from(j, &world.camera),
            false => 0.0,
        };
        let camera = PrimaryEdges::new(discontinuities.list.iter().map(size))?;
        let count =
            [camera.as_ref().map_or(0, |c| c.discontinuities.len() as u64), discontinuities.all];
        let [moving, all, resting] = [None, None, None];
        Ok(camera.is_some().then_some(Self {
            spatial,
            discontinuities,
            camera,
            moving,
            all,
            resting,
            count,
        }))
    }

    /// True when the camera can see something change.
    pub(crate) fn has_primary_edges(&self) -> bool {
        self.camera.is_some()
    }

    /// True when a vertex can.
    pub(crate) fn has_edges(&self, world: &World) -> bool {
        world.max_depth >= 2 && self.all.is_some()
    }
}
