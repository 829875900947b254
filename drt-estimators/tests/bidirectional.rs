//! Images by paths from both ends.

mod common;

use common::*;
use drt_estimators::{
    EstimatorKind, PathSampling, Rendering, Scene, Session, Settings, Unattended, agreement, finite_differences,
    gradient,
};
use drt_math::Rgb;
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
    for (what, one, both) in [
        ("image", &one.image, &both.image),
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
    check("albedo", &scene, vec![changes("floor-bsdf", "reflectance", grey(0.3))], 256);
    check("ball", &scene, vec![moves("ball", shift())], 256);
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
        finite_differences(&scene, &moving, &settings, 1, 1e-3, &Unattended).err(),
    ] {
        let message = refused.expect("a refusal").to_string();
        assert!(message.contains("bidirectional") && message.contains("sampling"), "{message}");
    }
}
