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

use alloc::boxed::Box;
use alloc::vec::Vec;
use core::ops::Range;

use drt_math::{Mat3, Vec3};

use crate::derivative::velocity::{
    Blend, EdgeMatter, Link, Mover, RayBehind, ShadowPart, ShadowTurn, Weight,
};
use crate::sampling::record::CameraRay;
use crate::world::vertex::{SurfacePoint, Vertex};

/// A summand of the rate of a ray's direction, linear in the velocity w of a point beside the ray less that of the ray's
/// origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TurnPart {
    /// The point; `None` of what is at rest.
    pub(crate) matter: Option<EdgeMatter>,
    /// The direction's rate by w; 1 / scene units. λ / r of what is across the ray, where all λ are numbers.
    pub(crate) rate: Mat3,
    /// What its dot product with w gives to div T. 1 / scene units.
    pub(crate) divergence: Vec3,
}

impl TurnPart {
    /// The summand times a weight that depends on the direction.
    pub(crate) fn scaled(&self, by: Weight) -> Self {
        let divergence = self.divergence * by.value + self.rate.transpose_mul(by.gradient);
        Self { matter: self.matter, rate: self.rate * by.value, divergence }
    }
}

/// A summand of the rate of a ray's direction that comes from something past a smooth surface, or from such a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChainPart {
    pub(crate) mover: Mover,
    /// The direction's rate by the velocity of the mover; 1 / scene units.
    pub(crate) rate: Mat3,
    /// What its dot product with that velocity gives to div T; 1 / scene units.
    pub(crate) divergence: Vec3,
}

/// The rate T of a ray's direction.
#[derive(Clone, Debug)]
pub(crate) struct RayTurn {
    /// Σ λ, of shadows too.
    pub(crate) weight: f64,
    /// Its gradient by the direction, across it.
    pub(crate) gradient: Vec3,
    /// Its summands.
    pub(crate) parts: Range<usize>,
    /// Those of edges that the ray meets past smooth surfaces.
    pub(crate) chain: Range<usize>,
    /// What shadows add, for the light of one emitter. Few rays have one, and turns are moved about.
    pub(crate) shadow: Option<Box<ShadowTurn>>,
}

impl RayTurn {
    /// 1 - Σ λ, what is left of other velocities at a distance along the ray.
    pub(crate) fn rest(&self, distance: f64) -> Blend {
        Blend { weight: 1.0 - self.weight, gradient: -self.gradient / distance }
    }
}

/// The summands of rays that turn with shadows.
#[derive(Clone, Debug, Default)]
pub(crate) struct TurnParts {
    pub(crate) edges: Vec<TurnPart>,
    pub(crate) shadows: Vec<ShadowPart>,
}

impl TurnParts {
    pub(crate) fn clear(&mut self) {
        self.edges.clear();
        self.shadows.clear();
    }
}

/// A ray that starts a chain of smooth surfaces, and the rays behind each of these.
#[derive(Clone, Debug)]
pub(crate) struct ChainedRay<'a> {
    pub(crate) start: TurningRay<'a>,
    pub(crate) links: Vec<Link>,
    pub(crate) rays: Vec<RayBehind>,
}

/// A plane by the direction of the ray that ends on it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TangentPlane {
    /// Unit, away from the ray's origin.
    pub(crate) normal: Vec3,
    /// Where the ray ends.
    pub(crate) place: Vec3,
    /// Two unit vectors across the ray, and what the normal and the place change by as the direction turns by them, per radian.
    pub(crate) by_direction: [(Vec3, [Vec3; 2]); 2],
}

/// A ray as its turn is asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TurningRay<'a> {
    /// Where it starts.
    pub(crate) viewer: &'a Vertex,
    /// The viewer moves for some parameter.
    pub(crate) moves: bool,
    /// The viewer is the camera, and this what the ray serves.
    pub(crate) of_camera: Option<CameraRay>,
    /// Unit.
    pub(crate) dir: Vec3,
    /// To where it ends; infinite where it leaves the scene.
    pub(crate) distance: f64,
    /// The surface point there.
    pub(crate) end: Option<&'a SurfacePoint>,
    /// Only the light counts that the surface there emits, and not what it scatters.
    pub(crate) emission_alone: bool,
    /// The tangent plane there, of a smooth surface with interpolated normals, where only the light counts that goes on from it in a
    /// single direction.
    pub(crate) tangent_plane: Option<TangentPlane>,
}
