use drt_geom::Mesh;
use drt_math::{Affine, Vec3};

use super::area::{Unit, area_rate, area_rate_transposed, edges_and_area};
use super::{JetAdjoint, SurfaceJet, SurfacePoint, VertexGradient, VertexVectors, normal_rate};

/// The local geometry of a mesh at a point: what every parameter's [`SurfaceJet`] there has in
/// common, computed once.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceElement {
    point: SurfacePoint,
    corners: [usize; 3],
    position: Vec3,
    /// Edges from the first corner.
    edges: [Vec3; 2],
    normal: Unit,
    /// The normals at the corners and their normalised interpolation.
    shading: Option<([Vec3; 3], Unit)>,
}

impl SurfaceElement {
    /// The element at a point.
    ///
    /// # Panics
    /// When the mesh has no such triangle.
    #[must_use]
    pub fn new(mesh: &Mesh, point: &SurfacePoint) -> Self {
        let corners = mesh.triangles[point.triangle as usize].map(|i| i as usize);
        let x = corners.map(|i| mesh.positions[i]);
        let (edges, area) = edges_and_area(x);
        let shading = mesh.normals.as_deref().map(|normals| {
            let at_corners = corners.map(|i| normals[i]);
            (at_corners, Unit::new(point.interpolate(at_corners)))
        });
        Self {
            point: *point,
            corners,
            position: point.interpolate(x),
            edges,
            normal: Unit::new(area),
            shading,
        }
    }

    /// Position of the point.
    #[inline]
    #[must_use]
    pub fn position(&self) -> Vec3 {
        self.position
    }

    /// Unit geometric normal, counter-clockwise side of the triangle.
    #[inline]
    #[must_use]
    pub fn normal(&self) -> Vec3 {
        self.normal.dir
    }

    /// Unit shading normal: the interpolated vertex normals, else the geometric normal.
    #[inline]
    #[must_use]
    pub fn shading_normal(&self) -> Vec3 {
        self.shading.map_or(self.normal.dir, |(_, s)| s.dir)
    }

    pub(crate) fn affine_jet(&self, field: &Affine) -> SurfaceJet {
        let n = self.normal.dir;
        let n_dot = normal_rate(field, n);
        let ns_dot = self.shading.map_or(n_dot, |(at_corners, s)| {
            s.rate(self.point.interpolate(at_corners.map(|n| normal_rate(field, n))))
        });
        SurfaceJet {
            u: field.point(self.position),
            n_dot,
            ns_dot,
            j_dot: field.linear.trace() - n.dot(field.vector(n)),
        }
    }

    pub(crate) fn vertex_jet(
        &self,
        velocities: &VertexVectors,
        normal_rates: Option<&VertexVectors>,
    ) -> SurfaceJet {
        let v = self.corners.map(|i| velocities[i]);
        let area_dot = area_rate(self.edges, v);
        let n_dot = self.normal.rate(area_dot);
        let ns_dot = match (self.shading, normal_rates) {
            (None, _) => n_dot,
            (Some(_), None) => Vec3::ZERO,
            (Some((_, s)), Some(rates)) => {
                s.rate(self.point.interpolate(self.corners.map(|i| rates[i])))
            }
        };
        SurfaceJet {
            u: self.point.interpolate(v),
            n_dot,
            ns_dot,
            j_dot: self.normal.dir.dot(area_dot) * self.normal.inv_length,
        }
    }

    /// Transpose of [`vertex_jet`](Self::vertex_jet), added to `gradient`.
    pub(crate) fn scatter(&self, a: &JetAdjoint, gradient: &mut VertexGradient) {
        let w = self.point.weights();
        let mut on_normal = a.n;
        match self.shading {
            None => on_normal += a.ns,
            Some((_, s)) => {
                let g = s.rate(a.ns);
                for (&i, w) in self.corners.iter().zip(w) {
                    gradient.normals[i] += g * w;
                }
            }
        }
        let on_area =
            self.normal.rate(on_normal) + self.normal.dir * (a.j * self.normal.inv_length);
        let corners = area_rate_transposed(self.edges, on_area);
        for ((&i, w), g) in self.corners.iter().zip(w).zip(corners) {
            gradient.positions[i] += a.u * w + g;
        }
    }
}

impl VertexGradient {
    /// Adds the transpose of the jet at a point, applied to `adjoint`.
    ///
    /// # Panics
    /// When the point or this gradient belongs to another mesh.
    pub fn scatter(&mut self, mesh: &Mesh, point: &SurfacePoint, adjoint: &JetAdjoint) {
        SurfaceElement::new(mesh, point).scatter(adjoint, self);
    }
}
