//! Mesh files: what the readers share. Those that take a path begin with `read`, and those that take bytes with `decode`.

use alloc::string::{String, ToString};
use alloc::vec::Vec;
use std::path::Path;

#[cfg(feature = "obj")]
mod obj;
#[cfg(feature = "ply")]
mod ply;
#[cfg(any(feature = "obj", feature = "ply"))]
mod polygons;
#[cfg(feature = "tet")]
mod tet;

#[cfg(feature = "obj")]
pub use obj::{ObjError, ObjErrorKind, decode_obj, decode_obj_mended, read_obj};
#[cfg(feature = "ply")]
pub use ply::{
    PlyError, PlyErrorKind, decode_ply, decode_ply_mended, decode_vertex_vectors, read_ply,
};
#[cfg(feature = "tet")]
pub use tet::{TetFileError, TetFileErrorKind, decode_medit, decode_tetgen, read_tet_mesh};

/// The name that errors call a file by, and its bytes or why it cannot be read.
fn named(path: &Path) -> (String, Result<Vec<u8>, String>) {
    (path.display().to_string(), std::fs::read(path).map_err(|e| e.to_string()))
}
