//! What the cross-crate tests of the drt family share: the oracle file, scenes built from it,
//! measurements to a given noise, and their judge.

#![forbid(unsafe_code)]

pub mod comparison;
pub mod cores;
pub mod detector;
pub mod insides;
pub mod judge;
pub mod matrix;
pub mod measure;
pub mod motion;
pub mod oracle;
pub mod reference;
pub mod region;
pub mod rooms;
pub mod scene;
pub mod stability;
pub mod trial;

/// A result whose error is for a reader of test output.
pub type Result<T> = std::result::Result<T, Box<dyn std::error::Error + Send + Sync>>;
