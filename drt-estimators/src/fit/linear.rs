//! Newton steps and their noise.

use alloc::vec::Vec;

use drt_math::dense::Cholesky;

/// Least pivot relative to its diagonal entry: below, two parameters do the same.
const LEAST_PIVOT: f64 = 1e-9;

/// With curvature H and covariance C of the gradient, the roots of the diagonal of H⁻¹ C H⁻¹; `None`
/// when H is not positive definite.
pub(super) fn newton_noise(curvature: &[Vec<f64>], covariance: &[Vec<f64>]) -> Option<Vec<f64>> {
    Some(Cholesky::new(curvature, LEAST_PIVOT)?.errors(covariance))
}

/// H⁻¹ g; `None` as above.
pub(super) fn newton_step(curvature: &[Vec<f64>], gradient: &[f64]) -> Option<Vec<f64>> {
    let factor = Cholesky::new(curvature, LEAST_PIVOT)?;
    let mut step = gradient.to_vec();
    factor.solve(&mut step);
    Some(step)
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
