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

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_geom::{Aabb, Mesh, procedural};
use drt_math::{Affine, Mat3, Vec3};
use drt_motion::mean_value::{MeanValueField, MeanValueVelocities, MeanValueWeights};
use drt_motion::volume::VolumeJet;

use super::parts::Part;
use super::tetrahedra::MARGIN;
use super::unusable;
use crate::Error;
use crate::tangents::Tangents;
use crate::transport::World;

/// What all parameters share.
#[derive(Clone, Debug)]
pub(crate) struct MeanValue {
    field: Arc<MeanValueField>,
    /// Cameras and point lights, and how far they are from anything else.
    points: Vec<(Vec3, f64)>,
}

/// The motion under one parameter.
#[derive(Clone, Debug)]
pub(crate) struct Velocities {
    field: Arc<MeanValueField>,
    surfaces: MeanValueVelocities,
    points: Vec<Vec3>,
}

/// The field at a point.
#[derive(Clone, Debug, Default)]
pub(crate) struct Place {
    weights: MeanValueWeights,
    /// The point it is near to, the weight of what surrounds it, and that weight's gradient.
    near: Option<(usize, f64, Vec3)>,
}

impl MeanValue {
    pub(super) fn new(
        world: &World,
        medium: usize,
        shapes: &[usize],
        parts: &[Part],
    ) -> Result<Self, Error> {
        let mut triangles = Vec::new();
        for s in shapes {
            triangles.extend(world.scene.shapes[*s].mesh.soup());
        }
        let points: Vec<Vec3> = parts.iter().filter_map(|part| part.point).collect();
        let distance = |x: Vec3| {
            let own = triangles.iter().map(|t| (x - drt_geom::nearest_point(*t, x)).length());
            let others = points.iter().filter(|p| **p != x).map(|p| 0.5 * (x - *p).length());
            own.chain(others).fold(f64::INFINITY, f64::min)
        };
        let points = points.iter().map(|x| (*x, distance(*x))).collect();
        if let Some(bounds) = enclosure(world, medium, &triangles) {
            triangles.extend(enclosing(&bounds).soup());
        }
        let field = MeanValueField::new(&triangles).map_err(|e| {
            unusable(world, medium, alloc::format!("mean value coordinates around it: {e}"))
        })?;
        Ok(Self { field: Arc::new(field), points })
    }

    pub(super) fn velocities(
        &self,
        world: &World,
        tangents: &Tangents,
        medium: usize,
        shapes: &[usize],
        parts: &[Part],
        parameter: usize,
    ) -> Result<Velocities, Error> {
        let mut corners = Vec::new();
        for s in shapes {
            let mesh = &world.scene.shapes[*s].mesh;
            let motion = tangents.shapes[*s].iter().find(|(p, _)| *p == parameter);
            let at =
                |v: u32| motion.map_or(Vec3::ZERO, |(_, m)| m.vertex_velocity(mesh, v as usize));
            corners.extend(mesh.triangles.iter().map(|t| t.map(at)));
        }
        // The enclosing box rests.
        corners.resize(self.field.triangle_count(), [Vec3::ZERO; 3]);
        let surfaces = self.field.velocities(&corners).map_err(|e| unusable(world, medium, e))?;
        let points = parts
            .iter()
            .filter_map(|part| Some(part.velocities[parameter].point(part.point?)))
            .collect();
        Ok(Velocities { field: Arc::clone(&self.field), surfaces, points })
    }

    pub(super) fn place(&self, x: Vec3, place: &mut Place) {
        self.field.weights(x, &mut place.weights);
        place.near = self.points.iter().enumerate().find_map(|(i, (c, reach))| {
            let away = x - *c;
            let t = away.length() / reach;
            // The gradient of t² (3 - 2t) is 6 (1 - t) (x - c) / R².
            let slope = away * (6.0 * (1.0 - t) / (reach * reach));
            (t < 1.0).then_some((i, t * t * (3.0 - 2.0 * t), slope))
        });
    }
}

impl Velocities {
    pub(super) fn jet(&self, place: &Place) -> VolumeJet {
        let around = self.field.jet(&place.weights, &self.surfaces);
        let Some((i, w, slope)) = place.near else { return around };
        let own = self.points[i];
        let more = around.u - own;
        VolumeJet { u: own + more * w, j_dot: around.j_dot * w + more.dot(slope) }
    }
}

/// The surroundings of a medium that goes on for ever.
fn enclosure(world: &World, medium: usize, triangles: &[[Vec3; 3]]) -> Option<Aabb> {
    let bounds = Aabb::around(triangles.iter().flatten().copied());
    let grown = Vec3::splat(MARGIN * bounds.extent().length());
    let bounds = Aabb { min: bounds.min - grown, max: bounds.max + grown };
    (world.medium_at(bounds.max) == Some(medium)).then_some(bounds)
}

fn enclosing(bounds: &Aabb) -> Mesh {
    let linear = Mat3::diagonal(bounds.extent() * 0.5);
    procedural::cube().transform(&Affine { linear, translation: bounds.center() })
}
