//! A session is prepared once, and answers for images, derivatives and gradients; another state of its scene updates it.

use std::sync::Arc;

use crate::common::*;
use drt_estimators::{EstimatorKind, Rendering, Scene, Session, Settings, Unattended, gradient};
use drt_geom::procedural;
use drt_math::{Rgb, Vec3, vec3};
use drt_motion::GeometryChange;

const SPP: u32 = 4;

fn settings(estimator: EstimatorKind) -> Settings {
    Settings { estimator, seed: 11, threads: 1, ..Settings::default() }
}

fn adjoint() -> Vec<Rgb> {
    (0..FILM[0] * FILM[1]).map(|i| Rgb::new(1.0, f64::from(i % 3) - 1.0, 0.5)).collect()
}

/// A scene whose ball has some thousand vertices.
fn fine(subdivisions: u32) -> Scene {
    let mut scene = surfaces(phong(), diffuse(0.6, 0.5, 0.4));
    let mesh = procedural::bumpy_sphere(subdivisions, 0.1, 5.0);
    scene.shapes[0].mesh = Arc::new(placed(mesh, Vec3::splat(0.9), 0.3, vec3(0.1, 0.1, 0.0)));
    scene
}

/// The scene with its first shape's vertices where a step has put them.
fn stepped(scene: &Scene, step: f64) -> Scene {
    let mut scene = scene.clone();
    let mesh = Arc::make_mut(&mut scene.shapes[0].mesh);
    for p in &mut mesh.positions {
        *p += vec3((7.0 * p.y).sin(), (5.0 * p.z).cos(), (3.0 * p.x).sin()) * step;
    }
    scene
}

fn means(rendering: &Rendering) -> Vec<Rgb> {
    let layers = rendering.derivatives.iter().map(|d| &d.total).chain([&rendering.image]);
    layers.flat_map(|l| l.pixels.iter().map(|p| p.mean)).collect()
}

#[test]
fn an_updated_session_is_a_new_one() {
    let first = fine(2);
    let shift = GeometryChange::Translate(vec3(0.0, 0.3, 0.1));
    let at = |value| [parameter("shift", value, vec![moves("ball", shift.clone())])];
    let kinds = [
        EstimatorKind::PathSpace,
        EstimatorKind::Radiative,
        EstimatorKind::Warped,
        EstimatorKind::Auto,
    ];
    for kind in kinds {
        let settings = settings(kind);
        let mut session = Session::new(&first, &at(0.0), &settings).expect("a valid scene");
        for step in 1..4 {
            let step = f64::from(step);
            let (scene, parameters) = (stepped(&first, 0.02 * step), at(0.1 * step));
            session.update(&scene, &parameters).expect("a valid scene");
            session.run(SPP, &Unattended);
            let own = session.gradient(&["ball", "floor"], SPP, &adjoint(), &Unattended);
            let mut other = Session::new(&scene, &parameters, &settings).expect("a valid scene");
            other.run(SPP, &Unattended);
            assert_eq!(means(&session.rendering()), means(&other.rendering()), "{kind:?}");
            assert_eq!(session.plan(), other.plan());
            let other = other.gradient(&["ball", "floor"], SPP, &adjoint(), &Unattended);
            let vertices = |g: &drt_estimators::SceneGradient| g.vertices(&scene, 0);
            assert_eq!(vertices(&own.expect("a gradient")), vertices(&other.expect("a gradient")));
        }
    }
}

/// A gradient by so many coordinates, from the preparation of images, is that of a session for it alone; asked for again, it
/// is the same.
#[test]
fn images_and_a_gradient_by_thirty_thousand_coordinates() {
    let scene = fine(5);
    assert!(3 * scene.shapes[0].mesh.positions.len() > 30_000);
    let shift = GeometryChange::Translate(vec3(0.0, 0.3, 0.1));
    let parameters = [parameter("shift", 0.0, vec![moves("ball", shift)])];
    for kind in [EstimatorKind::PathSpace, EstimatorKind::Radiative] {
        let settings = settings(kind);
        let mut session = Session::new(&scene, &parameters, &settings).expect("a valid scene");
        let first = session.gradient(&["ball"], SPP, &adjoint(), &Unattended);
        session.run(SPP, &Unattended);
        let again = session.gradient(&["ball"], SPP, &adjoint(), &Unattended);
        let alone = gradient(&scene, &["ball"], &settings, SPP, &adjoint(), &Unattended);
        let [first, again, alone] = [first, again, alone]
            .map(|g| g.expect("a gradient").vertices(&scene, 0).expect("wanted"));
        assert!(first == again && first == alone, "{kind:?}");
        assert!(first.iter().any(|g| *g != Vec3::ZERO));
    }
}

#[test]
fn what_cannot_be_prepared_leaves_a_session_as_it_was() {
    let scene = fine(1);
    let settings = settings(EstimatorKind::PathSpace);
    let mut session = Session::new(&scene, &[], &settings).expect("a valid scene");
    session.run(SPP, &Unattended);
    let before = means(&session.rendering());
    let mut bad = scene.clone();
    Arc::make_mut(&mut bad.shapes[0].mesh).positions[0].x = f64::NAN;
    assert!(session.update(&bad, &[]).is_err());
    assert_eq!(before, means(&session.rendering()));
    assert!(session.run(SPP, &Unattended));
}
