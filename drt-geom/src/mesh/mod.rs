use alloc::string::String;
use alloc::vec::Vec;

use drt_math::{Affine, Mat3, Vec3};

use crate::Aabb;

mod attribute;
mod clean;
mod smooth;

pub use self::attribute::MeshAttribute;

/// A triangle mesh: positions, triangles, and shading normals where the surface has them.
///
/// Triangles list their vertices counter-clockwise seen from outside, so that
/// `(v1 - v0) × (v2 - v0)` points outward. [`Mesh::new`] establishes what every method relies on:
/// finite coordinates and indices in range; code that edits the fields keeps it so.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "unchecked::Mesh")
)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Unit shading normals, one per vertex.
    pub normals: Option<Vec<Vec3>>,
    /// Vertex indices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Texture coordinates (u, v) of each corner of each triangle: of corners, not of vertices, so
    /// that seams need no vertices of their own.
    pub texcoords: Option<Vec<[[f64; 2]; 3]>>,
    /// Other values over the surface.
    pub attributes: Vec<MeshAttribute>,
    /// The index of each vertex in the order of the file it came from, where the loader split
    /// vertices (a position with several normals) or left some out. `None` is the identity.
    pub source_vertices: Option<Vec<u32>>,
    /// How many vertices the file held.
    pub source_vertex_count: u32,
}

/// Why a mesh cannot be made of the given arrays.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// A coordinate is NaN, infinite or beyond 1e100.
    #[error("vertex {vertex} (from 0) has a coordinate that is not a number below 1e100")]
    BadPosition {
        /// Which vertex.
        vertex: usize,
    },
    /// A normal is NaN, infinite or of length zero.
    #[error("the normal of vertex {vertex} (from 0) must be finite and not zero")]
    BadNormal {
        /// Which vertex.
        vertex: usize,
    },
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} (from 0) names vertex {index}, but there are only {count}")]
    IndexOutOfRange {
        /// Which triangle.
        triangle: usize,
        /// The index it names.
        index: u32,
        /// How many vertices there are.
        count: usize,
    },
    /// Texture coordinates are not one finite pair for each corner of each triangle.
    #[error(
        "triangle {triangle} (from 0) has no finite texture coordinates, or there are too many"
    )]
    BadTexcoords {
        /// Which triangle.
        triangle: usize,
    },
    /// An attribute has not three values for each triangle.
    #[error("the attribute `{0}` has not as many entries as there are triangles")]
    BadAttribute(String),
    /// An array with one entry per vertex has another length.
    #[error("{what} has {found} entries; it needs one for each of the {expected} vertices")]
    WrongLength {
        /// Which array.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The number of vertices.
        expected: usize,
    },
    /// A source index is not below the source's vertex count.
    #[error(
        "vertex {vertex} (from 0) claims source vertex {index}, but the source has only {count}"
    )]
    SourceOutOfRange {
        /// Which vertex.
        vertex: usize,
        /// The source index it claims.
        index: u32,
        /// How many vertices the source has.
        count: u32,
    },
    /// More vertices or triangles than 32-bit indices can name.
    #[error("{count} {what} are too many: at most 4294967294 can be indexed")]
    TooLarge {
        /// Vertices or triangles.
        what: &'static str,
        /// How many there are.
        count: usize,
    },
}

impl Mesh {
    /// A mesh without shading normals.
    ///
    /// # Errors
    /// When a coordinate is not finite or beyond 1e100, or a triangle names a missing vertex.
    pub fn new(
        positions: Vec<impl Into<Vec3>>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<Self, MeshError> {
        let positions: Vec<Vec3> = positions.into_iter().map(Into::into).collect();
        let source_vertex_count = positions.len() as u32;
        let mesh = Self {
            positions,
            triangles,
            normals: None,
            texcoords: None,
            attributes: Vec::new(),
            source_vertices: None,
            source_vertex_count,
        };
        mesh.validate()?;
        Ok(mesh)
    }

    /// Checks what rays and derivatives rely on: coordinates, indices and shading normals.
    ///
    /// # Errors
    /// When a coordinate is not finite or beyond 1e100, a triangle names a missing vertex, or there are shading
    /// normals but not one per vertex with a direction.
    pub fn validate(&self) -> Result<(), MeshError> {
        let (count, triangles) = (self.positions.len(), self.triangles.len());
        for (what, count) in [("vertices", count), ("triangles", triangles)] {
            if count >= crate::NONE as usize {
                return Err(MeshError::TooLarge { what, count });
            }
        }
        if let Some(vertex) = self.positions.iter().position(|p| !crate::is_usable(*p)) {
            return Err(MeshError::BadPosition { vertex });
        }
        for (triangle, corners) in self.triangles.iter().enumerate() {
            if let Some(&index) = corners.iter().find(|&&i| i as usize >= count) {
                return Err(MeshError::IndexOutOfRange { triangle, index, count });
            }
        }
        if let Some(texcoords) = &self.texcoords {
            let bad = |t: &[[f64; 2]; 3]| !t.iter().flatten().all(|c| c.is_finite());
            let first = texcoords.iter().position(bad);
            let wrong = (texcoords.len() != triangles).then_some(texcoords.len().min(triangles));
            if let Some(triangle) = first.or(wrong) {
                return Err(MeshError::BadTexcoords { triangle });
            }
        }
        if let Some(a) = self.attributes.iter().find(|a| a.values.len() != triangles) {
            return Err(MeshError::BadAttribute(a.name.clone()));
        }
        let Some(normals) = &self.normals else { return Ok(()) };
        self.expect_per_vertex("normals", normals.len())?;
        let directed = |n: &Vec3| n.is_finite() && n.max_abs() > 0.0;
        match normals.iter().position(|n| !directed(n)) {
            Some(vertex) => Err(MeshError::BadNormal { vertex }),
            None => Ok(()),
        }
    }

    /// The same mesh with the given shading normals, brought to unit length where they are not.
    ///
    /// # Errors
    /// When their number differs from the vertices' or one has no direction.
    pub fn with_normals(mut self, normals: Vec<impl Into<Vec3>>) -> Result<Self, MeshError> {
        let mut normals: Vec<Vec3> = normals.into_iter().map(Into::into).collect();
        self.expect_per_vertex("normals", normals.len())?;
        for (vertex, n) in normals.iter_mut().enumerate() {
            // Unit normals stay as they are, bit for bit.
            let is_unit = (n.length_squared() - 1.0).abs() <= 4.0 * f64::EPSILON;
            if !is_unit {
                *n = direction(*n).ok_or(MeshError::BadNormal { vertex })?;
            }
        }
        self.normals = Some(normals);
        Ok(self)
    }

    /// The same mesh with texture coordinates for each corner of each triangle.
    ///
    /// # Errors
    /// When there is not one finite pair for each corner.
    pub fn with_texcoords(mut self, texcoords: Vec<[[f64; 2]; 3]>) -> Result<Self, MeshError> {
        self.texcoords = Some(texcoords);
        self.validate()?;
        Ok(self)
    }

    /// The same mesh with other values over its surface.
    ///
    /// # Errors
    /// When one has not as many entries as there are triangles.
    pub fn with_attributes(mut self, attributes: Vec<MeshAttribute>) -> Result<Self, MeshError> {
        self.attributes = attributes;
        self.validate()?;
        Ok(self)
    }

    /// The attribute of a name.
    #[must_use]
    pub fn attribute(&self, name: &str) -> Option<&MeshAttribute> {
        self.attributes.iter().find(|a| a.name == name)
    }

    /// The texture coordinates at a point of a triangle, given by the weights of its second and third
    /// corner; the weights themselves where the mesh has no coordinates.
    #[inline]
    #[must_use]
    pub fn texcoord(&self, i: u32, [s, t]: [f64; 2]) -> [f64; 2] {
        let Some(texcoords) = &self.texcoords else { return [s, t] };
        let [a, b, c] = texcoords[i as usize];
        core::array::from_fn(|k| a[k] * (1.0 - s - t) + b[k] * s + c[k] * t)
    }

    /// The same mesh, remembering which of a file's `count` vertices each vertex is.
    ///
    /// # Errors
    /// When the number of entries differs from the vertices' or one is not below `count`.
    pub fn with_source(mut self, vertices: Vec<u32>, count: u32) -> Result<Self, MeshError> {
        self.expect_per_vertex("source_vertices", vertices.len())?;
        if let Some(vertex) = vertices.iter().position(|&s| s >= count) {
            return Err(MeshError::SourceOutOfRange { vertex, index: vertices[vertex], count });
        }
        let identity = count as usize == vertices.len()
            && vertices.iter().enumerate().all(|(i, &s)| i == s as usize);
        self.source_vertices = if identity { None } else { Some(vertices) };
        self.source_vertex_count = count;
        Ok(self)
    }

    fn expect_per_vertex(&self, what: &'static str, found: usize) -> Result<(), MeshError> {
        let expected = self.positions.len();
        if found == expected {
            Ok(())
        } else {
            Err(MeshError::WrongLength { what, found, expected })
        }
    }

    /// The index, in the source file's order, of a vertex.
    #[must_use]
    pub fn source_vertex(&self, vertex: u32) -> u32 {
        self.source_vertices.as_ref().map_or(vertex, |s| s[vertex as usize])
    }

    /// The corners of a triangle.
    #[inline]
    #[must_use]
    pub fn triangle(&self, i: u32) -> [Vec3; 3] {
        self.triangles[i as usize].map(|v| self.positions[v as usize])
    }

    /// The gradients by place, in the plane of a triangle, of the weights of its second and third corner;
    /// not finite where it has no area.
    #[must_use]
    pub fn barycentric_gradients(&self, i: u32) -> [Vec3; 2] {
        let [a, b, c] = self.triangle(i);
        let (e1, e2) = (b - a, c - a);
        let n = e1.cross(e2);
        let per_area = 1.0 / n.length_squared();
        [e2.cross(n) * per_area, n.cross(e1) * per_area]
    }

    /// All triangles by their corners, in order: what [`TriangleBvh::build`](crate::TriangleBvh::build)
    /// takes.
    #[must_use]
    pub fn soup(&self) -> Vec<[Vec3; 3]> {
        (0..self.triangles.len() as u32).map(|i| self.triangle(i)).collect()
    }

    /// Whether two meshes are the same but for their normals, to the bit.
    #[must_use]
    pub fn same_triangles(&self, other: &Self) -> bool {
        core::ptr::eq(self, other)
            || (self.triangles == other.triangles && self.positions == other.positions)
    }

    /// Unit geometric normal of a triangle; zero for a triangle without area.
    #[must_use]
    pub fn normal(&self, i: u32) -> Vec3 {
        let [a, b, c] = self.triangle(i);
        let (e1, e2) = (b - a, c - a);
        // Brought to size one first, so that neither tiny nor huge triangles lose their normal.
        let size = f64::max(e1.max_abs(), e2.max_abs());
        if size == 0.0 {
            return Vec3::ZERO;
        }
        direction((e1 / size).cross(e2 / size)).unwrap_or(Vec3::ZERO)
    }

    /// Area of a triangle.
    #[must_use]
    pub fn area(&self, i: u32) -> f64 {
        let [a, b, c] = self.triangle(i);
        0.5 * (b - a).cross(c - a).length()
    }

    /// Sum of the triangles' areas.
    #[must_use]
    pub fn surface_area(&self) -> f64 {
        (0..self.triangles.len() as u32).map(|i| self.area(i)).sum()
    }

    /// Signed volume: positive for a closed mesh with outward normals. For an open mesh, that of the
    /// cone from the middle of its bounds.
    #[must_use]
    pub fn volume(&self) -> f64 {
        // Relative to the middle: far from the origin the terms would cancel.
        let o = self.bounds().center();
        let six = |[a, b, c]: [Vec3; 3]| (a - o).dot((b - o).cross(c - o));
        (0..self.triangles.len() as u32).map(|i| six(self.triangle(i))).sum::<f64>() / 6.0
    }

    /// The smallest box around all positions.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        Aabb::around(self.positions.iter().copied())
    }

    /// The image under a finite map: positions by the map, normals by its inverse transpose.
    ///
    /// A mirroring map (negative determinant) also reverses the vertex order of every triangle, so
    /// that what was outside stays outside. Triangles and vertices keep their numbers.
    #[must_use]
    pub fn transform(&self, map: &Affine) -> Self {
        let [a, b, c] = map.linear.cols;
        // det · M⁻ᵀ, which also exists when the map flattens the mesh into a plane.
        let cofactors = Mat3 { cols: [b.cross(c), c.cross(a), a.cross(b)] };
        let mirrored = map.linear.determinant() < 0.0;
        let side = if mirrored { -1.0 } else { 1.0 };
        let turn = |n: &Vec3| direction(cofactors * *n * side).unwrap_or(*n);
        let mut image = Self {
            positions: self.positions.iter().map(|p| map.point(*p)).collect(),
            normals: self.normals.as_ref().map(|ns| ns.iter().map(turn).collect()),
            ..self.clone()
        };
        if mirrored {
            image.reverse_winding();
        }
        image
    }

    /// Turns the surface inside out: vertex order and shading normals.
    pub fn flip(&mut self) {
        self.reverse_winding();
        for n in self.normals.iter_mut().flatten() {
            *n = -*n;
        }
    }

    fn reverse_winding(&mut self) {
        for t in &mut self.triangles {
            t.swap(1, 2);
        }
        for t in self.texcoords.iter_mut().flatten() {
            t.swap(1, 2);
        }
        for t in self.attributes.iter_mut().flat_map(|a| &mut a.values) {
            t.swap(1, 2);
        }
    }
}

/// The unit vector along `v`, for any finite length but zero.
pub(crate) fn direction(v: Vec3) -> Option<Vec3> {
    let size = v.max_abs();
    (v.is_finite() && size > 0.0).then(|| (v / size).normalize())
}

#[cfg(feature = "serde")]
mod unchecked {
    use super::{MeshAttribute, MeshError, Vec, Vec3};

    /// A mesh as stored, before its arrays are checked against each other.
    #[derive(serde::Deserialize)]
    pub(super) struct Mesh {
        positions: Vec<Vec3>,
        normals: Option<Vec<Vec3>>,
        triangles: Vec<[u32; 3]>,
        #[serde(default)]
        texcoords: Option<Vec<[[f64; 2]; 3]>>,
        #[serde(default)]
        attributes: Vec<MeshAttribute>,
        source_vertices: Option<Vec<u32>>,
        source_vertex_count: u32,
    }

    impl TryFrom<Mesh> for super::Mesh {
        type Error = MeshError;
        fn try_from(m: Mesh) -> Result<Self, MeshError> {
            let mesh = Self::new(m.positions, m.triangles)?;
            let mesh = match m.source_vertices {
                Some(v) => mesh.with_source(v, m.source_vertex_count)?,
                None => mesh,
            };
            let mesh = match m.texcoords {
                Some(t) => mesh.with_texcoords(t)?,
                None => mesh,
            };
            let mesh = mesh.with_attributes(m.attributes)?;
            match m.normals {
                Some(n) => mesh.with_normals(n),
                None => Ok(mesh),
            }
        }
    }
}
