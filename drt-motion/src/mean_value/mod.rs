//! Mean value coordinates: interpolation from a closed triangle mesh into all of space.
//!
//! From a point x, with n the normals of a closed surface and φ the piecewise linear function that
//! is 1 at a vertex and 0 at the others (Floater, Kós and Reimers 2005; Ju, Schaefer and Warren
//! 2005),
//!
//! ```text
//! w = ∫ φ K dA(y),   D = ∫ K dA(y),   K = n·(y - x) / |y - x|⁴,   λ = w / D.
//! ```
//!
//! These λ are smooth off the surface, take the piecewise linear values on it, and give linear
//! functions back everywhere. By the divergence theorem, where the surface winds W(y) times around
//! y,
//!
//! ```text
//! D(x) = ∫ (W(x) - W(y)) / |y - x|⁴ dy,
//! ```
//!
//! over all of space: as long as W takes two neighbouring values only, D is positive where W is the
//! larger, negative where it is the smaller, and vanishes nowhere. Surfaces are therefore turned such
//! that they alternate (see the module `orientation`): nested ones, too, bound one region, seen from both of
//! its sides.
//!
//! Open surfaces, and such that pass through one another, have no such winding. For them the kernel is
//! K = 1/|y - x|⁴ ([`Kernel::InverseDistance`]): the weights of Shepard (1968), integrated. It is positive, so D
//! vanishes nowhere, and knows no sides. At a distance d from a surface, D grows like π/d², at a rim like half of that,
//! while everything else stays bounded: λ takes the piecewise linear values on sheets and rims, and leaves them with
//! the square of the distance. Constant functions come back everywhere, linear ones do not.

mod cage;
mod edge;
mod far;
mod field;
mod hierarchy;
mod moments;
mod orientation;
mod plane;
mod quadrature;
mod transpose;
mod triangle;
mod view;

use drt_math::Vec3;

pub use cage::{Cage, CageWeights};
pub use field::{MeanValueField, MeanValueVelocities, MeanValueWeights};
pub use transpose::MeanValueGradient;

/// What a piece of surface at y with the normal n weighs at a point x.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kernel {
    /// n·(y - x) / |y - x|⁴: mean value coordinates of closed surfaces.
    #[default]
    MeanValue,
    /// 1 / |y - x|⁴: inverse distance weights of any surfaces.
    InverseDistance,
}

/// How many sizes of a surface away a point is too far to tell its vertices apart.
const BEYOND: f64 = 1e12;

/// The weight of a vertex at a point, and how it changes with the point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeanValueWeight {
    /// The weight.
    pub value: f64,
    /// Its gradient.
    pub gradient: Vec3,
}

impl MeanValueWeight {
    fn add(&mut self, other: &Self) {
        self.value += other.value;
        self.gradient += other.gradient;
    }

    fn times(&self, other: &Self) -> Self {
        Self {
            value: self.value * other.value,
            gradient: self.gradient * other.value + other.gradient * self.value,
        }
    }
}

/// 1 over the power of two next to a size: lengths times this can be squared and cubed safely.
fn unit_of(size: f64) -> f64 {
    let exponent = (size.to_bits() >> 52) & 0x7ff;
    f64::from_bits(2046_u64.saturating_sub(exponent).clamp(1, 2045) << 52)
}
