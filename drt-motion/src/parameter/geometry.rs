use alloc::sync::Arc;

use drt_geom::Mesh;
use drt_math::{Affine, Mat3, Vec3, fm, vec3};

use crate::error::{Cause, finite};

/// How a shape, medium, light or camera moves with theta. Lengths are in scene units per unit of
/// theta.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum GeometryChange {
    /// x + theta t.
    Translate(Vec3),
    /// Turned right-handed by the angle theta, in radians.
    Rotate {
        /// Direction of the axis, of any length but zero.
        axis: Vec3,
        /// A point on the axis.
        pivot: Vec3,
    },
    /// Stretched by exp(theta factor) along each coordinate axis.
    Scale {
        /// Logarithmic growth along x, y and z.
        factor: Vec3,
        /// The point that stays.
        pivot: Vec3,
    },
    /// x + theta (M x + t).
    Matrix(Affine),
    /// Every vertex moves by theta times its own velocity, in the order of the mesh's file.
    VertexVelocity(Arc<[Vec3]>),
    /// One vertex moves by theta times a direction.
    Vertex {
        /// The vertex, counted from 0 in the order of the mesh's file.
        index: u32,
        /// Velocity of the vertex.
        direction: Vec3,
    },
    /// Vertex normals turn and positions stay: to the normal of every vertex, in the order of the mesh's file and where the scene
    /// file places the mesh, theta times a vector is added before it is made unit. It is done before all other changes of the mesh,
    /// none of which may move single vertices.
    VertexNormals(Arc<[Vec3]>),
    /// Every vertex x of the mesh, where the scene file places it, moves by theta times the sum of
    /// λ(x) v over moving vertices of a [cage](crate::mean_value::Cage): λ is the vertex's mean value coordinate
    /// and v its velocity.
    ///
    /// A mesh vertex outside of the cage moves, too; farther out than about the cage's size, coordinates
    /// grow with the distance and change sign.
    Cage {
        /// The cage, in the scene's coordinates: one closed mesh, or several nested ones.
        mesh: Arc<Mesh>,
        /// Moving vertices, counted from 0 in the order of the cage's file, and their velocities.
        /// Those of a vertex that comes twice add up.
        vertices: Arc<[(u32, Vec3)]>,
    },
}

impl GeometryChange {
    /// The map at theta from unmoved to moved positions; `None` for a change of single vertices.
    ///
    /// A rotation about the zero vector is no rotation here; [`check`](Self::check) reports it.
    #[must_use]
    pub fn affine(&self, theta: f64) -> Option<Affine> {
        match *self {
            Self::Translate(t) => Some(Affine::translation(t * theta)),
            Self::Rotate { axis, pivot } => {
                Some(Affine::about(Mat3::rotation(unit_or_zero(axis), theta), pivot))
            }
            Self::Scale { factor, pivot } => {
                let f = factor * theta;
                Some(Affine::about(
                    Mat3::diagonal(vec3(fm::exp(f.x), fm::exp(f.y), fm::exp(f.z))),
                    pivot,
                ))
            }
            Self::Matrix(m) => Some(Affine::IDENTITY.plus(&m.times(theta))),
            Self::VertexVelocity(_)
            | Self::Vertex { .. }
            | Self::VertexNormals(_)
            | Self::Cage { .. } => None,
        }
    }

    /// The velocity field at theta as a function of the *moved* position; `None` for a change of
    /// single vertices.
    ///
    /// Not finite where the map of a [`Matrix`](Self::Matrix) is singular; [`check`](Self::check)
    /// reports it.
    #[must_use]
    pub fn velocity(&self, theta: f64) -> Option<Affine> {
        match *self {
            Self::Translate(t) => Some(Affine { linear: Mat3::ZERO, translation: t }),
            Self::Rotate { axis, pivot } => Some(spin(Mat3::skew(unit_or_zero(axis)), pivot)),
            Self::Scale { factor, pivot } => Some(spin(Mat3::diagonal(factor), pivot)),
            Self::Matrix(m) => Some(m.after(&Affine::IDENTITY.plus(&m.times(theta)).inverse())),
            Self::VertexVelocity(_)
            | Self::Vertex { .. }
            | Self::VertexNormals(_)
            | Self::Cage { .. } => None,
        }
    }

    /// True when it moves single vertices.
    #[must_use]
    pub fn deforms(&self) -> bool {
        matches!(self, Self::VertexVelocity(_) | Self::Vertex { .. } | Self::Cage { .. })
    }

    /// The kind of change, as job files spell it.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Translate(_) => "translate",
            Self::Rotate { .. } => "rotate",
            Self::Scale { .. } => "scale",
            Self::Matrix(_) => "matrix",
            Self::VertexVelocity(_) => "vertex_velocity",
            Self::Vertex { .. } => "vertex",
            Self::VertexNormals(_) => "vertex_normals",
            Self::Cage { .. } => "cage",
        }
    }

    /// Whether the change makes sense at theta, whatever it is applied to.
    ///
    /// # Errors
    /// Names the number that is not finite, the axis that is zero, or the map that is singular.
    pub fn check(&self, theta: f64) -> Result<(), Cause> {
        finite(theta.is_finite(), "the parameter's value")?;
        match self {
            Self::Translate(t) => finite(t.is_finite(), "the translation")?,
            Self::Rotate { axis, pivot } => {
                finite(axis.is_finite(), "the axis")?;
                finite(pivot.is_finite(), "the pivot")?;
                if unit_or_zero(*axis) == Vec3::ZERO {
                    return Err(Cause::ZeroAxis);
                }
            }
            Self::Scale { factor, pivot } => {
                finite(factor.is_finite(), "the factor")?;
                finite(pivot.is_finite(), "the pivot")?;
            }
            Self::Matrix(m) => finite(m.is_finite(), "the matrix")?,
            Self::VertexVelocity(v) => {
                finite(v.iter().all(|v| v.is_finite()), "a vertex velocity")?;
            }
            Self::VertexNormals(v) => {
                finite(v.iter().all(|v| v.is_finite()), "a change of a normal")?;
            }
            Self::Vertex { direction, .. } => finite(direction.is_finite(), "the direction")?,
            Self::Cage { vertices, .. } => {
                finite(vertices.iter().all(|(_, v)| v.is_finite()), "the direction")?;
            }
        }
        match self.affine(theta) {
            Some(map) => check_map(&map, theta),
            None => Ok(()),
        }
    }
}

fn check_map(map: &Affine, theta: f64) -> Result<(), Cause> {
    finite(map.is_finite(), "the map at this value of the parameter")?;
    let determinant = map.linear.determinant();
    if determinant > 0.0 && map.inverse().is_finite() {
        Ok(())
    } else {
        Err(Cause::Collapsed { theta, determinant })
    }
}

/// The field a (x - pivot).
fn spin(a: Mat3, pivot: Vec3) -> Affine {
    Affine { linear: a, translation: -(a * pivot) }
}

/// Scaled by the largest coordinate first, so that no length under- or overflows.
fn unit_or_zero(v: Vec3) -> Vec3 {
    let size = v.max_abs();
    if size > 0.0 && size.is_finite() {
        vec3(v.x / size, v.y / size, v.z / size).normalize()
    } else {
        Vec3::ZERO
    }
}
