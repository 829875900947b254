//! What is around one medium.

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_geom::{Aabb, Mesh};
use drt_math::Vec3;

use super::MARGIN;
use crate::SurfaceMotion;

/// What is around one medium, and how it moves with each of several parameters.
#[derive(Clone, Debug, Default)]
pub struct Surroundings<'a> {
    /// How many parameters there are.
    pub parameters: usize,
    /// The surfaces that touch the medium, open or closed.
    pub surfaces: Vec<SurroundingSurface<'a>>,
    /// Cameras and point lights in the medium.
    pub points: Vec<InteriorPoint>,
    /// Whether the medium goes on beyond all surfaces, as at the corners of their [`enclosing_box`].
    pub unbounded: bool,
    /// Whether paths scatter more than once, so that single scattering does not find every flux.
    pub multiple_scattering: bool,
}

/// A surface that touches a medium.
#[derive(Clone, Copy, Debug)]
pub struct SurroundingSurface<'a> {
    /// Its mesh, as moved.
    pub mesh: &'a Arc<Mesh>,
    /// How it goes on moving, by the indices of the parameters that move it, ascending.
    pub motions: &'a [(usize, SurfaceMotion)],
    /// Paths have vertices on it: it scatters or emits.
    pub scatters: bool,
}

/// A point in a medium that has a velocity of its own: a camera or a point light.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InteriorPoint {
    /// Where it is.
    pub position: Vec3,
    /// Its velocities, by the indices of the parameters that move it.
    pub velocities: Vec<(usize, Vec3)>,
}

const REST: &SurfaceMotion = &SurfaceMotion::Rest;

impl SurroundingSurface<'_> {
    /// How a parameter moves it, if it does.
    pub(super) fn motion(&self, parameter: usize) -> Option<&SurfaceMotion> {
        let at = self.motions.binary_search_by_key(&parameter, |(p, _)| *p).ok()?;
        Some(&self.motions[at].1)
    }

    /// How a parameter moves it.
    pub(super) fn motion_or_rest(&self, parameter: usize) -> &SurfaceMotion {
        self.motion(parameter).unwrap_or(REST)
    }

    /// True when some parameter moves its vertices one by one.
    pub(super) fn deforms(&self) -> bool {
        self.motions.iter().any(|(_, m)| matches!(m, SurfaceMotion::Vertices { .. }))
    }

    /// True when a parameter moves its vertices one by one.
    pub(super) fn deforms_by(&self, parameter: usize) -> bool {
        matches!(self.motion(parameter), Some(SurfaceMotion::Vertices { .. }))
    }
}

impl InteriorPoint {
    /// Its velocity by a parameter.
    pub(super) fn velocity(&self, parameter: usize) -> Vec3 {
        let found = self.velocities.iter().find(|(p, _)| *p == parameter);
        found.map_or(Vec3::ZERO, |(_, v)| *v)
    }
}

impl Surroundings<'_> {
    /// Where the points are.
    pub(super) fn positions(&self) -> Vec<Vec3> {
        self.points.iter().map(|point| point.position).collect()
    }

    /// The velocities of the points by a parameter.
    pub(super) fn point_velocities(&self, parameter: usize) -> Vec<Vec3> {
        self.points.iter().map(|point| point.velocity(parameter)).collect()
    }
}

/// The bounds of surfaces, grown by [`MARGIN`] diagonals on each side; empty without surfaces.
#[must_use]
pub fn enclosing_box<'a>(surfaces: impl IntoIterator<Item = &'a Mesh>) -> Aabb {
    let corners = surfaces.into_iter().flat_map(Mesh::soup).flatten();
    let bounds = Aabb::around(corners);
    if bounds.is_empty() {
        return bounds;
    }
    let grown = Vec3::splat(MARGIN * bounds.extent().length());
    Aabb { min: bounds.min - grown, max: bounds.max + grown }
}
