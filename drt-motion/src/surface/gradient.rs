use alloc::vec;
use alloc::vec::Vec;

use drt_geom::Mesh;
use drt_math::{Affine, Mat3, Vec3};

use super::{SmoothNormals, SurfaceMotion, SurfacePoint, VertexVectors};
use crate::volume::VolumeAdjoint;

/// What multiplies each entry of a [`SurfaceJet`](super::SurfaceJet) in a derivative.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JetAdjoint {
    /// Multiplies the velocity.
    pub u: Vec3,
    /// Multiplies the rate of the geometric normal.
    pub n: Vec3,
    /// Multiplies the rate of the shading normal.
    pub ns: Vec3,
    /// Multiplies the rate of the area Jacobian.
    pub j: f64,
}

/// A gradient with respect to the motion of a mesh: the transpose of every
/// [`jet`](SurfaceMotion::jet) scattered so far.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct VertexGradient {
    /// With respect to the velocities, one per mesh vertex.
    pub positions: Vec<Vec3>,
    /// With respect to the rates of the unit vertex normals; empty for a mesh without normals.
    pub normals: Vec<Vec3>,
}

impl VertexGradient {
    /// No gradient yet.
    #[must_use]
    pub fn zeros(mesh: &Mesh) -> Self {
        Self {
            positions: vec![Vec3::ZERO; mesh.positions.len()],
            normals: vec![Vec3::ZERO; mesh.normals.as_ref().map_or(0, Vec::len)],
        }
    }

    /// Adds the transpose of the [velocity](SurfaceMotion::velocity) at a point alone.
    ///
    /// # Panics
    /// When the point or this gradient belongs to another mesh.
    pub fn scatter_velocity(&mut self, mesh: &Mesh, point: &SurfacePoint, u: Vec3) {
        let corners = mesh.triangles[point.triangle as usize];
        for (i, w) in corners.into_iter().zip(point.weights()) {
            self.positions[i as usize] += u * w;
        }
    }

    /// Adds another gradient of the same mesh: for buffers filled in parallel.
    pub fn add(&mut self, other: &Self) {
        let pairs = self.positions.iter_mut().zip(&other.positions);
        for (a, b) in pairs.chain(self.normals.iter_mut().zip(&other.normals)) {
            *a += *b;
        }
    }

    /// The derivative along one motion.
    ///
    /// # Panics
    /// When the motion does not fit the mesh.
    #[must_use]
    pub fn dot(&self, mesh: &Mesh, motion: &SurfaceMotion) -> f64 {
        match motion {
            SurfaceMotion::Rest => 0.0,
            SurfaceMotion::Affine(field) => self.to_affine(mesh).dot(field),
            SurfaceMotion::Vertices { positions, normals } => {
                let inner = |own: &[Vec3], v: &VertexVectors| {
                    v.stored().map(|(i, v)| own[i].dot(v)).sum::<f64>()
                };
                inner(&self.positions, positions)
                    + normals.as_ref().map_or(0.0, |n| inner(&self.normals, n))
            }
        }
    }

    /// The gradient with respect to the coefficients of an affine field that carries the whole
    /// mesh.
    #[must_use]
    pub fn to_affine(&self, mesh: &Mesh) -> AffineGradient {
        let mut sum = AffineGradient::default();
        for (&g, &x) in self.positions.iter().zip(&mesh.positions) {
            sum.add_velocity(x, g);
        }
        for (&g, &n) in self.normals.iter().zip(mesh.normals.iter().flatten()) {
            sum.add_normal(n, g);
        }
        sum
    }

    /// The gradient with respect to the velocities of the mesh's vertices, when the vertex normals
    /// are recomputed from them.
    ///
    /// # Panics
    /// When `smooth` belongs to another mesh.
    #[must_use]
    pub fn finish(&self, mesh: &Mesh, smooth: &SmoothNormals) -> Vec<Vec3> {
        let mut positions = self.positions.clone();
        // What is seen by its shadow alone has no gradient by its normals.
        if self.normals.iter().any(|g| *g != Vec3::ZERO) {
            smooth.rates_transposed(mesh, &self.normals, &mut positions);
        }
        positions
    }
}

/// Sums a gradient over the mesh vertices that stem from the same vertex of the mesh's file: the
/// gradient with respect to velocities in the order of the file.
///
/// # Panics
/// When there are fewer entries than mesh vertices.
#[must_use]
pub fn in_file_order(mesh: &Mesh, per_vertex: &[Vec3]) -> Vec<Vec3> {
    let mut per_source = vec![Vec3::ZERO; mesh.source_vertex_count as usize];
    for i in 0..mesh.positions.len() as u32 {
        per_source[mesh.source_vertex(i) as usize] += per_vertex[i as usize];
    }
    per_source
}

/// A gradient with respect to the twelve coefficients of an affine velocity field A x + t.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AffineGradient {
    /// With respect to A: entry (i, j) belongs to A's entry (i, j).
    pub linear: Mat3,
    /// With respect to t.
    pub translation: Vec3,
}

impl Default for AffineGradient {
    fn default() -> Self {
        Self { linear: Mat3::ZERO, translation: Vec3::ZERO }
    }
}

impl AffineGradient {
    /// The derivative along one field.
    #[must_use]
    pub fn dot(&self, field: &Affine) -> f64 {
        inner(&self.linear.cols, &field.linear.cols) + self.translation.dot(field.translation)
    }

    /// Adds the gradient `g` of something with respect to the velocity at `x`.
    #[inline]
    pub fn add_velocity(&mut self, x: Vec3, g: Vec3) {
        self.linear = self.linear + outer(g, x);
        self.translation += g;
    }

    /// Adds the gradient `g` of something with respect to the rate of the unit normal `n`.
    #[inline]
    pub fn add_normal(&mut self, n: Vec3, g: Vec3) {
        self.linear = self.linear + outer(n, n * n.dot(g) - g);
    }

    /// Adds the transpose of a [`VolumeJet`](crate::volume::VolumeJet) at `x`, applied to `adjoint`.
    #[inline]
    pub fn scatter(&mut self, x: Vec3, adjoint: &VolumeAdjoint) {
        self.add_velocity(x, adjoint.u);
        self.linear = self.linear + Mat3::IDENTITY * adjoint.j;
    }
}

/// The matrix a bᵀ.
fn outer(a: Vec3, b: Vec3) -> Mat3 {
    Mat3 { cols: [a * b.x, a * b.y, a * b.z] }
}

fn inner(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}
