//! Derivatives by paths from both ends are those from the camera, and need what the camera sees of light paths and the weights of all
//! strategies.

use crate::derivative::tests::choice::{LIGHT, Sum, parts, prepare_by, total};
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
        let sum = Sum { samples: 64, ..LIGHT };
        let one = parts(sum, &by(PathSampling::Unidirectional));
        let both = parts(sum, &by(PathSampling::Bidirectional));
        let reference = total(&one, &one);
        let fair = total(&both, &both).off(&reference);
        assert!(fair.0.abs() < 4.0 && fair.1 < 0.02, "{estimator:?} {fair:?}");
        let mut camera_alone = by(PathSampling::Bidirectional);
        camera_alone.0.terms.sources.retain(|s| *s != BoundarySource::LightPaths);
        let camera_alone = parts(sum, &camera_alone);
        let without = total(&camera_alone, &camera_alone).off(&reference);
        assert!(without.0.abs() > 5.0, "{estimator:?} {without:?}");
        // Paths from the camera that know nothing of light paths, with all that the camera sees of these.
        let unweighted = total(&one, &both).off(&reference);
        assert!(unweighted.0.abs() > 5.0, "{estimator:?} {unweighted:?}");
    }
}
