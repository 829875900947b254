//! Statistical tests: does a sampler follow its density, does an estimate equal a number.
//!
//! For the tests of this crate and of those above (feature `testing`). All p-values are
//! probabilities of a result at least as bad when nothing is wrong; tests here reject below
//! [`SIGNIFICANCE`], with fixed seeds, so that a passing test passes always.

use alloc::vec;
use alloc::vec::Vec;
use core::f64::consts::PI;

use crate::{Moments, Vec3, fm, vec3};

/// Reject below this p-value: four standard errors of a normal variable.
pub const SIGNIFICANCE: f64 = 6.3e-5;

/// Cells expecting fewer counts are pooled: the chi-square law is an approximation for many.
const FEWEST_EXPECTED: f64 = 8.0;

/// Pearson's chi-square test of counts against expected counts (of the same total); the p-value.
///
/// A count in a cell that expects less than 1e-9 of one gives 0: impossible things do not happen.
/// Expected counts that are negative or NaN give 0 too.
///
/// # Panics
/// When the two lists differ in length.
#[must_use]
pub fn chi_square(counts: &[u64], expected: &[f64]) -> f64 {
    assert_eq!(counts.len(), expected.len(), "one expected count per counted cell");
    let mut cells: Vec<(f64, f64)> =
        counts.iter().zip(expected).map(|(&n, &e)| (e, n as f64)).collect();
    if cells.iter().any(|&(e, n)| e.is_nan() || e < 0.0 || (n > 0.0 && e < 1e-9)) {
        return 0.0;
    }
    cells.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut statistic = 0.0;
    let mut used = 0_u32;
    let (mut pooled, mut observed) = (0.0, 0.0);
    for (i, (e, n)) in cells.iter().enumerate() {
        pooled += e;
        observed += n;
        // The rare cells come first, so every pool but a last one fills up.
        if pooled >= FEWEST_EXPECTED || i + 1 == cells.len() && pooled > 0.0 {
            statistic += (observed - pooled) * (observed - pooled) / pooled;
            used += 1;
            (pooled, observed) = (0.0, 0.0);
        }
    }
    // One degree of freedom goes to the common total.
    if used < 2 { 1.0 } else { gamma_q(0.5 * f64::from(used - 1), 0.5 * statistic) }
}

/// Chi-square test of numbers against a density on the interval `range`; the p-value.
///
/// The density may integrate to less than one; the rest must then lie outside the interval. It
/// should be smooth up to a few jumps.
pub fn interval_chi_square(
    samples: impl IntoIterator<Item = f64>,
    range: [f64; 2],
    pdf: impl Fn(f64) -> f64,
) -> f64 {
    Grid { low: [range[0], 0.0], high: [range[1], 1.0], cells: [64, 1], pieces: [64, 1] }
        .test(samples.into_iter().map(|x| [x, 0.5]), |[x, _]| pdf(x))
}

/// Chi-square test of points against a density (in area) on the rectangle from corner `low` to
/// corner `high`; the p-value. As for [`interval_chi_square`] otherwise.
pub fn rectangle_chi_square(
    samples: impl IntoIterator<Item = [f64; 2]>,
    low: [f64; 2],
    high: [f64; 2],
    pdf: impl Fn([f64; 2]) -> f64,
) -> f64 {
    Grid { low, high, cells: [24, 24], pieces: [4, 4] }.test(samples.into_iter(), pdf)
}

/// Chi-square test of unit vectors against a density in solid angle; the p-value. As for
/// [`interval_chi_square`] otherwise.
pub fn sphere_chi_square(
    samples: impl IntoIterator<Item = Vec3>,
    pdf: impl Fn(Vec3) -> f64,
) -> f64 {
    // The map to (z, azimuth) preserves areas.
    let grid = Grid { low: [-1.0, -PI], high: [1.0, PI], cells: [24, 32], pieces: [4, 4] };
    grid.test(samples.into_iter().map(|w| [w.z, fm::atan2(w.y, w.x)]), |[z, phi]| {
        let r = fm::sqrt(1.0 - z * z);
        pdf(vec3(r * fm::cos(phi), r * fm::sin(phi), z))
    })
}

/// A rectangle cut into cells.
struct Grid {
    low: [f64; 2],
    high: [f64; 2],
    cells: [usize; 2],
    /// Pieces per cell that quadrature starts from: a jump must not hide between its points.
    pieces: [usize; 2],
}

impl Grid {
    fn test(&self, samples: impl Iterator<Item = [f64; 2]>, pdf: impl Fn([f64; 2]) -> f64) -> f64 {
        let [rows, columns] = self.cells;
        let outside = rows * columns;
        let mut counts = vec![0; outside + 1];
        let mut total = 0_u64;
        for p in samples {
            counts[self.cell(p).unwrap_or(outside)] += 1;
            total += 1;
        }
        let mut expected: Vec<f64> = (0..outside)
            .map(|cell| total as f64 * self.mass([cell / columns, cell % columns], &pdf))
            .collect();
        let rest = 1.0 - expected.iter().sum::<f64>() / total as f64;
        if rest < -MASS_ERROR {
            return 0.0;
        }
        let nothing_left = counts[outside] == 0 && rest < MASS_ERROR;
        expected.push(if nothing_left { 0.0 } else { rest.max(0.0) * total as f64 });
        chi_square(&counts, &expected)
    }

    fn width(&self, axis: usize) -> f64 {
        (self.high[axis] - self.low[axis]) / self.cells[axis] as f64
    }

    fn cell(&self, p: [f64; 2]) -> Option<usize> {
        let index = |axis: usize| {
            let inside = (self.low[axis]..=self.high[axis]).contains(&p[axis]);
            let i = ((p[axis] - self.low[axis]) / self.width(axis)) as usize;
            inside.then(|| i.min(self.cells[axis] - 1))
        };
        Some(index(0)? * self.cells[1] + index(1)?)
    }

    fn mass(&self, cell: [usize; 2], pdf: &impl Fn([f64; 2]) -> f64) -> f64 {
        let pieces = self.pieces;
        let size = [0, 1].map(|axis| self.width(axis) / pieces[axis] as f64);
        let mut sum = 0.0;
        for i in 0..pieces[0] {
            for j in 0..pieces[1] {
                let piece = [cell[0] * pieces[0] + i, cell[1] * pieces[1] + j];
                let corner = [0, 1].map(|axis| self.low[axis] + piece[axis] as f64 * size[axis]);
                sum += integral(pdf, corner, size, 0);
            }
        }
        sum
    }
}

/// A density whose integral is nearer to one than this integrates to one: what jumps along a line
/// of cells may add up to.
const MASS_ERROR: f64 = 3e-3;

/// Quadrature halves a piece while the density's spread over it amounts to more probability...
const JUMP_MASS: f64 = 1e-6;
/// ...but no more often than this.
const MAX_HALVINGS: u32 = 12;

/// Integral of a density, which may jump, over a rectangle.
fn integral(
    pdf: &impl Fn([f64; 2]) -> f64,
    corner: [f64; 2],
    size: [f64; 2],
    halvings: u32,
) -> f64 {
    // The Gauss rule of two by two points; the corners, from just inside, only betray jumps.
    const NODES: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];
    const ENDS: [f64; 2] = [1e-9, 1.0 - 1e-9];
    let area = size[0] * size[1];
    let (mut sum, mut least, mut most) = (0.0, f64::INFINITY, f64::NEG_INFINITY);
    for (nodes, weight) in [(NODES, 0.25), (ENDS, 0.0)] {
        for a in nodes {
            for b in nodes {
                let p = pdf([corner[0] + a * size[0], corner[1] + b * size[1]]);
                sum += weight * p;
                (least, most) = (f64::min(least, p), f64::max(most, p));
            }
        }
    }
    if halvings == MAX_HALVINGS || (most - least) * area <= JUMP_MASS {
        return sum * area;
    }
    let half = size.map(|s| 0.5 * s);
    let quarter = |i: f64, j: f64| {
        integral(pdf, [corner[0] + i * half[0], corner[1] + j * half[1]], half, halvings + 1)
    };
    quarter(0.0, 0.0) + quarter(0.0, 1.0) + quarter(1.0, 0.0) + quarter(1.0, 1.0)
}

/// How many standard errors the mean lies above a known truth.
#[must_use]
pub fn z_score(estimate: &Moments, truth: f64) -> f64 {
    standardized(estimate.mean() - truth, estimate.variance_of_mean())
}

/// How many standard errors of the difference the mean of `a` lies above that of `b` (Welch 1947:
/// the variances need not be equal).
#[must_use]
pub fn welch_z(a: &Moments, b: &Moments) -> f64 {
    standardized(a.mean() - b.mean(), a.variance_of_mean() + b.variance_of_mean())
}

fn standardized(difference: f64, variance: f64) -> f64 {
    // Equal constants agree; a NaN anywhere must not pass for agreement.
    if difference == 0.0 { 0.0 } else { difference / fm::sqrt(variance) }
}

/// Probability of a standard normal variable at least as far from zero as `z`; 0 for NaN.
#[must_use]
pub fn two_sided_p_value(z: f64) -> f64 {
    if z.is_nan() { 0.0 } else { gamma_q(0.5, 0.5 * z * z) }
}

/// The regularised upper incomplete gamma function Q(a, x) for a > 0, x >= 0 (DLMF 8.2.4): power
/// series (8.11.4) below the mean, continued fraction (8.9.2) above.
fn gamma_q(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let front = fm::exp(a * fm::ln(x) - x - ln_gamma(a));
    if front == 0.0 {
        return if x < a { 1.0 } else { 0.0 };
    }
    if x < a + 1.0 {
        let (mut term, mut sum, mut k) = (1.0 / a, 1.0 / a, a);
        while term > f64::EPSILON * sum {
            k += 1.0;
            term *= x / k;
            sum += term;
        }
        return 1.0 - front * sum;
    }
    // Evaluated front to back by the modified Lentz method.
    let mut b = x + 1.0 - a;
    let (mut c, mut d) = (f64::INFINITY, 1.0 / b);
    let mut h = d;
    for i in 1..10_000 {
        let n = f64::from(i) * (a - f64::from(i));
        b += 2.0;
        d = 1.0 / (n * d + b);
        c = b + n / c;
        h *= c * d;
        if (c * d - 1.0).abs() < 4.0 * f64::EPSILON {
            break;
        }
    }
    front * h
}

/// ln Gamma(x) for x > 0: Stirling's series (DLMF 5.11.1) after raising the argument.
fn ln_gamma(x: f64) -> f64 {
    let (mut z, mut product) = (x, 1.0);
    while z < 12.0 {
        product *= z;
        z += 1.0;
    }
    let y = 1.0 / (z * z);
    let series =
        (1.0 / 12.0 - y * (1.0 / 360.0 - y * (1.0 / 1260.0 - y * (1.0 / 1680.0 - y / 1188.0)))) / z;
    (z - 0.5) * fm::ln(z) - z + 0.5 * fm::ln(2.0 * PI) + series - fm::ln(product)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rng;

    #[test]
    fn gamma_functions_match_closed_forms() {
        assert!((ln_gamma(0.5) - 0.5 * fm::ln(PI)).abs() < 1e-14);
        assert!((ln_gamma(11.0) - fm::ln(3_628_800.0)).abs() < 1e-13);
        for x in [1e-3, 0.4, 1.0, 2.5, 7.0, 40.0] {
            assert!((gamma_q(1.0, x) / fm::exp(-x) - 1.0).abs() < 1e-12, "{x}");
            let poisson = fm::exp(-x) * (1.0 + x + x * x / 2.0);
            assert!((gamma_q(3.0, x) / poisson - 1.0).abs() < 1e-12, "{x}");
        }
        // The normal law's 95 % and four sigma points.
        assert!((two_sided_p_value(1.959_963_984_540_054) - 0.05).abs() < 1e-14);
        assert!((two_sided_p_value(-4.0) - 6.334_248_366_623_996e-5).abs() < 1e-17);
        assert_eq!(two_sided_p_value(f64::NAN), 0.0);
    }

    #[test]
    fn p_values_are_uniform_when_nothing_is_wrong() {
        let mut rng = Rng::new(1, 0, 0);
        let p: Moments = (0..2000)
            .map(|_| {
                let mut counts = [0; 12];
                for _ in 0..600 {
                    counts[(rng.next_f64() * 12.0) as usize] += 1;
                }
                chi_square(&counts, &[50.0; 12])
            })
            .collect();
        assert!(z_score(&p, 0.5).abs() < 4.0, "{p:?}");
        assert!((p.variance() * 12.0 - 1.0).abs() < 0.1, "{p:?}");
    }

    #[test]
    fn faults_are_rejected() {
        assert_eq!(chi_square(&[10, 1], &[11.0, 0.0]), 0.0);
        assert_eq!(chi_square(&[10, 1], &[f64::NAN, 1.0]), 0.0);
        let mut rng = Rng::new(2, 0, 0);
        let uniform: Vec<f64> = (0..100_000).map(|_| rng.next_f64()).collect();
        let test =
            |pdf: fn(f64) -> f64| interval_chi_square(uniform.iter().copied(), [0.0, 1.0], pdf);
        assert!(test(|_| 1.0) > SIGNIFICANCE);
        assert!(test(|_| 1.02) < SIGNIFICANCE);
        assert!(test(|_| 0.98) < SIGNIFICANCE);
        assert!(test(|x| 0.94 + 0.12 * x) < SIGNIFICANCE);
        let rest = interval_chi_square(uniform.iter().copied(), [0.25, 0.5], |_| 1.0);
        assert!(rest > SIGNIFICANCE);
        assert!(test(|_| f64::NAN) < SIGNIFICANCE);
    }

    #[test]
    fn welch_sees_a_shift_and_nothing_else() {
        let mut rng = Rng::new(3, 0, 0);
        let a: Moments = (0..20_000).map(|_| rng.next_f64()).collect();
        let b: Moments = (0..40_000).map(|_| 3.0 * rng.next_f64() - 1.0).collect();
        assert!(welch_z(&a, &b).abs() < 4.0);
        let shifted: Moments = (0..20_000).map(|_| rng.next_f64() + 0.02).collect();
        assert!(welch_z(&shifted, &a) > 4.0 && welch_z(&a, &shifted) < -4.0);
        assert!(welch_z(&a, &Moments::repeated(f64::NAN, 9)).is_nan());
    }
}
