//! The derivative check matrix: scenes × kinds of change, each derivative image compared with
//! finite differences that use common random numbers.
//!
//! A [`Stage`] is a scene with [`Cell`]s, one per parameter. [`Row`] is a cell's verdict.

pub mod caged;
mod cell;
pub mod deforming;
pub(crate) mod effects;
pub mod lights;
pub mod media;
pub mod riding;
pub(crate) mod set;
pub mod surfaces;
mod verdict;

pub use cell::{Cell, Stage};
pub use set::Set;
pub use verdict::{Fault, Row, Table, check};
