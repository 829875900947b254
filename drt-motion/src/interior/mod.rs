//! Velocity fields inside a medium.

mod blend;
mod distances;
mod tetrahedral;

pub use blend::{Blend, Site, SiteWeight, blend_jet, triangle_field};
pub use tetrahedral::{Carrier, TetVelocities, TetrahedralField, TetrahedralPlace};
