#![doc = include_str!("../README.md")]
#![cfg_attr(not(feature = "std"), no_std)]
#![forbid(unsafe_code)]

extern crate alloc;

mod adjoint;
mod blend;
mod caged;
mod deformation;
mod distances;
mod element;
mod error;
mod geometry;
mod mean_value;
mod moved;
mod normals;
pub mod optimize;
mod parameter;
mod property;
mod surface;
mod tetrahedral;
mod volume;

pub use drt_math::{ValueChange, ValueMap};

pub use adjoint::{AffineGradient, JetAdjoint, VertexGradient, in_file_order};
pub use blend::{Blend, Site, SiteWeight, blend_jet, triangle_field};
pub use deformation::{AffineStretch, Deformation, DeformationError, DeformedPlace};
pub use element::SurfaceElement;
pub use error::{Cause, MotionError};
pub use geometry::GeometryChange;
pub use mean_value::{
    Cage, CageWeights, MeanValueField, MeanValueGradient, MeanValueVelocities, MeanValueWeight,
    MeanValueWeights,
};
pub use moved::{MovedFrame, MovedMesh, move_affine, move_mesh};
pub use normals::SmoothNormals;
pub use parameter::{Applied, Change, Effect, Parameter, geometry_changes, property_changes};
pub use property::{ChangedValue, PropertyChange, change_value};
pub use surface::{SurfaceJet, SurfaceMotion, SurfacePoint};
pub use tetrahedral::{Carrier, TetVelocities, TetrahedralField, TetrahedralPlace};
pub use volume::{VolumeAdjoint, VolumeJet, VolumeMotion};
