//! Points of triangles in the space of the scene.

use drt_math::Vec3;

use crate::model::texture::TexturePoint;
use crate::world::World;
use crate::world::geometry::Prim;
use crate::world::vertex::SurfacePoint;

impl World {
    pub(crate) fn prim_of(&self, shape: usize, triangle: u32) -> u32 {
        self.geometry.first_prim[shape] + triangle
    }

    /// The point of a triangle at given barycentric weights.
    pub(crate) fn point(&self, prim: u32, bary: [f64; 2]) -> (SurfacePoint, Vec3) {
        match self.geometry.prims.get(prim as usize) {
            Some(place) => self.point_of_mesh(prim, *place, bary),
            None => self.point_of_instance(prim, bary),
        }
    }

    #[cold]
    fn point_of_instance(&self, prim: u32, bary: [f64; 2]) -> (SurfacePoint, Vec3) {
        let (place, placed) = self.geometry.of_instance(prim);
        let (point, x) = self.point_of_mesh(prim, place, bary);
        let [ng, ns] = [point.ng, point.ns].map(|n| (placed.normals * n).normalize());
        (SurfacePoint { ng, ns, ..point }, placed.to_world.point(x))
    }

    /// The point in the space of the mesh.
    #[inline(always)]
    fn point_of_mesh(
        &self,
        prim: u32,
        Prim { shape, triangle }: Prim,
        bary: [f64; 2],
    ) -> (SurfacePoint, Vec3) {
        let mesh = &self.scene.shapes[shape as usize].mesh;
        let [a, b, c] = mesh.triangle(triangle);
        let (e1, e2) = (b - a, c - a);
        let ng = e1.cross(e2).normalize();
        let ns = match &mesh.normals {
            None => ng,
            Some(normals) => {
                let [i, j, k] = mesh.triangles[triangle as usize].map(|v| normals[v as usize]);
                (i * (1.0 - bary[0] - bary[1]) + j * bary[0] + k * bary[1]).normalize()
            }
        };
        let x = a * (1.0 - bary[0] - bary[1]) + b * bary[0] + c * bary[1];
        (SurfacePoint { prim, shape, triangle, bary, ng, ns }, x)
    }

    /// The point of a triangle's plane nearest to `x`, moved into the triangle.
    pub(crate) fn point_near(&self, prim: u32, x: Vec3) -> (SurfacePoint, Vec3) {
        let Prim { shape, triangle } = self.geometry.prim(prim);
        let mesh = &self.scene.shapes[shape as usize].mesh;
        let [a, ..] = mesh.triangle(triangle);
        let [g1, g2] = mesh.barycentric_gradients(triangle);
        let [b1, b2] = [g1, g2].map(|g| g.dot(x - a).clamp(0.0, 1.0));
        let sum = f64::max(b1 + b2, 1.0);
        self.point(prim, [b1 / sum, b2 / sum])
    }

    /// The gradient of `adjoint · shading normal` by the place of the point in its triangle.
    pub(crate) fn normal_slide(&self, s: &SurfacePoint, adjoint: Vec3) -> Vec3 {
        let mesh = &self.scene.shapes[s.shape as usize].mesh;
        let Some(normals) = &mesh.normals else { return Vec3::ZERO };
        let [i, j, k] = mesh.triangles[s.triangle as usize].map(|v| normals[v as usize]);
        let sum = i * (1.0 - s.bary[0] - s.bary[1]) + j * s.bary[0] + k * s.bary[1];
        let adjoint = adjoint.reject(s.ns) / sum.length();
        let [g1, g2] = mesh.barycentric_gradients(s.triangle);
        g1 * adjoint.dot(j - i) + g2 * adjoint.dot(k - i)
    }

    /// Where the textures of a point are looked up.
    #[inline]
    pub(crate) fn texture_point(&self, s: &SurfacePoint) -> TexturePoint<'_> {
        let mesh = &self.scene.shapes[s.shape as usize].mesh;
        let mut at = TexturePoint::new(mesh, s.triangle, s.bary);
        if s.prim as usize >= self.geometry.prims.len() {
            at.to_world = self.scene.placement(s.shape as usize);
        }
        at
    }
}
