use alloc::vec::Vec;

use super::{TetMesh, TetMeshError};
use crate::NONE;

/// The corners of the face opposite to each corner, counter-clockwise seen from outside.
const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// One face of one tetrahedron, keyed by its vertices in ascending order.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct TetFace {
    key: [u32; 3],
    tet: u32,
    face: u32,
}

impl TetMesh {
    /// The vertices of the face opposite to corner `k` of a tetrahedron, counter-clockwise seen
    /// from outside it.
    #[inline]
    #[must_use]
    pub fn face(&self, tet: u32, k: usize) -> [u32; 3] {
        FACES[k].map(|corner| self.tets[tet as usize][corner])
    }

    /// For each tetrahedron those that it shares a face with, by the corner opposite to the face;
    /// [`NONE`] at the domain's boundary.
    ///
    /// # Errors
    /// When a tetrahedron names a vertex twice, three share a face, or two lie on the same side of
    /// their shared face (unless one of them is inverted).
    pub fn neighbours(&self) -> Result<Vec<[u32; 4]>, TetMeshError> {
        let mut sides = Vec::with_capacity(4 * self.tets.len());
        for (tet, corners) in (0..).zip(&self.tets) {
            for k in 0..4 {
                if corners[..k].contains(&corners[k]) {
                    return Err(TetMeshError::RepeatedVertex { tet, vertex: corners[k] });
                }
                let mut key = self.face(tet, k);
                key.sort_unstable();
                sides.push(TetFace { key, tet, face: k as u32 });
            }
        }
        sides.sort_unstable();
        let mut neighbours = alloc::vec![[NONE; 4]; self.tets.len()];
        for shared in sides.chunk_by(|a, b| a.key == b.key) {
            match shared {
                [] | [_] => {}
                [a, b] => {
                    let even = |s: &TetFace| is_even(self.face(s.tet, s.face as usize));
                    if even(a) == even(b) {
                        return Err(TetMeshError::Overlap { tets: [a.tet, b.tet] });
                    }
                    neighbours[a.tet as usize][a.face as usize] = b.tet;
                    neighbours[b.tet as usize][b.face as usize] = a.tet;
                }
                [a, b, c, ..] => {
                    let tets = [a.tet, b.tet, c.tet];
                    return Err(TetMeshError::FaceSharedByThree { face: a.key, tets });
                }
            }
        }
        Ok(neighbours)
    }

    /// The faces at the domain's boundary: tetrahedron, and the corner opposite to the face.
    pub fn boundary_faces(neighbours: &[[u32; 4]]) -> impl Iterator<Item = (u32, usize)> + '_ {
        (0..).zip(neighbours).flat_map(|(tet, across)| {
            (0..4).filter(move |k| across[*k] == NONE).map(move |k| (tet, k))
        })
    }
}

/// Whether different numbers are an even permutation of their ascending order.
pub(super) fn is_even([a, b, c]: [u32; 3]) -> bool {
    (a < b) ^ (b < c) ^ (a < c)
}
