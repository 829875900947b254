use alloc::vec::Vec;
use core::ops::ControlFlow;

use drt_math::{Vec3, vec3};

use super::arrays::MOST;
use super::double::EdgeFrame;
use super::starts::Starts;
use super::{TetMesh, TetMeshError, flat_height};
use crate::query::BoxTree;
use crate::{Aabb, NONE};

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
    /// In the tree's order.
    pub(super) records: Vec<Record>,
    /// Where the record of each tetrahedron is.
    places: Vec<u32>,
    pub(super) tree: BoxTree,
    /// Where walks begin without a hint.
    starts: Option<Starts>,
    /// Where anything can be found.
    reach: Aabb,
    /// How far off a tetrahedron points are still its own when they are no other's.
    slack: f64,
}

/// All that is read of a tetrahedron: two lines of cache.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Record {
    /// The corner whose weight has the steepest gradient: formed from the others' weights, it has an
    /// error no larger than by its own gradient. (Flat faces would else have points that are on
    /// them only to the rounding of steeper weights.) It changes places with the first corner.
    origin: [f64; 3],
    /// By axis: the gradients of the weights of the other corners.
    gradients: [[f64; 3]; 3],
    /// What the rounding error of each of these weights is less than, for a point inside; infinite
    /// for a tetrahedron that counts as flat.
    error: [f32; 3],
    /// The tetrahedron's number, and the corner at the origin in the bits above [`NUMBER`].
    name: u32,
    /// The places of the tetrahedra across the faces opposite to the corners, or [`NONE`].
    neighbours: [u32; 4],
}

/// The bits of a name that are the number.
const NUMBER: u32 = MOST as u32;

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
        let bounds = Aabb::around(mesh.tets.iter().flatten().map(|v| mesh.positions[*v as usize]));
        let (tree, order) = BoxTree::build(&bounds, across.len() as u32, |tet| mesh.tet(tet));
        let mut places = alloc::vec![0; order.len()];
        for (place, tet) in (0..).zip(&order) {
            places[*tet as usize] = place;
        }
        let record = |tet: &u32| {
            let place = |t: u32| places.get(t as usize).copied().unwrap_or(NONE);
            Record::new(mesh, *tet, across[*tet as usize].map(place), height)
        };
        let records = order.iter().map(record).collect::<Result<_, _>>()?;
        let largest = f64::max(bounds.min.max_abs(), bounds.max.max_abs());
        let slack =
            128.0 * f64::EPSILON * bounds.extent().max_abs() + 16.0 * f64::EPSILON * largest;
        let reach = Vec3::splat(if bounds.is_empty() { 0.0 } else { slack });
        let mut locator = Self {
            records,
            places,
            tree,
            starts: None,
            reach: Aabb { min: bounds.min - reach, max: bounds.max + reach },
            slack,
        };
        if !bounds.is_empty() {
            let find = |x| Some(locator.places[locator.search(x)?.tet as usize]);
            locator.starts = Some(Starts::new(&bounds, mesh.tets.len(), find));
        }
        Ok(locator)
    }

    /// The tetrahedron that holds a point, and the point's weights there; `None` outside of the
    /// domain.
    ///
    /// A `hint` at a tetrahedron nearby makes it faster and changes nothing else.
    #[inline]
    #[must_use]
    pub fn locate(&self, x: Vec3, hint: Option<u32>) -> Option<TetPoint> {
        let hinted = hint.and_then(|tet| self.places.get(tet as usize).copied());
        let start = hinted.or_else(|| Some(self.starts.as_ref()?.near(x)));
        start.and_then(|place| self.walk(x, place)).or_else(|| self.search(x))
    }

    /// The gradients of the weights of a tetrahedron's corners, per unit of length; zero where it
    /// counts as flat. A function with values `f` at the corners has the gradient
    /// `Σ f[i] gradients[i]`, and a velocity `u` the divergence `Σ u[i] · gradients[i]`.
    #[must_use]
    pub fn gradients(&self, tet: u32) -> [Vec3; 4] {
        let record = &self.records[self.places[tet as usize] as usize];
        record.by_corner(record.gradients())
    }

    /// From neighbour to neighbour through the face that the point is farthest beyond.
    #[inline]
    fn walk(&self, x: Vec3, from: u32) -> Option<TetPoint> {
        let mut place = from;
        for _ in 0..STEPS {
            let record = self.records.get(place as usize)?;
            let weights = record.weights(x);
            let error = record.errors();
            if holds(&weights, &error) {
                return Some(record.found(weights));
            }
            let exit = least(&weights);
            // Not so on a face, nor where there are no weights to go by.
            if weights[exit] < -error[exit] {
                place = record.neighbours[exit];
            } else {
                return None;
            }
        }
        None
    }

    /// From scratch: a walk from a tetrahedron near the point, or else all of those.
    fn search(&self, x: Vec3) -> Option<TetPoint> {
        if !self.reach.contains(x) {
            return None;
        }
        let here = Aabb { min: x, max: x };
        let mut start = NONE;
        self.tree.near(&here, |places| {
            let depth = |place: usize| {
                let weights = self.records[place].weights(x);
                weights[least(&weights)]
            };
            let mut most = f64::NEG_INFINITY;
            for place in places {
                let depth = depth(place);
                if depth > most {
                    (most, start) = (depth, place as u32);
                }
            }
            ControlFlow::Break(())
        });
        self.walk(x, start).or_else(|| self.nearest(x))
    }

    /// Of the tetrahedra near the point the one that holds it, or with the largest least weight of
    /// those that nearly do, and of several the first.
    fn nearest(&self, x: Vec3) -> Option<TetPoint> {
        let mut best: Option<TetPoint> = None;
        let mut most = f64::NEG_INFINITY;
        self.tree.near(&Aabb { min: x, max: x }, |places| {
            for record in &self.records[places] {
                let weights = record.weights(x);
                if holds(&weights, &record.errors()) {
                    best = Some(record.found(weights));
                    return ControlFlow::Break(());
                }
                let depth = weights[least(&weights)];
                let first = best.is_none_or(|b| record.tet() < b.tet);
                let better = depth > most || (depth == most && first);
                if better && record.nearly_holds(&weights, self.slack) {
                    (most, best) = (depth, Some(record.found(weights)));
                }
            }
            ControlFlow::Continue(())
        });
        best
    }
}

impl Record {
    fn new(
        mesh: &TetMesh,
        tet: u32,
        mut neighbours: [u32; 4],
        flat_height: f64,
    ) -> Result<Self, TetMeshError> {
        let mut corners = mesh.tet(tet);
        let frame = EdgeFrame::of(corners);
        let determinant = frame.determinant();
        if determinant < 0.0 && !frame.is_flat(flat_height) {
            return Err(TetMeshError::Inverted { tet });
        }
        let steepest = frame.steepest();
        corners.swap(0, steepest);
        neighbours.swap(0, steepest);
        let flat = Self {
            origin: corners[0].to_array(),
            gradients: [[0.0; 3]; 3],
            error: [f32::INFINITY; 3],
            name: tet | (steepest as u32) << NUMBER.count_ones(),
            neighbours,
        };
        let frame = EdgeFrame::of(corners);
        let Some(rows) = frame.gradients().filter(|_| determinant > 0.0) else {
            return Ok(flat);
        };
        // Coordinate differences, gradients, products and sums of three: seven roundings of a point
        // inside, of 2^-53 each. A point farther off has larger errors but for some corner a weight
        // below them, as long as none is above `WORST_ERROR`.
        let one_norm = |g: &Vec3| g.x.abs() + g.y.abs() + g.z.abs();
        let error = rows.map(|g| 8.0 * f64::EPSILON * (1.0 + frame.size * one_norm(&g)));
        if !error.iter().all(|e| *e < WORST_ERROR) {
            return Ok(flat);
        }
        Ok(Self {
            gradients: [0, 1, 2].map(|axis| [0, 1, 2].map(|i| rows[i][axis])),
            error: error.map(|e| (e as f32).next_up()),
            ..flat
        })
    }

    /// The tetrahedron's number.
    pub(super) fn tet(&self) -> u32 {
        self.name & NUMBER
    }

    /// What is listed from the origin on, by the tetrahedron's own order of corners.
    #[inline(always)]
    fn by_corner<T>(&self, mut from_origin: [T; 4]) -> [T; 4] {
        from_origin.swap(0, (self.name >> NUMBER.count_ones()) as usize % 4);
        from_origin
    }

    #[inline(always)]
    fn found(&self, weights: [f64; 4]) -> TetPoint {
        TetPoint { tet: self.tet(), bary: self.by_corner(weights) }
    }

    /// The weights of a point, from the origin on.
    #[inline(always)]
    pub(super) fn weights(&self, x: Vec3) -> [f64; 4] {
        let o = &self.origin;
        let p = [x.x - o[0], x.y - o[1], x.z - o[2]];
        let [gx, gy, gz] = &self.gradients;
        let [b, c, d] = [0, 1, 2].map(|i| gx[i] * p[0] + gy[i] * p[1] + gz[i] * p[2]);
        [1.0 - (b + c + d), b, c, d]
    }

    /// What the rounding errors of the weights are less than, for a point inside.
    #[inline(always)]
    pub(super) fn errors(&self) -> [f64; 4] {
        let [b, c, d] = self.error.map(f64::from);
        [b + c + d, b, c, d]
    }

    /// Whether a point of the given weights is in the tetrahedron, or off its faces by the slack.
    fn nearly_holds(&self, weights: &[f64; 4], slack: f64) -> bool {
        let is_flat = self.error[0] == f32::INFINITY;
        let (gradients, errors) = (self.gradients(), self.errors());
        let reaches = |i: usize| weights[i] >= -(slack * gradients[i].length() + errors[i]);
        !is_flat && (0..4).all(reaches)
    }

    /// The gradients of the weights, from the origin on.
    fn gradients(&self) -> [Vec3; 4] {
        let [x, y, z] = &self.gradients;
        let [b, c, d] = [0, 1, 2].map(|i| vec3(x[i], y[i], z[i]));
        [-(b + c + d), b, c, d]
    }
}

/// Whether weights are positive beyond doubt.
#[inline(always)]
pub(super) fn holds(bary: &[f64; 4], error: &[f64; 4]) -> bool {
    let [a, b, c, d] = [0, 1, 2, 3].map(|i| bary[i] > error[i]);
    a & b & c & d
}

/// The corner of the least weight.
#[inline(always)]
fn least(&[a, b, c, d]: &[f64; 4]) -> usize {
    let (i, first) = if b < a { (1, b) } else { (0, a) };
    let (j, second) = if d < c { (3, d) } else { (2, c) };
    if second < first { j } else { i }
}
