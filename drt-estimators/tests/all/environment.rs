//! Light of an image around a scene.

use std::sync::Arc;

use crate::common::*;
use drt_estimators::EstimatorKind::{self, PathSpace, Radiative, Warped};
use drt_estimators::emitter::{Emitter, EnvironmentMap};
use drt_estimators::{
    AuxiliarySamples, PathSampling, Scene, Session, Settings, Unattended, Warp, agreement,
    finite_differences,
};
use drt_geom::procedural;
use drt_math::{Mat3, Rgb, Rng, Vec3, vec3};

/// Metal and a ball under a sky with a bright spot.
fn outside() -> Scene {
    let mut rng = Rng::new(5, 0, 0);
    let mut texels: Vec<[f32; 3]> =
        (0..32).map(|_| [0; 3].map(|_| 0.3 * rng.next_f64() as f32)).collect();
    texels[10] = [9.0, 7.0, 5.0];
    let frame = Mat3::rotation(vec3(0.2, 1.0, 0.1).normalize(), 0.8);
    let map = Arc::new(EnvironmentMap::new([8, 4], texels, frame).expect("a map"));
    let floor = placed(procedural::rectangle(), vec3(4.0, 4.0, 4.0), 0.0, vec3(0.0, 0.0, -1.0));
    let scene = SceneBuilder::new()
        .shape("floor", ShapeBuilder::new(floor, metal()))
        .shape("ball", ShapeBuilder::new(ball(0.8, Vec3::ZERO), diffuse(0.7, 0.6, 0.5)))
        .emitter("sky", Emitter::Envmap { radiance: Rgb::new(1.0, 0.9, 0.8), map });
    seen(scene, [vec3(0.4, 0.8, 6.0), Vec3::ZERO], 3)
}

#[test]
fn paths_from_both_ends_see_the_same_sky() {
    let images = [PathSampling::Unidirectional, PathSampling::Bidirectional].map(|sampling| {
        let settings = Settings { sampling, threads: 1, ..Settings::default() };
        let mut session = Session::new(&outside(), &[], &settings).expect("a valid scene");
        assert!(session.run(4096, &Unattended));
        sum(&session.rendering().image)
    });
    let [[a, error], [b, other]] = images;
    let error = error.hypot(other);
    assert!((a - b).abs() < 4.0 * error && error < 0.005 * a, "{a} {b} +- {error}");
}

/// Where the camera sees nothing but the sky, an image turns with the sky's gradient alone.
#[test]
fn a_camera_that_turns_sees_another_part_of_the_sky() {
    let mut scene = outside();
    let far = placed(procedural::rectangle(), Vec3::splat(0.01), 0.0, vec3(0.0, 0.0, -500.0));
    for shape in &mut scene.shapes {
        shape.mesh = Arc::new(far.clone());
    }
    let parameters = [parameter("camera", 0.0, vec![moves("camera", turn())])];
    let by = |estimator| {
        let settings = Settings { estimator, ..Settings::default() };
        rendered(&scene, &parameters, &settings, 2048).derivatives.remove(0).total
    };
    let settings = Settings::default();
    let differences = finite_differences(&scene, &parameters, &settings, 2048, 0.01, &Unattended);
    let expected = differences.expect("a valid scene").remove(0);
    for estimator in [PathSpace, Radiative, Warped] {
        let own = by(estimator);
        let found = agreement(&own, &expected, None);
        assert!(found.agrees, "{estimator:?} {found:?}");
        // Planted: the other way round.
        assert!(!agreement(&multiple(&own, -1.0), &expected, None).agrees, "{estimator:?}");
    }
}

#[test]
fn derivatives_under_a_sky() {
    let scene = outside();
    let parameters = [
        parameter("ball", 0.0, vec![moves("ball", shift())]),
        parameter("camera", 0.0, vec![moves("camera", turn())]),
        parameter("sky", 0.0, vec![changes("sky", "radiance", grey(1.0))]),
    ];
    let settings = Settings { estimator: EstimatorKind::FiniteDifference, ..Settings::default() };
    let differences = finite_differences(&scene, &parameters, &settings, 4096, 0.01, &Unattended);
    let differences = differences.expect("a valid scene");
    for estimator in [PathSpace, Radiative, Warped] {
        let settings = Settings { estimator, ..Settings::default() };
        let rendering = rendered(&scene, &parameters, &settings, 4096);
        for (d, f) in rendering.derivatives.iter().zip(&differences) {
            let ([own, error], [other, other_error]) = (sum(&d.total), sum(f));
            let error = error.hypot(other_error);
            assert!((own - other).abs() < 4.0 * error, "{own} {other} +- {error}");
            let found = agreement(&d.total, f, None);
            assert!(found.agrees, "{estimator:?} {} {found:?}", d.name);
        }
    }
    // Auxiliary samples do not know what else a ray that turns would see of it.
    for warp in [Warp::Points, Warp::Directions] {
        let warp = warp(AuxiliarySamples::default());
        let settings = Settings { estimator: Warped, warp, ..Settings::default() };
        let refusal = |parameter: usize| {
            Session::new(&scene, &parameters[parameter..=parameter], &settings).err()
        };
        let message = refusal(0).expect("a refusal").to_string();
        assert!(message.contains("not for environments of an image"), "{message}");
        assert!(refusal(2).is_none());
    }
}
