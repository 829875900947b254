use alloc::string::String;
use alloc::vec::Vec;

use drt_math::Vec3;

use crate::mesh::direction;
use crate::triangulate::{PolygonError, fan, newell_normal, triangulate};
use crate::{Mesh, MeshAttribute, MeshError, NONE};

/// A file's vertices and polygons before they become a mesh.
#[derive(Default)]
pub(super) struct Polygons {
    pub(super) positions: Vec<Vec3>,
    /// Shading normals of any length, in an order of their own.
    pub(super) normals: Vec<Vec3>,
    /// Texture coordinates, in an order of their own.
    pub(super) texcoords: Vec<[f64; 2]>,
    /// Values per vertex, and per polygon, by name.
    pub(super) vertex_attributes: Vec<Values>,
    pub(super) face_attributes: Vec<Values>,
    /// Polygons whose edges cross are cut into fans instead of being refused.
    mends: bool,
    corners: Vec<Corner>,
    /// Of each corner, its texture coordinates by index; [`NONE`] where the file gives none.
    corner_texcoords: Vec<u32>,
    /// Where each polygon's corners end.
    ends: Vec<usize>,
}

/// A name, and values in the order of what they are of.
pub(super) type Values = (String, Vec<[f32; 3]>);

/// A polygon's vertex and normal, both by index and in range.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Corner {
    pub(super) vertex: u32,
    /// [`NONE`] where the file gives none.
    pub(super) normal: u32,
}

/// Why polygons do not become a mesh.
pub(super) enum AssembleError {
    Polygon { index: usize, error: PolygonError },
    Mesh(MeshError),
}

impl Polygons {
    /// Polygons of which those whose edges cross are cut into fans.
    pub(super) fn mending() -> Self {
        Self { mends: true, ..Self::default() }
    }

    /// Adds a corner to the polygon under construction.
    pub(super) fn corner(&mut self, corner: Corner, texcoord: u32) {
        self.corners.push(corner);
        self.corner_texcoords.push(texcoord);
    }

    /// Ends the polygon under construction and returns its number of corners.
    pub(super) fn end_polygon(&mut self) -> usize {
        let begin = self.ends.last().copied().unwrap_or(0);
        self.ends.push(self.corners.len());
        self.corners.len() - begin
    }

    pub(super) fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// The triangulated mesh, of the vertices that polygons use, in the file's order. A vertex with
    /// several normals becomes several. Once any corner has a normal, those without (or with one of
    /// length zero) take their polygon's. Once any has texture coordinates, those without are at (0, 0).
    ///
    /// The number is that of polygons whose edges cross.
    pub(super) fn assemble(mut self) -> Result<(Mesh, usize), AssembleError> {
        if self.corners.iter().any(|c| c.normal != NONE) {
            self.complete_normals();
        }
        let mut vertices = self.corners.clone();
        vertices.sort_unstable();
        vertices.dedup();
        let place = |c: &Corner| vertices.partition_point(|v| v < c) as u32;

        let mut triangles = Vec::with_capacity(self.corners.len());
        let textured = self.corner_texcoords.iter().any(|t| *t != NONE);
        let texcoord = |corner: usize| {
            let i = self.corner_texcoords[corner] as usize;
            self.texcoords.get(i).copied().unwrap_or_default()
        };
        let named = self.vertex_attributes.iter().chain(&self.face_attributes);
        let mut attributes: Vec<MeshAttribute> =
            named.map(|a| MeshAttribute { name: a.0.clone(), values: Vec::new() }).collect();
        let (of_vertices, of_faces) = attributes.split_at_mut(self.vertex_attributes.len());
        let (mut texcoords, mut begin, mut mended) = (Vec::new(), 0, 0);
        for (index, corners) in self.polygons().enumerate() {
            let points: Vec<_> =
                corners.iter().map(|c| self.positions[c.vertex as usize]).collect();
            let pieces = match triangulate(&points) {
                Err(PolygonError::Crossing) if self.mends => {
                    mended += 1;
                    fan(points.len() as u32)
                }
                pieces => pieces.map_err(|error| AssembleError::Polygon { index, error })?,
            };
            triangles.extend(pieces.iter().map(|t| t.map(|k| place(&corners[k as usize]))));
            if textured {
                texcoords.extend(pieces.iter().map(|t| t.map(|k| texcoord(begin + k as usize))));
            }
            for (a, (_, values)) in of_vertices.iter_mut().zip(&self.vertex_attributes) {
                let value = |k: u32| values[corners[k as usize].vertex as usize];
                a.values.extend(pieces.iter().map(|t| t.map(value)));
            }
            for (a, (_, values)) in of_faces.iter_mut().zip(&self.face_attributes) {
                a.values.extend(pieces.iter().map(|_| [values[index]; 3]));
            }
            begin += corners.len();
        }

        let positions = vertices.iter().map(|c| self.positions[c.vertex as usize]).collect();
        let source = vertices.iter().map(|c| c.vertex).collect();
        let mesh = Mesh::new(positions, triangles)
            .and_then(|m| m.with_source(source, self.positions.len() as u32));
        let mesh = if textured { mesh.and_then(|m| m.with_texcoords(texcoords)) } else { mesh };
        let mesh = mesh.and_then(|m| m.with_attributes(attributes));
        let has_normals = vertices.first().is_some_and(|c| c.normal != NONE);
        let mesh = if has_normals {
            let normals = vertices.iter().map(|c| self.normals[c.normal as usize]).collect();
            mesh.and_then(|m| m.with_normals(normals))
        } else {
            mesh
        };
        mesh.map(|mesh| (mesh, mended)).map_err(AssembleError::Mesh)
    }

    fn polygons(&self) -> impl Iterator<Item = &[Corner]> {
        let begins = core::iter::once(0).chain(self.ends.iter().copied());
        begins.zip(&self.ends).map(|(begin, &end)| &self.corners[begin..end])
    }

    fn complete_normals(&mut self) {
        let mut begin = 0;
        for &end in &self.ends {
            let polygon = &mut self.corners[begin..end];
            begin = end;
            let given =
                |c: &Corner| c.normal != NONE && self.normals[c.normal as usize] != Vec3::ZERO;
            if polygon.iter().all(given) {
                continue;
            }
            let points = polygon.iter().map(|c| self.positions[c.vertex as usize]);
            // A polygon without area has no normal; any unit vector does for what is never hit.
            let own = direction(newell_normal(points)).unwrap_or(Vec3::Z);
            for c in polygon.iter_mut().filter(|c| !given(c)) {
                c.normal = self.normals.len() as u32;
            }
            self.normals.push(own);
        }
    }
}
