#![doc = include_str!("../README.md")]
#![cfg_attr(not(feature = "std"), no_std)]
#![forbid(unsafe_code)]

extern crate alloc;

mod aabb;
mod intersect;
mod mesh;
pub mod procedural;
mod query;
mod topology;
mod weld;

pub use aabb::Aabb;
pub use intersect::ray_plane;
pub use mesh::{Mesh, MeshError};
pub use query::{BvhError, ClosestPoint, Hit, Ray, Skip, TriangleBvh};
pub use topology::{Edge, EdgeClass, Topology};
pub use weld::weld;

/// The index that stands for "none" where a face or primitive may be absent.
pub const NONE: u32 = u32::MAX;
