//! All tests of the crate from outside, in one program.
#![cfg(feature = "command")]

mod batch;
mod command;
mod common;
mod groups;
mod hard_inputs;
mod looks;
#[cfg(all(unix, feature = "mpi"))]
mod mpi;
mod optimize;
mod shards;
#[cfg(feature = "tetgen")]
mod tetgen;
mod textures;
