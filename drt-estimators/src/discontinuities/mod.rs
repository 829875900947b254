//! Edges of the scene at which visibility or radiance can jump: finding them, the faces and media around them,
//! their velocities, and their importance to a viewer.

pub(crate) mod collect;
pub(crate) mod contact;
pub(crate) mod discontinuity_edge;
pub(crate) mod edge;
mod intersection;
pub(crate) mod intersection_faces;
pub(crate) mod movers;
mod order;
pub(crate) mod speeds;
