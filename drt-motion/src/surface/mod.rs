//! Velocities of moving and deforming surfaces: at a point of a mesh its velocity, how its normals turn
//! and how its area grows with a parameter, and the transposes of these maps.

use alloc::vec::Vec;

use drt_geom::Mesh;
use drt_math::{Affine, Vec3};

use crate::error::Cause;
use crate::error::finite;

mod area;
mod caged;
mod element;
mod gradient;
mod moved;
mod normals;
mod reached;
mod turned;
mod vectors;

pub use element::SurfaceElement;
pub use gradient::{AffineGradient, JetAdjoint, VertexGradient, in_file_order};
pub use moved::{MovedFrame, MovedMesh, move_affine, move_mesh};
pub use normals::SmoothNormals;
pub use reached::ReachedTriangles;
pub use vectors::VertexVectors;

/// A point of a mesh: the same material point however the mesh moves.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SurfacePoint {
    /// Index of the triangle.
    pub triangle: u32,
    /// Barycentric weights of the triangle's second and third corner; the first has the rest.
    pub bary: [f64; 2],
}

/// The velocity of a mesh for one parameter, at the parameters' current values.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum SurfaceMotion {
    /// It does not move.
    #[default]
    Rest,
    /// One affine field, a function of the moved position; unit normals turn with it.
    Affine(Affine),
    /// A velocity for each vertex of the mesh, linear on triangles.
    Vertices {
        /// Velocities, one per mesh vertex.
        positions: VertexVectors,
        /// Rates of the unit vertex normals, where the mesh has those.
        normals: Option<VertexVectors>,
    },
}

/// The rates of everything a path vertex on a surface depends on.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceJet {
    /// Velocity of the material point.
    pub u: Vec3,
    /// Rate of the unit geometric normal.
    pub n_dot: Vec3,
    /// Rate of the unit shading normal: the interpolated vertex normals, or the geometric normal
    /// of a mesh without those.
    pub ns_dot: Vec3,
    /// Rate of the area Jacobian: the surface divergence of the velocity.
    pub j_dot: f64,
}

impl SurfaceMotion {
    /// True when the surface does not move at all.
    #[must_use]
    pub fn is_rest(&self) -> bool {
        match self {
            Self::Rest => true,
            Self::Affine(field) => field.is_zero(),
            Self::Vertices { positions, normals } => {
                positions.is_zero() && normals.as_ref().is_none_or(VertexVectors::is_zero)
            }
        }
    }

    /// Whether the motion fits the mesh.
    ///
    /// # Errors
    /// When a list is not one vector per mesh vertex, or something is not finite.
    pub fn check(&self, mesh: &Mesh) -> Result<(), Cause> {
        match self {
            Self::Rest => Ok(()),
            Self::Affine(field) => finite(field.is_finite(), "the velocity field"),
            Self::Vertices { positions, normals } => {
                for list in [Some(positions), normals.as_ref()].into_iter().flatten() {
                    finite(list.stored().all(|(_, v)| v.is_finite()), "a vertex velocity")?;
                    if list.len() != mesh.positions.len() {
                        return Err(Cause::MotionLength {
                            expected: mesh.positions.len(),
                            found: list.len(),
                        });
                    }
                }
                Ok(())
            }
        }
    }

    /// Velocity of a material point of the moved mesh.
    ///
    /// # Panics
    /// When the point is not on the mesh, or the motion not [its own](Self::check).
    #[must_use]
    pub fn velocity(&self, mesh: &Mesh, point: &SurfacePoint) -> Vec3 {
        match self {
            Self::Rest => Vec3::ZERO,
            Self::Affine(field) => field.point(point.interpolate(mesh.triangle(point.triangle))),
            Self::Vertices { positions, .. } => {
                let corners = mesh.triangles[point.triangle as usize];
                point.interpolate(corners.map(|i| positions[i as usize]))
            }
        }
    }

    /// Velocity of a vertex of the moved mesh.
    ///
    /// # Panics
    /// As [`velocity`](Self::velocity).
    #[must_use]
    pub fn vertex_velocity(&self, mesh: &Mesh, vertex: usize) -> Vec3 {
        match self {
            Self::Rest => Vec3::ZERO,
            Self::Affine(field) => field.point(mesh.positions[vertex]),
            Self::Vertices { positions, .. } => positions[vertex],
        }
    }

    /// The fastest vertex's speed.
    ///
    /// # Panics
    /// As [`velocity`](Self::velocity).
    #[must_use]
    pub fn fastest(&self, mesh: &Mesh) -> f64 {
        let speeds = |v: &mut dyn Iterator<Item = Vec3>| v.map(Vec3::length).fold(0.0, f64::max);
        match self {
            Self::Rest => 0.0,
            Self::Affine(field) => speeds(&mut mesh.positions.iter().map(|x| field.point(*x))),
            Self::Vertices { positions, .. } => speeds(&mut positions.stored().map(|(_, v)| v)),
        }
    }

    /// The vertices around which alone the motion is felt, where these are known to be few; some may be there twice.
    pub(crate) fn few_vertices(&self) -> Option<impl Iterator<Item = u32>> {
        let Self::Vertices { positions, normals } = self else { return None };
        let normals = normals.as_ref().map_or(Some(&[][..]), VertexVectors::few)?;
        Some(positions.few()?.iter().chain(normals).map(|(v, _)| *v))
    }

    /// All rates at a point of the moved mesh.
    ///
    /// # Panics
    /// As [`velocity`](Self::velocity).
    #[must_use]
    pub fn jet(&self, mesh: &Mesh, point: &SurfacePoint) -> SurfaceJet {
        self.jet_of(&SurfaceElement::new(mesh, point))
    }

    /// All rates at a surface element prepared once for many parameters.
    ///
    /// # Panics
    /// When the motion does not fit the element's mesh.
    #[must_use]
    pub fn jet_of(&self, element: &SurfaceElement) -> SurfaceJet {
        match self {
            Self::Rest => SurfaceJet::default(),
            Self::Affine(field) => element.affine_jet(field),
            Self::Vertices { positions, normals } => {
                element.vertex_jet(positions, normals.as_ref())
            }
        }
    }

    /// The sum of two motions of the same mesh.
    ///
    /// # Panics
    /// When a motion does not fit the mesh.
    #[must_use]
    pub fn plus(&self, other: &Self, mesh: &Mesh) -> Self {
        match (self, other) {
            (Self::Rest, m) | (m, Self::Rest) => m.clone(),
            (Self::Affine(a), Self::Affine(b)) => Self::Affine(a.plus(b)),
            _ => {
                let (mut positions, mut normals) = self.at_vertices(mesh);
                let (p, n) = other.at_vertices(mesh);
                add(&mut positions, &p);
                add(&mut normals, &n);
                let normals = mesh.normals.is_some().then(|| normals.into());
                Self::Vertices { positions: positions.into(), normals }
            }
        }
    }

    /// Velocities of the mesh's vertices and rates of its vertex normals (none without normals).
    fn at_vertices(&self, mesh: &Mesh) -> (Vec<Vec3>, Vec<Vec3>) {
        let mesh_normals = mesh.normals.as_deref().unwrap_or_default();
        let still = |n: usize| alloc::vec![Vec3::ZERO; n];
        match self {
            Self::Rest => (still(mesh.positions.len()), still(mesh_normals.len())),
            Self::Affine(field) => (
                mesh.positions.iter().map(|&x| field.point(x)).collect(),
                mesh_normals.iter().map(|&n| normal_rate(field, n)).collect(),
            ),
            Self::Vertices { positions, normals } => (
                positions.clone().into(),
                normals.clone().map_or_else(|| still(mesh_normals.len()), Vec::from),
            ),
        }
    }
}

impl SurfacePoint {
    /// Barycentric weights of the three corners.
    #[inline]
    #[must_use]
    pub fn weights(&self) -> [f64; 3] {
        let [b1, b2] = self.bary;
        [1.0 - b1 - b2, b1, b2]
    }

    #[inline]
    pub(crate) fn interpolate(&self, [a, b, c]: [Vec3; 3]) -> Vec3 {
        let [w0, w1, w2] = self.weights();
        a * w0 + b * w1 + c * w2
    }
}

/// Rate of a unit normal of a surface carried by an affine field u = A x + t:
/// -Aᵀ n + n (n·A n).
#[inline]
pub(crate) fn normal_rate(field: &Affine, n: Vec3) -> Vec3 {
    n * n.dot(field.vector(n)) - field.linear.transpose_mul(n)
}

fn add(sum: &mut [Vec3], other: &[Vec3]) {
    for (s, o) in sum.iter_mut().zip(other) {
        *s += *o;
    }
}
