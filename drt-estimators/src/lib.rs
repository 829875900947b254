//! Volumetric path tracing and its path-space derivatives
