//! The terms of a derivative: the interior, boundary segments, edges seen from vertices, and flux.

pub(crate) mod boundary_segments;
pub(crate) mod boundary_source;
pub(crate) mod edge_queries;
pub(crate) mod flux;
pub(crate) mod grazing;
pub(crate) mod guiding;
pub(crate) mod interior;
pub(crate) mod level;
pub(crate) mod light_paths;
pub(crate) mod prepared;
pub(crate) mod selected;
pub(crate) mod splatting;
