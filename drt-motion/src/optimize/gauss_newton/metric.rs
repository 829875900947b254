use alloc::vec::Vec;

use drt_math::dense::{Cholesky, eigen};
use drt_math::fm;

use super::Averages;

/// Least pivot of a matrix with a diagonal of ones, added to it: variables that do the same share a step.
const RIDGE: f64 = 1e-10;
/// M as L Lᵀ, of variables with units in which its diagonal is 1.
pub(super) struct Metric {
    units: Vec<f64>,
    factor: Cholesky,
}

impl Metric {
    pub(super) fn new(averages: &Averages) -> Option<Self> {
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
    pub(super) fn relative(&self, matrix: &[Vec<f64>]) -> Vec<Vec<f64>> {
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

/// The averaged H in the directions in which it and M are diagonal.
pub(super) struct Signal {
    /// μ, between 0 and 1.
    values: Vec<f64>,
    /// L v of each.
    directions: Vec<Vec<f64>>,
}

impl Signal {
    /// `None` as for [`Metric::new`].
    pub(super) fn new(averages: &Averages) -> Option<Self> {
        let metric = Metric::new(averages)?;
        let (values, directions) = eigen(&metric.relative(&averages.curvature));
        let values = values.iter().map(|s| s.clamp(0.0, 1.0)).collect();
        let directions = directions.iter().map(|v| metric.absolute(v)).collect();
        Some(Self { values, directions })
    }

    /// The matrix whose μ are these functions of them.
    pub(super) fn matrix(&self, value: impl Fn(f64) -> f64) -> Vec<Vec<f64>> {
        let weights: Vec<f64> = self.values.iter().map(|s| value(*s)).collect();
        table(weights.len(), |i, j| {
            weights.iter().zip(&self.directions).map(|(w, v)| w * v[i] * v[j]).sum()
        })
    }
}

pub(super) fn table(n: usize, value: impl Fn(usize, usize) -> f64) -> Vec<Vec<f64>> {
    (0..n).map(|i| (0..n).map(|j| value(i, j)).collect()).collect()
}
