use alloc::vec::Vec;

use drt_math::Vec3;

use super::words::Words;
use super::{TetFileError, TetFileErrorKind, vertex_index};
use crate::TetMesh;

/// Reads TetGen's `.node` and `.ele` files, in this order, each given as its bytes and the name that
/// errors should call it by.
///
/// Vertices may be numbered from 0 or from 1. Attributes, boundary markers and comments after `#` are
/// passed over. Tetrahedra are [oriented](TetMesh::orient); nothing else is repaired, and vertices of no
/// tetrahedron stay, so that vertices keep their numbers.
///
/// # Errors
/// For the first line that does not say what it should.
pub fn decode_tetgen(
    [(nodes, node_file), (tets, tet_file)]: [(&[u8], &str); 2],
) -> Result<TetMesh, TetFileError> {
    let mut words = Words::new(nodes, node_file);
    let (positions, first) = read_nodes(&mut words).map_err(|kind| words.fail(kind))?;
    let mut words = Words::new(tets, tet_file);
    let tets = read_tets(&mut words, first, positions.len()).map_err(|kind| words.fail(kind))?;
    let mut mesh = TetMesh { positions, tets };
    mesh.orient();
    Ok(mesh)
}

/// The points, and the first one's number.
fn read_nodes(words: &mut Words) -> Result<(Vec<Vec3>, u64), TetFileErrorKind> {
    let count = words.number("the number of points")?;
    let dimension = words.number("the dimension")?;
    if dimension != 3 {
        return Err(TetFileErrorKind::NotSpatial(dimension));
    }
    words.end_line();
    // Not reserved ahead: the count may be a lie.
    let mut positions = Vec::new();
    let mut first = 0;
    for i in 0..count {
        let number = words.number("the number of a point")?;
        if i == 0 {
            first = number.min(1);
        }
        in_sequence(number, first, i)?;
        positions.push(words.point()?);
        words.end_line();
    }
    Ok((positions, first))
}

fn read_tets(
    words: &mut Words,
    first: u64,
    vertices: usize,
) -> Result<Vec<[u32; 4]>, TetFileErrorKind> {
    let count = words.number("the number of tetrahedra")?;
    let corners = words.number("the number of vertices of each")?;
    if corners != 4 {
        return Err(TetFileErrorKind::NotLinear(corners));
    }
    words.end_line();
    let mut tets = Vec::new();
    for i in 0..count {
        in_sequence(words.number("the number of a tetrahedron")?, first, i)?;
        let mut corner = || vertex_index(words, first, vertices);
        tets.push([corner()?, corner()?, corner()?, corner()?]);
        words.end_line();
    }
    Ok(tets)
}

fn in_sequence(found: u64, first: u64, i: u64) -> Result<(), TetFileErrorKind> {
    let expected = first.saturating_add(i);
    if found == expected {
        Ok(())
    } else {
        Err(TetFileErrorKind::OutOfSequence { expected, found })
    }
}
