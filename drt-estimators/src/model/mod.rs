//! The contents of a scene, the settings of estimators, and their results.
//!
//! These are plain data: nothing here traces a ray.

pub(crate) mod builder;
pub mod emitter;
mod emitter_overlap;
pub(crate) mod error;
pub mod filter;
mod gradient;
pub(crate) mod image_comparison;
pub(crate) mod plan;
pub(crate) mod refusals;
pub(crate) mod rendering;
pub(crate) mod scene;
pub mod sensor;
pub(crate) mod settings;
pub(crate) mod shard;
pub mod surface;
pub mod texture;
