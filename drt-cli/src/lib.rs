#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

#[cfg(feature = "command")]
pub mod commands;
pub mod error;
pub mod files;
mod job;
mod prepared;
mod scene_xml;
#[cfg(test)]
mod testing;
mod wording;

// What the public interface is made of, so that one dependency is enough.
pub use {drt_estimators, drt_geom, drt_math, drt_medium, drt_motion};

pub use error::CliError;
pub use files::atomic::{check_target, write_atomically};
pub use files::digest::{RunFacts, Verdict, digest, write_digest};
pub use files::image::{
    ExrFile, Picture, Provenance, Tone, ToneCurve, decode_exr, read_exr, read_picture, write_exr,
    write_preview,
};
pub use files::measured_file::encode_measured;
pub use files::npy::write_npy;
pub use job::{GroupSteps, Job, Optimize, Overrides, ParameterGroup, decode_job, read_job};
pub use prepared::{FieldSteps, PreparedJob, Samples, Unknown, independent_seed};
pub use scene_xml::{Defaults, decode_scene, read_scene};

/// Name and version, as files carry them.
pub const PROGRAM: &str = concat!("drt ", env!("CARGO_PKG_VERSION"));
