//! The errors of one image by one estimator, at doubling sample counts.

/// One measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    /// Samples per pixel.
    pub(super) spp: u32,
    /// Wall time, without setting up.
    pub(super) seconds: f64,
    /// Processor time of all threads.
    pub(super) cpu_seconds: f64,
    /// Rms standard error over the 8×8 block means.
    pub(super) noise: f64,
    /// Rms deviation of the block means from the reference, where there is one.
    pub(super) error: Option<f64>,
}

/// The measurements of one image.
#[derive(Clone, Debug)]
pub(super) struct Series {
    pub(super) job: String,
    pub(super) estimator: &'static str,
    /// `image`, or `d_NAME`.
    pub(super) image: String,
    /// What errors are relative to: the rms of the image's block means, or of the job's largest
    /// derivative where it is not known to differ from zero.
    pub(super) scale: f64,
    /// Wall time before the first sample.
    pub(super) set_up: f64,
    pub(super) points: Vec<Point>,
}

/// Samples from which on batches make the standard errors.
const TRUSTED: u32 = 64;

impl Point {
    /// True where noise and time are positive and finite: after a single sample the noise is not.
    pub(super) fn has_logarithms(&self) -> bool {
        self.noise > 0.0 && self.noise.is_finite() && self.seconds > 0.0
    }
}

impl Series {
    /// An error over the scale.
    pub(super) fn relative(&self, error: f64) -> f64 {
        if error == 0.0 { 0.0 } else { error / self.scale }
    }

    /// Exponent of the noise against the time; -1/2 for independent samples. `None` with fewer than
    /// three points.
    pub(super) fn slope(&self) -> Option<f64> {
        let known = |p: &&Point| p.has_logarithms();
        let trusted = |p: &&Point| p.spp >= TRUSTED;
        let logs = |points: &mut dyn Iterator<Item = &Point>| -> Vec<[f64; 2]> {
            points.filter(known).map(|p| [p.seconds.ln(), p.noise.ln()]).collect()
        };
        let mut points = logs(&mut self.points.iter().filter(trusted));
        if points.len() < 3 {
            points = logs(&mut self.points.iter());
        }
        if points.len() < 3 {
            return None;
        }
        let n = points.len() as f64;
        let mean = |k: usize| points.iter().map(|p| p[k]).sum::<f64>() / n;
        let (x, y) = (mean(0), mean(1));
        let moment = |k: usize| points.iter().map(|p| (p[0] - x) * (p[k] - [x, y][k])).sum::<f64>();
        Some(moment(1) / moment(0))
    }

    /// Relative variance times processor time: what a variance of one costs.
    pub(super) fn cost(&self) -> Option<f64> {
        self.points.last().map(|p| self.relative(p.noise).powi(2) * p.cpu_seconds)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A series whose noise falls by a power of the time.
    pub(in super::super) fn falling(exponent: f64) -> Series {
        let point = |k: i32| {
            let seconds = 0.01 * 2.0_f64.powi(k);
            let noise = 0.3 * seconds.powf(exponent);
            Point { spp: 1 << k, seconds, cpu_seconds: 2.0 * seconds, noise, error: None }
        };
        Series {
            job: "job".into(),
            estimator: "path-space",
            image: "d_x".into(),
            scale: 2.0,
            set_up: 0.001,
            points: (0..12).map(point).collect(),
        }
    }

    #[test]
    fn slope_is_the_exponent_and_cost_does_not_depend_on_time() {
        for exponent in [-0.5, -0.75, -1.0] {
            let slope = falling(exponent).slope().unwrap();
            assert!((slope - exponent).abs() < 1e-12, "{slope} for {exponent}");
        }
        let series = falling(-0.5);
        assert!((series.cost().unwrap() - 2.0 * 0.15_f64.powi(2)).abs() < 1e-12);
        let short = Series { points: series.points[..2].to_vec(), ..series };
        assert_eq!(short.slope(), None);
    }
}
