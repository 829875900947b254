//! OBJ files, whose numbers and indices `tobj` reads.
//!
//! It is given the file as two plain tables: positions with the faces' indices of them, and normals
//! likewise. So it does nothing that we do not want and could not notice: give a corner without a
//! normal that of the corner before, or overflow at a normal that does not exist; nor divide by weights,
//! or give up at comments behind statements, at statements of several lines and at names that are not
//! UTF-8.

use alloc::string::{String, ToString};
use alloc::vec::Vec;
use std::path::Path;

use self::table::Table;
use super::polygons::{AssembleError, Corner, Polygons};
use crate::triangulate::PolygonError;
use crate::{Mesh, MeshError, NONE};

mod table;

/// What is wrong with an OBJ file, and where.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}:{line}: {kind}")]
#[non_exhaustive]
pub struct ObjError {
    /// The file's path, or the name given with its bytes.
    pub file: String,
    /// Line, from 1; the last one where the file as a whole is at fault.
    pub line: usize,
    /// What is wrong there.
    pub kind: ObjErrorKind,
}

/// What can be wrong with an OBJ file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ObjErrorKind {
    /// A `v` or `vn` without three finite numbers.
    #[error("`{statement}` needs three finite numbers, found `{found}`")]
    BadNumbers {
        /// `v` or `vn`.
        statement: &'static str,
        /// What there is instead, up to three words.
        found: String,
    },
    /// A corner that is not of the form v, v/vt, v//vn or v/vt/vn.
    #[error("`{0}` is not a face corner: expected v, v/vt, v//vn or v/vt/vn with indices not 0")]
    BadCorner(String),
    /// An index before the first or beyond the last.
    #[error("{what} {index} does not exist: there are {count}")]
    MissingItem {
        /// Vertex or normal.
        what: &'static str,
        /// The index as written.
        index: i64,
        /// How many there are in the file, or before the face where the index counts backwards.
        count: usize,
    },
    /// A polygon that cannot be triangulated.
    #[error(transparent)]
    Polygon(#[from] PolygonError),
    /// A mesh that cannot be indexed.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Not one face in the file.
    #[error("the file has no faces")]
    NoFaces,
    /// The file cannot be read at all.
    #[error("cannot be read: {0}")]
    Unreadable(String),
    /// Anything else that `tobj` has to say.
    #[error("{0}")]
    Other(tobj::LoadError),
}

/// Reads a Wavefront OBJ file as [`decode_obj`] does.
///
/// # Errors
/// When the file cannot be read, or as that.
pub fn read_obj(path: impl AsRef<Path>) -> Result<Mesh, ObjError> {
    let (file, bytes) = super::named(path.as_ref());
    match bytes {
        Ok(bytes) => decode_obj(&bytes, &file),
        Err(reason) => Err(ObjError { file, line: 1, kind: ObjErrorKind::Unreadable(reason) }),
    }
}

/// Reads a Wavefront OBJ file, given as its bytes and the name that errors should call it by.
///
/// All groups and objects become one mesh; of the statements, `v`, `vn`, `vt` and `f` are read and the
/// others (materials, points, lines, smoothing groups) passed over. Texture coordinates are as in the
/// file, which often means v = 0 at the bottom of images. Polygons are
/// triangulated as [`triangulate`](crate::triangulate()) does. Vertices no face uses are left out and vertices with
/// several normals split; [`Mesh::source_vertices`] keeps the file's order. Faces may name vertices
/// that come further down.
///
/// # Errors
/// For a line that does not say what it should, and for a file without faces.
pub fn decode_obj(bytes: &[u8], name: &str) -> Result<Mesh, ObjError> {
    read(bytes, name, Polygons::default()).map(|(mesh, _)| mesh)
}

/// As [`decode_obj`], with polygons whose edges cross (warped quads, say) cut into the fans from their first corners, and the
/// number of these.
///
/// # Errors
/// As [`decode_obj`], but for polygons whose edges cross.
pub fn decode_obj_mended(bytes: &[u8], name: &str) -> Result<(Mesh, usize), ObjError> {
    read(bytes, name, Polygons::mending())
}

fn read(bytes: &[u8], name: &str, mut polygons: Polygons) -> Result<(Mesh, usize), ObjError> {
    let fail = |(line, kind)| ObjError { file: name.to_string(), line, kind };
    let mut lines = LogicalLines { rest: bytes, next: 1 };
    let mut file = Statements::new();
    while let Some((line, text)) = lines.next() {
        file.read(line, &text).map_err(|kind| fail((line, kind)))?;
    }
    let last = lines.next.saturating_sub(1).max(1);
    let (vertices, corner_normals);
    (polygons.positions, vertices) = file.positions.load().map_err(fail)?;
    (polygons.normals, corner_normals) = file.normals.load().map_err(fail)?;
    let (texcoords, corner_texcoords) = file.texcoords.load().map_err(fail)?;
    polygons.texcoords = texcoords.iter().map(|t| [t.x, t.y]).collect();
    let (mut corner_normals, mut corner_texcoords) =
        (corner_normals.into_iter(), corner_texcoords.into_iter());
    let mut corners = vertices.into_iter().zip(file.has).map(|(vertex, [textured, normal])| {
        let normal = if normal { corner_normals.next() } else { None };
        let texcoord = if textured { corner_texcoords.next() } else { None };
        (Corner { vertex, normal: normal.unwrap_or(NONE) }, texcoord.unwrap_or(NONE))
    });
    for &(_, count) in &file.faces {
        corners.by_ref().take(count).for_each(|(corner, texcoord)| {
            polygons.corner(corner, texcoord);
        });
        polygons.end_polygon();
    }
    if polygons.is_empty() {
        return Err(fail((last, ObjErrorKind::NoFaces)));
    }
    polygons.assemble().map_err(|e| match e {
        AssembleError::Polygon { index, error } => fail((file.faces[index].0, error.into())),
        AssembleError::Mesh(error) => fail((last, error.into())),
    })
}

/// Lines without comments, joined where they end in a backslash.
struct LogicalLines<'a> {
    rest: &'a [u8],
    next: usize,
}

impl LogicalLines<'_> {
    /// The next line and its number.
    fn next(&mut self) -> Option<(usize, String)> {
        if self.rest.is_empty() {
            return None;
        }
        let number = self.next;
        let mut text = String::new();
        loop {
            let end = self.rest.iter().position(|&b| b == b'\n').unwrap_or(self.rest.len());
            let (line, rest) = self.rest.split_at(end);
            self.rest = rest.get(1..).unwrap_or_default();
            self.next += 1;
            // Names and comments may be in any encoding; what is read here is ASCII.
            let line = String::from_utf8_lossy(line);
            let code = line.split('#').next().unwrap_or_default().trim_end();
            match code.strip_suffix('\\') {
                Some(more) if !self.rest.is_empty() => {
                    text.push_str(more);
                    text.push(' ');
                }
                other => {
                    text.push_str(other.unwrap_or(code));
                    return Some((number, text));
                }
            }
        }
    }
}

/// What a file says.
struct Statements {
    positions: Table,
    normals: Table,
    texcoords: Table,
    /// The line of each face and its number of corners.
    faces: Vec<(usize, usize)>,
    /// Whether each corner of each face has texture coordinates and a normal.
    has: Vec<[bool; 2]>,
}

impl Statements {
    fn new() -> Self {
        let (positions, normals) = (Table::new("v", "vertex"), Table::new("vn", "normal"));
        let texcoords = Table::new("vt", "texture coordinate");
        Self { positions, normals, texcoords, faces: Vec::new(), has: Vec::new() }
    }

    fn read(&mut self, line: usize, text: &str) -> Result<(), ObjErrorKind> {
        let mut words = text.split_whitespace();
        match words.next() {
            // What may follow (a weight, a colour) is not used.
            Some("v") => self.positions.vector(line, words.take(3)),
            Some("vn") => self.normals.vector(line, words.take(3)),
            // v may be left out, and a third coordinate is not used.
            Some("vt") => self.texcoords.vector(line, words.chain(["0", "0"]).take(3)),
            Some("f") => {
                let corners = words.map(indices).collect::<Result<Vec<_>, _>>()?;
                if corners.len() < 3 {
                    return Err(PolygonError::TooFewCorners(corners.len()).into());
                }
                self.faces.push((line, corners.len()));
                self.has.extend(corners.iter().map(|(_, t, n)| [t.is_some(), n.is_some()]));
                self.positions.face(line, corners.iter().map(|(vertex, ..)| *vertex));
                self.texcoords.face(line, corners.iter().filter_map(|(_, texcoord, _)| *texcoord));
                self.normals.face(line, corners.iter().filter_map(|(.., normal)| *normal));
            }
            _ => {}
        }
        Ok(())
    }
}

/// The words for vertex, texture coordinates and normal of a corner.
fn indices(corner: &str) -> Result<(&str, Option<&str>, Option<&str>), ObjErrorKind> {
    let mut parts = corner.split('/');
    let mut part = || parts.next().filter(|p| !p.is_empty());
    let (vertex, texture, normal) = (part(), part(), part());
    let is_index = |word: &str| word.parse::<i64>().is_ok_and(|i| i != 0);
    match vertex {
        Some(vertex) if texture.is_none_or(is_index) && parts.next().is_none() => {
            Ok((vertex, texture, normal))
        }
        _ => Err(ObjErrorKind::BadCorner(corner.to_string())),
    }
}
