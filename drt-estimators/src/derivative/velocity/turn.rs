//! Rates of the directions of rays.
//!
//! In the spatial form a ray keeps its direction d; of the camera's, its image point. It may turn with any rate
//! that is a differentiable field over the directions at its origin, the camera's included: with T that field,
//!
//! ```text
//! d/dθ ∫ F dω = ∫ [∂F + T·∇F + F div T] dω + jumps of F that move relative to T.
//! ```
//!
//! T is a sum over material points y beside the ray, at distances r from its origin x, with weights λ that add up to
//! at most 1 (2023 paper, Eqs. 44–47; theory sheet §10, route B):
//!
//! ```text
//! T = Σ λ (y_dot - x_dot - d d·(y_dot - x_dot)) / r - Σ λ d_dot,
//! ```
//!
//! d_dot being the rate of the camera ray's direction at its image point, which T replaces as far as Σ λ goes.

use core::ops::Range;

use drt_math::Vec3;

use crate::derivative::velocity::Blend;
use crate::world::vertex::{MaterialPoint, SurfacePoint, Vertex};

/// A summand of the rate of a ray's direction, linear in the velocity w of a point beside the ray less that of the ray's
/// origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TurnPart {
    /// The point; `None` of what is at rest.
    pub(crate) matter: Option<MaterialPoint>,
    /// λ / r: the direction's rate per unit of w across the ray. 1 / scene units.
    pub(crate) rate: f64,
    /// What its dot product with w gives to div T. 1 / scene units.
    pub(crate) divergence: Vec3,
}

/// The rate T of a ray's direction.
#[derive(Clone, Debug)]
pub(crate) struct RayTurn {
    /// Σ λ.
    pub(crate) weight: f64,
    /// Its gradient by the direction, across it.
    pub(crate) gradient: Vec3,
    /// Its summands.
    pub(crate) parts: Range<usize>,
}

impl RayTurn {
    /// 1 - Σ λ, what is left of other velocities at a distance along the ray.
    pub(crate) fn rest(&self, distance: f64) -> Blend {
        Blend { weight: 1.0 - self.weight, gradient: -self.gradient / distance }
    }
}

/// A ray as its turn is asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TurningRay<'a> {
    /// Where it starts.
    pub(crate) viewer: &'a Vertex,
    /// The viewer moves for some parameter.
    pub(crate) moves: bool,
    /// The viewer is the camera, and this the pixel's column and row.
    pub(crate) pixel: Option<[u32; 2]>,
    /// Unit.
    pub(crate) dir: Vec3,
    /// To where it ends; infinite where it leaves the scene.
    pub(crate) distance: f64,
    /// The surface point there.
    pub(crate) end: Option<&'a SurfacePoint>,
}
