//! Which looks are followed.
//!
//! What a look at an edge counts for, its weight w, is known before anything is traced: throughput, scattering and the
//! edge's angle over the density of having chosen it. Weights differ by orders of magnitude, as what is chosen is chosen by
//! estimates. A look that is followed with the chance p has the second moment w² E \[ΔL²\] / p and costs c₀ + c₁ p, c₁ being
//! the larger part: two paths. By Cauchy and Schwarz's inequality p in proportion to w is best as long as it is below 1:
//!
//! ```text
//! p = min(w / w₀, 1),    w₀ = 0.4 × the power of two below (mean of √w)²,
//! ```
//!
//! a mean that neither a rare large weight decides nor how many have next to none. The paths it is of are the same whatever samples a run takes.

use alloc::sync::Arc;

use drt_math::{Real, Rgb, Rng};

use super::{Look, Radiative};
use crate::interior::{PathView, Recorder};
use crate::sensitivity::Interest;
use crate::transport::pairs::Pairs;
use crate::transport::record::PathRecord;
use crate::transport::velocity::{Movers, PathVelocities, Spatial};
use crate::transport::{Tracer, World};

/// Paths that look.
const PATHS: u32 = 256;

/// Their seed.
const SEED: u64 = 0x6c6f_6f6b;

/// w₀ over the power of two below the mean.
const PART: f64 = 0.4;

/// The power of two below a positive number: what differs in its last bits, as the same scene by another way of
/// preparing it does, then makes the same choices.
fn power_of_two(x: f64) -> f64 {
    f64::from_bits(x.to_bits() & f64::INFINITY.to_bits())
}

/// What looks must count for.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Worth {
    /// w₀.
    whole: f64,
}

impl Worth {
    /// p; positive.
    pub(super) fn chance(self, weight: f64) -> f64 {
        if weight > 0.0 && weight < self.whole { weight / self.whole } else { 1.0 }
    }
}

impl Radiative {
    /// Finds out what looks count for.
    pub(crate) fn weigh(&mut self, world: &World, interest: &Interest) {
        let mut tracer = Tracer::new(world);
        let field = Arc::new(Spatial::new(Movers::new(interest)));
        let (velocities, pairs) = (PathVelocities::new(field), Pairs::default());
        let mut views = [PathView { world, velocities, pairs, flux: None }];
        let mut record = PathRecord::default();
        let [width, height] = world.camera.film();
        let pixels = u64::from(width) * u64::from(height);
        let mut sum = 0.0;
        for i in 0..PATHS {
            let mut rng = Rng::new(SEED, 0, i);
            let pixel = (u64::from(i) * pixels / u64::from(PATHS)) as u32;
            let view = world.camera.sample_view(pixel, rng.next_2d(), false);
            let look = Look::new(&mut rng);
            tracer.rng = rng;
            let weight = Rgb::splat(view.weight);
            views[0].begin(None, Rng::new(0, 0, 0));
            let (record, views) = (&mut record, &mut views[..]);
            let mut recorder = Recorder { record, views, camera_ray: None };
            recorder.begin([pixel % width, pixel / width], view.direction, weight);
            tracer.trace_camera(view.direction, weight, &mut recorder);
            let Recorder { record, views, .. } = recorder;
            if let Some(glance) = self.glance(&mut tracer, &views[0].of(record), &look) {
                sum += Real::sqrt(glance.weight.max_abs());
            }
        }
        let mean = sum / f64::from(PATHS);
        self.worth.whole = PART * power_of_two(mean * mean);
    }
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use alloc::vec;

    use super::*;
    use crate::transport::tests::choice::{self, MOMENT};
    use crate::transport::tests::scenes::{diffuse, moves, parameter, phong, shift, surfaces};

    /// Derivatives do not depend on which looks are followed.
    #[test]
    fn what_is_not_followed_is_made_up_for() {
        let scene = surfaces(phong(), diffuse(0.6, 0.5, 0.4));
        let motion = parameter("ball", 0.0, vec![moves("ball", shift())]);
        let [all, some, few] = [0.0, 1.0, 30.0].map(|strength| {
            let prepare = |strength: f64| {
                let (mut prepared, motion) = choice::prepare(&scene, &motion, 4);
                let worth = &mut prepared.radiative.as_mut().expect("edges").worth;
                assert!(worth.whole > 0.0);
                worth.whole *= strength;
                (prepared, motion)
            };
            choice::derivative(MOMENT, &move |_| prepare(strength), [1.0; 2])
        });
        for m in [some, few] {
            let error = f64::sqrt(m.variance_of_mean() + all.variance_of_mean());
            assert!((m.mean() - all.mean()).abs() < 4.0 * error, "{m:?} {all:?}");
            assert!(error < 0.1 * all.mean().abs(), "{error} {all:?}");
        }
    }

    #[test]
    fn powers_of_two_are_just_below() {
        for (x, power) in
            [(1.0, 1.0), (1.999, 1.0), (2.0, 2.0), (0.3, 0.25), (1e-320, 0.0), (0.0, 0.0)]
        {
            assert_eq!(power_of_two(x), power);
        }
    }

    #[test]
    fn chances_are_probabilities() {
        let worth = Worth { whole: 2.0 };
        for weight in [0.0, 1e-300, 1e-3, 1.0, 2.0, 1e9] {
            let chance = worth.chance(weight);
            assert!(chance > 0.0 && chance <= 1.0, "{weight} {chance}");
        }
        assert_eq!(worth.chance(0.5), 0.25);
        assert_eq!(Worth::default().chance(1e-9), 1.0);
    }
}
