//! Derivatives do not depend on what is drawn by area, and miss what is not drawn at all.

use core::f64::consts::FRAC_PI_2;

use drt_geom::procedural;
use drt_math::{Affine, Mat3, Rgb, Vec3, vec3};
use drt_motion::GeometryChange;

use crate::derivative::tests::choice::{LIGHT, MOMENT, Sum, derivative, prepare_for};
use crate::derivative::tests::scenes::{
    FILM, SceneBuilder, ShapeBuilder, diffuse, glowing, moves, parameter, placed, seen,
};
use crate::model::emitter::Emitter;
use crate::model::filter::{Filter, FilterKind};
use crate::model::settings::EstimatorKind;
use crate::terms::boundary_source::BoundarySource;

/// Compares `radiative` with `path-space` through a filter, where a `body` moves along `by` before a camera.
fn compare(filter: FilterKind, body: ShapeBuilder, by: Vec3, camera: [Vec3; 2], sum: Sum) {
    // Its light comes from above.
    let linear = Mat3::rotation(Vec3::X, FRAC_PI_2) * Mat3::diagonal(Vec3::splat(0.5));
    let to_world = Affine { linear, translation: vec3(0.4, 1.2, 0.3) };
    let lamp = procedural::rectangle().transform(&to_world);
    let scene = SceneBuilder::new()
        .shape("body", body)
        .shape("lamp", glowing(lamp, Rgb::splat(4.0)))
        .emitter("sky", Emitter::Constant { radiance: Rgb::splat(0.3) });
    let mut scene = seen(scene, camera, 2);
    let sensor = &mut scene.sensors[0].item.sensor;
    *sensor = sensor.clone().with_filter(Filter::new(filter).expect("a valid filter"));
    let motion = parameter("body", 0.0, alloc::vec![moves("body", GeometryChange::Translate(by))]);
    let by = |kind| prepare_for(kind, &scene, &motion, 2);
    let reference = derivative(sum, &by(EstimatorKind::PathSpace));
    let mut radiative = by(EstimatorKind::Radiative);
    let fair = derivative(sum, &radiative).off(&reference);
    assert!(fair.0.abs() < 4.0 && fair.1 < 0.03, "{filter:?}: {fair:?} of {}", reference.mean());
    let sources = &mut radiative.0.terms.sources;
    sources.retain(|source| *source != BoundarySource::GrazingPaths);
    let faulty = derivative(sum, &radiative).off(&reference);
    assert!(faulty.0.abs() > 8.0, "{filter:?}: {faulty:?} of {}", reference.mean());
}

/// Facets at the silhouette of a ball with interpolated normals.
#[test]
fn facets_of_a_ball() {
    for filter in [FilterKind::BOX, FilterKind::TENT] {
        let ball = placed(procedural::uv_sphere(16), Vec3::splat(0.9), 0.2, vec3(0.1, 0.2, 0.0));
        let ball = ShapeBuilder::new(ball, diffuse(0.7, 0.5, 0.3));
        let camera = [vec3(0.0, 0.0, 4.0), Vec3::ZERO];
        compare(filter, ball, vec3(1.0, 0.3, 0.0), camera, Sum { samples: 512, ..MOMENT });
    }
}

/// The top of a cube, a little lower than the camera.
#[test]
fn a_face_almost_in_the_plane_of_the_camera() {
    let cube = placed(procedural::cube(), Vec3::splat(0.5), 0.0, vec3(0.0, -0.52, 0.0));
    let cube = ShapeBuilder::new(cube, diffuse(0.7, 0.5, 0.3));
    let camera = [vec3(0.0, 0.0, 4.0), Vec3::ZERO];
    let sum = Sum {
        weight: |pixel| f64::from(u8::from(pixel / FILM[0] == FILM[1] / 2)),
        samples: 512,
        ..LIGHT
    };
    compare(FilterKind::BOX, cube, vec3(0.0, 1.0, 0.0), camera, sum);
}
