//! Derivatives under lights that throw pictures.

use std::sync::Arc;

use crate::common::*;
use drt_estimators::emitter::{Emitter, Slide};
use drt_estimators::texture::{Bitmap, Texture};
use drt_estimators::{
    EstimatorKind, Scene, Session, Settings, Unattended, agreement, finite_differences, gradient,
};
use drt_geom::procedural;
use drt_math::{Mat3, Rgb, Rng, Vec3, vec3};
use drt_motion::{GeometryChange, Parameter};

fn picture(border: f32) -> Texture {
    let mut rng = Rng::new(3, 0, 0);
    let texels = (0..30).map(|i| {
        let (x, y) = (i % 6, i / 6);
        let dim = if x == 0 || y == 0 || x == 5 || y == 4 { border } else { 1.0 };
        [0; 3].map(|_| dim * (rng.next_f64() as f32 + 0.1))
    });
    Texture::Bitmap(Bitmap::new([6, 5], texels.collect()).expect("an image"))
}

/// A cube over a floor in the light of a picture.
fn scene(slide: Slide) -> Scene {
    let cube = placed(procedural::cube(), Vec3::splat(0.5), 0.5, vec3(0.1, 0.1, 0.0));
    let linear = Mat3::rotation(Vec3::X, -core::f64::consts::FRAC_PI_2) * 4.0;
    let floor = drt_math::Affine { linear, translation: vec3(0.0, -1.0, 0.0) };
    let floor = procedural::rectangle().transform(&floor);
    let position = vec3(0.8, 2.5, 1.5);
    let view = drt_estimators::sensor::look_at(position, vec3(0.1, -0.2, 0.0), Vec3::Y);
    let frame = view.expect("a view").linear;
    let strength = Rgb::new(4.0, 5.0, 6.0);
    let lamp = Emitter::Projector { position, frame, strength, slide: Arc::new(slide) };
    let scene = SceneBuilder::new()
        .shape("cube", ShapeBuilder::new(cube, diffuse(0.5, 0.7, 0.6)))
        .shape("floor", ShapeBuilder::new(floor, diffuse(0.6, 0.5, 0.7)))
        .emitter("lamp", lamp);
    seen(scene, [vec3(0.3, 0.9, 4.0), vec3(0.0, -0.1, 0.0)], 3)
}

fn parameters(name: &str) -> Vec<Parameter> {
    let spin = GeometryChange::Rotate { axis: vec3(0.3, 0.8, -0.2), pivot: vec3(0.5, 2.0, 1.0) };
    vec![
        parameter("cube", 0.0, vec![moves("cube", shift())]),
        parameter("lamp", 0.0, vec![moves("lamp", spin)]),
        parameter("bright", 0.0, vec![changes("lamp", name, grey(3.0))]),
    ]
}

#[test]
fn derivatives_agree() {
    for (slide, name) in [
        (Slide::projector(Some(picture(0.0)), [0.7, 0.5]), "irradiance"),
        (Slide::spot(picture(1.0), 0.6, 0.2), "intensity"),
    ] {
        let scene = scene(slide.expect("a picture"));
        let by = |estimator, seed| {
            let settings = Settings { estimator, seed, ..Settings::default() };
            rendered(&scene, &parameters(name), &settings, 2000).derivatives
        };
        let settings = Settings { seed: 3, ..Settings::default() };
        let differences =
            finite_differences(&scene, &parameters(name), &settings, 4000, 1e-2, &Unattended);
        let differences = differences.expect("a valid scene");
        for (estimator, seed) in [(EstimatorKind::PathSpace, 1), (EstimatorKind::Warped, 2)] {
            for (a, b) in by(estimator, seed).iter().zip(&differences) {
                let found = agreement(&a.total, b, None);
                assert!(found.agrees, "{estimator:?} {} {found:?}", a.name);
                let half = multiple(&a.total, 0.5);
                assert!(!agreement(&half, b, None).agrees, "{estimator:?} {}", a.name);
            }
        }
    }
}

/// Of what moves in it; its strength is as ever.
#[test]
fn light_that_jumps_is_refused_by_name() {
    let white = scene(Slide::projector(None, [0.7, 0.5]).expect("a picture"));
    let parameters = parameters("irradiance");
    let session =
        |p: &[Parameter], scene: &Scene| Session::new(scene, p, &Settings::default()).map(|_| ());
    for p in [&parameters[..1], &parameters[1..2]] {
        let message = session(p, &white).expect_err("refused").to_string();
        let parts = ["lamp: its light is discontinuous", &format!("`{}`", p[0].name)];
        assert!(parts.iter().all(|part| message.contains(part)), "{message}");
    }
    session(&parameters[2..], &white).expect("nothing moves");
    let mut sharp = surfaces(phong(), phong());
    if let Emitter::Spot { cutoff_angle, beam_width, .. } = &mut sharp.emitters[2].item.emitter {
        *beam_width = *cutoff_angle;
    }
    let ball = [parameter("ball", 0.0, vec![moves("ball", shift())])];
    let message = session(&ball, &sharp).expect_err("refused").to_string();
    assert!(message.contains("spot: its light is discontinuous"), "{message}");
}

/// A texel's part of the image, and the gradient of the image's sum by all texels.
#[test]
fn texels_in_reverse() {
    for (slide, name) in [
        (Slide::projector(Some(picture(0.0)), [0.7, 0.5]), "irradiance"),
        (Slide::spot(picture(1.0), 0.6, 0.2), "intensity"),
    ] {
        let scene = scene(slide.expect("a picture"));
        let settings = Settings { guiding: false, ..Settings::default() };
        let texel = changes_texel("lamp", name, Some([2, 1]), grey(1.0));
        // Reverse mode takes samples for a lamp that moves as well.
        let own = [parameter("texel", 0.0, vec![texel]), parameters(name).remove(1)];
        let forward = &rendered(&scene, &own, &settings, 16).derivatives[0].total.pixels;
        let forward = forward.iter().fold(Rgb::ZERO, |sum, p| sum + p.mean);
        let adjoint = vec![Rgb::ONE; pixels(&scene)];
        let lamp = [scene.find("lamp").expect("a lamp")];
        let g = gradient(&scene, &lamp, &settings, 16, &adjoint, &Unattended).expect("a gradient");
        let of_texels = g.emitter_texels.iter().flatten().next().expect("texels").values();
        let found = of_texels[6 + 2];
        assert!((found - forward).max_abs() < 1e-9 * forward.max_abs(), "{found:?} {forward:?}");
        assert!(forward.max_abs() > 1e-3 && of_texels.len() == 30);
    }
}

fn pixels(scene: &Scene) -> usize {
    let [w, h] = scene.sensors[0].item.sensor.film();
    (w * h) as usize
}
