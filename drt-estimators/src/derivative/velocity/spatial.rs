//! The spatial form: vertices move with the rays that found them (2019 paper, Eqs. 19–32; theory sheet §2,
//! §3).
//!
//! A path is a function of the camera's ray and of directions and distances that do not depend on the
//! parameters. A ray x + t d whose origin has the velocity x_dot, and whose direction has the rate d_dot (the
//! camera's alone; every other direction is an integration variable), gives the points along it the velocity
//! x_dot + t d_dot: volume vertices at fixed t, and the points at which coefficients are looked up. It
//! lands on a surface with unit normal n and velocity u at the distance D, where (D19.19)
//!
//! ```text
//! D_dot = n·(u - x_dot - D d_dot) / (n·d),     x0_dot = x_dot + D d_dot + D_dot d.
//! ```
//!
//! A landing point slides over its triangle with the velocity x0_dot - u. A plane's normal does not mind;
//! an interpolated one does, and turns with the barycentric weights.
//!
//! Where a surface is grazed, on lamps, and in media that move by one affine field, the velocity is
//! [blended](super::blend) with that of matter; in homogeneous media distances are [warped](super::warp).
//!
//! What these derivatives leave out, jumps of the integrand that move, is in
//! [`radiative`](crate::terms::edge_queries).

use alloc::vec::Vec;

use drt_math::Vec3;

use crate::derivative::sensitivity::ActiveInputs;
use crate::derivative::velocity::blend::Blends;
use crate::derivative::velocity::warp::{free_paths, warps};
use crate::derivative::velocity::{
    Auxiliary, Blend, Found, Movers, Probe, VelocityField, VertexVelocity,
};
use crate::sampling::trace::Endpoint;
use crate::world::World;
use crate::world::vertex::{Matter, SurfacePoint, Vertex};

/// In wider lobes, in radians, what the two rays of a pair see differs too much for their cost.
pub(super) const WIDEST_PAIRED: f64 = 0.15;

/// φ = 0 but for blends.
#[derive(Clone, Debug)]
pub(crate) struct Spatial {
    movers: Movers,
    pub(crate) blends: Blends,
    /// 1/σ, a length, of the media in which distances are warped.
    pub(super) free_paths: Vec<Option<f64>>,
}

impl Spatial {
    /// Of a scene in which what is of interest moves.
    pub(crate) fn new(world: &World, active: &ActiveInputs) -> Self {
        let movers = Movers::new(active);
        if !active.moves_geometry() {
            return Self { movers, blends: Blends::default(), free_paths: Vec::new() };
        }
        Self { movers, blends: Blends::new(world, active), free_paths: free_paths(world) }
    }

    /// 1/σ of a medium in which distances are warped.
    pub(crate) fn free_path(&self, medium: usize) -> Option<f64> {
        self.free_paths.get(medium).copied().flatten()
    }

    /// Whether a surface point moves.
    pub(crate) fn moves(&self, s: &SurfacePoint) -> bool {
        self.movers.moves(&Matter::Surface(s.material()))
    }
}

impl VelocityField for Spatial {
    fn camera(&self) -> VertexVelocity {
        VertexVelocity { moves: self.movers.camera, ..Default::default() }
    }

    fn vertex(
        &self,
        world: &World,
        found: &Found<'_>,
        _: &mut Probe,
        auxiliary: &mut Vec<Auxiliary>,
    ) -> VertexVelocity {
        let Found { arrival, viewer, .. } = *found;
        let first = auxiliary.len();
        if let Endpoint::Volume(Vertex { medium: Some(m), .. }, _) = &arrival.end
            && let Some(free_path) = self.free_path(*m)
        {
            auxiliary.extend(warps(found.hits, arrival.dir, arrival.distance, free_path));
        }
        let auxiliary = first..auxiliary.len();
        let propagated = found.ray_moves;
        let on_mover = match &arrival.end {
            Endpoint::Surface(v) => v.surface().is_some_and(|s| self.moves(s)),
            _ => false,
        };
        let blend = match (&arrival.end, viewer) {
            // A point at rest that a ray at rest finds.
            (Endpoint::Surface(_), _) if !(propagated || on_mover) => Blend::default(),
            (Endpoint::Surface(v), None) => {
                self.blends.in_pixel(world, v, arrival.dir, arrival.distance, found.camera_ray)
            }
            (Endpoint::Surface(v) | Endpoint::Volume(v, _), Some(viewer)) => {
                self.blends.of(world, viewer, v, arrival.dir, arrival.distance)
            }
            _ => Blend::default(),
        };
        let moves = propagated || on_mover || !auxiliary.is_empty() || blend.weight > 0.0;
        VertexVelocity { moves, blend, auxiliary, turn: None }
    }

    fn may_move(&self) -> bool {
        self.movers.any()
    }

    fn moves_image_points(&self) -> bool {
        false
    }

    fn blend(
        &self,
        world: &World,
        viewer: &Vertex,
        end: &Vertex,
        dir: Vec3,
        distance: f64,
    ) -> Blend {
        self.blends.of(world, viewer, end, dir, distance)
    }

    fn turns_rays(&self, world: &World, s: &SurfacePoint, velocity: &VertexVelocity) -> bool {
        // Rays turn where they end on a material velocity, and normals of curved surfaces under points
        // that slide.
        self.moves(s) || (velocity.moves && (velocity.blend.weight > 0.0 || world.is_smooth(s)))
    }

    fn widest_paired(&self, _: bool) -> f64 {
        WIDEST_PAIRED
    }
}
