//! What is asked of the arrays of a mesh before anything is computed with them.

use super::{TetMesh, TetMeshError};
use crate::is_usable;

/// Most tetrahedra, and vertices: 30 bits name them.
pub(super) const MOST: usize = (1 << 30) - 1;

impl TetMesh {
    /// Checks that positions can be computed with and that all indices name one.
    pub(super) fn check_arrays(&self) -> Result<(), TetMeshError> {
        let count = self.positions.len();
        for (what, count) in [("vertices", count), ("tetrahedra", self.tets.len())] {
            if count > MOST {
                return Err(TetMeshError::TooLarge { what, count });
            }
        }
        if let Some(vertex) = self.positions.iter().position(|p| !is_usable(*p)) {
            return Err(TetMeshError::BadPosition { vertex: vertex as u32 });
        }
        for (tet, corners) in (0..).zip(&self.tets) {
            if let Some(&index) = corners.iter().find(|v| **v as usize >= count) {
                return Err(TetMeshError::IndexOutOfRange { tet, index, count });
            }
        }
        Ok(())
    }
}
