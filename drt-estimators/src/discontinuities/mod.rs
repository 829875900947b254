//! Edges of the scene at which visibility or radiance can jump: which there are, what is around them, how
//! fast they move, and which matter to a viewer.

pub(crate) mod collect;
pub(crate) mod contact;
pub(crate) mod discontinuity_edge;
pub(crate) mod edge;
mod intersection;
pub(crate) mod intersection_faces;
pub(crate) mod movers;
mod order;
pub(crate) mod speeds;
