#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod atomic;
pub mod commands;
mod digest;
pub mod error;
mod files;
mod fingerprint;
mod image;
mod job;
mod lines;
mod measured_file;
mod npy;
mod scene_xml;
mod shard_file;
mod tensor_file;
#[cfg(test)]
mod testing;

pub use atomic::{check_target, write_atomically};
pub use digest::{RunFacts, Verdict, digest, write_digest};
pub use error::CliError;
pub use image::{ExrFile, Provenance, read_exr, write_exr, write_preview};
pub use job::{Job, Optimize, Overrides, ParameterGroup, load_job};
pub use measured_file::encode_measured;
pub use scene_xml::{Defaults, load_scene, parse_scene_str};

/// Name and version, as files carry them.
pub const PROGRAM: &str = concat!("drt ", env!("CARGO_PKG_VERSION"));
