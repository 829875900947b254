//! Films on which every path of the image counts for all pixels that it reaches: the same images with less noise, and
//! the same derivatives.

use crate::common::*;
use drt_estimators::filter::{Filter, FilterKind};
use drt_estimators::sensor::{Lens, Sensor};
use drt_estimators::{Layer, Rendering, Scene, Session, Settings, Unattended, agreement};
use drt_math::{Rgb, Vec3, vec3};
use drt_motion::Parameter;

fn scene(kind: FilterKind) -> Scene {
    let mut scene = fog();
    let filter = Filter::new(kind).expect("a valid filter");
    let view = [vec3(0.4, 0.8, 4.2), vec3(0.0, 0.1, 0.0), Vec3::Y];
    let sensor = Sensor::look_at(view, Lens::with_fov(40.0), [21, 17], filter);
    scene.sensors[0].item.sensor = sensor.expect("a valid camera");
    scene
}

fn rendered(scene: &Scene, parameters: &[Parameter], settings: &Settings) -> Rendering {
    let mut session = Session::new(scene, parameters, settings).expect("a valid scene");
    for _ in 0..2 {
        assert!(session.run(64, &Unattended));
    }
    session.rendering()
}

fn variance(layer: &Layer) -> f64 {
    layer.pixels.iter().map(|e| (e.stderr * e.stderr).mean()).sum()
}

#[test]
fn only_noise_depends_on_splatting() {
    let own = Settings { splatting: false, ..Settings::default() };
    for (kind, gain) in [(FilterKind::TENT, 1.6), (FilterKind::GAUSSIAN, 2.2)] {
        let scene = scene(kind);
        for adaptive in [false, true] {
            let settings = Settings { seed: 1, adaptive, ..Settings::default() };
            let splatted = rendered(&scene, &[], &settings);
            let alone = rendered(&scene, &[], &Settings { adaptive, ..own.clone() });
            assert!(splatted.plan.splatting && !alone.plan.splatting);
            let found = agreement(&splatted.image, &alone.image, None);
            assert!(found.agrees, "{kind:?} {found:?}");
            let found = variance(&alone.image) / variance(&splatted.image);
            assert!(found > gain, "{kind:?} {found}");
        }
        // A border that the filters beyond it had no part in.
        let splatted = rendered(&scene, &[], &Settings { seed: 1, ..Settings::default() });
        let alone = rendered(&scene, &[], &own);
        let mut planted = splatted.image;
        for block in planted.blocks.iter_mut().take(8) {
            block.mean *= 0.875;
        }
        assert!(!agreement(&planted, &alone.image, None).agrees, "{kind:?}");
    }
}

#[test]
fn derivatives_are_left_alone() {
    let parameters = [parameter("ball", 0.0, vec![moves("ball", shift())])];
    let scene = scene(FilterKind::GAUSSIAN);
    let [splatted, alone] = [true, false].map(|splatting| {
        rendered(&scene, &parameters, &Settings { splatting, ..Settings::default() })
    });
    let [a, b] = [&splatted, &alone].map(|r| &r.derivatives[0].total);
    assert!(a.pixels == b.pixels && a.blocks == b.blocks);
    let other = Settings { splatting: false, seed: 1, ..Settings::default() };
    let other = rendered(&scene, &[], &other).image;
    let found = agreement(&splatted.image, &other, None);
    assert!(found.agrees, "{found:?}");
    let found = variance(&alone.image) / variance(&splatted.image);
    assert!(found > 1.5, "{found}");
}

/// Where filters reach no neighbour, or too many, pixels have paths of their own.
#[test]
fn other_filters_are_left_alone() {
    for kind in [FilterKind::BOX, FilterKind::Tent { radius: 0.5 }, FilterKind::gaussian(2.1)] {
        let scene = scene(kind);
        let session = Session::new(&scene, &[], &Settings::default()).expect("a valid scene");
        assert!(!session.plan().splatting, "{kind:?}");
    }
}

/// Light that is the same everywhere leaves no noise but that of weights, at the film's border, too.
#[test]
fn even_light_is_nearly_free_of_noise() {
    let mut scene = surfaces(phong(), phong());
    scene.shapes.clear();
    scene.emitters.retain(|e| e.id.as_deref() == Some("sky"));
    for (kind, most) in [(FilterKind::TENT, 2e-3), (FilterKind::GAUSSIAN, 2e-3)] {
        scene.sensors = self::scene(kind).sensors;
        let image = rendered(&scene, &[], &Settings::default()).image;
        for e in &image.pixels {
            let relative = (e.mean - Rgb::new(0.2, 0.3, 0.5)).abs().max_abs() / 0.5;
            assert!(relative < most, "{kind:?} {e:?}");
        }
    }
}
