//! Distances from boundaries: the test function B.

use alloc::vec::Vec;

use drt_geom::{EdgeClass, NONE, Topology};
use drt_math::{Real, Vec3};

use crate::world::World;
use crate::world::vertex::SurfacePoint;

/// What is beyond an edge of a triangle.
#[derive(Clone, Copy, Debug)]
enum Rim {
    /// The same plane.
    Flat,
    /// Nothing, or more than one face.
    Open,
    /// A face with this corner besides the edge's.
    Fold(Vec3),
}

/// The edges of all triangles, each opposite to a corner.
#[derive(Debug)]
pub(super) struct Rims {
    list: Vec<[Rim; 3]>,
}

impl Rims {
    pub(super) fn new(world: &World) -> Self {
        let mut list = alloc::vec![[Rim::Flat; 3]; world.geometry.prims.len()];
        for (s, shape) in world.scene.shapes.iter().enumerate() {
            let mesh = &shape.mesh;
            for e in &Topology::of(mesh).edges {
                for (side, face) in e.faces.into_iter().enumerate().filter(|(_, f)| *f != NONE) {
                    let corners = mesh.triangles[face as usize];
                    let Some(at) = corners.iter().position(|v| !e.vertices.contains(v)) else {
                        continue;
                    };
                    let other = e.opposite[1 - side];
                    list[world.prim_of(s, face) as usize][at] = match e.class {
                        EdgeClass::Flat => Rim::Flat,
                        _ if other == NONE => Rim::Open,
                        _ => Rim::Fold(mesh.positions[other as usize]),
                    };
                }
            }
        }
        Self { list }
    }

    /// Distance of a point of a triangle, in scene units, from the nearest of its edges of which `counts` holds: given the
    /// edge's ends, the triangle's other corner, and that of the face beyond, if there is one.
    fn distance(
        &self,
        world: &World,
        s: &SurfacePoint,
        x: Vec3,
        counts: impl Fn([Vec3; 3], Option<Vec3>) -> bool,
    ) -> f64 {
        let corners = world.scene.shapes[s.shape as usize].mesh.triangle(s.triangle);
        let mut nearest = f64::INFINITY;
        for (k, rim) in self.list[s.prim as usize].iter().enumerate() {
            let beyond = match rim {
                Rim::Flat => continue,
                Rim::Open => None,
                Rim::Fold(corner) => Some(*corner),
            };
            let [own, a, b] = [0, 1, 2].map(|i| corners[(k + i) % 3]);
            if counts([own, a, b], beyond) {
                let side = b - a;
                let along = ((x - a).dot(side) / side.length_squared()).clamp(0.0, 1.0);
                nearest = f64::min(nearest, (x - a - side * along).length());
            }
        }
        nearest
    }

    /// From edges that are open, or silhouettes seen from a viewer: both faces are on one side of the plane of viewer and edge.
    pub(super) fn to_silhouette(
        &self,
        world: &World,
        s: &SurfacePoint,
        x: Vec3,
        viewer: Vec3,
    ) -> f64 {
        self.distance(world, s, x, |[own, a, b], beyond| {
            let n = (b - a).cross(viewer - a);
            beyond.is_none_or(|other| n.dot(own - a) * n.dot(other - a) >= 0.0)
        })
    }

    /// From edges that are open or sharp.
    pub(super) fn to_crease(&self, world: &World, s: &SurfacePoint, x: Vec3) -> f64 {
        self.distance(world, s, x, |_, _| true)
    }

    /// From open edges.
    pub(super) fn to_border(&self, world: &World, s: &SurfacePoint, x: Vec3) -> f64 {
        self.distance(world, s, x, |_, beyond| beyond.is_none())
    }

    /// min(|n·w|, distance to an open edge), as printed in the 2023 paper, Eq. 18.
    pub(super) fn printed(
        &self,
        world: &World,
        s: &SurfacePoint,
        x: Vec3,
        viewer: Vec3,
        length: f64,
    ) -> f64 {
        let cosine = Real::abs(s.ng.dot((viewer - x).normalize()));
        f64::min(cosine, self.to_border(world, s, x) / length)
    }
}
