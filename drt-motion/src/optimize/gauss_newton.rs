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

use alloc::vec::Vec;

use drt_math::dense::{Cholesky, dot, eigen, times, zeros};
use drt_math::fm;

use super::OptimizeError;
use super::optimizer::{all_finite, same_length};

/// What one iteration sees of a sum of squares at the present values.
#[derive(Clone, Copy, Debug)]
pub struct Observation<'a> {
    /// The gradient by the values.
    pub gradient: &'a [f64],
    /// Gauss and Newton's matrix, one row per variable; symmetric, and unbiased rather than positive.
    pub curvature: &'a [Vec<f64>],
    /// What noise adds to a square of derivatives, in the same units; no rows where there is no noise.
    pub noise: &'a [Vec<f64>],
    /// How much it counts, such as its number of samples; positive.
    pub weight: f64,
}

impl Observation<'_> {
    pub(super) fn check(&self, n: usize) -> Result<(), OptimizeError> {
        same_length("the gradient", n, self.gradient)?;
        all_finite("the gradient", self.gradient)?;
        check_square("the curvature", n, self.curvature)?;
        if !self.noise.is_empty() {
            check_square("the noise", n, self.noise)?;
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
    /// S, the sum of all weights.
    pub total: f64,
    /// 1/k = Σ w² / (Σ w)²: the variance of the averages relative to that of one iteration.
    pub share: f64,
    /// f, the squared scatter of one iteration's curvature, relative to that with noise.
    pub scatter: f64,
}

/// Least pivot of a matrix with a diagonal of ones, added to it: variables that do the same share a step.
const RIDGE: f64 = 1e-10;
/// Most passes over the variables in the search for the best step within limits.
const SWEEPS: usize = 10_000;
/// A change of a step, relative to its limits, that ends the search.
const SETTLED: f64 = 1e-13;

impl Averages {
    pub(super) fn new(n: usize) -> Self {
        let (curvature, noise) = (zeros(n), zeros(n));
        // As large as it can be, until it is seen.
        let scatter = 0.25 * n as f64;
        Self { gradient: alloc::vec![0.0; n], curvature, noise, total: 0.0, share: 0.0, scatter }
    }

    pub(super) fn check(&self, n: usize) -> Result<(), OptimizeError> {
        same_length("the averaged gradient", n, &self.gradient)?;
        all_finite("the averaged gradient", &self.gradient)?;
        check_square("the averaged curvature", n, &self.curvature)?;
        check_square("the averaged noise", n, &self.noise)?;
        for (name, value) in [("total", self.total), ("share", self.share)] {
            if !(value > 0.0 && value.is_finite()) {
                let expected = "a positive number";
                return Err(OptimizeError::Method { name, value, expected });
            }
        }
        if self.scatter >= 0.0 && self.scatter.is_finite() {
            return Ok(());
        }
        let expected = "a number that is not negative";
        Err(OptimizeError::Method { name: "scatter", value: self.scatter, expected })
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
        self.total += seen.weight;
        let part = f64::min(1.0, seen.weight / (memory * self.total));
        self.share = (1.0 - part) * (1.0 - part) * self.share + part * part;
        let towards = |mean: &mut f64, new: f64| *mean += part * (new - *mean);
        towards(&mut self.scatter, scatter);
        for i in 0..n {
            towards(&mut self.gradient[i], seen.gradient[i] * slopes[i]);
            for j in 0..n {
                towards(&mut self.curvature[i][j], curvature[i][j]);
                let noise = seen.noise.get(i).map_or(0.0, |row| row[j]);
                towards(&mut self.noise[i][j], noise * slopes[i] * slopes[j]);
            }
        }
        Some(())
    }

    /// q.
    fn damping(&self) -> f64 {
        let edge = 2.0 * fm::sqrt(self.scatter / self.gradient.len() as f64);
        f64::min(1.0, edge) * fm::sqrt(self.share)
    }

    /// The step of the coordinates, each between its two limits, which include 0. The averaged gradient
    /// becomes that at the end of it. `None` when the matrices are not those of a sum of squares.
    pub(super) fn step(&mut self, limits: &[[f64; 2]]) -> Option<Vec<f64>> {
        let metric = Metric::new(self)?;
        let (signal, directions) = eigen(&metric.relative(&self.curvature));
        let signal: Vec<f64> = signal.iter().map(|s| s.clamp(0.0, 1.0)).collect();
        let directions: Vec<Vec<f64>> = directions.iter().map(|v| metric.absolute(v)).collect();
        let sum = |value: &dyn Fn(f64) -> f64| {
            let weights: Vec<f64> = signal.iter().map(|s| value(*s)).collect();
            table(limits.len(), |i, j| {
                weights.iter().zip(&directions).map(|(w, v)| w * v[i] * v[j]).sum()
            })
        };
        let q = self.damping();
        let damped = sum(&|s| s + q * (1.0 - s));
        if !damped.iter().flatten().all(|v| v.is_finite()) {
            return None;
        }
        let step = least(&damped, &self.gradient, limits);
        for (b, change) in self.gradient.iter_mut().zip(times(&sum(&|s| s), &step)) {
            *b += change;
        }
        Some(step)
    }
}

/// M as L Lᵀ, of variables with units in which its diagonal is 1.
struct Metric {
    units: Vec<f64>,
    factor: Cholesky,
}

impl Metric {
    fn new(averages: &Averages) -> Option<Self> {
        let Averages { curvature, noise, .. } = averages;
        let n = curvature.len();
        let square = |i: usize| curvature[i][i] + noise[i][i];
        // Variables without any effect have a unit of their own.
        let units: Vec<f64> =
            (0..n).map(|i| if square(i) > 0.0 { fm::sqrt(square(i)) } else { 1.0 }).collect();
        let matrix = table(n, |i, j| {
            let ridge = match i == j {
                true if square(i) > 0.0 => RIDGE,
                true => 1.0,
                false => 0.0,
            };
            (curvature[i][j] + noise[i][j]) / units[i] / units[j] + ridge
        });
        Some(Self { units, factor: Cholesky::new(&matrix, 0.0)? })
    }

    /// L⁻¹ H L⁻ᵀ of a symmetric H.
    fn relative(&self, matrix: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let n = self.units.len();
        let mut rows = table(n, |i, j| matrix[i][j] / self.units[i] / self.units[j]);
        for _ in 0..2 {
            rows.iter_mut().for_each(|row| self.factor.solve_lower(row));
            rows = table(n, |i, j| rows[j][i]);
        }
        rows
    }

    /// L v: what v is the relative form of.
    fn absolute(&self, v: &[f64]) -> Vec<f64> {
        self.factor.times(v).iter().zip(&self.units).map(|(v, unit)| v * unit).collect()
    }
}

fn table(n: usize, value: impl Fn(usize, usize) -> f64) -> Vec<Vec<f64>> {
    (0..n).map(|i| (0..n).map(|j| value(i, j)).collect()).collect()
}

/// The minimum of b·Δ + Δ·B Δ / 2 between limits, for a positive definite B.
fn least(matrix: &[Vec<f64>], b: &[f64], limits: &[[f64; 2]]) -> Vec<f64> {
    let n = b.len();
    let mut step = alloc::vec![0.0; n];
    if let Some(factor) = Cholesky::new(matrix, 0.0) {
        step.iter_mut().zip(b).for_each(|(s, b)| *s = -b);
        factor.solve(&mut step);
        let within = |(s, [low, high]): (&f64, &[f64; 2])| (*low..=*high).contains(s);
        if step.iter().zip(limits).all(within) {
            return step;
        }
        step.iter_mut().zip(limits).for_each(|(s, [low, high])| *s = s.clamp(*low, *high));
    }
    // One variable after the other, which converges for convex functions in a box.
    for _ in 0..SWEEPS {
        let mut change: f64 = 0.0;
        for i in 0..n {
            let [low, high] = limits[i];
            if !(high > low && matrix[i][i] > 0.0) {
                continue;
            }
            let slope = b[i] + dot(&matrix[i], &step);
            let next = (step[i] - slope / matrix[i][i]).clamp(low, high);
            change = change.max((next - step[i]).abs() / (high - low));
            step[i] = next;
        }
        if change <= SETTLED {
            break;
        }
    }
    step
}
