#![doc = include_str!("../README.md")]
#![cfg_attr(not(feature = "std"), no_std)]
#![forbid(unsafe_code)]

extern crate alloc;
// Scenes for tests are shared with the tests outside the crate.
#[cfg(all(test, feature = "std"))]
extern crate self as drt_estimators;

mod agreement;
mod allocation;
mod boundary;
mod budget;
mod contraction;
pub mod emitter;
mod error;
mod film;
pub mod filter;
mod finite_difference;
pub mod fit;
mod flux;
mod grid_deformation;
mod interior;
mod kept;
pub mod loss;
mod medium_motion;
mod parallel;
mod pixels;
mod plan;
mod prepared;
mod radiative;
mod rendering;
mod reverse;
mod scene;
mod scene_gradient;
mod sensitivity;
pub mod sensor;
mod session;
mod settings;
mod splatting;
mod streams;
pub mod surface;
mod tangents;
mod transport;

pub use agreement::{Agreement, agreement};
pub use drt_motion::interior::{GivenTetrahedra, InteriorMotion};
pub use error::Error;
pub use finite_difference::finite_differences;
pub use plan::{MediumPlan, Plan};
pub use rendering::{BLOCKS, Counters, Derivative, Estimate, Layer, NonFinite, Rendering, Term};
pub use reverse::gradient;
pub use scene::{
    Integrator, MediumBoundary, Named, Scene, SceneEmitter, SceneSensor, Shape, Surrounding, Target,
};
pub use scene_gradient::SceneGradient;
pub use session::{Control, FinishedTile, Session, Unattended};
pub use settings::{EstimatorKind, Settings};
pub use tangents::moved;
