//! Tetrahedra unlike the library's own, whose inside is stirred at random; and what spoils them.

use std::sync::Arc;

use drt_estimators::{GivenTetrahedra, InteriorMotion, Scene};
use drt_geom::{Mesh, TetMesh, TetVertexOrigin, Tetrahedralization, TetrahedralizeInput};
use drt_math::{Rng, Vec3, vec3};
use drt_motion::Parameter;
use drt_motion::interior::{Carrier, TetrahedralField};
use drt_motion::parameter::geometry_changes;
use drt_motion::surface::move_mesh;

use crate::Result;

/// Space beyond the surfaces, in diagonals: not as much as the library leaves.
const MARGIN: f64 = 0.2;

/// Tetrahedra of somebody else's making: TetGen's, where its feature is on.
fn fill(input: &TetrahedralizeInput<'_>) -> Result<Tetrahedralization> {
    #[cfg(feature = "tetgen")]
    return Ok(drt_geom::tetrahedralize_tetgen(input, std::time::Duration::from_secs(60))?);
    #[cfg(not(feature = "tetgen"))]
    return Ok(drt_geom::tetrahedralize(input)?);
}

/// Tetrahedra around a medium with velocities of all vertices.
#[derive(Clone, Debug)]
pub struct Stirred {
    mesh: TetMesh,
    origins: Vec<TetVertexOrigin>,
    velocities: Vec<Vec3>,
}

impl Stirred {
    /// Tetrahedra with the medium's surfaces, with the eye at rest, and with further vertices that
    /// move at random up to `speed` along each axis.
    ///
    /// # Errors
    /// When a surface is missing or cannot be moved, or no tetrahedra fill the space.
    pub fn new(
        scene: &Scene,
        parameter: &Parameter,
        surfaces: &[&str],
        eye: Option<Vec3>,
        further: &[Vec3],
        speed: f64,
    ) -> Result<Self> {
        let parameters = [parameter.clone()];
        let moved = surfaces.iter().map(|id| {
            let shape = scene.shapes.iter().find(|s| s.id.as_deref() == Some(*id));
            let mesh = &shape.ok_or("no such shape")?.mesh;
            Ok(move_mesh(mesh, &geometry_changes(&parameters, &(*id).to_string())?, 1)?)
        });
        let moved = moved.collect::<Result<Vec<_>>>()?;
        let meshes: Vec<&Mesh> = moved.iter().map(|m| &m.mesh).collect();
        // The eye comes last, so that the others keep their numbers.
        let points: Vec<Vec3> = further.iter().copied().chain(eye).collect();
        let input = TetrahedralizeInput { surfaces: &meshes, points: &points, margin: MARGIN };
        let made = fill(&input)?;
        let (mesh, origins) = (made.mesh.clone(), made.origins.clone());
        let carriers: Vec<Carrier<'_>> =
            moved.iter().map(|m| Carrier { mesh: &m.mesh, motion: &m.motions[0] }).collect();
        let mut rng = Rng::new(5, 0, 0);
        let mut random = || (2.0 * rng.next_f64() - 1.0) * speed;
        let mut any: Vec<Vec3> =
            further.iter().map(|_| vec3(random(), random(), random())).collect();
        any.extend(eye.map(|_| Vec3::ZERO));
        let velocities = TetrahedralField::new(made)?.velocities(&carriers, &any).to_vec();
        Ok(Self { mesh, origins, velocities })
    }

    /// As what is asked for the first medium.
    #[must_use]
    pub fn kind(&self) -> (usize, InteriorMotion) {
        let (mesh, velocities) = (self.mesh.clone(), self.velocities.as_slice().into());
        let given = GivenTetrahedra { mesh, velocities: vec![(0, velocities)] };
        (0, InteriorMotion::Tetrahedral(Some(Arc::new(given))))
    }

    /// Wrong: vertices on surfaces move `factor` times as fast as these.
    #[must_use]
    pub fn lagging(mut self, factor: f64) -> Self {
        for (v, origin) in self.velocities.iter_mut().zip(&self.origins) {
            if matches!(origin, TetVertexOrigin::Surface { .. }) {
                *v *= factor;
            }
        }
        self
    }

    /// Wrong: no tetrahedra around the first of the further vertices, where everything rests then, and
    /// velocities jump.
    #[must_use]
    pub fn torn(self, count: u32) -> Self {
        let gone =
            |v: &u32| matches!(self.origins[*v as usize], TetVertexOrigin::Point(i) if i < count);
        let kept = self.mesh.tets.iter().copied().filter(|tet| !tet.iter().any(gone));
        let mut tets: Vec<[u32; 4]> = kept.collect();
        let mut used: Vec<u32> = tets.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        for v in tets.iter_mut().flatten() {
            *v = used.partition_point(|u| u < v) as u32;
        }
        let positions = used.iter().map(|v| self.mesh.positions[*v as usize]).collect();
        Self {
            mesh: TetMesh { positions, tets },
            origins: used.iter().map(|v| self.origins[*v as usize]).collect(),
            velocities: used.iter().map(|v| self.velocities[*v as usize]).collect(),
        }
    }
}
