use alloc::vec::Vec;

use drt_math::Vec3;

use super::words::{Words, shown};
use super::{TetFileError, TetFileErrorKind, vertex_index};
use crate::TetMesh;

/// Reads an ASCII Medit `.mesh` file, given as its bytes and the name that errors should call it by.
///
/// Of its sections, `Vertices` and `Tetrahedra` are read, an item to a line, and the others passed
/// over, as are reference numbers. Tetrahedra are [oriented](TetMesh::orient); nothing else is repaired, and
/// vertices of no tetrahedron stay, so that vertices keep their numbers.
///
/// # Errors
/// For the first line that does not say what it should, and for a file without the sections.
pub fn decode_medit(bytes: &[u8], name: &str) -> Result<TetMesh, TetFileError> {
    let mut words = Words::new(bytes, name);
    let mut mesh = read_sections(&mut words).map_err(|kind| words.fail(kind))?;
    mesh.orient();
    Ok(mesh)
}

fn read_sections(words: &mut Words) -> Result<TetMesh, TetFileErrorKind> {
    let header = words.next().ok_or(TetFileErrorKind::Cut("`MeshVersionFormatted`"))?;
    if header != b"MeshVersionFormatted" {
        let (expected, found) = ("`MeshVersionFormatted`", shown(header));
        return Err(TetFileErrorKind::Unexpected { expected, found });
    }
    words.number("the version")?;
    let mut positions: Option<Vec<Vec3>> = None;
    let mut tets = None;
    while let Some(word) = words.next() {
        match word {
            b"Dimension" => {
                let dimension = words.number("the dimension")?;
                if dimension != 3 {
                    return Err(TetFileErrorKind::NotSpatial(dimension));
                }
            }
            b"Vertices" if positions.is_some() => {
                return Err(TetFileErrorKind::Repeated("Vertices"));
            }
            b"Vertices" => {
                let point = |words: &mut Words| words.point();
                positions = Some(rows(words, "the number of vertices", point)?);
            }
            b"Tetrahedra" if tets.is_some() => {
                return Err(TetFileErrorKind::Repeated("Tetrahedra"));
            }
            b"Tetrahedra" => {
                let vertices = positions.as_ref();
                let vertices =
                    vertices.ok_or(TetFileErrorKind::Missing("Vertices before its Tetrahedra"))?;
                let tet = |words: &mut Words| {
                    let mut corner = || vertex_index(words, 1, vertices.len());
                    Ok([corner()?, corner()?, corner()?, corner()?])
                };
                tets = Some(rows(words, "the number of tetrahedra", tet)?);
            }
            b"End" => break,
            // Another section's name, or its numbers.
            _ => words.end_line(),
        }
    }
    let positions = positions.ok_or(TetFileErrorKind::Missing("Vertices"))?;
    let tets = tets.ok_or(TetFileErrorKind::Missing("Tetrahedra"))?;
    Ok(TetMesh { positions, tets })
}

/// A section's rows: their number, then one to a line.
fn rows<T>(
    words: &mut Words,
    counted: &'static str,
    mut row: impl FnMut(&mut Words) -> Result<T, TetFileErrorKind>,
) -> Result<Vec<T>, TetFileErrorKind> {
    let count = words.number(counted)?;
    // Not reserved ahead: the count may be a lie.
    let mut rows = Vec::new();
    for _ in 0..count {
        rows.push(row(words)?);
        words.end_line();
    }
    Ok(rows)
}
