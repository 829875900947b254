//! Grids that follow a shape which deforms: the deformation of space that takes both along.
//!
//! Tetrahedra fill the space in the followed shape and around it, up to a box that holds the grid as
//! well. Their vertices on the shape go where the shape goes; the others go with the affine part of the
//! changes alone, so that the deformation dies out towards the box. A grid is as deformed as the space
//! it lies in, and its faces stay on the shape's where they lie on them.

use alloc::sync::Arc;
use alloc::vec::Vec;
use core::ops::ControlFlow;

use drt_geom::{Mesh, TetrahedralizeInput, tetrahedralize};
use drt_math::{Affine, Mat3, Ray, Vec3};
use drt_medium::{Flow, FlowBasis, Medium, NodeWeights, SpaceMap};
use drt_motion::deformation::Deformation;
use drt_motion::interior::{Carrier, MARGIN, TetrahedralField};
use drt_motion::parameter::Applied;
use drt_motion::surface::{MovedFrame, move_affine, move_mesh};
use drt_motion::{GeometryChange, MotionError, SurfaceMotion};

use crate::model::error::EffectError;

/// Why a grid cannot follow a shape.
pub(crate) enum GridDeformationError {
    /// A change is at fault.
    Motion(MotionError),
    /// The shape is, or how far it has gone; with the first parameter that deforms it.
    Shape(usize, EffectError),
}

impl From<MotionError> for GridDeformationError {
    fn from(e: MotionError) -> Self {
        Self::Motion(e)
    }
}

/// What changes do to a grid that follows a shape.
pub(crate) struct GridDeformation {
    map: Arc<DeformedSpace>,
    /// The affine part of the changes.
    frame: MovedFrame,
    /// Nothing else has happened yet.
    is_affine: bool,
    velocities: Vec<Arc<[Vec3]>>,
}

impl GridDeformation {
    /// The deformation of grids in the given bounds that follow a shape, given as it was before any change, that `changes` are made to.
    pub(crate) fn new(
        bounds: [Vec3; 2],
        shape: &Mesh,
        changes: &[Applied<'_, GeometryChange>],
        parameters: usize,
    ) -> Result<Self, GridDeformationError> {
        let again = changes.iter().map(|c| Applied { ..*c });
        let (affine, deforming): (Vec<_>, Vec<_>) =
            again.partition(|c| c.change.affine(c.theta).is_some());
        let culprit = deforming.first().map_or(0, |c| c.parameter);
        let frame = move_affine(&affine, parameters)?;
        let moved = move_mesh(shape, changes, parameters)?;
        let field =
            fill(bounds, shape).map_err(|reason| GridDeformationError::Shape(culprit, reason))?;
        // What vertices on the shape do beyond the affine part; others do nothing beyond it.
        let spread = |own: Vec<Vec3>| {
            let motion = SurfaceMotion::Vertices { positions: own.into(), normals: None };
            field.velocities(&[Carrier { mesh: shape, motion: &motion }], &[])
        };
        let placed = |p: &Vec3| frame.map.point(*p);
        let tets = field.mesh();
        let offsets =
            shape.positions.iter().zip(&moved.mesh.positions).map(|(p, q)| *q - placed(p));
        let offsets = spread(offsets.collect());
        let positions = tets.positions.iter().zip(&*offsets).map(|(p, d)| placed(p) + *d);
        let deformation = Deformation::new(tets, positions.collect())
            .map_err(|e| GridDeformationError::Shape(culprit, e.into()))?;
        let velocities = moved.motions.iter().zip(&frame.velocities).map(|(motion, affine)| {
            let own = (0..shape.positions.len()).map(|v| {
                motion.vertex_velocity(&moved.mesh, v) - affine.point(placed(&shape.positions[v]))
            });
            let own = spread(own.collect());
            tets.positions.iter().zip(&*own).map(|(p, v)| affine.point(placed(p)) + *v).collect()
        });
        Ok(Self {
            velocities: velocities.collect(),
            is_affine: deforming.iter().all(|c| c.theta == 0.0),
            map: Arc::new(DeformedSpace(deformation)),
            frame,
        })
    }

    /// Deforms the grids of a medium.
    pub(crate) fn apply(&self, medium: &mut Medium) -> Result<(), drt_medium::MediumError> {
        if self.is_affine {
            return medium.place(&self.frame.map);
        }
        medium.deform(self.map.clone())
    }

    /// The velocity of the grids by a parameter.
    pub(crate) fn flow(&self, parameter: usize) -> Flow {
        let nodes = self.velocities[parameter].clone();
        Flow { basis: self.map.clone(), nodes }
    }
}

/// Tetrahedra in a shape and around it, up to a box that holds the given corners as well.
fn fill([min, max]: [Vec3; 2], shape: &Mesh) -> Result<TetrahedralField, EffectError> {
    let bounds = shape.bounds();
    let beyond = (bounds.min - min).max(max - bounds.max).max(Vec3::ZERO).max_abs();
    let diagonal = bounds.extent().length();
    let margin = MARGIN + if diagonal > 0.0 { beyond / diagonal } else { 0.0 };
    let input = TetrahedralizeInput { surfaces: &[shape], points: &[], margin };
    let mut made = tetrahedralize(&input).map_err(EffectError::Surroundings)?;
    made.remove_slivers(&[shape]);
    Ok(TetrahedralField::new(made)?)
}

/// A deformation as media see it.
#[derive(Debug)]
struct DeformedSpace(Deformation);

impl SpaceMap for DeformedSpace {
    fn material(&self, x: Vec3) -> Option<(Vec3, Mat3)> {
        self.0.place(x).map(|place| (place.material, place.inverse))
    }

    fn stretches(&self, ray: &Ray, visit: &mut dyn FnMut(f64, f64, &Affine) -> ControlFlow<()>) {
        let Ray { origin, dir, t_max } = *ray;
        self.0.stretches(origin, dir, t_max, &mut |s| visit(s.start, s.end, &s.inverse));
    }
}

impl FlowBasis for DeformedSpace {
    fn weights(&self, x: Vec3) -> NodeWeights {
        let place = self.0.place(x);
        place.map_or_else(NodeWeights::default, |p| NodeWeights {
            nodes: p.corners,
            weights: p.weights,
        })
    }
}
