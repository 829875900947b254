#![doc = include_str!("../README.md")]
#![cfg_attr(not(feature = "std"), no_std)]
#![forbid(unsafe_code)]

extern crate alloc;
// Scenes for tests are shared with the tests outside the crate.
#[cfg(all(test, feature = "std"))]
extern crate self as drt_estimators;

mod derivative;
mod discontinuities;
mod estimators;
pub mod fit;
mod model;
mod run;
mod sampling;
mod terms;
mod world;

// What the public interface is made of, so that one dependency is enough.
pub use {drt_geom, drt_math, drt_medium, drt_motion};

pub use derivative::scene_gradient::SceneGradient;
pub use derivative::tangents::moved;
pub use drt_motion::interior::{GivenTetrahedra, InteriorMotion};
pub use fit::loss;
pub use model::builder::{SceneBuilder, ShapeBuilder};
pub use model::error::{EffectError, ElementError, Error, SettingError};
pub use model::image_comparison::{Agreement, agreement};
pub use model::plan::{MediumPlan, Plan};
pub use model::rendering::{
    BLOCKS, Counters, Derivative, Estimate, Layer, NonFinite, Rendering, Tail, Term,
};
pub use model::scene::{
    Instance, Integrator, MediumBoundary, Named, Scene, SceneEmitter, SceneSensor, Shape,
    Surrounding, Target, TargetName,
};
pub use model::settings::{
    AuxiliarySamples, Depth, EstimatorKind, PathSampling, Settings, Warp, WarpKernel,
};
pub use model::shard::Shard;
pub use model::{emitter, filter, sensor, surface, texture};
pub use run::control::{Control, FinishedTile, Part, Unattended};
pub use run::finite_difference::finite_differences;
pub use run::gradient::GradientBatch;
pub use run::session::{Merged, Session, ShardError, ShardSums, gradient, gradient_in_batches};
pub use run::stencil::one_sided_differences;
pub use world::cache::PreparedCache;
