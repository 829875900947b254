//! Sessions with forward and reverse mode from one preparation, and finite differences.

pub(crate) mod component;
pub(crate) mod control;
pub(crate) mod finite_difference;
pub(crate) mod gradient;
pub(crate) mod session;
pub(crate) mod stencil;
#[cfg(all(test, feature = "std"))]
mod tests;
