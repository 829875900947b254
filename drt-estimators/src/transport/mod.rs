//! Light transport in plain numbers: the prepared scene, the walks through it, the record they
//! leave and its differentiation.

pub(crate) mod adjoint;
pub(crate) mod flight;
mod geometry;
pub(crate) mod importance;
pub(crate) mod lights;
mod mode;
pub(crate) mod pairs;
pub(crate) mod record;
pub(crate) mod scatter;
#[cfg(all(test, feature = "std"))]
pub(crate) mod tests;
pub(crate) mod trace;
pub(crate) mod velocity;
pub(crate) mod vertex;
mod walk;
pub(crate) mod world;

pub(crate) use adjoint::Differentiator;
pub(crate) use geometry::Geometry;
pub(crate) use lights::Lit;
pub(crate) use record::{Radiance, RadianceBySegments};
pub(crate) use trace::Tracer;
pub(crate) use velocity::RecordedPath;
pub(crate) use vertex::{Kind, MaterialPoint, Matter, SurfacePoint, Vertex};
pub(crate) use world::{MediumNeed, Needs, RayPath, World};
