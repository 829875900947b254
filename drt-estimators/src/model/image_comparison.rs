//! Whether two images agree, in standard errors.

use drt_math::{Real, Rgb, fm};

use crate::model::rendering::{Estimate, Layer};

/// How two images compare on their 8×8 block means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// Root mean square of z = (a - b) / sqrt(se_a² + se_b²) over blocks and channels.
    pub rms_z: f64,
    /// Largest |z|.
    pub max_z: f64,
    /// The |z| that chance passes once in 1000 images.
    pub limit: f64,
    /// True when rms z ≤ 1.3 and max |z| is below the limit.
    pub agrees: bool,
}

/// Compares two images. `step_difference`, where given, is the difference between two finite
/// differences of different step: its square joins the variance.
#[must_use]
pub fn agreement(a: &Layer, b: &Layer, step_difference: Option<&Layer>) -> Agreement {
    let mut squares = 0.0;
    let mut count = 0.0;
    let mut max_z: f64 = 0.0;
    for (k, (x, y)) in a.blocks.iter().zip(&b.blocks).enumerate() {
        let bias = step_difference.map_or(Rgb::ZERO, |d| d.blocks[k].mean);
        let difference = (x.mean - y.mean).to_array();
        let variance = (x.stderr * x.stderr + y.stderr * y.stderr + bias * bias).to_array();
        for (d, v) in difference.into_iter().zip(variance) {
            // Where both are exactly known, only exact equality agrees.
            let z = if d == 0.0 { 0.0 } else { Real::abs(d) / fm::sqrt(v) };
            squares += z * z;
            count += 1.0;
            max_z = f64::max(max_z, z);
        }
    }
    let rms_z = fm::sqrt(squares / f64::max(count, 1.0));
    let limit = quantile_of_largest(count);
    Agreement { rms_z, max_z, limit, agrees: rms_z <= 1.3 && max_z < limit }
}

/// The z that the largest of `n` standard normal numbers passes with probability 1/1000.
fn quantile_of_largest(n: f64) -> f64 {
    // P(|z| > x) = 2 (1 - Φ(x)) = 1 - (1 - 1e-3)^(1/n), solved by bisection on ln of the tail.
    let tail = -fm::exp_m1(fm::ln(0.999) / f64::max(n, 1.0));
    let (mut low, mut high) = (0.0, 12.0);
    for _ in 0..60 {
        let mid = 0.5 * (low + high);
        if two_sided_tail(mid) > tail { low = mid } else { high = mid }
    }
    0.5 * (low + high)
}

/// P(|z| > x) of a standard normal number, by the continued fraction of erfc for large x and the
/// series of erf for small (Abramowitz and Stegun 7.1.6 and 7.1.14).
fn two_sided_tail(x: f64) -> f64 {
    let y = x / core::f64::consts::SQRT_2;
    let scale = fm::exp(-y * y) / fm::sqrt(core::f64::consts::PI);
    if y < 2.0 {
        let (mut term, mut sum, mut k) = (y, y, 0.0);
        while term > 1e-17 * sum {
            k += 1.0;
            term *= 2.0 * y * y / (2.0 * k + 1.0);
            sum += term;
        }
        return 1.0 - 2.0 * scale * sum;
    }
    let mut fraction = y;
    for k in (1..60).rev() {
        fraction = y + 0.5 * f64::from(k) / fraction;
    }
    scale / fraction
}

impl Layer {
    /// Relative noise: rms standard error of the block means over their rms value, or over `against`
    /// where the image itself is near zero.
    #[must_use]
    pub fn relative_noise(&self, against: Option<f64>) -> f64 {
        self.rms(|e| e.stderr) / against.unwrap_or_else(|| self.rms(|e| e.mean))
    }

    /// Root mean square over block means of the image.
    #[must_use]
    pub fn rms_value(&self) -> f64 {
        self.rms(|e| e.mean)
    }

    fn rms(&self, of: impl Fn(&Estimate) -> Rgb) -> f64 {
        let sum: f64 = self.blocks.iter().map(|e| of(e).dot(of(e))).sum();
        fm::sqrt(sum / (3 * self.blocks.len()).max(1) as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tail_matches_known_quantiles() {
        assert!((two_sided_tail(1.959_963_984_540_054) - 0.05).abs() < 1e-12);
        assert!((two_sided_tail(3.290_526_731_491_9) - 1e-3).abs() < 1e-14);
        assert!((quantile_of_largest(1.0) - 3.290_526_731_491_9).abs() < 1e-9);
    }
}
