//! A face almost in the camera's own plane, which few rays meet.

use alloc::vec;

use drt_geom::procedural;
use drt_math::stats::Moments;
use drt_math::{Rgb, Vec3, vec3};
use drt_motion::{GeometryChange, Parameter};

use crate::derivative::contraction::Contraction;
use crate::derivative::tests::choice;
use crate::derivative::tests::scenes::{
    FILM, SceneBuilder, ShapeBuilder, glowing, homogeneous, moves, parameter, placed, seen,
};
use crate::model::emitter::Emitter;
use crate::model::scene::Scene;
use crate::model::settings::EstimatorKind;
use crate::model::settings::Settings;
use crate::run::control::Unattended;
use crate::run::session::Session;
use crate::terms::boundary_source::BoundarySource;
use crate::terms::splatting::Checked;

/// A cube of milk, lit by a lamp and the sky, whose top is a little lower than the camera.
fn milk() -> (Scene, Parameter) {
    let milk = homogeneous(Rgb::new(2.0, 1.5, 3.0), Rgb::splat(0.9), Rgb::ZERO, 0.2);
    let cube = placed(procedural::cube(), Vec3::splat(0.5), 0.0, vec3(0.0, -0.52, 0.0));
    let lamp = placed(procedural::rectangle(), Vec3::splat(2.0), 180.0, vec3(0.0, 3.0, 0.0));
    let scene = SceneBuilder::new()
        .medium("milk", milk)
        .shape("cube", ShapeBuilder::interface(cube).interior("milk"))
        .shape("lamp", glowing(lamp, Rgb::splat(2.0)))
        .emitter("sky", Emitter::Constant { radiance: Rgb::splat(0.3) });
    let up = GeometryChange::Translate(vec3(0.0, 1.0, 0.0));
    let motion = parameter("cube", 0.0, vec![moves("cube", up)]);
    (seen(scene, [vec3(0.0, 0.0, 4.0), Vec3::ZERO], 5), motion)
}

const PIXELS: u32 = FILM[0] * FILM[1];

/// The derivative of the mean of all pixels, of what is seen edge on alone.
fn grazing_flux() -> Moments {
    let (scene, motion) = milk();
    let (prepared, motion) = choice::prepare(&scene, &motion, 5);
    let mut moments = Moments::default();
    for seed in 0..32 {
        let contraction = Contraction::new(&prepared.world, &motion);
        let mut mean = Checked::new(choice::Total { contraction, weight: |_| 1.0, sum: 0.0 });
        let count = 1 << 12;
        prepared.splatter(&prepared.world, seed).run(
            BoundarySource::GrazingFlux,
            None,
            BoundarySource::GrazingFlux.stream(),
            count,
            &mut mean,
        );
        moments.push(mean.inner.sum / f64::from(count * PIXELS));
    }
    moments
}

/// Path space, where the milk moves along with its cube, has no flux. Both estimators agree, and would not
/// without what is seen edge on.
#[test]
fn faces_seen_edge_on() {
    let (scene, motion) = milk();
    let run = |estimator| {
        let settings = Settings { estimator, ..Settings::default() };
        let mut session =
            Session::new(&scene, core::slice::from_ref(&motion), &settings).expect("a valid scene");
        session.run(1 << 13, &Unattended);
        session.rendering().derivatives.swap_remove(0).total.total
    };
    let [path_space, radiative] = [EstimatorKind::PathSpace, EstimatorKind::Radiative].map(run);
    let part = grazing_flux();
    let error = path_space.stderr.mean().hypot(radiative.stderr.mean());
    let off = radiative.mean.mean() - path_space.mean.mean();
    assert!(off.abs() < 4.0 * error, "{off} ± {error}");
    assert!(part.mean().abs() > 8.0 * error.hypot(part.variance_of_mean().sqrt()));
}
