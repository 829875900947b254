use alloc::sync::Arc;
use alloc::vec;
use alloc::vec::Vec;
use core::fmt;

use drt_math::Vec3;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMat, Triplet};
use faer::{Conj, MatMut, Par, Side, Spec};

use super::MeshLaplacian;
use crate::optimize::OptimizeError;

/// The relative error of a solution from which on a factorisation is refused.
const LOST: f64 = 1e-6;

/// Smooth steps for the vertices of a mesh, after Nicolet, Jacobson and Jakob 2021, "Large Steps in Inverse
/// Rendering of Geometry".
///
/// With the Laplacian L of the mesh (see [`MeshLaplacian`]) and λ ≥ 0, descent goes over u = (I + λL) x in place of
/// the coordinates x. The derivatives of a loss by u are (I + λL)⁻¹ times its gradient g by x, and a step of u leads
/// to x = (I + λL)⁻¹ u, so that plain gradient descent with the learning rate η is x ← x - η (I + λL)⁻² g. Noise of
/// single vertices is damped, while motions of whole parts keep their speed. With
/// [`Method::Adam`](crate::optimize::Method::Adam) the second moment is one number for the whole field, the largest,
/// as in their variant of Adam: a factor for each value would undo the smoothing.
///
/// The matrix is factorised once; clones share the factor.
///
/// ```
/// use drt_motion::optimize::field::{FieldOptimizer, FieldRule, LaplacianSmoothing};
///
/// // Two triangles, and a gradient by the height of a single vertex.
/// let smoothing = LaplacianSmoothing::new(4, &[[0, 1, 2], [0, 2, 3]], 10.0)?;
/// let rule = FieldRule { smoothing: Some(smoothing), ..FieldRule::default() };
/// let mut coordinates = FieldOptimizer::new(rule, &[0.0; 12])?;
/// let mut gradient = [0.0; 12];
/// gradient[2] = -1.0;
/// coordinates.step(&gradient, 0, 1.0)?;
/// // The others go along.
/// let z = |vertex: usize| coordinates.values()[3 * vertex + 2];
/// assert!((1..4).all(|v| z(v) > 0.9 * z(0) && z(v) < z(0)));
/// # Ok::<(), drt_motion::optimize::OptimizeError>(())
/// ```
#[derive(Clone)]
pub struct LaplacianSmoothing {
    factorised: Arc<Factorised>,
}

/// A mesh with its matrix I + λL = P L' L'ᵀ Pᵀ, with a lower triangular L' and a permutation P that keeps it sparse.
struct Factorised {
    laplacian: MeshLaplacian,
    lambda: f64,
    /// The permutation, and where L' is not zero.
    pattern: SymbolicCholesky<usize>,
    /// The numbers of L'.
    numbers: Vec<f64>,
}

impl fmt::Debug for LaplacianSmoothing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LaplacianSmoothing")
            .field("vertices", &self.factorised.laplacian.vertices())
            .field("lambda", &self.factorised.lambda)
            .finish_non_exhaustive()
    }
}

impl LaplacianSmoothing {
    /// The smoothing of a mesh with this number of vertices, none of which is a copy of another one, by `lambda`
    /// (λ above): 0 changes nothing, and from 10 to 100 is usual.
    ///
    /// # Errors
    /// When λ is negative or not finite, or so large that the identity is lost beside it, or when a triangle names a
    /// vertex that does not exist.
    pub fn new(
        vertices: usize,
        triangles: &[[u32; 3]],
        lambda: f64,
    ) -> Result<Self, OptimizeError> {
        Self::of(MeshLaplacian::new(vertices, triangles)?, lambda)
    }

    /// The smoothing of a mesh in which vertices at equal positions are copies of each other and move together (see
    /// [`MeshLaplacian::with_seams`]).
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_seams(
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        lambda: f64,
    ) -> Result<Self, OptimizeError> {
        Self::of(MeshLaplacian::with_seams(positions, triangles)?, lambda)
    }

    /// The smoothing by a Laplacian.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn of(laplacian: MeshLaplacian, lambda: f64) -> Result<Self, OptimizeError> {
        if !(lambda >= 0.0 && lambda.is_finite()) {
            let expected = "0 or a positive number";
            return Err(OptimizeError::Method { name: "lambda", value: lambda, expected });
        }
        let (pattern, numbers) =
            factorise(&laplacian, lambda).ok_or(OptimizeError::Factorisation { lambda })?;
        let smoothing =
            Self { factorised: Arc::new(Factorised { laplacian, lambda, pattern, numbers }) };
        // What is the same everywhere is not changed by I + λL, unless rounding has lost the I.
        let mut ones = vec![1.0; smoothing.laplacian().vertices()];
        smoothing.solve(&mut ones, 1)?;
        if ones.iter().all(|one| (one - 1.0).abs() < LOST) {
            Ok(smoothing)
        } else {
            Err(OptimizeError::Factorisation { lambda })
        }
    }

    /// The Laplacian L.
    #[must_use]
    pub fn laplacian(&self) -> &MeshLaplacian {
        &self.factorised.laplacian
    }

    /// The factor λ of the Laplacian.
    #[must_use]
    pub fn lambda(&self) -> f64 {
        self.factorised.lambda
    }

    /// Replaces `values` by (I + λL)⁻¹ times them. The values have this number of columns, side by side, for each
    /// vertex, copies included. Copies of a vertex count as one whose value is the mean of theirs, and all of them
    /// get the same result.
    ///
    /// # Errors
    /// When the number of values is not the number of vertices times that of columns.
    pub fn solve(&self, values: &mut [f64], columns: usize) -> Result<(), OptimizeError> {
        let Factorised { laplacian, pattern, numbers, .. } = &*self.factorised;
        laplacian.same_shape("the values", values, columns)?;
        let mut at_places = laplacian.mean(values, columns);
        let rows = pattern.nrows();
        // One thread whatever else the program uses faer for: sums stay in the same order.
        let mut memory = MemBuffer::new(pattern.solve_in_place_scratch::<f64>(columns, Par::Seq));
        LltRef::new(pattern, numbers).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_row_major_slice_mut(&mut at_places, rows, columns),
            Par::Seq,
            MemStack::new(&mut memory),
        );
        laplacian.spread(&at_places, values, columns);
        Ok(())
    }

    /// Turns derivatives by x into those by u.
    pub(super) fn pull_back(&self, gradient: &mut [f64]) -> Result<(), OptimizeError> {
        let columns = self.laplacian().columns(gradient.len())?;
        self.laplacian().sum_copies(gradient, columns)?;
        self.solve(gradient, columns)
    }

    /// Turns a change of u into one of x.
    pub(super) fn push_forward(&self, change: &mut [f64]) -> Result<(), OptimizeError> {
        self.solve(change, self.laplacian().columns(change.len())?)
    }
}

/// The factor of I + λL; `None` where it is not positive definite to rounding, or does not fit into memory.
fn factorise(
    laplacian: &MeshLaplacian,
    lambda: f64,
) -> Option<(SymbolicCholesky<usize>, Vec<f64>)> {
    let neighbours = laplacian.neighbours();
    let rows = neighbours.len();
    let mut lower = Vec::new();
    for (j, around) in neighbours.enumerate() {
        lower.push(Triplet::new(j, j, 1.0 + lambda * around.len() as f64));
        let below = around.iter().map(|i| *i as usize).filter(|i| *i > j);
        lower.extend(below.map(|i| Triplet::new(i, j, -lambda)));
    }
    let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(rows, rows, &lower).ok()?;
    let pattern = factorize_symbolic_cholesky(
        matrix.symbolic(),
        Side::Lower,
        SymmetricOrdering::Amd,
        CholeskySymbolicParams::default(),
    )
    .ok()?;
    let mut numbers = vec![0.0; pattern.len_val()];
    let scratch = pattern.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default());
    let mut memory = MemBuffer::try_new(scratch).ok()?;
    pattern
        .factorize_numeric_llt(
            &mut numbers,
            matrix.as_ref(),
            Side::Lower,
            LltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut memory),
            Spec::default(),
        )
        .ok()?;
    numbers.iter().all(|number| number.is_finite()).then_some((pattern, numbers))
}
