//! Derivatives by several estimators against finite differences.

use super::{rendered, sum};
use drt_estimators::{
    EstimatorKind, PathSampling, Rendering, Scene, Settings, Unattended, agreement,
    finite_differences,
};
use drt_motion::Parameter;

/// Asserts that all estimators from the camera, and some from both ends, agree with finite differences of a half step, and that none
/// would if half of a derivative were missing. Renderings are shown to `look`.
pub fn agree_with_differences(
    scene: &Scene,
    parameters: &[Parameter],
    step: f64,
    spp: u32,
    both_ends: &[EstimatorKind],
    look: impl Fn(&Rendering),
) {
    let settings = Settings { seed: 3, ..Settings::default() };
    let differences = finite_differences(scene, parameters, &settings, 4 * spp, step, &Unattended);
    let differences = differences.expect("a valid scene");
    let kinds = [EstimatorKind::PathSpace, EstimatorKind::Radiative, EstimatorKind::Warped];
    let from_camera = kinds.map(|kind| (kind, PathSampling::Unidirectional));
    let both = both_ends.iter().map(|kind| (*kind, PathSampling::Bidirectional));
    for (seed, (estimator, sampling)) in (7..).zip(from_camera.into_iter().chain(both)) {
        let settings = Settings { estimator, sampling, seed, ..Settings::default() };
        let found = rendered(scene, parameters, &settings, spp);
        look(&found);
        for (d, difference) in found.derivatives.iter().zip(&differences) {
            let name = format!("{} by {estimator:?}, {sampling:?}", d.name);
            let same = agreement(&d.total, difference, None);
            assert!(same.agrees, "{name}: {same:?}");
            let [known, error] = sum(difference);
            let [value, own] = sum(&d.total);
            let off = |part: f64| (part * value - known).abs() / f64::hypot(own, error);
            println!("{name}: {value} ± {own}, {known} ± {error}");
            assert!(off(1.0) < 4.0, "{name}: {}", off(1.0));
            // As if half of it were missing.
            assert!(off(0.5) > 4.0, "{name}: {}", off(0.5));
        }
    }
}
