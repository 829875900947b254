//! Mesh files: what the readers share.

#[cfg(feature = "obj")]
mod obj;
#[cfg(feature = "ply")]
mod ply;
#[cfg(any(feature = "obj", feature = "ply"))]
mod polygons;
#[cfg(feature = "tet")]
mod tet;

#[cfg(feature = "obj")]
pub use obj::{ObjError, ObjErrorKind, load_obj, load_obj_mended};
#[cfg(feature = "ply")]
pub use ply::{PlyError, PlyErrorKind, load_ply, load_ply_mended, read_vertex_vectors};
#[cfg(feature = "tet")]
pub use tet::{TetFileError, TetFileErrorKind, load_tet_mesh, read_medit, read_tetgen};
