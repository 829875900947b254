use alloc::vec::Vec;

use super::double::EdgeFrame;
use super::faces::is_even;
use super::{TetLocator, TetMesh, TetMeshError};
use crate::weld;

impl TetMesh {
    /// Checks that the tetrahedra are a mesh of a domain: every point of it lies in one of them, or
    /// on faces that neighbours share.
    ///
    /// However thin, a tetrahedron of positive volume is fine. Parts that touch without a common face
    /// are apart. Beyond what [`TetMesh::neighbours`]
    /// finds, overlaps are seen where a face of the boundary passes through a tetrahedron, or the
    /// middle of one lies in another: since neighbours lie on the two sides of their faces, the
    /// tetrahedra over a point change in number at the boundary only. (For the same reason their
    /// volumes always sum to what the boundary encloses, which tells nothing.)
    ///
    /// # Errors
    /// For the first fault found, of arrays, single tetrahedra, neighbours, and pairs, in this order.
    pub fn validate(&self) -> Result<(), TetMeshError> {
        self.check_arrays()?;
        for tet in 0..self.tets.len() as u32 {
            let determinant = EdgeFrame::of(self.tet(tet)).determinant();
            if determinant < 0.0 {
                return Err(TetMeshError::Inverted { tet });
            }
            if determinant == 0.0 {
                return Err(TetMeshError::Flat { tet });
            }
        }
        let neighbours = self.neighbours()?;
        let mut used = alloc::vec![false; self.positions.len()];
        for &v in self.tets.iter().flatten() {
            used[v as usize] = true;
        }
        if let Some(vertex) = used.iter().position(|u| !u) {
            return Err(TetMeshError::UnreferencedVertex { vertex: vertex as u32 });
        }
        let boundary: Vec<_> = Self::boundary_faces(&neighbours).collect();
        self.check_doubled(&boundary)?;
        match TetLocator::new(self)?.overlap(self, &boundary) {
            Some(tets) => Err(TetMeshError::Overlap { tets }),
            None => Ok(()),
        }
    }

    /// Checks that no two faces of the boundary have the same positions.
    fn check_doubled(&self, boundary: &[(u32, usize)]) -> Result<(), TetMeshError> {
        let welded = weld(&self.positions);
        let side = |&(tet, k): &(u32, usize)| {
            let mut key = self.face(tet, k).map(|v| welded[v as usize]);
            let even = is_even(key);
            key.sort_unstable();
            (key, even, tet)
        };
        let mut sides: Vec<_> = boundary.iter().map(side).collect();
        sides.sort_unstable();
        match sides.windows(2).find(|s| s[0].0 == s[1].0) {
            None => Ok(()),
            Some(s) => {
                let mut tets = [s[0].2, s[1].2];
                tets.sort_unstable();
                let same_side = s[0].1 == s[1].1;
                Err(if same_side {
                    TetMeshError::Overlap { tets }
                } else {
                    TetMeshError::Crack { tets }
                })
            }
        }
    }
}
