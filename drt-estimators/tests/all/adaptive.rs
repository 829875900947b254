//! Samples that go where noise is: the same images and derivatives, by either estimator.

use crate::common::*;
use drt_estimators::{EstimatorKind, Layer, Session, Settings, Unattended, agreement};
use drt_motion::Parameter;

/// The image, and its derivative.
fn layers(estimator: EstimatorKind, adaptive: bool, seed: u64) -> [Layer; 2] {
    let scene = surfaces(phong(), diffuse(0.6, 0.5, 0.4));
    let parameters: [Parameter<_>; 1] = [parameter("ball", 0.0, vec![moves("ball", shift())])];
    let settings = Settings { estimator, adaptive, seed, ..Settings::default() };
    let mut session = Session::new(&scene, &parameters, &settings).expect("a valid scene");
    // Two passes, of which the second one knows what the first one's pilot saw.
    session.run(1 << 11, &Unattended);
    session.run(1 << 11, &Unattended);
    let mut found = session.rendering();
    [found.image, found.derivatives.swap_remove(0).total]
}

#[test]
fn nothing_but_noise_depends_on_it() {
    for kind in [EstimatorKind::PathSpace, EstimatorKind::Radiative] {
        let (equal, adaptive) = (layers(kind, false, 1), layers(kind, true, 2));
        for (a, b) in equal.iter().zip(&adaptive) {
            let found = agreement(a, b, None);
            assert!(found.agrees, "{kind:?} {found:?}");
            let error = a.total.stderr.r.hypot(b.total.stderr.r);
            assert!((a.total.mean.r - b.total.mean.r).abs() < 4.0 * error, "{kind:?}");
            // Pixels that count by their samples would be seen.
            let planted = agreement(&scaled(a), b, None);
            assert!(!planted.agrees, "{kind:?} {planted:?}");
        }
    }
}

/// As if pixels that take half as many samples again counted by them.
fn scaled(layer: &Layer) -> Layer {
    let mut wrong = layer.clone();
    let of = |e: &mut drt_estimators::Estimate| e.mean *= 1.5;
    wrong.pixels.iter_mut().for_each(of);
    wrong.blocks.iter_mut().for_each(of);
    of(&mut wrong.total);
    wrong
}

/// Boundary samples are as many as are worth their rays: variance times rays falls, from many.
#[test]
fn looks_are_worth_their_rays() {
    let scene = surfaces(phong(), diffuse(0.6, 0.5, 0.4));
    let parameters: [Parameter<_>; 1] = [parameter("ball", 0.0, vec![moves("ball", shift())])];
    let run = |adaptive, boundary_ratio| {
        let estimator = EstimatorKind::Radiative;
        let settings = Settings { estimator, adaptive, boundary_ratio, ..Settings::default() };
        let mut session = Session::new(&scene, &parameters, &settings).expect("a valid scene");
        session.run(1 << 11, &Unattended);
        let found = session.rendering();
        let c = found.counters;
        let error = |e: &drt_estimators::Estimate| (e.stderr * e.stderr).mean();
        let variance: f64 = found.derivatives[0].total.pixels.iter().map(error).sum();
        (variance * c.rays as f64, c.boundary_samples as f64 / c.paths as f64)
    };
    let (work, queries) = run(true, None);
    // Two looks from vertices to each path, and half a one from the camera or more.
    let (many, all) = run(true, Some(4.0));
    println!("{work:.0} at {queries:.2} a path, {many:.0} at {all:.2}");
    assert!(work < 0.9 * many && queries < 0.7 * all, "{work} {many}");
}

/// Boundary samples of all kinds are no more than is said, with lights that take two estimators and with those
/// that take one: of two or three equal parts, edges that the camera sees take a quarter of theirs or more.
#[test]
fn boundary_samples_are_shared() {
    let mut scene = surfaces(phong(), diffuse(0.6, 0.5, 0.4));
    let parameters: [Parameter<_>; 1] = [parameter("ball", 0.0, vec![moves("ball", shift())])];
    let said = 0.5;
    let settings = Settings {
        estimator: EstimatorKind::Radiative,
        boundary_ratio: Some(said),
        ..Settings::default()
    };
    for lights in ["all", "extended"] {
        if lights == "extended" {
            let before = scene.emitters.len();
            scene.emitters.retain(|e| !e.item.emitter.is_delta());
            assert!((1..before).contains(&scene.emitters.len()));
        }
        let mut session = Session::new(&scene, &parameters, &settings).expect("a valid scene");
        session.run(64, &Unattended);
        let found = session.rendering();
        let samples = f64::from(found.spp) * found.image.pixels.len() as f64;
        let taken = found.counters.boundary_samples as f64 / samples;
        // A path that sees no edge does not look.
        let part = taken / said;
        assert!((0.4..1.01).contains(&part), "{taken} with {lights} lights");
    }
}
