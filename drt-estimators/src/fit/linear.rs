//! Small symmetric systems.

use alloc::vec::Vec;

use drt_math::fm;

/// Least pivot relative to its diagonal entry: below, two parameters do the same.
const LEAST_PIVOT: f64 = 1e-9;

/// With curvature H and covariance C of the gradient, the roots of the diagonal of H⁻¹ C H⁻¹; `None`
/// when H is not positive definite.
pub(super) fn newton_noise(curvature: &[Vec<f64>], covariance: &[Vec<f64>]) -> Option<Vec<f64>> {
    let factor = cholesky(curvature)?;
    let n = curvature.len();
    let noise = (0..n).map(|p| {
        let mut row: Vec<f64> = (0..n).map(|i| f64::from(u8::from(i == p))).collect();
        solve(&factor, &mut row);
        let variance: f64 = covariance
            .iter()
            .zip(&row)
            .map(|(c, r)| r * c.iter().zip(&row).map(|(c, r)| c * r).sum::<f64>())
            .sum();
        fm::sqrt(f64::max(variance, 0.0))
    });
    Some(noise.collect())
}

/// H⁻¹ g; `None` as above.
pub(super) fn newton_step(curvature: &[Vec<f64>], gradient: &[f64]) -> Option<Vec<f64>> {
    let factor = cholesky(curvature)?;
    let mut step = gradient.to_vec();
    solve(&factor, &mut step);
    Some(step)
}

/// The lower triangle L of H = L Lᵀ.
fn cholesky(h: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let mut l: Vec<Vec<f64>> = Vec::new();
    for (i, row) in h.iter().enumerate() {
        let mut next: Vec<f64> = Vec::new();
        for (j, value) in row.iter().take(i).enumerate() {
            let known: f64 = next.iter().zip(&l[j]).map(|(a, b)| a * b).sum();
            next.push((value - known) / l[j][j]);
        }
        let pivot = row[i] - next.iter().map(|v| v * v).sum::<f64>();
        if !(pivot > LEAST_PIVOT * row[i] && pivot.is_finite()) {
            return None;
        }
        next.push(fm::sqrt(pivot));
        l.push(next);
    }
    Some(l)
}

/// Replaces b by the x of L Lᵀ x = b.
fn solve(l: &[Vec<f64>], b: &mut [f64]) {
    for i in 0..b.len() {
        let known: f64 = (0..i).map(|j| l[i][j] * b[j]).sum();
        b[i] = (b[i] - known) / l[i][i];
    }
    for i in (0..b.len()).rev() {
        let known: f64 = (i + 1..b.len()).map(|j| l[j][i] * b[j]).sum();
        b[i] = (b[i] - known) / l[i][i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_goes_through_the_inverse() {
        let h = [alloc::vec![4.0, 1.0], alloc::vec![1.0, 0.5]];
        let c = [alloc::vec![2.0, 0.3], alloc::vec![0.3, 1.0]];
        // The inverse is ((0.5, -1), (-1, 4)).
        let found = newton_noise(&h, &c).unwrap();
        let expected = [0.25 * 2.0 - 0.3 + 1.0, 2.0 - 2.4 + 16.0];
        for (f, e) in found.iter().zip(expected) {
            assert!((f * f - e).abs() < 1e-12, "{f} {e}");
        }
        let step = newton_step(&h, &[2.0, 1.0]).unwrap();
        assert!(step[0].abs() < 1e-12 && (step[1] - 2.0).abs() < 1e-12, "{step:?}");
    }

    #[test]
    fn parameters_that_do_the_same_have_no_answer() {
        let h = [alloc::vec![1.0, 2.0], alloc::vec![2.0, 4.0]];
        assert!(newton_noise(&h, &h).is_none());
    }
}
