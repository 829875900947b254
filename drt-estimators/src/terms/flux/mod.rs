//! The flux term: scattering that moving surfaces sweep over where the inside of a medium does not
//! follow them (theory sheet §4.1).
//!
//! For every surface Σ with unit normal n from its back (-) to its front (+) and a medium whose
//! velocity field u does not match the surface's velocity u_Σ, the term is
//!
//! ```text
//! ∫_Σ [f(-) - f(+)] n·(u_Σ - u) dA,
//! ```
//!
//! f being the contribution of paths with a volume vertex on that side of Σ (0 inside an opaque
//! body). Seen from the vertex before, at the distance r in the direction w, dA = r² dω / |n·w|: every ray of a camera
//! path that crosses Σ gives one term, throughput × τ × Lout / |n·w|, with the transmittance τ and the radiance Lout
//! that a volume vertex there sends back. So the term is sampled along the camera paths themselves, however small the
//! pixel. To keep the cost linear in path length, one of the crossings of a path is chosen with probability
//! proportional to its throughput over the cosine (weighted reservoir sampling), and Lout is traced for it alone. In a
//! grid the probability is also proportional to the extinction there: where a cloud fades out inside its box, nothing
//! is traced.
//!
//! In the spatial form (2019 paper, Eqs. 16 and 20; theory sheet §3, §6) volume vertices are at fixed
//! distances along their rays, u is the velocity of the ray's point at Σ, and every surface beside a
//! medium has this flux. The term f̂ D_dot with D_dot = n·(u_Σ - u) / (n·w) is this flux, less what this surface and
//! the one beyond the medium have [warped](crate::derivative::velocity::warp) along, times the share by which vertices
//! there do not [blend](crate::derivative::velocity::blend) to their medium. Where the fluxes of the two surfaces
//! cancel for every velocity of the ray, as in a thin layer, nothing is traced.
//!
//! Camera rays rarely hit surfaces that the camera sees [edge on](grazing): points on these are sampled by area.
//!
//! A grid ends at its box, where coefficients jump to zero. Faces of the box that lie inside the medium
//! are surfaces of this kind, too, with f(+) = 0 and the velocity of the grid for u_Σ.

mod grazing_flux;
mod reservoir;

use alloc::sync::Arc;

use drt_math::Vec3;
use drt_medium::MediumKind;

pub(crate) use crate::terms::flux::grazing_flux::{Buffers, GrazingFlux};
pub(crate) use crate::terms::flux::reservoir::{FluxRay, Reservoir};

use crate::derivative::sensitivity::ActiveInputs;
use crate::derivative::velocity::Spatial;
use crate::derivative::velocity::warp::GRAZED;
use crate::world::Tracking;
use crate::world::World;
use crate::world::vertex::{SurfacePoint, Vertex};

/// Cosine of the angle of incidence below which the camera's rays leave the flux to [`GrazingFlux`].
const EDGE_ON: f64 = GRAZED;

/// The surfaces with a flux.
#[derive(Clone, Debug)]
pub(crate) struct Flux {
    /// In the material form: the shapes with a flux.
    shapes: Arc<[bool]>,
    /// Media in which the faces of a grid's box have a flux.
    grids: Arc<[bool]>,
    /// The largest extinctions of media that are grids.
    largest: Arc<[Option<f64>]>,
    /// Segments at which a volume vertex can no longer send anything.
    longest: u32,
    /// In the spatial form: the shapes and grids that have a flux even if the ray is at rest.
    movers: Option<Movers>,
    /// In the spatial form: the velocity field of vertices.
    pub(crate) spatial: Option<Arc<Spatial>>,
    /// Cosine of the angle of incidence below which the camera's rays leave the flux to [`GrazingFlux`].
    least_cosine: f64,
    /// What a flux must count for to be followed for every path, in those.
    pub(crate) followed: f64,
}

/// What moves by itself.
#[derive(Clone, Debug)]
struct Movers {
    shapes: Arc<[bool]>,
    grids: Arc<[bool]>,
}

impl Flux {
    /// The flux of the material form; `None` when nothing has a flux.
    pub(crate) fn new(world: &World, shapes: &[usize], active: &ActiveInputs) -> Option<Self> {
        let flags = (0..world.scene.shapes.len()).map(|s| shapes.contains(&s)).collect();
        let moves = |m: usize| {
            let of = |list: &[bool]| list.get(m).copied().unwrap_or(false);
            (of(&active.grids) || of(&active.volumes))
                && world.tracking[m] == Tracking::Vertices
                && ends_inside(world, m)
        };
        let grids: Arc<[bool]> = (0..world.scene.media.len()).map(moves).collect();
        let any = !shapes.is_empty() || grids.contains(&true);
        any.then_some(Self {
            shapes: flags,
            grids,
            largest: largest(world),
            longest: longest(world),
            movers: None,
            spatial: None,
            least_cosine: EDGE_ON,
            followed: 1.0,
        })
    }

    /// The flux of the spatial form; `None` when no medium has vertices.
    pub(crate) fn spatial(
        world: &World,
        active: &ActiveInputs,
        spatial: &Arc<Spatial>,
    ) -> Option<Self> {
        let media = 0..world.scene.media.len();
        let tracked = |m: usize| world.tracking[m] == Tracking::Vertices;
        let grids = media.clone().map(|m| tracked(m) && ends_inside(world, m)).collect();
        let movers = Movers {
            shapes: active.shapes.as_slice().into(),
            grids: active.grids.as_slice().into(),
        };
        media.clone().any(tracked).then(|| Self {
            shapes: Arc::default(),
            grids,
            largest: largest(world),
            longest: longest(world),
            movers: Some(movers),
            spatial: Some(Arc::clone(spatial)),
            least_cosine: EDGE_ON,
            followed: 1.0,
        })
    }

    /// This flux with everything sampled along rays, at grazing angles too.
    pub(crate) fn along_rays(self) -> Self {
        Self { least_cosine: 0.0, ..self }
    }

    /// True when a shape sweeps over the points of a ray, which may itself be `moves`.
    fn sweeps(&self, shape: u32, moves: bool) -> bool {
        (moves && self.movers.is_some()) || self.moves(shape)
    }

    /// True when a shape sweeps over the points of a ray at rest.
    fn moves(&self, shape: u32) -> bool {
        self.movers.as_ref().map_or(&self.shapes, |m| &m.shapes)[shape as usize]
    }

    /// True when the faces of a medium's grid sweep over the points of a ray, which may itself be `moves`.
    fn sweeps_grid(&self, medium: usize, moves: bool) -> bool {
        let moves = |m: &Movers| moves || m.grids[medium];
        self.grids[medium] && self.movers.as_ref().is_none_or(moves)
    }

    /// The extinction at a volume vertex over the largest in its grid: nothing where a cloud fades out inside of
    /// its box. 1 in other media.
    fn fullness(&self, world: &World, vertex: &Vertex) -> f64 {
        let Some(medium) = vertex.medium else { return 0.0 };
        match self.largest[medium] {
            Some(0.0) => 0.0,
            Some(largest) => world.medium(medium).sigma_t(vertex.x).max_abs() / largest,
            None => 1.0,
        }
    }
}

/// Segments at which a volume vertex can no longer send anything: one that is the path's last sends
/// light only if it emits.
fn longest(world: &World) -> u32 {
    let emissive = world.scene.media.iter().any(|m| m.item.is_emissive());
    world.max_depth.saturating_add(u32::from(emissive))
}

fn largest(world: &World) -> Arc<[Option<f64>]> {
    let of = |m: usize| Some(world.medium(m).grid()?.largest_sigma_t());
    (0..world.scene.media.len()).map(of).collect()
}

/// Whether a medium's grid may end inside of it: not all around the medium is in the grid's box.
fn ends_inside(world: &World, medium: usize) -> bool {
    let grid = match &world.medium(medium).kind {
        MediumKind::Grid(grid) => grid.density(),
        MediumKind::Deformed(_) => return true,
        MediumKind::Homogeneous(_) | MediumKind::Uniform(_) | MediumKind::Custom(_) => {
            return false;
        }
    };
    let shapes = &world.scene.shapes;
    let mut around =
        shapes.iter().filter(|s| s.boundary.is_some_and(|b| b.interior == Some(medium))).peekable();
    let beyond = |x: &Vec3| (grid.from_world().point(*x) - Vec3::splat(0.5)).max_abs() > 0.5 + 1e-9;
    around.peek().is_none() || around.any(|s| s.mesh.positions.iter().any(beyond))
}

/// The medium on one side of a surface, if paths have vertices in it.
fn filled(
    world: &World,
    point: &SurfacePoint,
    front: bool,
    around: Option<usize>,
) -> Option<usize> {
    let medium = world.medium_on_side(point, front, around)?;
    (world.tracking[medium] == Tracking::Vertices).then_some(medium)
}
