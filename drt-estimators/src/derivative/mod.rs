//! Differentiating a recorded path once: velocities of its vertices, the backward sweep, and the sinks of
//! sensitivities.

pub(crate) mod adjoint;
pub(crate) mod antithetic;
pub(crate) mod contraction;
pub(crate) mod grid_deformation;
pub(crate) mod medium_motion;
pub(crate) mod recorded_path;
pub(crate) mod scene_gradient;
pub(crate) mod sensitivity;
pub(crate) mod tangents;
#[cfg(all(test, feature = "std"))]
pub(crate) mod tests;
pub(crate) mod velocity;
