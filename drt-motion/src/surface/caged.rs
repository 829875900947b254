use alloc::sync::Arc;
use alloc::vec;
use alloc::vec::Vec;

use drt_geom::Mesh;
use drt_math::Vec3;

use crate::error::{Cause, MotionError};
use crate::mean_value::{Cage, CageWeights};
use crate::parameter::{Applied, GeometryChange};

/// The cages that move a mesh: whatever the number of parameters, the coordinates of its vertices
/// with respect to each cage are computed once.
pub(crate) struct Caged<'a> {
    cages: Vec<Bound<'a>>,
}

/// A mesh as bound to a cage.
struct Bound<'a> {
    cage: &'a Arc<Mesh>,
    /// The cage vertices that some parameter moves, ascending.
    moving: Vec<u32>,
    weights: CageWeights,
}

impl<'a> Caged<'a> {
    /// Binds the unmoved mesh to all cages among the changes.
    pub(crate) fn new(
        mesh: &Mesh,
        changes: &[Applied<'a, GeometryChange>],
    ) -> Result<Self, MotionError> {
        let mut moving: Vec<(&Arc<Mesh>, Vec<u32>, &Applied<'a, GeometryChange>)> = Vec::new();
        for c in changes {
            let GeometryChange::Cage { mesh: cage, vertices } = c.change else { continue };
            let count = cage.source_vertex_count as usize;
            let indices = vertices.iter().map(|(index, _)| *index);
            if let Some(index) = indices.clone().find(|index| *index as usize >= count) {
                return Err(c.error(Cause::CageVertexIndex { index, count }));
            }
            match moving.iter_mut().find(|(known, ..)| is_same(known, cage)) {
                Some((_, list, _)) => list.extend(indices),
                None => moving.push((cage, indices.collect(), c)),
            }
        }
        let bind = |(cage, mut moving, first): (&'a Arc<Mesh>, Vec<u32>, &Applied<'a, _>)| {
            moving.sort_unstable();
            moving.dedup();
            let prepared = Cage::new(cage).map_err(|cause| first.error(cause))?;
            let weights = CageWeights::of_vertices(&prepared, &mesh.positions, &moving);
            Ok(Bound { cage, moving, weights })
        };
        Ok(Self { cages: moving.into_iter().map(bind).collect::<Result<_, _>>()? })
    }

    /// Velocities of the mesh's vertices for some of the cage's; `None` for a cage that is not among
    /// the changes.
    pub(crate) fn velocities(
        &self,
        cage: &Arc<Mesh>,
        vertices: &[(u32, Vec3)],
    ) -> Option<Vec<Vec3>> {
        let bound = self.cages.iter().find(|b| is_same(b.cage, cage))?;
        let mut directions = vec![Vec3::ZERO; bound.moving.len()];
        for (index, direction) in vertices {
            directions[bound.moving.binary_search(index).ok()?] += *direction;
        }
        Some(bound.weights.spread(&directions))
    }
}

fn is_same(a: &Arc<Mesh>, b: &Arc<Mesh>) -> bool {
    Arc::ptr_eq(a, b) || a == b
}
