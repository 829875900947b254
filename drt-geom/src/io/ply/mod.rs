use alloc::string::{String, ToString};
use alloc::vec::Vec;
use std::path::Path;

use drt_math::Vec3;

use self::attributes::Columns;
use self::body::Body;
use self::header::{Element, Header};
use super::polygons::{AssembleError, Corner, Polygons, Values};
use crate::triangulate::PolygonError;
use crate::{Mesh, MeshError, NONE};

mod attributes;
mod body;
mod header;
mod property;

/// What is wrong with a PLY file, and where.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}: {place}: {kind}")]
#[non_exhaustive]
pub struct PlyError {
    /// The file's path, or the name given with its bytes.
    pub file: String,
    /// The header line, or the element and its number, or `the file` where that cannot be read at all.
    pub place: String,
    /// What is wrong there.
    pub kind: PlyErrorKind,
}

/// What can be wrong with a PLY file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlyErrorKind {
    /// The file cannot be read at all.
    #[error("cannot be read: {0}")]
    Unreadable(String),
    /// A header line that cannot be understood.
    #[error("`{found}`: expected {expected}")]
    Header {
        /// The line.
        found: String,
        /// What should be there.
        expected: &'static str,
    },
    /// The file ends before its header or its data do.
    #[error("the file ends here, before all the data its header announces")]
    Cut,
    /// A token of an ASCII file that is not a number of the declared type.
    #[error("`{0}` is not a number of the declared type")]
    BadNumber(String),
    /// A coordinate is NaN or infinite.
    #[error("a coordinate is not a finite number")]
    NotFinite,
    /// A list whose length is negative.
    #[error("a list cannot have length {0}")]
    BadLength(i64),
    /// An index that names no vertex.
    #[error("vertex {index} does not exist: the file has {count}")]
    MissingVertex {
        /// The index as written.
        index: i64,
        /// How many vertices there are.
        count: usize,
    },
    /// The header lacks something a mesh needs.
    #[error("the file has no {0}")]
    Missing(&'static str),
    /// A polygon that cannot be triangulated.
    #[error(transparent)]
    Polygon(#[from] PolygonError),
    /// A mesh that cannot be indexed.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// Where and what, before the file's name is added.
type Failure = (String, PlyErrorKind);

/// Reads a PLY file as [`decode_ply`] does.
///
/// # Errors
/// When the file cannot be read, or as that.
pub fn read_ply(path: impl AsRef<Path>) -> Result<Mesh, PlyError> {
    let (file, bytes) = super::named(path.as_ref());
    match bytes {
        Ok(bytes) => decode_ply(&bytes, &file),
        Err(reason) => {
            Err(PlyError { file, place: "the file".into(), kind: PlyErrorKind::Unreadable(reason) })
        }
    }
}

/// Reads a PLY file (ASCII, or binary of either byte order), given as its bytes and the name that errors
/// should call it by.
///
/// The mesh needs an element `vertex` with `x y z`, and `face` with a list `vertex_indices` or
/// `vertex_index`; `nx ny nz` become shading normals, `u v` or `s t` texture coordinates; groups of
/// one or three columns, such as `red green blue` or `heat_0`, become [attributes](Mesh::attributes), and all else is passed over. Polygons are
/// triangulated as [`triangulate`](crate::triangulate()) does, and vertices no face uses left out
/// ([`Mesh::source_vertices`] keeps the file's order).
///
/// # Errors
/// For the first thing that is not as the header says, and for a file without faces. Memory grows
/// with the file, whatever counts the header claims.
pub fn decode_ply(bytes: &[u8], name: &str) -> Result<Mesh, PlyError> {
    let read = read_mesh(bytes, Polygons::default()).map(|(mesh, _)| mesh);
    read.map_err(|(place, kind)| PlyError { file: name.to_string(), place, kind })
}

/// As [`decode_ply`], with polygons whose edges cross (warped quads, say) cut into the fans from their first corners, and the
/// number of these.
///
/// # Errors
/// As [`decode_ply`], but for polygons whose edges cross.
pub fn decode_ply_mended(bytes: &[u8], name: &str) -> Result<(Mesh, usize), PlyError> {
    read_mesh(bytes, Polygons::mending()).map_err(|(place, kind)| PlyError {
        file: name.to_string(),
        place,
        kind,
    })
}

/// Reads the `x y z` of the element `vertex` of a PLY file as plain vectors, in the file's order: a
/// velocity per vertex, say. Other elements may be there or not.
///
/// # Errors
/// As [`decode_ply`].
pub fn decode_vertex_vectors(bytes: &[u8], name: &str) -> Result<Vec<Vec3>, PlyError> {
    read_vectors(bytes).map_err(|(place, kind)| PlyError { file: name.to_string(), place, kind })
}

fn read_mesh(bytes: &[u8], mut polygons: Polygons) -> Result<(Mesh, usize), Failure> {
    let (header, mut body) = Header::read(bytes)?;
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => {
                let vertices = read_vertices(element, &mut body)?;
                (polygons.positions, polygons.normals) = (vertices.positions, vertices.normals);
                polygons.texcoords = vertices.texcoords;
                polygons.vertex_attributes = vertices.attributes;
            }
            "face" => read_faces(element, &mut body, &mut polygons)?,
            _ => element.each(&mut body, |_, _| Ok(()))?,
        }
    }
    if polygons.is_empty() {
        return Err(("header".to_string(), PlyErrorKind::Missing("faces")));
    }
    polygons.assemble().map_err(|e| match e {
        AssembleError::Polygon { index, error } => (place("face", index), error.into()),
        AssembleError::Mesh(error) => ("the mesh".to_string(), error.into()),
    })
}

fn read_vectors(bytes: &[u8]) -> Result<Vec<Vec3>, Failure> {
    let (header, mut body) = Header::read(bytes)?;
    for element in &header.elements {
        if element.name == "vertex" {
            return Ok(read_vertices(element, &mut body)?.positions);
        }
        element.each(&mut body, |_, _| Ok(()))?;
    }
    Err(("header".to_string(), PlyErrorKind::Missing("element `vertex`")))
}

fn place(element: &str, index: usize) -> String {
    alloc::format!("{element} {index} (from 0)")
}

/// Positions, with what else the file has.
struct Vertices {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    texcoords: Vec<[f64; 2]>,
    attributes: Vec<Values>,
}

/// Places for the values of attributes.
fn to_be_filled(columns: &[Columns]) -> Vec<Values> {
    columns.iter().map(|c| (c.name.clone(), Vec::new())).collect()
}

/// Adds a row's values.
fn fill(attributes: &mut [Values], columns: &[Columns], row: &[Vec<f64>]) {
    for (attribute, columns) in attributes.iter_mut().zip(columns) {
        attribute.1.push(columns.value(row));
    }
}

fn read_vertices(element: &Element, body: &mut Body) -> Result<Vertices, Failure> {
    let column = |name: &str| element.properties.iter().position(|p| p.name == name);
    let columns = |names: [&str; 3]| {
        let [a, b, c] = names.map(column);
        Some([a?, b?, c?])
    };
    let Some(position) = columns(["x", "y", "z"]) else {
        return Err((
            "header".to_string(),
            PlyErrorKind::Missing("properties x, y, z of `vertex`"),
        ));
    };
    let normal = columns(["nx", "ny", "nz"]);
    let pair = |[u, v]: [&str; 2]| Some([column(u)?, column(v)?]);
    let texcoord = pair(["u", "v"]).or_else(|| pair(["s", "t"]));
    let (mut positions, mut normals, mut texcoords) = (Vec::new(), Vec::new(), Vec::new());
    let others = Columns::of(element, "vertex");
    let mut attributes = to_be_filled(&others);
    element.each(body, |_, values| {
        let scalar = |c: usize| match values[c][..] {
            [x] => x,
            _ => f64::NAN,
        };
        let vector = |columns: [usize; 3]| {
            let v = Vec3::from(columns.map(scalar));
            if v.is_finite() { Ok(v) } else { Err(PlyErrorKind::NotFinite) }
        };
        positions.push(vector(position)?);
        if let Some(columns) = normal {
            normals.push(vector(columns)?);
        }
        if let Some(columns) = texcoord {
            let [u, v] = columns.map(scalar);
            texcoords.push(if u.is_finite() && v.is_finite() {
                [u, v]
            } else {
                return Err(PlyErrorKind::NotFinite);
            });
        }
        fill(&mut attributes, &others, values);
        Ok(())
    })?;
    Ok(Vertices { positions, normals, texcoords, attributes })
}

fn read_faces(element: &Element, body: &mut Body, polygons: &mut Polygons) -> Result<(), Failure> {
    let is_list = |name: &str| name == "vertex_indices" || name == "vertex_index";
    let Some(list) = element.properties.iter().position(|p| is_list(&p.name) && p.is_list()) else {
        let missing = "list `vertex_indices` or `vertex_index` of `face`";
        return Err(("header".to_string(), PlyErrorKind::Missing(missing)));
    };
    let count = polygons.positions.len();
    let has_normals = !polygons.normals.is_empty();
    let has_texcoords = !polygons.texcoords.is_empty();
    let others = Columns::of(element, "face");
    let mut attributes = to_be_filled(&others);
    element.each(body, |_, values| {
        for &v in &values[list] {
            // Integers up to 2^32 are exact in f64.
            if !(v >= 0.0 && v < count as f64 && v == f64::from(v as u32)) {
                return Err(PlyErrorKind::MissingVertex { index: v as i64, count });
            }
            let vertex = v as u32;
            let given = |there| if there { vertex } else { NONE };
            polygons.corner(Corner { vertex, normal: given(has_normals) }, given(has_texcoords));
        }
        fill(&mut attributes, &others, values);
        match polygons.end_polygon() {
            n @ 0..3 => Err(PolygonError::TooFewCorners(n).into()),
            _ => Ok(()),
        }
    })?;
    polygons.face_attributes = attributes;
    Ok(())
}
