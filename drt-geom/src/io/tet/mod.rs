use alloc::string::{String, ToString};
use std::path::Path;

use self::words::Words;
use crate::TetMesh;

mod medit;
mod tetgen;
mod words;

pub use medit::decode_medit;
pub use tetgen::decode_tetgen;

/// What is wrong with a file of tetrahedra, and where.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}:{line}: {kind}")]
#[non_exhaustive]
pub struct TetFileError {
    /// The file's path, or the name given with its bytes.
    pub file: String,
    /// Line, from 1; the last one where the file as a whole is at fault.
    pub line: usize,
    /// What is wrong there.
    pub kind: TetFileErrorKind,
}

/// What can be wrong with a file of tetrahedra.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TetFileErrorKind {
    /// The file cannot be read at all.
    #[error("cannot be read: {0}")]
    Unreadable(String),
    /// An extension of none of the formats.
    #[error("the extension must be .mesh (Medit), or .node or .ele (TetGen)")]
    UnknownFormat,
    /// A word that is not what should be there.
    #[error("expected {expected}, found `{found}`")]
    Unexpected {
        /// What should be there.
        expected: &'static str,
        /// The word.
        found: String,
    },
    /// The file ends before its data do.
    #[error("the file ends where {0} should be")]
    Cut(&'static str),
    /// A vertex or tetrahedron out of sequence.
    #[error("number {found} where {expected} should be: they must be in sequence from 0 or 1")]
    OutOfSequence {
        /// The number that should be there.
        expected: u64,
        /// The number found.
        found: u64,
    },
    /// Tetrahedra with other than four vertices.
    #[error("tetrahedra of {0} vertices; only those of four (linear ones) are read")]
    NotLinear(u64),
    /// Another dimension than three.
    #[error("the dimension is {0}; it must be 3")]
    NotSpatial(u64),
    /// A tetrahedron names a vertex that does not exist.
    #[error("vertex {index} does not exist: they are numbered from {first}, and there are {count}")]
    MissingVertex {
        /// The index as written.
        index: u64,
        /// The first vertex's number.
        first: u64,
        /// How many vertices there are.
        count: usize,
    },
    /// The file lacks something.
    #[error("the file has no {0}")]
    Missing(&'static str),
    /// A section comes a second time.
    #[error("a second section `{0}`")]
    Repeated(&'static str),
}

/// Reads a tetrahedral mesh from a file by its extension: `.mesh` by [`decode_medit`]; `.node` or
/// `.ele`, and the other next to it, by [`decode_tetgen`].
///
/// # Errors
/// When a file cannot be read, or as these.
pub fn read_tet_mesh(path: impl AsRef<Path>) -> Result<TetMesh, TetFileError> {
    let path = path.as_ref();
    let read = |path: &Path| {
        let (name, bytes) = super::named(path);
        match bytes {
            Ok(bytes) => Ok((bytes, name)),
            Err(reason) => {
                let kind = TetFileErrorKind::Unreadable(reason);
                Err(TetFileError { file: name, line: 1, kind })
            }
        }
    };
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    match extension.to_str() {
        Some("mesh") => {
            let (bytes, name) = read(path)?;
            decode_medit(&bytes, &name)
        }
        Some("node" | "ele") => {
            let (nodes, node_name) = read(&path.with_extension("node"))?;
            let (tets, tet_name) = read(&path.with_extension("ele"))?;
            decode_tetgen([(&nodes, &node_name), (&tets, &tet_name)])
        }
        _ => {
            let file = path.display().to_string();
            Err(TetFileError { file, line: 1, kind: TetFileErrorKind::UnknownFormat })
        }
    }
}

/// The index from 0 of a vertex that is written as a number from `first`.
fn vertex_index(words: &mut Words, first: u64, count: usize) -> Result<u32, TetFileErrorKind> {
    let index = words.number("the index of a vertex")?;
    index
        .checked_sub(first)
        .filter(|i| *i < count as u64)
        .and_then(|i| u32::try_from(i).ok())
        .ok_or(TetFileErrorKind::MissingVertex { index, first, count })
}
