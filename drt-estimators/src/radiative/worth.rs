//! Which looks are followed.
//!
//! What a look at an edge counts for, its weight w, is known before anything is traced: throughput, scattering and the
//! edge's angle over the density of having chosen it. Weights differ by orders of magnitude, as what is chosen is chosen by
//! estimates. A look that is followed with the chance p has the second moment w² E \[ΔL²\] / p and costs c₀ + c₁ p, c₁ being
//! the larger part: two paths. By Cauchy and Schwarz's inequality p in proportion to w is best as long as it is below 1:
//!
//! ```text
//! p = min(w / w₀, 1),    w₀ = (mean of w^(1/4))⁴ / 2,
//! ```
//!
//! a mean that no rare large weight decides. The paths it is of are the same whatever samples a run takes.

use drt_math::{Real, Rgb, Rng};

use super::{Look, Radiative};
use crate::sensitivity::Interest;
use crate::transport::{PathRecord, Tracer, World};

/// Paths that look.
const PATHS: u32 = 256;

/// Their seed.
const SEED: u64 = 0x6c6f_6f6b;

/// w₀ over the mean.
const PART: f64 = 0.5;

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
        let mut record = PathRecord { carriers: interest.carriers(), ..PathRecord::default() };
        let [width, height] = world.camera.film();
        let pixels = u64::from(width) * u64::from(height);
        let (mut sum, mut count) = (0.0, 0.0);
        for i in 0..PATHS {
            let mut rng = Rng::new(SEED, 0, i);
            let pixel = (u64::from(i) * pixels / u64::from(PATHS)) as u32;
            let view = world.camera.sample_view(pixel, rng.next_2d(), false);
            let look = Look::new(&mut rng);
            tracer.rng = rng;
            let weight = Rgb::splat(view.weight);
            record.begin([pixel % width, pixel / width], view.direction, weight);
            tracer.trace_camera(view.direction, weight, &mut record);
            if let Some(glance) = self.glance(&mut tracer, &record, &look) {
                sum += Real::sqrt(Real::sqrt(glance.weight.max_abs()));
                count += 1.0;
            }
        }
        if count > 0.0 {
            let mean: f64 = sum / count;
            self.worth.whole = PART * mean * mean * mean * mean;
        }
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
