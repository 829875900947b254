//! Guides of boundary samples: learnt alike by any number of threads and in every shard, in forward and reverse mode,
//! and left alone where nothing is to be learnt.

use std::sync::Arc;

use crate::common::pairing::{pair, targets};
use crate::common::*;
use drt_estimators::filter::{Filter, FilterKind};
use drt_estimators::sensor::{Lens, Sensor};
use drt_estimators::{
    Rendering, Scene, Session, Settings, Shard, ShardSums, Term, Unattended, gradient,
};
use drt_math::stats::Moments;
use drt_math::testing::welch_z;
use drt_math::{Affine, Mat3, Rgb, Vec3, vec3};
use drt_motion::Parameter;

const SPP: u32 = 8;

/// Enough boundary samples for a pilot.
fn settings(seed: u64, guiding: bool) -> Settings {
    let boundary_ratio = Some(500.0);
    Settings { seed, threads: 1, guiding, boundary_ratio, ..Settings::default() }
}

/// A part of the shadow of a ball that slides, out of view.
fn case() -> (Scene, Parameter) {
    let mut scene = surfaces(phong(), phong());
    scene.emitters.truncate(1);
    // A small lamp.
    let lamp = scene.shapes.iter_mut().find(|s| s.emitter.is_some()).expect("a lamp");
    let centre = vec3(0.6, 2.2, -0.4);
    let shrink = Affine { linear: Mat3::diagonal(Vec3::splat(0.2)), translation: centre * 0.8 };
    lamp.mesh = Arc::new(lamp.mesh.transform(&shrink));
    scene.integrator.max_depth = Some(2);
    let filter = Filter::new(FilterKind::Tent { radius: 1.0 }).expect("a valid filter");
    let view = [vec3(-2.4, 2.0, 0.2), vec3(-1.5, -1.0, 0.2), Vec3::Y];
    let sensor = Sensor::look_at(view, Lens::with_fov(12.0), FILM, filter);
    scene.sensors[0].item.sensor = sensor.expect("a valid camera");
    (scene, parameter("slides", 0.0, vec![moves("ball", shift())]))
}

fn rendered(scene: &Scene, parameter: &Parameter, settings: &Settings) -> Rendering {
    let parameters = core::slice::from_ref(parameter);
    let mut session = Session::new(scene, parameters, settings).expect("a valid scene");
    assert!(session.run(SPP, &Unattended));
    session.rendering()
}

fn adjoint() -> Vec<Rgb> {
    (0..FILM[0] * FILM[1]).map(|i| Rgb::splat(f64::from(i % 7) - 2.0)).collect()
}

#[test]
fn threads_and_shards_learn_alike() {
    let (scene, slides) = case();
    let one = rendered(&scene, &slides, &settings(5, true));
    assert!(one.counters.guide_samples > 0);
    let learnt = |what: &str| one.plan.guiding.iter().any(|g| g.starts_with(what));
    assert!(learnt("emitter boundary: 0."), "{:?}", one.plan.guiding);
    let three = Settings { threads: 3, ..settings(5, true) };
    let many = rendered(&scene, &slides, &three);
    let pixels = |r: &Rendering| r.derivatives[0].total.pixels.clone();
    assert!(pixels(&one) == pixels(&many) && one.counters == many.counters);
    let parameters = core::slice::from_ref(&slides);
    let mut session = Session::new(&scene, parameters, &three).expect("a valid scene");
    let shards = (1..=2).map(|k| {
        let shard = Shard::new(k, 2).expect("a shard");
        session.run_shard(SPP, 5, shard, &Unattended).expect("few shards").expect("not cancelled")
    });
    let merged = ShardSums::merge(&shards.collect::<Vec<_>>()).expect("all shards");
    assert!(pixels(&one) == pixels(&merged.rendering));
    let wanted = targets(&scene, &slides);
    let by = |settings: &Settings| {
        gradient(&scene, &wanted, settings, SPP, &adjoint(), &Unattended).expect("a valid scene")
    };
    let (one, many) = (by(&settings(5, true)), by(&three));
    assert!(one.shapes == many.shapes && one.counters == many.counters);
    assert!(one.counters.guide_samples > 0);
}

/// What is guided is what is not, in either mode, with less noise.
#[test]
fn guides_change_no_expected_value() {
    let (scene, slides) = case();
    let wanted = targets(&scene, &slides);
    let a = adjoint();
    let forward = |guiding: bool| -> (Moments, f64) {
        let mut noise = 0.0;
        let one = |seed| {
            let settings = Settings { terms: true, ..settings(seed, guiding) };
            let derivative = &rendered(&scene, &slides, &settings).derivatives[0];
            let direct = derivative.terms.iter().find(|(term, _)| *term == Term::Direct);
            let (_, direct) = direct.expect("shadows");
            noise += direct.pixels.iter().map(|p| p.stderr.dot(p.stderr)).sum::<f64>();
            let pixels = derivative.total.pixels.iter().zip(&a);
            pixels.map(|(p, a)| p.mean.dot(*a)).sum::<f64>()
        };
        ((0..8).map(one).collect(), noise)
    };
    let reverse: Moments = (0..8)
        .map(|seed| {
            let settings = settings(seed, true);
            let g = gradient(&scene, &wanted, &settings, SPP, &a, &Unattended);
            pair(&scene, &slides, &g.expect("a valid scene"))
        })
        .collect();
    let ((guided, noise), (unguided, more)) = (forward(true), forward(false));
    for m in [&guided, &reverse] {
        let z = welch_z(m, &unguided);
        assert!(z.abs() < 4.0, "{z}: {} {}", m.mean(), unguided.mean());
        assert!(m.standard_error() < 0.04 * unguided.mean().abs(), "{m:?}");
    }
    assert!(noise < 0.2 * more, "{noise} {more}");
}

/// Pilots of short runs would cost more than they tell.
#[test]
fn short_runs_have_no_pilots() {
    let (scene, slides) = case();
    let short = Settings { boundary_ratio: None, ..settings(5, true) };
    let r = rendered(&scene, &slides, &short);
    assert_eq!(r.counters.guide_samples, 0);
    let off = Settings { boundary_ratio: None, ..settings(5, false) };
    assert!(rendered(&scene, &slides, &off).plan.guiding.is_empty());
    let still = parameter("brighter", 0.0, vec![changes("lamp", "radiance", grey(1.0))]);
    let r = rendered(&scene, &still, &settings(5, true));
    assert!(r.counters.guide_samples == 0 && r.plan.guiding.is_empty());
}
