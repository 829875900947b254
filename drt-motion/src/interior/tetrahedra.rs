//! Tetrahedra around and inside the surfaces of a medium.

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_geom::{
    Mesh, TetMesh, TetVertexOrigin, Tetrahedralization, TetrahedralizeInput, tetrahedralize,
};

use super::{
    Carrier, GivenTetrahedra, InteriorError, MARGIN, Surroundings, TetVelocities, TetrahedralField,
    rims,
};

#[cfg(feature = "tetgen")]
/// How long TetGen may take: a hundred times what it needs for a hundred thousand triangles.
const PATIENCE: core::time::Duration = core::time::Duration::from_secs(300);

/// Who makes tetrahedra.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Tetrahedralizer {
    /// The one of drt-geom.
    Own,
    /// The library of Hang Si.
    Tetgen,
}

impl Tetrahedralizer {
    fn make(self, input: &TetrahedralizeInput<'_>) -> Result<Tetrahedralization, InteriorError> {
        match self {
            Self::Own => tetrahedralize(input).map_err(InteriorError::Unfilled),
            #[cfg(feature = "tetgen")]
            Self::Tetgen => drt_geom::tetrahedralize_tetgen(input, PATIENCE)
                .map_err(|e| InteriorError::Tetgen(alloc::string::ToString::to_string(&e))),
            #[cfg(not(feature = "tetgen"))]
            Self::Tetgen => Err(InteriorError::NoTetgen),
        }
    }
}

impl Surroundings<'_> {
    /// Fills the space around and inside all surfaces, up to the enclosing box, with tetrahedra.
    pub(super) fn tetrahedra(
        &self,
        maker: Tetrahedralizer,
    ) -> Result<TetrahedralField, InteriorError> {
        let joined = rims::joined(&self.surfaces);
        let surfaces: Vec<&Mesh> = joined.iter().map(|mesh| &**mesh).collect();
        let points = self.positions();
        let input = TetrahedralizeInput { surfaces: &surfaces, points: &points, margin: MARGIN };
        let mut made = maker.make(&input)?;
        // Beyond one that lies on a flat face, velocities would be those of another surface.
        made.remove_flat(&surfaces);
        Ok(TetrahedralField::new(made)?)
    }

    /// Tetrahedra that were given: a vertex on a surface moves with it, other vertices of the boundary
    /// rest.
    pub(super) fn given(&self, mesh: &TetMesh) -> Result<TetrahedralField, InteriorError> {
        mesh.validate()?;
        let mut origins = alloc::vec![TetVertexOrigin::Inside; mesh.positions.len()];
        let neighbours = mesh.neighbours()?;
        for (tet, k) in TetMesh::boundary_faces(&neighbours) {
            for v in mesh.face(tet, k) {
                origins[v as usize] = TetVertexOrigin::Box;
            }
        }
        let mut shared = Vec::new();
        for (s, surface) in self.surfaces.iter().enumerate() {
            let places = mesh
                .conformity(surface.mesh)
                .map_err(|error| InteriorError::Conformity { surface: s, error })?;
            for (v, place) in places {
                let origin = TetVertexOrigin::Surface {
                    surface: s as u32,
                    triangle: place.triangle,
                    bary: place.bary,
                };
                match &mut origins[v as usize] {
                    TetVertexOrigin::Surface { .. } => shared.push((v, origin)),
                    free => *free = origin,
                }
            }
        }
        shared.sort_by_key(|(v, _)| *v);
        let made = Tetrahedralization { mesh: mesh.clone(), origins, shared };
        Ok(TetrahedralField::new(made)?)
    }

    /// The velocities of a field's vertices for one parameter, and the surfaces that it leaves behind
    /// where others touch them.
    pub(super) fn vertex_velocities(
        &self,
        field: &TetrahedralField,
        parameter: usize,
    ) -> (TetVelocities, Vec<usize>) {
        let carriers: Vec<Carrier<'_>> = self
            .surfaces
            .iter()
            .map(|s| Carrier { mesh: s.mesh, motion: s.motion_or_rest(parameter) })
            .collect();
        let velocities = field.velocities(&carriers, &self.point_velocities(parameter));
        let left = field.left_behind(&velocities, &carriers);
        (velocities, left.into_iter().map(|s| s as usize).collect())
    }
}

impl GivenTetrahedra {
    /// The velocities that came with the tetrahedra for one parameter, if any did.
    pub(super) fn velocities(
        &self,
        parameter: usize,
    ) -> Result<Option<TetVelocities>, InteriorError> {
        let Some((_, list)) = self.velocities.iter().find(|(p, _)| *p == parameter) else {
            return Ok(None);
        };
        if list.len() != self.mesh.positions.len() {
            let (found, expected) = (list.len(), self.mesh.positions.len());
            return Err(InteriorError::VelocityCount { found, expected });
        }
        if let Some(vertex) = list.iter().position(|v| !v.is_finite()) {
            return Err(InteriorError::VelocityNotFinite { vertex });
        }
        Ok(Some(Arc::clone(list)))
    }
}
