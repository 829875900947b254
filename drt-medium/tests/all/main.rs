//! All tests of the crate from outside, in one program.

mod big_grids;
mod changes;
mod common;
mod deformed;
mod dense_voxels;
mod grids;
mod phase;
#[cfg(feature = "serde")]
mod serde;
mod sggx;
mod single_scattering;
mod tracking;
mod transmittance;
#[cfg(feature = "vol")]
mod vol;
