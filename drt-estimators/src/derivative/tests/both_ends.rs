//! Derivatives by paths from both ends are those from the camera, and need what the camera sees of light paths and the weights of all
//! strategies.

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
        let off = |prepare: &dyn Fn() -> _| {
            let own = sum(prepare);
            let error = f64::sqrt(own.variance_of_mean() + reference.variance_of_mean());
            ((own.mean() - reference.mean()) / error, error / reference.mean().abs())
        };
        let fair = off(&|| by(PathSampling::Bidirectional));
        assert!(fair.0.abs() < 4.0 && fair.1 < 0.02, "{estimator:?} {fair:?}");
        let without = off(&|| {
            let mut both = by(PathSampling::Bidirectional);
            both.0.terms.sources.retain(|s| *s != BoundarySource::LightPaths);
            both
        });
        assert!(without.0.abs() > 5.0, "{estimator:?} {without:?}");
        let never_back = off(&|| {
            let mut both = by(PathSampling::Bidirectional);
            both.0.terms.emission.iter_mut().for_each(|e| e.never_back = true);
            both
        });
        assert!(never_back.0.abs() > 5.0, "{estimator:?} {never_back:?}");
    }
}
