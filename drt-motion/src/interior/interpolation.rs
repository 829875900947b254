//! Mean value interpolation of the velocities of all surfaces around a medium, with room for the
//! cameras and point lights inside it.
//!
//! The interpolation v has the surfaces' velocities, and knows no points. Around each point c, with the
//! velocity u_c and a distance R to the nearest surface or half that to another point, it gives way
//! smoothly:
//!
//! ```text
//! u(x) = u_c + w (v(x) - u_c),   w = t² (3 - 2t),   t = |x - c| / R < 1.
//! ```
//!
//! Surfaces that are not closed, even with their rims joined, are interpolated from both sides, and enclosed
//! by a box at rest.

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_geom::{Aabb, Mesh, procedural};
use drt_math::{Affine, Mat3, Vec3};

use super::{InteriorError, Surroundings, enclosing_box, rims};
use crate::error::Cause;
use crate::mean_value::{MeanValueField, MeanValueVelocities, MeanValueWeights};
use crate::volume::VolumeJet;

/// What the interpolated fields of all parameters share.
#[derive(Clone, Debug)]
pub struct Interpolation {
    field: Arc<MeanValueField>,
    /// Triangles of the surfaces and the box.
    triangles: usize,
    /// Cameras and point lights, and how far they are from anything else.
    points: Vec<(Vec3, f64)>,
}

/// The interpolated field of one parameter.
#[derive(Clone, Debug)]
pub struct InterpolationVelocities {
    field: Arc<MeanValueField>,
    surfaces: MeanValueVelocities,
    points: Vec<Vec3>,
}

/// An [`Interpolation`] at a point.
#[derive(Clone, Debug, Default)]
pub struct InterpolationValues {
    weights: MeanValueWeights,
    /// The point it is near to, the weight of what surrounds it, and that weight's gradient.
    near: Option<(usize, f64, Vec3)>,
}

impl Interpolation {
    pub(super) fn new(around: &Surroundings<'_>) -> Result<Self, InteriorError> {
        let mut triangles = Vec::new();
        for mesh in rims::joined(&around.surfaces) {
            triangles.extend(mesh.soup());
        }
        let points = around.positions();
        let distance = |x: Vec3| {
            let own = triangles.iter().map(|t| (x - drt_geom::nearest_point(*t, x)).length());
            let others = points.iter().filter(|p| **p != x).map(|p| 0.5 * (x - *p).length());
            own.chain(others).fold(f64::INFINITY, f64::min)
        };
        let points = points.iter().map(|x| (*x, distance(*x))).collect();
        let own = triangles.len();
        let bounds = enclosing_box(around.surfaces.iter().map(|s| &**s.mesh));
        if !bounds.is_empty() {
            triangles.extend(box_mesh(&bounds).soup());
        }
        let closed = if around.unbounded { &triangles } else { &triangles[..own] };
        let (field, triangles) = match MeanValueField::new(closed) {
            Err(Cause::OpenSurface { .. } | Cause::OneSidedSurface | Cause::FlatSurface) => {
                (MeanValueField::two_sided(&triangles), triangles.len())
            }
            field => (field, closed.len()),
        };
        let field = Arc::new(field.map_err(InteriorError::MeanValue)?);
        Ok(Self { field, triangles, points })
    }

    /// The field of a parameter.
    pub(super) fn velocities(
        &self,
        around: &Surroundings<'_>,
        parameter: usize,
    ) -> Result<InterpolationVelocities, InteriorError> {
        let mut corners = Vec::new();
        for surface in &around.surfaces {
            let (mesh, motion) = (surface.mesh, surface.motion(parameter));
            let at = |v: u32| motion.map_or(Vec3::ZERO, |m| m.vertex_velocity(mesh, v as usize));
            corners.extend(mesh.triangles.iter().map(|t| t.map(at)));
        }
        // The enclosing box rests.
        corners.resize(self.triangles, [Vec3::ZERO; 3]);
        let surfaces = self.field.velocities(&corners).map_err(InteriorError::Velocities)?;
        let points = around.point_velocities(parameter);
        Ok(InterpolationVelocities { field: Arc::clone(&self.field), surfaces, points })
    }

    /// Replaces `values` by those at `x`.
    pub fn evaluate(&self, x: Vec3, values: &mut InterpolationValues) {
        self.field.weights(x, &mut values.weights);
        values.near = self.points.iter().enumerate().find_map(|(i, (c, reach))| {
            let away = x - *c;
            let t = away.length() / reach;
            // The gradient of t² (3 - 2t) is 6 (1 - t) (x - c) / R².
            let slope = away * (6.0 * (1.0 - t) / (reach * reach));
            (t < 1.0).then_some((i, t * t * (3.0 - 2.0 * t), slope))
        });
    }
}

impl InterpolationVelocities {
    /// Velocity and divergence where the interpolation has these values.
    #[must_use]
    pub fn jet(&self, values: &InterpolationValues) -> VolumeJet {
        let around = self.field.jet(&values.weights, &self.surfaces);
        let Some((i, w, slope)) = values.near else { return around };
        let own = self.points[i];
        let more = around.u - own;
        VolumeJet { u: own + more * w, j_dot: around.j_dot * w + more.dot(slope) }
    }
}

fn box_mesh(bounds: &Aabb) -> Mesh {
    let linear = Mat3::diagonal(bounds.extent() * 0.5);
    procedural::cube().transform(&Affine { linear, translation: bounds.center() })
}
