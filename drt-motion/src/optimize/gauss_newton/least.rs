use alloc::vec::Vec;

use drt_math::dense::{Cholesky, dot};

/// Most passes over the variables in the search for the best step within limits.
const SWEEPS: usize = 10_000;
/// A change of a step, relative to its limits, that ends the search.
const SETTLED: f64 = 1e-13;

/// The minimum of b·Δ + Δ·B Δ / 2 between limits, for a positive definite B.
pub(super) fn least(matrix: &[Vec<f64>], b: &[f64], limits: &[[f64; 2]]) -> Vec<f64> {
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
