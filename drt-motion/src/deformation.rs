//! Deformations of space that are linear on tetrahedra: the map from unmoved to moved positions, the
//! map back, and the derivatives of both (2021 paper, §6.3).
//!
//! With corners X_k before and x_k after, the point x = Σ b_k x_k came from X = Σ b_k X_k. At a fixed
//! x, velocities v_k of the moved corners give
//!
//! ```text
//! F⁻¹ = dX/dx = Σ X_k ⊗ ∇b_k,   u(x) = Σ b_k v_k,   dX/dθ = -F⁻¹ u.
//! ```
//!
//! Both maps are continuous; F jumps between tetrahedra.

use alloc::vec::Vec;
use core::ops::ControlFlow;

use drt_geom::{Aabb, TetLocator, TetMesh, TetMeshError};
use drt_math::{Affine, Mat3, Vec3};

/// A deformation of the space that tetrahedra fill.
#[derive(Clone, Debug)]
pub struct Deformation {
    /// Corners before.
    unmoved: Vec<Vec3>,
    moved: TetMesh,
    locator: TetLocator,
    bounds: Aabb,
}

/// Why positions are no deformation of tetrahedra.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DeformationError {
    /// One position per vertex is needed.
    #[error("expected {expected} moved positions, one per vertex of the tetrahedra, found {found}")]
    Count {
        /// Vertices.
        expected: usize,
        /// Positions given.
        found: usize,
    },
    /// Space is turned inside out somewhere.
    #[error("tetrahedron {tet} (from 0), around {at:?} before, turns over")]
    TurnedOver {
        /// The first such tetrahedron.
        tet: u32,
        /// Its middle before it moved.
        at: [f64; 3],
    },
    /// The tetrahedra, or the positions, are no mesh.
    #[error(transparent)]
    Tetrahedra(TetMeshError),
}

/// A deformation at a point of moved space: the same for all parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeformedPlace {
    /// The vertices of the tetrahedron around the point.
    pub corners: [u32; 4],
    /// Their barycentric weights.
    pub weights: [f64; 4],
    /// The gradients of the weights by the moved position.
    pub gradients: [Vec3; 4],
    /// Where the point came from, X.
    pub material: Vec3,
    /// F⁻¹ = dX/dx.
    pub inverse: Mat3,
}

/// A stretch of a line on which a deformation is affine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AffineStretch {
    /// Distance where it starts.
    pub start: f64,
    /// Distance where it ends.
    pub end: f64,
    /// The map from moved to unmoved positions.
    pub inverse: Affine,
}

impl Deformation {
    /// The deformation that takes the vertices of tetrahedra to new positions.
    ///
    /// # Errors
    /// When a tetrahedron turns over by more than rounding, the positions do not fit the tetrahedra, or
    /// as [`TetLocator::new`].
    pub fn new(unmoved: &TetMesh, moved: Vec<Vec3>) -> Result<Self, DeformationError> {
        let (expected, found) = (unmoved.positions.len(), moved.len());
        if found != expected {
            return Err(DeformationError::Count { expected, found });
        }
        let moved = TetMesh { positions: moved, tets: unmoved.tets.clone() };
        let locator = TetLocator::new(&moved).map_err(|e| match e {
            TetMeshError::Inverted { tet } => {
                let [a, b, c, d] = unmoved.tet(tet);
                let at = ((a + b + c + d) * 0.25).to_array();
                DeformationError::TurnedOver { tet, at }
            }
            other => DeformationError::Tetrahedra(other),
        })?;
        let bounds = moved.bounds();
        Ok(Self { unmoved: unmoved.positions.clone(), moved, locator, bounds })
    }

    /// The tetrahedra after the deformation.
    #[must_use]
    pub fn moved(&self) -> &TetMesh {
        &self.moved
    }

    /// The map the other way: what it calls material points are the moved positions of this one.
    ///
    /// # Errors
    /// As [`Deformation::new`].
    pub fn inverse(&self) -> Result<Self, DeformationError> {
        let unmoved = self.moved.positions.clone();
        Self::new(&TetMesh { positions: unmoved, ..self.moved.clone() }, self.unmoved.clone())
    }

    /// The deformation at a point of moved space; `None` outside of the tetrahedra.
    #[must_use]
    pub fn place(&self, x: Vec3) -> Option<DeformedPlace> {
        let found = self.locator.locate(x, None)?;
        let gradients = self.locator.gradients(found.tet);
        let corners = self.moved.tets[found.tet as usize];
        // From one corner on: far from the origin of space little is lost then.
        let [a, b, c, d] = corners.map(|v| self.unmoved[v as usize]);
        let edges = [b - a, c - a, d - a];
        let [_, g1, g2, g3] = gradients;
        let column = |k: usize| edges[0] * g1[k] + edges[1] * g2[k] + edges[2] * g3[k];
        let [_, w1, w2, w3] = found.bary;
        Some(DeformedPlace {
            corners,
            weights: found.bary,
            gradients,
            material: a + (edges[0] * w1 + edges[1] * w2 + edges[2] * w3),
            inverse: Mat3 { cols: [column(0), column(1), column(2)] },
        })
    }

    /// Shows the stretches of a line of moved space, `origin + t dir` with unit `dir` and
    /// `0 < t < t_max`, in order until `visit` breaks; what lies outside of the tetrahedra is left out.
    ///
    /// Stretches end within rounding of where they should: 2^-40 of the extent of the tetrahedra.
    pub fn stretches(
        &self,
        origin: Vec3,
        dir: Vec3,
        t_max: f64,
        visit: &mut dyn FnMut(&AffineStretch) -> ControlFlow<()>,
    ) {
        let Some((mut t, end)) = self.clip(origin, dir, t_max) else { return };
        let least = self.bounds.extent().max_abs() * f64::from_bits((1023 - 40) << 52);
        let mut step = least;
        while t < end {
            // Looked up a little further on, where the next tetrahedron has begun.
            let probe = f64::min(t + step, 0.5 * (t + end));
            let Some(place) = self.place(origin + dir * probe) else {
                t += step;
                step *= 2.0;
                continue;
            };
            let mut leave = end;
            for (w, g) in place.weights.iter().zip(&place.gradients) {
                let slope = g.dot(dir);
                if slope < 0.0 {
                    leave = f64::min(leave, probe - w / slope);
                }
            }
            // In the corner of a sliver the way out is lost to rounding: longer steps lead on.
            let next = f64::min(f64::max(leave, t + step), end);
            step = if leave > t + step { least } else { 2.0 * step };
            let stretch =
                AffineStretch { start: t, end: next, inverse: place.affine(origin, dir, probe) };
            if visit(&stretch).is_break() {
                return;
            }
            t = next;
        }
    }

    /// From where to where a line can be inside.
    fn clip(&self, origin: Vec3, dir: Vec3, t_max: f64) -> Option<(f64, f64)> {
        let Aabb { min, max } = self.bounds;
        let (mut enter, mut leave) = (0.0, t_max);
        for k in 0..3 {
            if dir[k] == 0.0 {
                if !(min[k]..=max[k]).contains(&origin[k]) {
                    return None;
                }
                continue;
            }
            let (a, b) = ((min[k] - origin[k]) / dir[k], (max[k] - origin[k]) / dir[k]);
            enter = f64::max(enter, f64::min(a, b));
            leave = f64::min(leave, f64::max(a, b));
        }
        (enter < leave).then_some((enter, leave))
    }
}

impl DeformedPlace {
    /// The map back of the tetrahedron around the place, from the place on the line that it lies at.
    fn affine(&self, origin: Vec3, dir: Vec3, t: f64) -> Affine {
        let x = origin + dir * t;
        Affine { linear: self.inverse, translation: self.material - self.inverse * x }
    }

    /// The velocity of the material point here, by velocities of the moved vertices.
    ///
    /// # Panics
    /// When the velocities belong to other tetrahedra.
    #[inline]
    #[must_use]
    pub fn velocity(&self, velocities: &[Vec3]) -> Vec3 {
        let mut u = Vec3::ZERO;
        for k in 0..4 {
            u += velocities[self.corners[k] as usize] * self.weights[k];
        }
        u
    }

    /// How fast the material point changes that is here, at this fixed point of space: -F⁻¹ u.
    ///
    /// # Panics
    /// As [`velocity`](Self::velocity).
    #[inline]
    #[must_use]
    pub fn material_rate(&self, velocities: &[Vec3]) -> Vec3 {
        -(self.inverse * self.velocity(velocities))
    }

    /// The transpose of [`material_rate`](Self::material_rate): adds to the gradient by the moved
    /// vertices, the derivative of something by the material point being `adjoint`.
    ///
    /// # Panics
    /// When the gradient belongs to other tetrahedra.
    #[inline]
    pub fn scatter(&self, adjoint: Vec3, gradient: &mut [Vec3]) {
        let pull = -self.inverse.transpose_mul(adjoint);
        for k in 0..4 {
            gradient[self.corners[k] as usize] += pull * self.weights[k];
        }
    }

    /// Volume after over volume before.
    #[must_use]
    pub fn volume_ratio(&self) -> f64 {
        1.0 / self.inverse.determinant()
    }
}
