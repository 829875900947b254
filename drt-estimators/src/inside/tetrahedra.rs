//! Tetrahedra around and inside the surfaces of a medium.

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_geom::{
    Mesh, SurfaceTriangle, TetMesh, TetVertexOrigin, Tetrahedralization, TetrahedralizeError,
    TetrahedralizeInput, tetrahedralize,
};
use drt_math::Vec3;
use drt_motion::SurfaceMotion;
use drt_motion::interior::{Carrier, TetVelocities, TetrahedralField};

use super::parts::Part;
use super::unusable;
use crate::Error;
use crate::settings::GivenTetrahedra;
use crate::tangents::Tangents;
use crate::transport::World;

/// How far the enclosing box is, in diagonals of what it encloses: the field dies out on the way.
pub(crate) const MARGIN: f64 = 0.5;

/// Fills the surroundings of a medium with tetrahedra.
pub(super) fn around(
    world: &World,
    medium: usize,
    shapes: &[usize],
    points: &[Vec3],
) -> Result<TetrahedralField, Error> {
    let surfaces: Vec<&Mesh> = shapes.iter().map(|s| &*world.scene.shapes[*s].mesh).collect();
    let input = TetrahedralizeInput { surfaces: &surfaces, points, margin: MARGIN };
    let mut made = tetrahedralize(&input).map_err(|e| {
        let named = |t: SurfaceTriangle| {
            alloc::format!(
                "triangle {} of {}",
                t.triangle,
                world.shape_name(shapes[t.surface as usize])
            )
        };
        let reason = match e {
            TetrahedralizeError::Intersection { first, second } => {
                alloc::format!("{} and {} intersect", named(first), named(second))
            }
            TetrahedralizeError::Unrecovered { triangle } => {
                alloc::format!("{} is too thin, or too near to others", named(triangle))
            }
            other => alloc::format!("{other}"),
        };
        unusable(world, medium, alloc::format!("no tetrahedra fill it: {reason}"))
    })?;
    // Beyond one that lies on a flat face, velocities would be those of another surface.
    made.remove_flat(&surfaces);
    TetrahedralField::new(made).map_err(|e| unusable(world, medium, e))
}

/// Tetrahedra that came with the job: a vertex on a surface moves with it, other vertices of the
/// boundary rest.
pub(super) fn given(
    world: &World,
    medium: usize,
    shapes: &[usize],
    mesh: &TetMesh,
) -> Result<TetrahedralField, Error> {
    let fail = |e: &dyn core::fmt::Display| unusable(world, medium, e);
    mesh.validate().map_err(|e| fail(&e))?;
    let mut origins = alloc::vec![TetVertexOrigin::Inside; mesh.positions.len()];
    let neighbours = mesh.neighbours().map_err(|e| fail(&e))?;
    for (tet, k) in TetMesh::boundary_faces(&neighbours) {
        for v in mesh.face(tet, k) {
            origins[v as usize] = TetVertexOrigin::Box;
        }
    }
    let mut shared = Vec::new();
    for (surface, s) in (0..).zip(shapes) {
        let shape = &world.scene.shapes[*s].mesh;
        for (v, place) in mesh
            .conformity(shape)
            .map_err(|e| fail(&format_args!("its tetrahedra and {}: {e}", world.shape_name(*s))))?
        {
            let origin =
                TetVertexOrigin::Surface { surface, triangle: place.triangle, bary: place.bary };
            match &mut origins[v as usize] {
                TetVertexOrigin::Surface { .. } => shared.push((v, origin)),
                free => *free = origin,
            }
        }
    }
    shared.sort_by_key(|(v, _)| *v);
    let made = Tetrahedralization { mesh: mesh.clone(), origins, shared };
    TetrahedralField::new(made).map_err(|e| fail(&e))
}

/// The velocities of a field's vertices for one parameter, and the shapes that it leaves behind where
/// others touch them.
pub(super) fn velocities(
    field: &TetrahedralField,
    world: &World,
    tangents: &Tangents,
    shapes: &[usize],
    parts: &[Part],
    parameter: usize,
) -> (TetVelocities, Vec<usize>) {
    const REST: &SurfaceMotion = &SurfaceMotion::Rest;
    let carriers: Vec<Carrier<'_>> = shapes
        .iter()
        .map(|s| {
            let motion = tangents.shapes[*s].iter().find(|(p, _)| *p == parameter);
            Carrier {
                mesh: &world.scene.shapes[*s].mesh,
                motion: motion.map_or(REST, |(_, motion)| motion),
            }
        })
        .collect();
    let points: Vec<Vec3> = parts
        .iter()
        .filter_map(|part| Some(part.velocities[parameter].point(part.point?)))
        .collect();
    let velocities = field.velocities(&carriers, &points);
    let left = field.left_behind(&velocities, &carriers);
    (velocities, left.into_iter().map(|s| shapes[s as usize]).collect())
}

/// The velocities that came with tetrahedra, for one parameter.
pub(super) fn given_velocities(
    world: &World,
    medium: usize,
    given: &GivenTetrahedra,
    parameter: usize,
) -> Result<Option<TetVelocities>, Error> {
    let Some((_, list)) = given.velocities.iter().find(|(p, _)| *p == parameter) else {
        return Ok(None);
    };
    if list.len() != given.mesh.positions.len() {
        let (found, expected) = (list.len(), given.mesh.positions.len());
        let reason = alloc::format!("{found} velocities for a mesh of {expected} vertices");
        return Err(unusable(world, medium, reason));
    }
    if let Some(v) = list.iter().position(|v| !v.is_finite()) {
        return Err(unusable(world, medium, alloc::format!("velocity {v} is not finite")));
    }
    Ok(Some(Arc::clone(list)))
}
