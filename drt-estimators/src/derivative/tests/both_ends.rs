//! Derivatives by paths from both ends are those from the camera, and need what the camera sees of light paths and the weights of all
//! strategies.

use drt_math::stats::Moments;

use crate::derivative::tests::choice::{LIGHT, derivative, prepare_by};
use crate::derivative::tests::scenes::*;
use crate::model::settings::EstimatorKind::{PathSpace, Warped};
use crate::model::settings::{PathSampling, Settings};
use crate::terms::boundary_source::BoundarySource;
use crate::world::lights::EmitterMask::{All, Extended};

#[test]
fn every_strategy_and_its_weight_are_needed() {
    let scene = fog();
    let brightens = parameter("brightens", 0.0, vec![changes("thin", "albedo", grey(0.3))]);
    for (estimator, mask) in [(PathSpace, All), (Warped, Extended)] {
        let by = |sampling| {
            let settings = Settings { estimator, sampling, ..Settings::default() };
            prepare_by(&settings, mask, &scene, &brightens, 5)
        };
        let sum = |prepare: &dyn Fn() -> _| derivative(LIGHT, &|_| prepare(), [1.0; 2]);
        let reference = sum(&|| by(PathSampling::Unidirectional));
        let judged = |own: Moments| {
            let error = f64::sqrt(own.variance_of_mean() + reference.variance_of_mean());
            ((own.mean() - reference.mean()) / error, error / reference.mean().abs())
        };
        let off = |prepare: &dyn Fn() -> _| judged(sum(prepare));
        let mixed = |both: f64| {
            by(if both == 1.0 { PathSampling::Bidirectional } else { PathSampling::Unidirectional })
        };
        let fair = off(&|| by(PathSampling::Bidirectional));
        assert!(fair.0.abs() < 4.0 && fair.1 < 0.02, "{estimator:?} {fair:?}");
        let without = off(&|| {
            let mut both = by(PathSampling::Bidirectional);
            both.0.terms.sources.retain(|s| *s != BoundarySource::LightPaths);
            both
        });
        assert!(without.0.abs() > 5.0, "{estimator:?} {without:?}");
        // Paths from the camera that know nothing of light paths, with all that the camera sees of these.
        let unweighted = judged(derivative(LIGHT, &mixed, [0.0, 1.0]));
        assert!(unweighted.0.abs() > 5.0, "{estimator:?} {unweighted:?}");
    }
}
