use alloc::string::{String, ToString};
use alloc::vec::Vec;

use drt_math::Vec3;

use super::polygons::{AssembleError, Corner, Polygons};
use crate::triangulate::PolygonError;
use crate::{Mesh, MeshError, NONE};

/// What is wrong with an OBJ file, and where.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}:{line}: {kind}")]
pub struct ObjError {
    /// The name given to [`load_obj`].
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
        /// The rest of the line.
        found: String,
    },
    /// A corner that is not of the form v, v/vt, v//vn or v/vt/vn.
    #[error("`{0}` is not a face corner: expected v, v/vt, v//vn or v/vt/vn with indices not 0")]
    BadCorner(String),
    /// An index before the first or beyond the last so far.
    #[error("{what} {index} does not exist: the file has {count} up to here")]
    MissingItem {
        /// Vertex or normal.
        what: &'static str,
        /// The index as written.
        index: i64,
        /// How many there are.
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
}

/// Reads a Wavefront OBJ file, given as its bytes and the name that errors should call it by.
///
/// All groups and objects become one mesh; of the statements, `v`, `vn` and `f` are read and the others
/// (texture coordinates, materials, points, lines, smoothing groups) passed over. Polygons are
/// triangulated as [`triangulate`](crate::triangulate()) does. Vertices no face uses are left out and vertices with
/// several normals split; [`Mesh::source_vertices`] keeps the file's order.
///
/// # Errors
/// For the first line that does not say what it should, and for a file without faces.
pub fn load_obj(bytes: &[u8], name: &str) -> Result<Mesh, ObjError> {
    let fail = |line, kind| ObjError { file: name.to_string(), line, kind };
    let mut polygons = Polygons::default();
    let mut face_lines = Vec::new();
    let mut lines = LogicalLines { rest: bytes, next: 1 };
    while let Some((line, text)) = lines.next() {
        if read_statement(&text, &mut polygons).map_err(|kind| fail(line, kind))? {
            face_lines.push(line);
        }
    }
    if polygons.is_empty() {
        return Err(fail(lines.next.saturating_sub(1).max(1), ObjErrorKind::NoFaces));
    }
    polygons.assemble().map_err(|e| match e {
        AssembleError::Polygon { index, error } => fail(face_lines[index], error.into()),
        AssembleError::Mesh(error) => fail(lines.next - 1, error.into()),
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

/// Reads one line; true when it was a face.
fn read_statement(text: &str, polygons: &mut Polygons) -> Result<bool, ObjErrorKind> {
    let text = text.trim_start();
    let (keyword, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    match keyword {
        "v" => polygons.positions.push(vector("v", rest)?),
        "vn" => polygons.normals.push(vector("vn", rest)?),
        "f" => {
            for token in rest.split_ascii_whitespace() {
                let corner = corner(token, polygons.positions.len(), polygons.normals.len())?;
                polygons.corner(corner);
            }
            let corners = polygons.end_polygon();
            if corners < 3 {
                return Err(PolygonError::TooFewCorners(corners).into());
            }
            return Ok(true);
        }
        _ => {}
    }
    Ok(false)
}

fn vector(statement: &'static str, rest: &str) -> Result<Vec3, ObjErrorKind> {
    let mut numbers = rest.split_ascii_whitespace().map(str::parse::<f64>);
    let mut number = || numbers.next()?.ok();
    // What may follow (a weight, a colour) is not used.
    let v = (|| Some(Vec3::from([number()?, number()?, number()?])))();
    v.filter(|v| v.is_finite())
        .ok_or_else(|| ObjErrorKind::BadNumbers { statement, found: rest.trim().to_string() })
}

fn corner(token: &str, positions: usize, normals: usize) -> Result<Corner, ObjErrorKind> {
    let bad = || ObjErrorKind::BadCorner(token.to_string());
    let mut parts = token.split('/');
    let mut part = || match parts.next() {
        None | Some("") => Ok(None),
        Some(digits) => match digits.parse::<i64>() {
            Ok(index) if index != 0 => Ok(Some(index)),
            _ => Err(bad()),
        },
    };
    let (vertex, _texture, normal) = (part()?, part()?, part()?);
    if parts.next().is_some() {
        return Err(bad());
    }
    Ok(Corner {
        vertex: resolve("vertex", vertex.ok_or_else(bad)?, positions)?,
        normal: normal.map_or(Ok(NONE), |i| resolve("normal", i, normals))?,
    })
}

/// An index from 1, or from -1 backwards, as an index from 0.
fn resolve(what: &'static str, index: i64, count: usize) -> Result<u32, ObjErrorKind> {
    let from_zero = if index > 0 { index - 1 } else { index.saturating_add(count as i64) };
    u32::try_from(from_zero)
        .ok()
        .filter(|&i| (i as usize) < count && i != NONE)
        .ok_or(ObjErrorKind::MissingItem { what, index, count })
}
