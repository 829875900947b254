//! Light that goes straight through: at no depth, and to where points and directions light.

use crate::common::{SceneBuilder, ShapeBuilder, changes, diffuse, parameter, placed, seen};
use drt_estimators::emitter::Emitter;
use drt_estimators::surface::{Bsdf, Mask, ThinDielectric};
use drt_estimators::{Estimate, EstimatorKind, PathSampling, Scene, Session, Settings, Unattended};
use drt_geom::procedural::rectangle;
use drt_math::{Rgb, ValueChange, Vec3, vec3};

const OPACITY: f64 = 0.3;

fn mask() -> Bsdf {
    Bsdf::Mask(Box::new(Mask { bsdf: diffuse(0.0, 0.0, 0.0), opacity: OPACITY }))
}

/// Something between a floor and its light, out of the camera's sight.
fn shaded(by: Option<Bsdf>, light: Emitter, depth: u32) -> Scene {
    let floor = placed(rectangle(), Vec3::splat(3.0), 0.0, Vec3::ZERO);
    let mut scene = SceneBuilder::new()
        .shape("floor", ShapeBuilder::new(floor, diffuse(0.5, 0.5, 0.5)))
        .emitter("light", light);
    if let Some(bsdf) = by {
        let roof = placed(rectangle(), Vec3::splat(9.0), 0.0, vec3(0.0, 0.0, 2.0));
        scene = scene.shape("roof", ShapeBuilder::new(roof, bsdf));
    }
    seen(scene, [vec3(0.3, 0.2, 1.5), Vec3::ZERO], depth)
}

fn image(scene: &Scene) -> Estimate {
    let settings = Settings { threads: 1, ..Settings::default() };
    let mut session = Session::new(scene, &[], &settings).expect("a scene");
    assert!(session.run(256, &Unattended));
    session.rendering().image.total
}

/// How many standard errors the green of an image is off so much of another's.
fn z(image: &Estimate, part: f64, of: &Estimate) -> f64 {
    let error = image.stderr.g.powi(2) + (part * of.stderr.g).powi(2);
    (image.mean.g - part * of.mean.g) / (error.sqrt() + 1e-12)
}

#[test]
fn points_and_directions_shine_through() {
    let lamp = Emitter::Point { position: vec3(0.4, 0.2, 4.0), intensity: Rgb::splat(9.0) };
    let sun = Emitter::Directional { direction: -Vec3::Z, irradiance: Rgb::ONE };
    // Once reflected at both sides of a pane, and again.
    let once: f64 = 0.04;
    let pane = ThinDielectric { eta: 1.5, ..ThinDielectric::default() };
    let through = 1.0 - 2.0 * once / (1.0 + once);
    for (by, light, part) in [
        (mask(), lamp.clone(), 1.0 - OPACITY),
        (mask(), sun.clone(), 1.0 - OPACITY),
        (Bsdf::ThinDielectric(pane), sun, through),
    ] {
        let [free, shaded] = [None, Some(by)].map(|by| image(&shaded(by, light.clone(), 2)));
        assert!(z(&shaded, part, &free).abs() < 4.0, "{shaded:?} {free:?}");
        // Planted: what is behind has no light, or all of it.
        assert!(z(&shaded, 0.97 * part, &free).abs() > 4.0);
    }
}

/// The sky through two masks, by paths up to a depth.
fn sky_behind(depth: u32, straight_depth: bool) -> Estimate {
    let sky = Emitter::Constant { radiance: Rgb::ONE };
    let mut scene = SceneBuilder::new().emitter("sky", sky);
    for (id, z) in [("roof", 2.0), ("cover", 2.5)] {
        let mesh = placed(rectangle(), Vec3::splat(9.0), 0.0, vec3(0.0, 0.0, z));
        scene = scene.shape(id, ShapeBuilder::new(mesh, mask()));
    }
    let mut scene = seen(scene, [vec3(0.0, 0.0, 1.5), vec3(0.1, 0.1, 4.0)], depth);
    scene.integrator.straight_depth = straight_depth;
    image(&scene)
}

/// Paths see the sky through a mask at any depth that sees it without, or at one more for each, as in Mitsuba's `path`.
#[test]
fn masks_add_depth_where_they_should() {
    let expected = (1.0 - OPACITY).powi(2);
    for seen in [sky_behind(1, false), sky_behind(3, true)] {
        let off = (seen.mean.g - expected) / seen.stderr.g;
        assert!(off.abs() < 4.0 && seen.stderr.g < 0.02 * expected, "{seen:?}");
    }
    assert_eq!(sky_behind(2, true).mean, Rgb::ZERO);
}

/// Where going straight adds depth, points and directions do not shine through.
#[test]
fn masks_may_cast_shadows() {
    let sun = Emitter::Directional { direction: -Vec3::Z, irradiance: Rgb::ONE };
    let mut scene = shaded(Some(mask()), sun, 3);
    assert!(image(&scene).mean.g > 0.0);
    scene.integrator.straight_depth = true;
    assert_eq!(image(&scene).mean, Rgb::ZERO);

    let both = Settings { sampling: PathSampling::Bidirectional, ..Settings::default() };
    let refused = Session::new(&scene, &[], &both).err().expect("refused").to_string();
    assert!(refused.contains("`roof`") && refused.contains("straight"), "{refused}");
}

#[test]
fn what_goes_through_a_mask_falls_with_its_opacity() {
    let lamp = Emitter::Point { position: vec3(0.4, 0.2, 4.0), intensity: Rgb::splat(9.0) };
    let free = image(&shaded(None, lamp.clone(), 2));
    let scene = shaded(Some(mask()), lamp, 2);
    let fades =
        [parameter("fades", 0.0, vec![changes("roof", "opacity", ValueChange::Add(Rgb::ONE))])];
    let derivative = |estimator| {
        let settings = Settings { threads: 1, estimator, ..Settings::default() };
        let mut session = Session::new(&scene, &fades, &settings).expect("a scene");
        assert!(session.run(256, &Unattended));
        session.rendering().derivatives[0].total.total
    };
    let by_path = derivative(EstimatorKind::PathSpace);
    assert!(z(&by_path, -1.0, &free).abs() < 4.0, "{by_path:?} {free:?}");
    // Planted: the wrong way.
    assert!(z(&by_path, 1.0, &free).abs() > 10.0);
    // Nothing moves, so that all estimators are one.
    for estimator in [EstimatorKind::Radiative, EstimatorKind::Warped] {
        assert_eq!(derivative(estimator), by_path);
    }
}
