#![doc = include_str!("../README.md")]
#![cfg_attr(not(feature = "std"), no_std)]
#![forbid(unsafe_code)]

extern crate alloc;

pub mod emitter;
mod error;
pub mod filter;
mod plan;
mod rendering;
mod scene;
pub mod sensor;
mod settings;
pub mod surface;

pub use error::Error;
pub use plan::{MediumPlan, Plan};
pub use rendering::{
    BLOCKS, Counters, Derivative, Estimate, Layer, NonFinite, Rendering, Term,
};
pub use scene::{
    Integrator, MediumBoundary, Named, Scene, SceneEmitter, SceneSensor, Shape, Surrounding, Target,
};
pub use settings::{EstimatorKind, Settings};
