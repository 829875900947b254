//! Vertex normals that turn by themselves, at positions at rest.
//!
//! With θ the parameters and v the vectors that they add, the normal of a vertex is N (n + Σ θ v), made unit, where n is
//! the file's and N takes normals along with the affine changes of the mesh. What a
//! parameter adds so turns the normal at the rate (N v - n' n'·N v) / |N (n + Σ θ v)|, n' being the normal.

use alloc::vec;
use alloc::vec::Vec;

use drt_geom::Mesh;
use drt_math::{Mat3, Vec3};

use crate::error::{Cause, MotionError, finite};
use crate::parameter::{Applied, GeometryChange};

/// What parameters add to the vertex normals of a mesh.
#[derive(Debug)]
pub(super) struct TurnedNormals {
    /// Sums with the normals of the mesh, before they are made unit.
    sums: Vec<Vec3>,
    /// What each parameter adds per unit; empty where that is nothing.
    rates: Vec<Vec<Vec3>>,
}

impl TurnedNormals {
    /// Collects the changes of normals, of `parameters` parameters in all; `None` without any.
    pub(super) fn new(
        mesh: &Mesh,
        changes: &[Applied<'_, GeometryChange>],
        parameters: usize,
    ) -> Result<Option<Self>, MotionError> {
        let mut turned: Option<Self> = None;
        for c in changes {
            let GeometryChange::VertexNormals(vectors) = c.change else { continue };
            let Some(normals) = &mesh.normals else { return Err(c.error(Cause::NoNormals)) };
            if changes.iter().any(|other| other.change.deforms()) {
                return Err(c.error(Cause::DeformedNormals));
            }
            let expected = mesh.source_vertex_count as usize;
            if vectors.len() != expected {
                return Err(c.error(Cause::VertexCount { expected, found: vectors.len() }));
            }
            let turned = turned.get_or_insert_with(|| Self {
                sums: normals.clone(),
                rates: vec![Vec::new(); parameters],
            });
            let rates = &mut turned.rates[c.parameter];
            rates.resize(normals.len(), Vec3::ZERO);
            for (i, (rate, sum)) in (0..).zip(rates.iter_mut().zip(&mut turned.sums)) {
                let vector = vectors[mesh.source_vertex(i) as usize];
                *rate += vector;
                *sum += vector * c.theta;
            }
            let all_finite = turned.sums.iter().all(|n| n.is_finite());
            finite(all_finite, "a vertex normal").map_err(|cause| c.error(cause))?;
            if turned.sums.iter().any(|n| n.length() == 0.0) {
                return Err(c.error(Cause::NoDirection));
            }
        }
        Ok(turned)
    }

    /// The unit normals of the mesh before anything else changes.
    pub(super) fn normals(&self) -> Vec<Vec3> {
        self.sums.iter().map(|n| n.normalize()).collect()
    }

    /// The rates at which a parameter turns the unit normals of the mesh after an affine map; `None` where it does not.
    pub(super) fn rates(&self, parameter: usize, linear: &Mat3) -> Option<Vec<Vec3>> {
        let own = &self.rates[parameter];
        if own.is_empty() {
            return None;
        }
        let [a, b, c] = linear.cols;
        let cofactors = Mat3 { cols: [b.cross(c), c.cross(a), a.cross(b)] };
        // As a mesh turns its normals: mirrored ones point to the same side of the surface.
        let side = if linear.determinant() < 0.0 { -1.0 } else { 1.0 };
        let rate = |(sum, rate): (&Vec3, &Vec3)| {
            let carried = cofactors * *sum;
            let length = carried.length();
            if length == 0.0 {
                return Vec3::ZERO;
            }
            (cofactors * *rate).reject(carried / length) * (side / length)
        };
        Some(self.sums.iter().zip(own).map(rate).collect())
    }
}
