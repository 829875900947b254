#![doc = include_str!("../README.md")]
#![cfg_attr(not(feature = "std"), no_std)]
#![forbid(unsafe_code)]

extern crate alloc;

mod bounds;
mod change;
mod coefficients;
mod crossing;
mod deformed;
mod depth;
mod directed;
mod error;
mod field;
mod flow;
mod gradient;
mod grid;
mod grid_medium;
mod homogeneous;
mod lattice;
mod medium;
#[cfg(feature = "vol")]
pub mod nanovdb;
#[cfg(feature = "vol")]
mod pages;
mod phase;
mod reach;
mod tangent;
pub mod tracking;
mod transmittance;
mod uniform;
#[cfg(feature = "vol")]
pub mod vol;
#[cfg(feature = "vol")]
mod vol_error;
mod volume;
mod voxel_gradient;

// What the public interface is made of, so that one dependency is enough.
pub use drt_math;

pub use drt_math::{Ray, ValueChange};

pub use change::MediumChange;
pub use coefficients::{CoefficientGradients, CoefficientRates, Coefficients};
pub use crossing::Crossing;
pub use deformed::{DeformedGrid, SpaceMap};
pub use depth::DepthEstimate;
pub use error::{MediumError, Property};
pub use field::{DensityField, Piece};
pub use flow::{Flow, FlowBasis, FlowPlace, NodeWeights};
pub use gradient::{FieldGradient, FlowGradient, MediumGradient};
pub use grid::Grid;
pub use grid_medium::GridMedium;
pub use homogeneous::Homogeneous;
pub use lattice::{Filter, Layout, Wrap};
pub use medium::{Medium, MediumKind};
pub use phase::{
    Flakes, FlakesGradient, LocalPhase, Phase, PhaseBlend, PhaseGradient, PhaseTable, Sggx,
    henyey_greenstein, rayleigh,
};
pub use tangent::{FieldTangent, MediumTangent};
pub use tracking::{DistanceSample, TrackingStats};
pub use transmittance::TransmittanceRate;
pub use uniform::UniformMedium;
pub use volume::Volume;
pub use voxel_gradient::VoxelGradient;
