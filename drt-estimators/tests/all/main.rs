//! All tests of the crate from outside, in one program.

mod adaptive;
mod auto;
mod bidirectional;
mod check;
mod common;
mod determinism;
mod environment;
mod every_vertex;
mod film;
mod fit;
mod gradient_insides;
mod grid_deformation;
mod groups;
mod guiding;
mod instances;
mod intersections;
mod orthographic;
mod plan;
mod sessions;
mod shards;
mod slides;
mod straight;
mod textures;
mod thinlens;
mod transposition;
mod warped;
