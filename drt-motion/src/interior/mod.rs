//! The velocity field inside a medium: how what is between moving surfaces moves with each parameter.
//!
//! The derivative of a path integral in material form follows volume vertices along a velocity field u
//! (2021 paper, §4.1). Any continuous field is right that has the normal velocity of every surface around
//! the medium; where it misses that of a surface S by
//!
//! ```text
//! (v - u) · n,   v the velocity of S,  n its normal,
//! ```
//!
//! the flux of what is in the medium through S at that speed must be added. The variance is finite only if
//! u also has the velocities of surfaces on which paths have vertices, and of cameras and point lights in
//! the medium: else two neighbouring vertices of a path move apart at a rate that does not vanish with
//! their distance r, and the rate of 1/r² between them grows like 1/r more than the integrand does.
//!
//! [`Surroundings`] say what is around one medium. [`Surroundings::plan`] chooses for every parameter,
//! unless an [`InteriorMotion`] is asked for:
//!
//! * nothing around it moves: rest;
//! * everything around it moves by one affine field: that field;
//! * paths scatter once, and only surfaces without path vertices move: rest, with the flux added, which
//!   single scattering finds exactly;
//! * some surface deforms: tetrahedra that carry the velocities of all surfaces ([`TetrahedralField`]);
//! * else: the affine fields around it, blended ([`Blend`]).
//!
//! Where surfaces pass through each other there are no tetrahedra. Then the blend serves, with a surface of
//! few triangles counting triangle by triangle, and one of many as resting, with its flux added; if that
//! leaves nothing that moves, the medium rests, with the flux. The [plan](InteriorPlan::instead_of) says so.
//!
//! # Open surfaces
//!
//! A room may be built of sheets whose rims meet only up to rounding. Before anything is made of their
//! triangles, a vertex on a rim is joined with the vertices that differ from it by rounding alone (see
//! [`WELDED`]). What is open after that is closed by a box around everything that rests, at a distance of
//! [`MARGIN`] diagonals. Tetrahedra fill that box on both sides of a sheet. Mean value coordinates need closed surfaces:
//! with open ones, each triangle counts with the kernel 1/r⁴ instead ([`Kernel`](crate::mean_value::Kernel)),
//! which knows no sides.
//!
//! # Several parameters
//!
//! What depends on the geometry alone is found once for all parameters: an [`InteriorBasis`] gives the values
//! and gradients of its functions φ_i at a point, and an [`InteriorVelocity`] holds one parameter's
//! coefficients v_i,
//!
//! ```text
//! u(x) = Σ φ_i(x) v_i,   div u = Σ v_i · ∇φ_i.
//! ```
//!
//! In reverse mode every vertex of every active surface moves by itself, see [`Surroundings::plan_reverse`].

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_geom::TetMesh;

mod blend;
mod cache;
mod distances;
mod error;
mod field;
mod interpolation;
mod plan;
mod reverse;
mod rims;
mod sites;
mod surroundings;
mod tetrahedra;
mod tetrahedral;

pub use blend::{Blend, Site, SiteWeight, blend_jet, triangle_field};
pub use cache::TetrahedraCache;
pub use error::InteriorError;
pub use field::{BasisValues, InteriorBasis, InteriorVelocity};
pub use interpolation::{Interpolation, InterpolationValues, InterpolationVelocities};
pub use plan::InteriorPlan;
pub use reverse::{ActiveInputs, ReverseInteriorPlan};
pub use rims::WELDED;
pub use surroundings::{InteriorPoint, SurroundingSurface, Surroundings, enclosing_box};
pub use tetrahedral::{Carrier, TetVelocities, TetrahedralField, TetrahedralPlace};

/// How far the box around everything is, in diagonals of what it encloses: fields die out on the way.
pub const MARGIN: f64 = 0.5;

/// How the velocities of surfaces reach the inside of a medium.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum InteriorMotion {
    /// By the one affine field that everything around the medium moves by.
    Affine,
    /// Not at all; the flux through moving surfaces is added. Always right, but noisy next to moving
    /// surfaces that scatter.
    Static,
    /// By a blend of the affine fields around it; the flux through others is added.
    Blend,
    /// By mean value coordinates with respect to all surfaces that touch it.
    MeanValue,
    /// By tetrahedra that fill the space around and inside all surfaces that touch it: those given,
    /// or our own.
    Tetrahedral(Option<Arc<GivenTetrahedra>>),
    /// By tetrahedra that TetGen makes, which needs the feature `tetgen`.
    Tetgen,
}

/// Tetrahedra of somebody else's making.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct GivenTetrahedra {
    /// The tetrahedra, of which every surface that touches the medium must be a union of faces.
    pub mesh: TetMesh,
    /// Velocities of all vertices per unit of a parameter, by the parameter's index. For parameters
    /// that are not listed, vertices move with the surfaces that they lie on.
    pub velocities: Vec<(usize, TetVelocities)>,
}
