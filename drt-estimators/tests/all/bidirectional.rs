//! Images by paths from both ends.

use crate::common::*;
use drt_estimators::{
    EstimatorKind, PathSampling, Rendering, Scene, Session, Settings, Unattended, agreement,
    finite_differences, gradient,
};
use drt_geom::procedural;
use drt_math::{Rgb, Vec3, vec3};
use drt_motion::Effect;

fn settings(sampling: PathSampling, seed: u64, threads: usize) -> Settings {
    Settings { sampling, seed, threads, ..Settings::default() }
}

fn rendered(scene: &Scene, settings: &Settings) -> Rendering {
    let mut session = Session::new(scene, &[], settings).expect("a valid scene");
    assert!(session.run(64, &Unattended) && session.run(192, &Unattended));
    session.rendering()
}

#[test]
fn images_are_those_from_the_camera() {
    for scene in [surfaces(phong(), metal()), fog(), smoke(1.0), glow()] {
        let [one, both] = [PathSampling::Unidirectional, PathSampling::Bidirectional]
            .map(|sampling| rendered(&scene, &settings(sampling, sampling as u64, 0)));
        let found = agreement(&both.image, &one.image, None);
        assert!(found.agrees, "{found:?}");
        assert!(both.image.relative_noise(None) < 0.1);
        assert!(both.plan.bidirectional && !one.plan.bidirectional);
    }
}

#[test]
fn threads_make_no_difference() {
    let by = |threads| rendered(&fog(), &settings(PathSampling::Bidirectional, 3, threads));
    let one = by(1);
    for threads in [2, 3] {
        assert!(one.image.pixels == by(threads).image.pixels, "{threads} threads");
    }
}

/// A small lamp in thick fog, and lights in plain view.
#[test]
fn a_pilot_chooses_what_takes_less_work() {
    for (scene, both) in [(surfaces(phong(), metal()), false), (lamp_in_fog(), true)] {
        let by = |sampling, threads| {
            let mut session = Session::new(&scene, &[], &settings(sampling, 5, threads));
            let session = session.as_mut().expect("a valid scene");
            assert!(session.run(8, &Unattended));
            session.rendering()
        };
        let found = by(PathSampling::Auto, 1);
        let why = found.plan.sampling.clone().expect("a reason");
        assert_eq!(found.plan.bidirectional, both, "{why}");
        assert!(why.contains("pilot"), "{why}");
        // The image is that of the one chosen, and the choice is no matter of threads.
        let chosen = [PathSampling::Unidirectional, PathSampling::Bidirectional][usize::from(both)];
        assert!(found.image.pixels == by(chosen, 1).image.pixels);
        let again = by(PathSampling::Auto, 3);
        assert!(again.image.pixels == found.image.pixels && again.plan.sampling == Some(why));
    }
    let mut dark = surfaces(phong(), metal());
    dark.emitters.retain(|e| e.id.as_deref() == Some("sky"));
    dark.shapes.iter_mut().for_each(|s| s.emitter = None);
    let session = Session::new(&dark, &[], &settings(PathSampling::Auto, 0, 1));
    let plan = session.expect("a valid scene").plan().clone();
    assert!(!plan.bidirectional && plan.sampling.expect("a reason").contains("no light paths"));
    let moving = [parameter("p", 0.0, vec![moves("ball", shift())])];
    let session = Session::new(&lamp_in_fog(), &moving, &settings(PathSampling::Auto, 0, 1));
    let plan = session.expect("a valid scene").plan().clone();
    assert!(!plan.bidirectional && plan.sampling.expect("a reason").contains("for images"));
}

/// A ball in thick fog, with a small lamp beside it.
fn lamp_in_fog() -> Scene {
    let tub = placed(procedural::cube(), Vec3::splat(2.0), 0.0, Vec3::ZERO);
    let lamp = placed(procedural::rectangle(), Vec3::splat(0.05), 0.4, vec3(-0.7, 0.6, -0.3));
    let ball = ball(0.5, vec3(0.6, -0.5, 0.0));
    let scene = SceneBuilder::new()
        .medium("fog", homogeneous(Rgb::splat(1.2), Rgb::splat(0.97), Rgb::ZERO, 0.0))
        .shape("tub", ShapeBuilder::interface(tub).interior("fog"))
        .shape("ball", ShapeBuilder::new(ball, diffuse(0.6, 0.5, 0.4)))
        .shape("lamp", glowing(lamp, Rgb::splat(900.0)));
    seen(scene, [vec3(0.3, 0.4, 5.0), Vec3::ZERO], 8)
}

/// Derivatives by paths from both ends, over the bars of those from the camera.
fn check(name: &str, scene: &Scene, effects: Vec<Effect>, spp: u32) {
    let moving = [parameter(name, 0.0, effects)];
    use EstimatorKind::{PathSpace, Warped};
    use PathSampling::{Bidirectional, Unidirectional};
    let ways = [(PathSpace, Unidirectional), (PathSpace, Bidirectional), (Warped, Bidirectional)];
    let [one, both, warped] = ways.map(|(estimator, sampling)| {
        let seed = 7 + sampling as u64 + estimator as u64;
        let settings = Settings { estimator, ..settings(sampling, seed, 0) };
        let mut session = Session::new(scene, &moving, &settings).expect("a valid scene");
        assert!(session.run(spp, &Unattended));
        let rendering = session.rendering();
        assert_eq!(rendering.non_finite, 0);
        rendering
    });
    let settings = settings(Bidirectional, 3, 0);
    let differences = finite_differences(scene, &moving, &settings, 16 * spp, 2e-2, &Unattended);
    let differences = differences.expect("a valid scene").remove(0);
    let turned = multiple(&differences, -1.0);
    assert!(!agreement(&turned, &both.derivatives[0].total, None).agrees, "{name}");
    for (what, one, both) in [
        ("image", &one.image, &both.image),
        ("differences", &one.derivatives[0].total, &differences),
        ("derivative", &one.derivatives[0].total, &both.derivatives[0].total),
        ("warped", &one.derivatives[0].total, &warped.derivatives[0].total),
    ] {
        let found = agreement(both, one, None);
        let noise = [one, both].map(|layer| layer.relative_noise(None));
        println!("{name} {what}: {found:?} {noise:?}");
        assert!(found.agrees, "{name} {what}: {found:?}");
    }
}

#[test]
fn derivatives_are_those_from_the_camera() {
    let scene = surfaces(metal(), phong());
    check("albedo", &scene, vec![changes("floor", "reflectance", grey(0.3))], 256);
    check("ball", &scene, vec![moves("ball", shift())], 256);
    check("extinction", &fog(), vec![changes("thin", "sigma_t", grey(0.3))], 512);
}

#[test]
fn derivatives_are_refused_by_other_kinds() {
    let (scene, settings) = (fog(), settings(PathSampling::Bidirectional, 0, 1));
    let moving = [parameter("p", 0.0, vec![moves("ball", shift())])];
    let pixels = (FILM[0] * FILM[1]) as usize;
    let adjoint = vec![Rgb::ONE; pixels];
    let radiative = Settings { estimator: EstimatorKind::Radiative, ..settings.clone() };
    for refused in [
        Session::new(&scene, &moving, &radiative).err(),
        gradient(&scene, &["ball"], &radiative, 1, &adjoint, &Unattended).err(),
    ] {
        let message = refused.expect("a refusal").to_string();
        assert!(message.contains("bidirectional") && message.contains("sampling"), "{message}");
    }
}
