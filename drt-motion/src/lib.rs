#![doc = include_str!("../README.md")]
#![cfg_attr(not(feature = "std"), no_std)]
#![forbid(unsafe_code)]

extern crate alloc;

pub mod deformation;
mod error;
pub mod interior;
mod lists;
pub mod mean_value;
pub mod optimize;
pub mod parameter;
pub mod surface;
pub mod volume;

// What the public interface is made of, so that one dependency is enough.
pub use {drt_geom, drt_math};

pub use drt_math::{ValueChange, ValueMap};

pub use error::{Cause, MotionError};
pub use parameter::{Change, Effect, GeometryChange, Parameter, PropertyChange, Texels};
pub use surface::{SurfaceMotion, SurfacePoint};
