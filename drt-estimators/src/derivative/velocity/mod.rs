//! The velocities of the vertices of a path as parameters change.
//!
//! A path integral is differentiated along a velocity field of its vertices, which is free except for its
//! value at jumps of the integrand (theory sheet §4.1, §9). Let a vertex at x be found
//! by a ray that starts at x_p and runs along d over the distance t. Every field here gives it the velocity
//!
//! ```text
//! v = φ u + (1 - φ) c + Σ_j a_j (b_j·w_j),
//! ```
//!
//! | symbol | code | meaning |
//! |---|---|---|
//! | u | | velocity of the material point at x |
//! | c | | velocity propagated by the ray: x_p_dot + t d_dot, and on a surface D_dot d in addition (2019 paper, Eq. 19) |
//! | φ, ∇φ | [`Blend`] | weight of the material velocity, and its gradient with respect to x |
//! | w_j | [`Auxiliary::matter`] | velocity of another material point, relative to that of the [ray](Moved) |
//! | b_j | [`Auxiliary::functional`] | vector whose dot product with w_j counts |
//! | a_j | [`Auxiliary::displacement`] | velocity of x per unit of this product |
//!
//! The field enters a derivative by its values and by its divergence (2023 paper, Eq. 38),
//!
//! ```text
//! div v = φ div u + (1 - φ) div c + ∇φ·(u - c) + Σ_j s_j (b_j·w_j),    s_j = div(a_j b_j·w_j) / (b_j·w_j),
//! ```
//!
//! so that v and div v are linear functionals of the velocities of matter, with coefficients that depend
//! on the path alone. [`material`] has φ = 1 (2021 paper), [`spatial`] mostly φ = 0 (2019 paper). A field
//! that is smoothed from auxiliary points (2023 paper, Eqs. 44–47) has φ = 1 and summands for each of these points.
//! Rays may also [turn] with edges beside them.
//! Only the [`VelocityField`] itself knows which of these fields it is.

pub(crate) mod blend;
mod chain;
mod intersection;
mod material;
mod path;
mod shadow;
pub(crate) mod spatial;
mod turn;
pub(crate) mod warp;
mod weight;

use alloc::sync::Arc;
use alloc::vec::Vec;
use core::ops::Range;

use drt_geom::Hit;
use drt_math::{Rng, Vec3};

pub(crate) use crate::derivative::velocity::blend::Blend;
pub(crate) use crate::derivative::velocity::chain::{
    ByU, Lamp, Link, LinkChange, Mover, RayBehind, RayByMover, RayByU, RayVelocity, evened,
    first_ray, ray_by_movers, rays_by_u,
};
pub(crate) use crate::derivative::velocity::intersection::EdgeMatter;
pub(crate) use crate::derivative::velocity::material::Material;
pub(crate) use crate::derivative::velocity::path::PathVelocities;
pub(crate) use crate::derivative::velocity::shadow::{ShadowPart, ShadowPlace, ShadowTurn};
pub(crate) use crate::derivative::velocity::spatial::Spatial;
pub(crate) use crate::derivative::velocity::turn::{
    ChainPart, ChainedRay, RayTurn, TangentPlane, TurnPart, TurnParts, TurningRay,
};
use crate::derivative::velocity::warp::SurfaceHit;
pub(crate) use crate::derivative::velocity::weight::Weight;

use crate::derivative::sensitivity::ActiveInputs;
use crate::sampling::record::CameraRay;
use crate::sampling::trace::Arrival;
use crate::world::World;
use crate::world::lights::LightSample;
use crate::world::vertex::{Matter, SurfacePoint, Vertex};

/// The velocity of one vertex of a path, as a functional of the velocities of matter.
#[derive(Clone, Debug, Default)]
pub(crate) struct VertexVelocity {
    /// False where it is zero for every parameter.
    pub(crate) moves: bool,
    /// φ and ∇φ.
    pub(crate) blend: Blend,
    /// The vertex's summands in [`PathVelocities::auxiliary`].
    pub(crate) auxiliary: Range<usize>,
    /// Index of the ray that found the vertex among the path's rays that turn, if the ray turns.
    pub(crate) turn: Option<u32>,
}

/// A part of a vertex's velocity that comes from another material point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Auxiliary {
    pub(crate) matter: Matter,
    /// b.
    pub(crate) functional: Vec3,
    /// a; scene units per unit of b·w.
    pub(crate) displacement: Vec3,
    /// s; 1 / scene units per unit of b·w.
    pub(crate) divergence: f64,
    pub(crate) moved: Moved,
}

/// What a summand of a velocity moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Moved {
    /// The vertex, by the velocity of the material point.
    #[cfg(test)]
    Vertex,
    /// The vertex, by how much faster the material point is than the vertex before.
    FromViewer,
    /// The point of the ray that found the vertex, at fixed direction, by how much faster the material point is than
    /// the ray's at its distance.
    RayPoint(f64),
}

/// A vertex, and the ray that has just found it.
pub(crate) struct Found<'a> {
    /// The ray that the path starts with.
    pub(crate) camera_ray: CameraRay,
    /// The vertex that the ray started from; `None` at the camera.
    pub(crate) viewer: Option<&'a Vertex>,
    /// The ray moves: its origin, or its direction.
    pub(crate) ray_moves: bool,
    /// How the ray turns, beyond what the camera's image point does.
    pub(crate) turn: Option<&'a RayTurn>,
    pub(crate) arrival: &'a Arrival,
    /// The surfaces on the ray, if any of them has a [flux](crate::terms::flux).
    pub(crate) hits: &'a [SurfaceHit],
}

/// What a field needs to trace rays of its own.
#[derive(Clone, Debug)]
pub(crate) struct Probe {
    /// Random numbers that are independent of the walk's.
    pub(crate) rng: Rng,
    /// Rays cast.
    pub(crate) rays: u64,
    /// Edges and shadows that turned rays, counted for each ray.
    pub(crate) turning_edges: u64,
    /// Buffer for the hits of one ray.
    pub(crate) hits: Vec<Hit>,
}

impl Probe {
    pub(crate) fn new(rng: Rng) -> Self {
        Self { rng, rays: 0, turning_edges: 0, hits: Vec::new() }
    }
}

/// A velocity field of the vertices of paths.
pub(crate) trait VelocityField: core::fmt::Debug + Send + Sync {
    /// The velocity of the camera.
    fn camera(&self) -> VertexVelocity;

    /// The velocity of a vertex of a path, or of the environment to which the path escaped; appends its summands to
    /// `auxiliary`.
    fn vertex(
        &self,
        world: &World,
        found: &Found<'_>,
        probe: &mut Probe,
        auxiliary: &mut Vec<Auxiliary>,
    ) -> VertexVelocity;

    /// Whether the field depends on the rays that find vertices, up to their ends.
    fn follows_rays(&self) -> bool {
        true
    }

    /// Whether a vertex may move, however it is found.
    fn may_move(&self) -> bool {
        true
    }

    /// Whether the image points of paths move, so that a pixel's filter has a rate.
    fn moves_image_points(&self) -> bool {
        true
    }

    /// Whether vertices move with the edges beside them; what this adds is a term of its own.
    fn follows_edges(&self) -> bool {
        false
    }

    /// Whether the image points of the camera's rays move by a rate that is continuous wherever light does not jump, equals that of the jump
    /// where it does, and is zero at the ends of the pixel's filter, so that a constant radiance has no derivative in any pixel.
    fn is_continuous_in_view(&self) -> bool {
        false
    }

    /// Whether an index of refraction changes that turns light where it goes on from a surface point in a single direction.
    fn bends(&self, _s: &SurfacePoint) -> bool {
        false
    }

    /// Whether the field draws random numbers.
    fn is_random(&self) -> bool {
        false
    }

    /// Whether points on emitters may get a velocity though neither the emitter nor the ray moves.
    fn looks_around(&self) -> bool {
        false
    }

    /// The velocity of a point on an emitter to which a `viewer` is connected along the unit direction `dir` over a
    /// `distance`; appends its summands to `auxiliary`.
    #[allow(clippy::too_many_arguments)]
    fn light(
        &self,
        world: &World,
        viewer: &Vertex,
        end: &Vertex,
        dir: Vec3,
        distance: f64,
        _viewer_moves: bool,
        _probe: &mut Probe,
        auxiliary: &mut Vec<Auxiliary>,
    ) -> VertexVelocity {
        let blend = self.blend(world, viewer, end, dir, distance);
        let last = auxiliary.len();
        VertexVelocity { moves: true, blend, auxiliary: last..last, turn: None }
    }

    /// How a ray turns, beyond what the camera's image point does; appends the summands.
    fn turn(
        &self,
        _world: &World,
        _ray: &TurningRay<'_>,
        _probe: &mut Probe,
        _parts: &mut Vec<TurnPart>,
    ) -> Option<RayTurn> {
        None
    }

    /// How a ray turns that starts a chain of smooth surfaces, with the edges beside all rays of the chain; appends the summands.
    fn turn_with_chain(
        &self,
        _world: &World,
        _chain: &ChainedRay<'_>,
        _parts: &mut Vec<TurnPart>,
        _chained: &mut Vec<ChainPart>,
    ) -> Option<RayTurn> {
        None
    }

    /// Whether rays that end at a surface point turn otherwise for what the surface emits than for what it scatters.
    fn emission_turns_apart(&self, _s: &SurfacePoint) -> bool {
        false
    }

    /// How a ray turns for what it sees by a point or directional emitter, where that differs: also with the
    /// shadows beside the point where it ends. `light_moves` tells that the emitter or that point may. Appends the
    /// summands.
    fn turn_with_shadows(
        &self,
        _world: &World,
        _ray: &TurningRay<'_>,
        _light: &LightSample,
        _light_moves: bool,
        _parts: &mut TurnParts,
    ) -> Option<RayTurn> {
        None
    }

    /// φ and ∇φ of a point seen from a `viewer` along the unit direction `dir` at a `distance`.
    fn blend(
        &self,
        world: &World,
        viewer: &Vertex,
        end: &Vertex,
        dir: Vec3,
        distance: f64,
    ) -> Blend;

    /// Whether rays that scatter at a surface point of some velocity may turn against its normal.
    fn turns_rays(&self, _world: &World, _s: &SurfacePoint, _velocity: &VertexVelocity) -> bool {
        false
    }

    /// The widest lobes, in radians, whose turning is estimated by [antithetic pairs](super::antithetic) of rays.
    fn widest_paired(&self, _transmissive: bool) -> f64 {
        0.0
    }
}

/// What moves with some parameter.
#[derive(Clone, Debug, Default)]
pub(crate) struct Movers {
    /// Shapes.
    pub(crate) shapes: Arc<[bool]>,
    /// Media whose inside moves.
    pub(crate) volumes: Arc<[bool]>,
    pub(crate) camera: bool,
}

impl Movers {
    pub(crate) fn new(active: &ActiveInputs) -> Self {
        Self {
            shapes: active.shapes.as_slice().into(),
            volumes: active.volumes.as_slice().into(),
            camera: active.sensor,
        }
    }

    /// Whether anything does.
    pub(crate) fn any(&self) -> bool {
        self.camera || [&self.shapes, &self.volumes].iter().any(|list| list.contains(&true))
    }

    /// Whether a material point does.
    pub(crate) fn moves(&self, matter: &Matter) -> bool {
        let of = |list: &[bool], i: usize| list.get(i) == Some(&true);
        match matter {
            Matter::Surface(point) => of(&self.shapes, point.shape as usize),
            Matter::Volume(medium, _) => of(&self.volumes, *medium),
        }
    }
}
