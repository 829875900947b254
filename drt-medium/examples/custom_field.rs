//! Light that crosses a cloud defined by a formula: the tracking functions inside a path loop that
//! knows nothing else of this crate's media.
//!
//! Prints the shares of light that leave upwards, downwards and sideways, with standard errors.
//! `cargo run --release -p drt-medium --example custom_field`

use std::ops::ControlFlow;

use drt_math::{Moments, Rgb, Rng, Vec3, vec3};
use drt_medium::tracking::{self, DistanceSample, TrackingStats};
use drt_medium::{CoefficientGradients, Coefficients, DensityField, Phase, Piece, Ray};

/// A ball of radius one whose extinction falls from the middle like `peak (1 - r²)`.
#[derive(Debug)]
struct SoftBall {
    peak: f64,
}

impl DensityField for SoftBall {
    fn coefficients(&self, x: Vec3) -> Coefficients {
        let sigma_t = Rgb::splat(self.peak * f64::max(1.0 - x.length_squared(), 0.0));
        Coefficients { sigma_t, albedo: Rgb::splat(0.95), emission: Rgb::ZERO }
    }

    fn gradients(&self, x: Vec3) -> CoefficientGradients {
        let slope = if x.length_squared() < 1.0 { -2.0 * self.peak } else { 0.0 };
        let sigma_t = Rgb::splat(slope).outer(x);
        CoefficientGradients { sigma_t, ..CoefficientGradients::ZERO }
    }

    fn pieces(&self, ray: &Ray, visit: &mut dyn FnMut(&Piece) -> ControlFlow<()>) {
        const PIECES: u32 = 8;
        // The chord: |origin + t dir|² = 1.
        let middle = -ray.origin.dot(ray.dir);
        let closest = ray.at(middle).length_squared();
        if closest >= 1.0 {
            return;
        }
        let half = (1.0 - closest).sqrt();
        let (enter, leave) = (f64::max(middle - half, 0.0), f64::min(middle + half, ray.t_max));
        let width = (leave - enter) / f64::from(PIECES);
        if width <= 0.0 {
            return;
        }
        for n in 0..PIECES {
            let (start, end) = (enter + width * f64::from(n), enter + width * f64::from(n + 1));
            // A parabola along the chord: highest where it comes closest to the middle, lowest at
            // one of the ends.
            let sigma = |t: f64| self.coefficients(ray.at(t)).sigma_t;
            let majorant = sigma(middle.clamp(start, end));
            let (a, b) = (sigma(start), sigma(end));
            let minorant = if a.r < b.r { a } else { b };
            let mean = (a + b) * 0.5;
            if visit(&Piece { start, end, majorant, minorant, mean }).is_break() {
                return;
            }
        }
    }
}

/// Follows one photon downwards into the ball; where it leaves, and with which weight.
fn photon(ball: &SoftBall, phase: &Phase, rng: &mut Rng, stats: &mut TrackingStats) -> (Vec3, f64) {
    let [u, v] = rng.next_2d();
    let mut ray = Ray::new(vec3(2.0 * u - 1.0, 2.0 * v - 1.0, 2.0), -Vec3::Z, f64::INFINITY);
    let mut weight = Rgb::ONE;
    loop {
        match tracking::sample_distance(ball, &ray, weight, 0.0, rng, stats) {
            DistanceSample::Pass { weight: passed } => return (ray.dir, (weight * passed).r),
            DistanceSample::Scatter { t, weight: flown, .. } => {
                let x = ray.at(t);
                weight *= flown * ball.coefficients(x).sigma_s();
                let (flow, _) = phase.sample(ray.dir, rng.next_2d());
                ray = Ray::new(x, flow, f64::INFINITY);
            }
        }
    }
}

fn main() {
    let ball = SoftBall { peak: 8.0 };
    let phase = Phase::HenyeyGreenstein { g: 0.6 };
    let mut stats = TrackingStats::default();
    let mut shares = [Moments::ZERO; 3];
    let photons = 100_000;
    for n in 0..photons {
        let (dir, weight) = photon(&ball, &phase, &mut Rng::new(1, 0, n), &mut stats);
        let leaves = [dir.z > 0.5, dir.z < -0.5, dir.z.abs() <= 0.5];
        for (share, here) in shares.iter_mut().zip(leaves) {
            share.push(if here { weight } else { 0.0 });
        }
    }
    for (name, share) in ["up", "down", "sideways"].iter().zip(&shares) {
        println!("{name:>9}: {:.4} ± {:.4}", share.mean(), share.standard_error());
    }
    println!("{:.1} lookups per photon", stats.lookups as f64 / f64::from(photons));
}
