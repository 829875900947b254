use alloc::vec::Vec;
use core::ops::ControlFlow;

use drt_math::{Vec3, vec3};

use super::double::EdgeFrame;
use super::{TetMesh, TetMeshError, flat_height};
use crate::Aabb;
use crate::query::BoxTree;

/// Steps of a walk before searching from scratch takes less time.
const STEPS: usize = 16;

/// Weights whose rounding error may be larger say too little: their tetrahedron counts as flat.
const WORST_ERROR: f64 = 1.0 / 64.0;

/// A point of the domain, by the tetrahedron it lies in.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TetPoint {
    /// Which tetrahedron.
    pub tet: u32,
    /// Weights of its corners. They sum to one and are negative by no more than rounding.
    pub bary: [f64; 4],
}

/// Finds the tetrahedron that a point lies in.
///
/// *No point of the domain is lost.* Where rounding leaves a point between tetrahedra, or just
/// outside of the domain, the one whose least weight is the largest has it. Just outside means
/// within 2^-45 of the domain's largest extent and 2^-48 of its largest coordinate.
///
/// *The same bits whatever the hint.* A walk ends only in a tetrahedron that holds the point by
/// more than the rounding error of its weights, which no other does; all other points are searched
/// for from scratch. So results depend on the mesh and the point alone, for every mesh that
/// [`TetMesh::validate`] accepts.
///
/// *Slivers.* Weights are right to about 2^-50 times the ratio of the tetrahedron's longest edge to
/// its least height. Tetrahedra flatter than 1 : 2^43 or so, and those that the rounding of their
/// corners inverted, are never answers: within rounding their points are points of neighbours.
#[derive(Clone, Debug)]
pub struct TetLocator {
    pub(super) records: Vec<Record>,
    pub(super) tree: BoxTree,
    /// Where anything can be found.
    reach: Aabb,
    /// How far off a tetrahedron points are still its own when they are no other's.
    slack: f64,
}

/// All that is read of a tetrahedron: two lines of cache.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Record {
    /// The first corner.
    origin: [f64; 3],
    /// By axis: the gradients of the weights of the other corners.
    gradients: [[f64; 3]; 3],
    /// What the rounding error of each weight is less than, for a point inside; infinite for a
    /// tetrahedron that counts as flat.
    pub(super) error: [f32; 4],
    /// The tetrahedra across the faces opposite to the corners, or [`NONE`](crate::NONE).
    neighbours: [u32; 4],
}

const _: () = assert!(size_of::<Record>() == 128);

impl TetLocator {
    /// Prepares point location in a mesh.
    ///
    /// Tetrahedra without volume are let pass, and so are those inverted by no more than rounding (a
    /// corner is on the wrong side of the others by at most 8 units of rounding of the largest
    /// coordinate).
    ///
    /// # Errors
    /// When the arrays do not fit each other, a coordinate is not finite or beyond 1e100, a
    /// tetrahedron is inverted, or as for [`TetMesh::neighbours`].
    pub fn new(mesh: &TetMesh) -> Result<Self, TetMeshError> {
        mesh.check_arrays()?;
        let across = mesh.neighbours()?;
        let height = flat_height(&mesh.positions);
        let mut records = Vec::with_capacity(mesh.tets.len());
        for (tet, neighbours) in (0..).zip(across) {
            records.push(Record::new(mesh, tet, neighbours, height)?);
        }
        let bounds = Aabb::around(mesh.tets.iter().flatten().map(|v| mesh.positions[*v as usize]));
        let largest = f64::max(bounds.min.max_abs(), bounds.max.max_abs());
        let slack = if records.is_empty() {
            0.0
        } else {
            128.0 * f64::EPSILON * bounds.extent().max_abs() + 16.0 * f64::EPSILON * largest
        };
        Ok(Self {
            tree: BoxTree::build(&bounds, records.len() as u32, |tet| mesh.tet(tet)),
            records,
            reach: Aabb {
                min: bounds.min - Vec3::splat(slack),
                max: bounds.max + Vec3::splat(slack),
            },
            slack,
        })
    }

    /// The tetrahedron that holds a point, and the point's weights there; `None` outside of the
    /// domain.
    ///
    /// A `hint` at a tetrahedron nearby makes it faster and changes nothing else.
    #[inline]
    #[must_use]
    pub fn locate(&self, x: Vec3, hint: Option<u32>) -> Option<TetPoint> {
        if let Some(hint) = hint
            && let Some(found) = self.walk(x, hint)
        {
            return Some(found);
        }
        self.search(x)
    }

    /// The gradients of the weights of a tetrahedron's corners, per unit of length; zero where it
    /// counts as flat. A function with values `f` at the corners has the gradient
    /// `Σ f[i] gradients[i]`, and a velocity `u` the divergence `Σ u[i] · gradients[i]`.
    #[must_use]
    pub fn gradients(&self, tet: u32) -> [Vec3; 4] {
        let [x, y, z] = &self.records[tet as usize].gradients;
        let [b, c, d] = [0, 1, 2].map(|i| vec3(x[i], y[i], z[i]));
        [-(b + c + d), b, c, d]
    }

    /// From neighbour to neighbour through the face that the point is farthest beyond.
    #[inline]
    fn walk(&self, x: Vec3, hint: u32) -> Option<TetPoint> {
        let mut tet = hint;
        for _ in 0..STEPS {
            let record = self.records.get(tet as usize)?;
            let bary = record.weights(x);
            if record.holds(&bary) {
                return Some(TetPoint { tet, bary });
            }
            let exit = least(&bary);
            // Not so on a face, nor where there are no weights to go by.
            if bary[exit] < -f64::from(record.error[exit]) {
                tet = record.neighbours[exit];
            } else {
                return None;
            }
        }
        None
    }

    /// From scratch: a walk from any tetrahedron near the point, or else all of them.
    fn search(&self, x: Vec3) -> Option<TetPoint> {
        if !self.reach.contains(x) {
            return None;
        }
        let here = Aabb { min: x, max: x };
        let mut found = None;
        self.tree.near(&here, |tet| {
            found = self.walk(x, tet);
            ControlFlow::Break(())
        });
        if found.is_some() {
            return found;
        }
        let mut best: Option<TetPoint> = None;
        let mut most = f64::NEG_INFINITY;
        self.tree.near(&here, |tet| {
            let record = &self.records[tet as usize];
            let bary = record.weights(x);
            if record.holds(&bary) {
                best = Some(TetPoint { tet, bary });
                return ControlFlow::Break(());
            }
            let weight = bary[least(&bary)];
            let better = weight > most || (weight == most && best.is_some_and(|b| tet < b.tet));
            if better && self.nearly_holds(tet, &bary) {
                most = weight;
                best = Some(TetPoint { tet, bary });
            }
            ControlFlow::Continue(())
        });
        best
    }

    /// Whether a point of the given weights is in a tetrahedron or off it by the slack.
    fn nearly_holds(&self, tet: u32, bary: &[f64; 4]) -> bool {
        let gradients = self.gradients(tet);
        let inside = |i: usize| bary[i] >= -self.slack * gradients[i].length();
        !self.records[tet as usize].is_flat() && (0..4).all(inside)
    }
}

impl Record {
    fn new(
        mesh: &TetMesh,
        tet: u32,
        neighbours: [u32; 4],
        flat_height: f64,
    ) -> Result<Self, TetMeshError> {
        let corners = mesh.tet(tet);
        let frame = EdgeFrame::of(corners);
        let flat = Self {
            origin: corners[0].to_array(),
            gradients: [[0.0; 3]; 3],
            error: [f32::INFINITY; 4],
            neighbours,
        };
        if frame.determinant() < 0.0 && !frame.is_flat(flat_height) {
            return Err(TetMeshError::Inverted { tet });
        }
        let Some(rows) = frame.gradients().filter(|_| frame.determinant() > 0.0) else {
            return Ok(flat);
        };
        // Coordinate differences, gradients, products and sums of three: seven roundings of a point
        // inside, of 2^-53 each. A point farther off has larger errors but for some corner a weight
        // below them, as long as none is above `WORST_ERROR`.
        let one_norm = |g: &Vec3| g.x.abs() + g.y.abs() + g.z.abs();
        let [b, c, d] =
            [0, 1, 2].map(|i| 8.0 * f64::EPSILON * (1.0 + frame.size * one_norm(&rows[i])));
        let error = [b + c + d, b, c, d];
        if !error.iter().all(|e| *e < WORST_ERROR) {
            return Ok(flat);
        }
        Ok(Self {
            gradients: [0, 1, 2].map(|axis| [0, 1, 2].map(|i| rows[i][axis])),
            error: error.map(|e| (e as f32).next_up()),
            ..flat
        })
    }

    #[inline(always)]
    pub(super) fn weights(&self, x: Vec3) -> [f64; 4] {
        let o = &self.origin;
        let p = [x.x - o[0], x.y - o[1], x.z - o[2]];
        let [gx, gy, gz] = &self.gradients;
        let [b, c, d] = [0, 1, 2].map(|i| gx[i] * p[0] + gy[i] * p[1] + gz[i] * p[2]);
        [1.0 - (b + c + d), b, c, d]
    }

    /// Whether the weights are positive beyond doubt.
    #[inline(always)]
    pub(super) fn holds(&self, bary: &[f64; 4]) -> bool {
        (0..4).all(|i| bary[i] > f64::from(self.error[i]))
    }

    fn is_flat(&self) -> bool {
        self.error[0] == f32::INFINITY
    }
}

/// The corner of the least weight.
#[inline(always)]
fn least(bary: &[f64; 4]) -> usize {
    (1..4).fold(0, |k, i| if bary[i] < bary[k] { i } else { k })
}
