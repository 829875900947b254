#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

#[cfg(feature = "system")]
mod request;
#[cfg(feature = "system")]
mod worker;

#[cfg(feature = "system")]
pub use request::{Error, Tetrahedra, tetrahedralize};
