//! Small dense symmetric matrices, as lists of rows: factors, solutions, eigenvalues.

use alloc::vec;
use alloc::vec::Vec;

use crate::fm;

/// The lower triangle L of a positive definite matrix L Lᵀ.
#[derive(Clone, Debug, PartialEq)]
pub struct Cholesky {
    rows: Vec<Vec<f64>>,
}

impl Cholesky {
    /// Factors a matrix, of which only the lower triangle is read. `None` when a pivot is not larger
    /// than `least_pivot` times its diagonal entry, or the matrix is not finite.
    ///
    /// # Panics
    /// When a row is shorter than its part of the triangle.
    #[must_use]
    pub fn new(matrix: &[Vec<f64>], least_pivot: f64) -> Option<Self> {
        let mut rows: Vec<Vec<f64>> = Vec::new();
        for (i, row) in matrix.iter().enumerate() {
            let mut next: Vec<f64> = Vec::new();
            for (j, value) in row.iter().take(i).enumerate() {
                next.push((value - dot(&next, &rows[j])) / rows[j][j]);
            }
            let pivot = row[i] - dot(&next, &next);
            if !(pivot > least_pivot * row[i] && pivot > 0.0 && pivot.is_finite()) {
                return None;
            }
            next.push(fm::sqrt(pivot));
            rows.push(next);
        }
        Some(Self { rows })
    }

    /// Replaces b by the x of L Lᵀ x = b.
    ///
    /// # Panics
    /// When b has another length.
    pub fn solve(&self, b: &mut [f64]) {
        self.solve_lower(b);
        let l = &self.rows;
        for i in (0..b.len()).rev() {
            let known: f64 = (i + 1..b.len()).map(|j| l[j][i] * b[j]).sum();
            b[i] = (b[i] - known) / l[i][i];
        }
    }

    /// The standard errors of the x of L Lᵀ x = b, where the errors of b have this covariance.
    ///
    /// # Panics
    /// When the covariance has another size.
    #[must_use]
    pub fn errors(&self, covariance: &[Vec<f64>]) -> Vec<f64> {
        let n = self.rows.len();
        let error = |p: usize| {
            let mut row: Vec<f64> = (0..n).map(|i| f64::from(u8::from(i == p))).collect();
            self.solve(&mut row);
            fm::sqrt(f64::max(dot(&row, &times(covariance, &row)), 0.0))
        };
        (0..n).map(error).collect()
    }

    /// Replaces b by the x of L x = b.
    ///
    /// # Panics
    /// When b has another length.
    pub fn solve_lower(&self, b: &mut [f64]) {
        assert_eq!(b.len(), self.rows.len(), "a vector of another length");
        for i in 0..b.len() {
            let known = dot(&self.rows[i][..i], &b[..i]);
            b[i] = (b[i] - known) / self.rows[i][i];
        }
    }

    /// L x.
    ///
    /// # Panics
    /// When x has another length.
    #[must_use]
    pub fn times(&self, x: &[f64]) -> Vec<f64> {
        assert_eq!(x.len(), self.rows.len(), "a vector of another length");
        self.rows.iter().map(|row| dot(row, x)).collect()
    }
}

/// Eigenvalues of a symmetric matrix, in no particular order, and the eigenvector of each, of length 1.
///
/// By Jacobi's rotations (Golub and Van Loan 2013, *Matrix Computations*, section 8.5), which lose no
/// accuracy in small eigenvalues and take time in proportion to the cube of the size.
///
/// # Panics
/// When the matrix is not square.
#[must_use]
pub fn eigen(matrix: &[Vec<f64>]) -> (Vec<f64>, Vec<Vec<f64>>) {
    /// More than any matrix of numbers needs: off-diagonal entries shrink quadratically.
    const SWEEPS: usize = 40;
    let n = matrix.len();
    assert!(matrix.iter().all(|row| row.len() == n), "a matrix that is not square");
    let mut a = matrix.to_vec();
    let unit = |i| (0..n).map(|j| f64::from(u8::from(i == j))).collect();
    let mut vectors: Vec<Vec<f64>> = (0..n).map(unit).collect();
    for _ in 0..SWEEPS {
        let mut turned = false;
        for p in 0..n {
            for q in p + 1..n {
                let scale = fm::sqrt(a[p][p].abs()) * fm::sqrt(a[q][q].abs());
                if !(a[p][q].abs() > f64::EPSILON * scale && a[p][q].abs() > f64::MIN_POSITIVE) {
                    continue;
                }
                turned = true;
                rotate(&mut a, &mut vectors, p, q);
            }
        }
        if !turned {
            break;
        }
    }
    ((0..n).map(|i| a[i][i]).collect(), vectors)
}

/// Turns the axes p and q so that entry (p, q) becomes zero.
fn rotate(a: &mut [Vec<f64>], vectors: &mut [Vec<f64>], p: usize, q: usize) {
    let half = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    // The smaller of the two tangents that do it.
    let tan = f64::copysign(1.0, half) / (half.abs() + fm::sqrt(half * half + 1.0));
    let cos = 1.0 / fm::sqrt(tan * tan + 1.0);
    let sin = tan * cos;
    let turn = |x: &mut f64, y: &mut f64| (*x, *y) = (cos * *x - sin * *y, sin * *x + cos * *y);
    for row in a.iter_mut() {
        let (head, tail) = row.split_at_mut(q);
        turn(&mut head[p], &mut tail[0]);
    }
    for rows in [a, vectors] {
        let (head, tail) = rows.split_at_mut(q);
        head[p].iter_mut().zip(&mut tail[0]).for_each(|(x, y)| turn(x, y));
    }
}

/// The product of two vectors, as far as both reach.
#[must_use]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The product of a matrix and a vector.
#[must_use]
pub fn times(matrix: &[Vec<f64>], x: &[f64]) -> Vec<f64> {
    matrix.iter().map(|row| dot(row, x)).collect()
}

/// A matrix of zeros with so many rows and columns.
#[must_use]
pub fn zeros(n: usize) -> Vec<Vec<f64>> {
    vec![vec![0.0; n]; n]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rng;

    /// Jᵀ J of a random J with columns of very different lengths.
    fn random(n: usize, stream: u64) -> Vec<Vec<f64>> {
        let mut rng = Rng::new(3, stream, 0);
        let mut column = |j: usize| -> Vec<f64> {
            (0..n + 3).map(|_| (rng.next_f64() - 0.5) * fm::exp(-(j as f64))).collect()
        };
        let columns: Vec<Vec<f64>> = (0..n).map(&mut column).collect();
        columns.iter().map(|a| columns.iter().map(|b| dot(a, b)).collect()).collect()
    }

    #[test]
    fn factors_solve() {
        for n in [1, 2, 5, 12] {
            let matrix = random(n, 1);
            let factor = Cholesky::new(&matrix, 0.0).unwrap();
            let x: Vec<f64> = (0..n).map(|i| 1.0 + i as f64).collect();
            let mut found = times(&matrix, &x);
            factor.solve(&mut found);
            for (f, x) in found.iter().zip(&x) {
                assert!((f / x - 1.0).abs() < 1e-9, "{found:?}");
            }
            let mut there_and_back = factor.times(&x);
            factor.solve_lower(&mut there_and_back);
            for (f, x) in there_and_back.iter().zip(&x) {
                assert!((f / x - 1.0).abs() < 1e-12);
            }
        }
        let flat = [vec![1.0, 2.0], vec![2.0, 4.0]];
        assert!(Cholesky::new(&flat, 1e-9).is_none());
        assert!(Cholesky::new(&[vec![0.0]], 0.0).is_none());
        assert!(Cholesky::new(&[vec![f64::NAN]], 0.0).is_none());
    }

    #[test]
    fn eigenvectors_are_stretched() {
        for n in [1, 2, 3, 9, 20] {
            let mut matrix = random(n, 2);
            // Indefinite.
            matrix[0][0] -= 1.0;
            let (values, vectors) = eigen(&matrix);
            let largest = values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            for (value, vector) in values.iter().zip(&vectors) {
                assert!((dot(vector, vector) - 1.0).abs() < 1e-13);
                for (m, v) in times(&matrix, vector).iter().zip(vector) {
                    assert!((m - value * v).abs() < 1e-13 * largest, "{n}: {values:?}");
                }
            }
            let trace: f64 = (0..n).map(|i| matrix[i][i]).sum();
            assert!((values.iter().sum::<f64>() - trace).abs() < 1e-13 * largest * n as f64);
        }
    }
}
