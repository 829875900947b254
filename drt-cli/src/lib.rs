#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

pub mod error;
mod job;
mod scene_xml;

pub use error::CliError;
pub use job::{Job, Overrides, load_job};
pub use scene_xml::{Defaults, load_scene, parse_scene_str};
