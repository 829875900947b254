//! Gauss and Newton's steps from noisy gradients and matrices.
//!
//! # Setting
//!
//! A sum of squares L(x) has the gradient g and the matrix H = Jᵀ W J of first derivatives, its second
//! derivatives but for what vanishes where the squares do. An iteration t sees g and H at x_t with errors
//! that average out. Two independent estimates A and B of J give
//!
//! ```text
//! H_t = (J_Aᵀ W J_B + J_Bᵀ W J_A) / 2        expected to be H,
//! N_t = (J_A − J_B)ᵀ W (J_A − J_B) / 2       what the noise of J adds to a square:
//! M_t = H_t + N_t = (J_Aᵀ W J_A + J_Bᵀ W J_B) / 2.
//! ```
//!
//! For W ≥ 0, vᵀ M_t v ≥ |vᵀ H_t v| in every direction v, by (a ± b)² ≥ 0. So the eigenvalues μ of H
//! relative to M (H v = μ M v) lie between −1 and 1, whatever the noise, for single iterations and for
//! averages. They tell how much of what is seen in a direction is signal, do not depend on the units of the
//! variables or on how they are mixed, and that of the true H is not negative.
//!
//! # Averages
//!
//! Each iteration is a linear equation for the goal: g_t + H_t (x − x_t) ≈ 0. With weights w, the sum of
//! all of them has the gradient at x and the matrix
//!
//! ```text
//! b(x) = Σ w_t (g_t + H_t (x − x_t)) / Σ w_t,     H = Σ w_t H_t / Σ w_t.
//! ```
//!
//! b is linear in x, so that it follows the values as they move: b ← b + H Δ after a step Δ, and
//! b ← b + γ (g_t − b), H ← H + γ (H_t − H) with what an iteration sees, γ = w_t / Σ w. This is recursive
//! least squares, or the extended Kalman filter of a state at rest (Ljung and Söderström 1983, *Theory and
//! Practice of Recursive Identification*). A step to b = 0 leaves γ g_t of the next iteration, and so x_t moves
//! by −γ H⁻¹ g_t: Robbins and Monro's recursion with Newton's matrix, whose error approaches H⁻¹ C H⁻¹ / t
//! for equal weights, with C the covariance of one gradient. No other way to use the same gradients does better
//! (Polyak and Juditsky 1992). What a step was not allowed to do stays in b and is done later.
//!
//! L is not quadratic: what was seen far away must be forgotten. γ_t = min(1, s_t / (m S_t)), where s_t is the
//! number of samples (or what else a weight is in proportion to), S_t their sum so far and m the `memory`:
//! the average spans the last part m of the run, weights growing with the power 1/m − 1 of S_t. It costs a
//! variance of 1 / (m (2 − m)) times that of equal weights: 1.7 for m = 0.35.
//!
//! # Damping
//!
//! With M = L Lᵀ and L⁻¹ H L⁻ᵀ = V μ Vᵀ, all that follows is one number in each direction:
//!
//! - H, known to be positive, takes μ between 0 and 1: the nearest that is possible.
//! - With 1/k = Σ w² / (Σ w)², the averaged H has 1/√k of the errors of one H_t. Those of L⁻¹ H_t L⁻ᵀ, n × n numbers, are
//!   seen as they come: f is the mean of ‖L⁻¹ (H_t − H) L⁻ᵀ‖² over iterations, the squared norm by Frobenius, 1/k of it
//!   due to H. A symmetric matrix of independent errors with the variance f/n² has no eigenvalue beyond 2 √(f/n), by
//!   Wigner's semicircle; nor, as above, beyond 1. The damped matrix is B = H + q N with q = min(1, 2 √(f/n)) / √k:
//!   μ + q (1 − μ) in each direction.
//!
//! B is positive definite as q > 0. The first step, with no f yet, takes M itself; without noise B is H throughout. The step
//! changes the gradient by H Δ, not by B Δ, so that damping delays, but does not bias.
//!
//! # Uncertainty
//!
//! Errors of iterations are independent, so that those of b have the covariance of a sum with the same weights:
//! S ← (1 − γ)² S + γ² C_t, with C_t the covariance of g_t's. They lead values astray by H⁻¹ times them, the
//! covariance of the values being H⁻¹ S H⁻¹. With the averaged H, each μ counts as at least q there: no less
//! can be told from noise, and in a direction of less signal the values are known no better than that.
//!
//! What is averaged also errs by errors of H times steps, and by what is not quadratic. Both show: before an
//! iteration is taken in, g_t is expected to be b, with the covariance C_t + S. Where the squared differences r by that
//! measure, rᵀ (C_t + S)⁻¹ r, exceed their number n, all errors are larger than they are said to be by the root of the
//! ratio (Birge 1932, "The Calculation of Errors by the Method of Least Squares"), in the same average over iterations.
//!
//! # Limits
//!
//! The step minimises b·Δ + Δ·B Δ / 2 where no variable moves by more than its learning rate, nor out of its
//! bounds. A variable that meets a limit does not shorten the others' steps; they are best given its own. Variables with a
//! logarithm have all of this by their logarithm.
//!
//! # Not handled
//!
//! Residuals that are large at the goal, whose second derivatives then count. Far from it, where the quadratic
//! model fails, only the limits hold. The time of a step grows with the cube of the number of variables.

mod least;
mod metric;

use alloc::vec::Vec;

use drt_math::dense::{Cholesky, dot, times, zeros};
use drt_math::fm;

use super::OptimizeError;
use super::checks::{all_finite, same_length};
use least::least;
use metric::{Metric, Signal, table};

/// What one iteration sees of a sum of squares at the present values.
#[derive(Clone, Copy, Debug)]
pub struct Observation<'a> {
    /// The gradient by the values.
    pub gradient: &'a [f64],
    /// Gauss and Newton's matrix, one row per variable; symmetric, and unbiased rather than positive.
    pub curvature: &'a [Vec<f64>],
    /// What noise adds to a square of derivatives, in the same units; no rows where there is no noise.
    pub noise: &'a [Vec<f64>],
    /// The covariance of the gradient's errors; no rows where it is known exactly.
    pub covariance: &'a [Vec<f64>],
    /// How much it counts, such as its number of samples; positive.
    pub weight: f64,
}

impl Observation<'_> {
    pub(super) fn check(&self, n: usize) -> Result<(), OptimizeError> {
        same_length("the gradient", n, self.gradient)?;
        all_finite("the gradient", self.gradient)?;
        check_square("the curvature", n, self.curvature)?;
        for (what, rows) in [("the noise", self.noise), ("the covariance", self.covariance)] {
            if !rows.is_empty() {
                check_square(what, n, rows)?;
            }
        }
        if self.weight > 0.0 && self.weight.is_finite() {
            return Ok(());
        }
        let expected = "a positive number";
        Err(OptimizeError::Method { name: "weight", value: self.weight, expected })
    }
}

fn check_square(what: &'static str, n: usize, rows: &[Vec<f64>]) -> Result<(), OptimizeError> {
    if rows.len() != n {
        return Err(OptimizeError::Length { what, expected: n, found: rows.len() });
    }
    rows.iter().try_for_each(|row| {
        same_length(what, n, row)?;
        all_finite(what, row)
    })
}

/// Least pivot relative to its diagonal entry: below, two variables do the same.
const LEAST_PIVOT: f64 = 1e-9;

/// The averages of what was seen, at the present coordinates.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Averages {
    /// b.
    pub gradient: Vec<f64>,
    /// H.
    pub curvature: Vec<Vec<f64>>,
    /// N.
    pub noise: Vec<Vec<f64>>,
    /// S, the covariance of b's errors.
    pub covariance: Vec<Vec<f64>>,
    /// The sum of all weights.
    pub total: f64,
    /// 1/k = Σ w² / (Σ w)²: the variance of the averages relative to that of one iteration.
    pub share: f64,
    /// rᵀ (C_t + S)⁻¹ r / n.
    pub surprise: f64,
    /// f, the squared scatter of one iteration's curvature, relative to that with noise.
    pub scatter: f64,
}

impl Averages {
    pub(super) fn new(n: usize) -> Self {
        let [curvature, noise, covariance] = [(); 3].map(|()| zeros(n));
        // As large as it can be, until it is seen.
        let scatter = 0.25 * n as f64;
        let gradient = alloc::vec![0.0; n];
        let (total, share, surprise) = (0.0, 0.0, 1.0);
        Self { gradient, curvature, noise, covariance, total, share, surprise, scatter }
    }

    pub(super) fn check(&self, n: usize) -> Result<(), OptimizeError> {
        same_length("the averaged gradient", n, &self.gradient)?;
        all_finite("the averaged gradient", &self.gradient)?;
        check_square("the averaged curvature", n, &self.curvature)?;
        check_square("the averaged noise", n, &self.noise)?;
        check_square("the averaged covariance", n, &self.covariance)?;
        for (name, value) in [("total", self.total), ("share", self.share)] {
            if !(value > 0.0 && value.is_finite()) {
                let expected = "a positive number";
                return Err(OptimizeError::Method { name, value, expected });
            }
        }
        for (name, value) in [("scatter", self.scatter), ("surprise", self.surprise)] {
            if !(value >= 0.0 && value.is_finite()) {
                let expected = "a number that is not negative";
                return Err(OptimizeError::Method { name, value, expected });
            }
        }
        Ok(())
    }

    /// Takes an iteration into the averages; `slopes` are the derivatives of the values by their
    /// coordinates. `None` as for [`step`](Self::step).
    pub(super) fn observe(
        &mut self,
        seen: &Observation<'_>,
        slopes: &[f64],
        memory: f64,
    ) -> Option<()> {
        let n = slopes.len();
        let curvature = table(n, |i, j| seen.curvature[i][j] * slopes[i] * slopes[j]);
        let scatter = match self.total > 0.0 {
            true => {
                let change = table(n, |i, j| curvature[i][j] - self.curvature[i][j]);
                let change = Metric::new(self)?.relative(&change);
                change.iter().map(|row| dot(row, row)).sum::<f64>() / (1.0 + self.share)
            }
            false => self.scatter,
        };
        let surprise = self.surprise_by(seen, slopes);
        self.total += seen.weight;
        let part = f64::min(1.0, seen.weight / (memory * self.total));
        self.share = (1.0 - part) * (1.0 - part) * self.share + part * part;
        let towards = |mean: &mut f64, new: f64| *mean += part * (new - *mean);
        towards(&mut self.scatter, scatter);
        towards(&mut self.surprise, surprise);
        for i in 0..n {
            towards(&mut self.gradient[i], seen.gradient[i] * slopes[i]);
            for j in 0..n {
                towards(&mut self.curvature[i][j], curvature[i][j]);
                let [noise, error] = [seen.noise, seen.covariance]
                    .map(|rows| rows.get(i).map_or(0.0, |row| row[j] * slopes[i] * slopes[j]));
                towards(&mut self.noise[i][j], noise);
                let mean = &mut self.covariance[i][j];
                *mean = (1.0 - part) * (1.0 - part) * *mean + part * part * error;
            }
        }
        Some(())
    }

    /// How far a gradient is from what was expected, over how far it should be; as before where that is not
    /// known.
    fn surprise_by(&self, seen: &Observation<'_>, slopes: &[f64]) -> f64 {
        let n = slopes.len();
        let error = |i: usize, j: usize| {
            let own = seen.covariance.get(i).map_or(0.0, |row| row[j] * slopes[i] * slopes[j]);
            own + self.covariance[i][j]
        };
        let root = |i: usize| fm::sqrt(error(i, i));
        if self.total == 0.0 || (0..n).any(|i| root(i) == 0.0) {
            return self.surprise;
        }
        let correlation = table(n, |i, j| error(i, j) / root(i) / root(j));
        let Some(factor) = Cholesky::new(&correlation, LEAST_PIVOT) else { return self.surprise };
        let difference = |i: usize| (seen.gradient[i] * slopes[i] - self.gradient[i]) / root(i);
        let mut r: Vec<f64> = (0..n).map(difference).collect();
        factor.solve_lower(&mut r);
        dot(&r, &r) / n as f64
    }

    /// q.
    fn damping(&self) -> f64 {
        let edge = 2.0 * fm::sqrt(self.scatter / self.gradient.len() as f64);
        f64::min(1.0, edge) * fm::sqrt(self.share)
    }

    /// The step of the coordinates, each between its two limits, which include 0. The averaged gradient
    /// becomes that at the end of it. `None` when the matrices are not those of a sum of squares.
    pub(super) fn step(&mut self, limits: &[[f64; 2]]) -> Option<Vec<f64>> {
        let signal = Signal::new(self)?;
        let q = self.damping();
        let damped = signal.matrix(|s| s + q * (1.0 - s));
        if !damped.iter().flatten().all(|v| v.is_finite()) {
            return None;
        }
        let step = least(&damped, &self.gradient, limits);
        for (b, change) in self.gradient.iter_mut().zip(times(&signal.matrix(|s| s), &step)) {
            *b += change;
        }
        Some(step)
    }

    /// What the coordinates have still to go by the averages, without limits, and the standard errors that
    /// noise leaves them. `None` where directions without noise are without effect, too.
    pub(super) fn outlook(&self) -> Option<[Vec<f64>; 2]> {
        let (signal, q) = (Signal::new(self)?, self.damping());
        let factor = Cholesky::new(&signal.matrix(|s| f64::max(s, q)), LEAST_PIVOT)?;
        let mut step: Vec<f64> = self.gradient.iter().map(|b| -b).collect();
        factor.solve(&mut step);
        let more = fm::sqrt(self.surprise.max(1.0));
        let errors = factor.errors(&self.covariance);
        Some([step, errors.iter().map(|e| e * more).collect()])
    }
}
