//! NanoVDB files (`.nvdb`, version 32): sparse grids in a tree of three levels below its root (Museth 2021, "NanoVDB: A GPU-Friendly and Portable
//! VDB Data Structure for Real-Time Rendering and Simulation").
//!
//! A file gives one grid of `f32` or of three `f32` a voxel, of the class *fog volume* or of none. It becomes a dense grid over the tree's
//! bounding box of active values. In NanoVDB a value belongs to the point at its integer coordinates; here the voxel around it is that point's cube, so that the
//! grid's box reaches half a voxel farther than the outermost points.
//!
//! Files may be as they are in memory or packed by zlib; those packed by Blosc and quantized values are refused.

mod decode;
mod encode;
mod layout;

use std::path::Path;
use std::string::{String, ToString};
use std::vec::Vec;

use drt_math::Affine;

use crate::Grid;
use crate::vol_error::VolError;

pub use crate::nanovdb::decode::decode;
pub use crate::nanovdb::encode::encode;

/// A grid and what is stored with it.
#[derive(Clone, Debug, PartialEq)]
pub struct NanoVdb {
    /// The grid's name in its file.
    pub name: String,
    /// The values, in the unit cube.
    pub grid: Grid,
    /// The map of the unit cube to where the file places the grid.
    pub placement: Affine,
}

/// Reads a grid of a file: that of a given name, or the only one, or the one that is called `density`.
///
/// # Errors
/// When the file cannot be opened, is not a NanoVDB file of version 32, is cut off or contradicts itself, has no such grid, or has one of values that
/// are not read. Nothing is allocated for sizes that the file does not have the bytes for.
pub fn read(path: impl AsRef<Path>, name: Option<&str>) -> Result<NanoVdb, VolError> {
    let file = path.as_ref().display().to_string();
    match std::fs::read(path) {
        Ok(bytes) => decode(&bytes, &file, name),
        Err(source) => Err(VolError::Io { file, source }),
    }
}

/// Writes a file with one grid, not packed. Blocks of 8³ voxels that are zero are left out. Layout, filter and wrap mode are not part of the
/// format.
///
/// # Errors
/// As [`encode`], and when the file cannot be written.
pub fn write(path: impl AsRef<Path>, volume: &NanoVdb) -> Result<(), VolError> {
    let file = path.as_ref().display().to_string();
    let bytes: Vec<u8> = encode(volume)?;
    std::fs::write(path, bytes).map_err(|source| VolError::Io { file, source })
}

#[cfg(test)]
mod tests;
