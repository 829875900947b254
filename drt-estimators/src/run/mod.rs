//! Runs: forward and reverse mode, and finite differences.

pub(crate) mod finite_difference;
pub(crate) mod reverse;
pub(crate) mod session;
pub(crate) mod stencil;
