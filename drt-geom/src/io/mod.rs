//! Mesh files: what the readers share.

#[cfg(feature = "obj")]
mod obj;
#[cfg(feature = "ply")]
mod ply;
mod polygons;

#[cfg(feature = "obj")]
pub use obj::{ObjError, ObjErrorKind, load_obj};
#[cfg(feature = "ply")]
pub use ply::{PlyError, PlyErrorKind, load_ply, read_vertex_vectors};
