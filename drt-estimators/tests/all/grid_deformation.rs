//! Grids that follow a shape which deforms.

use std::sync::Arc;

use crate::common::{moves, parameter, smoke};
use drt_estimators::{Error, InteriorMotion, Rendering, Scene, Session, Settings, Unattended};
use drt_math::{Affine, Mat3, Vec3, vec3};
use drt_motion::{Change, Effect, GeometryChange, Parameter};

const FIELD: Affine = Affine {
    linear: Mat3 { cols: [vec3(0.1, 0.3, -0.1), vec3(-0.2, 0.2, 0.1), vec3(0.2, -0.1, -0.1)] },
    translation: vec3(0.1, -0.2, 0.05),
};

fn follows() -> Effect {
    Effect { target: "smoke".into(), change: Change::Follow("box".into()) }
}

/// A deformation of the border by its vertices.
fn by_vertex(scene: &Scene, field: impl Fn(Vec3) -> Vec3) -> Effect {
    let body = scene.shapes.iter().find(|s| s.id.as_deref() == Some("box")).expect("a box");
    let velocities: Arc<[Vec3]> = body.mesh.positions.iter().map(|p| field(*p)).collect();
    moves("box", GeometryChange::VertexVelocity(velocities))
}

fn prepared(scene: &Scene, parameters: &[Parameter]) -> Result<Session, Error> {
    let insides = vec![(0, InteriorMotion::Static)];
    let settings = Settings { insides, ..Settings::default() };
    Session::new(scene, parameters, &settings)
}

fn rendered(scene: &Scene, value: f64, effects: Vec<Effect>) -> Rendering {
    let mut session = prepared(scene, &[parameter("p", value, effects)]).expect("a valid scene");
    assert!(session.run(32, &Unattended));
    session.rendering()
}

/// A linear field given vertex by vertex is the same motion as the affine one: of surfaces, and of
/// the space between.
#[test]
fn an_affine_deformation_is_the_affine_motion() {
    for border in [0.0, 0.2] {
        let scene = smoke(border);
        let affine = || vec![moves("box", GeometryChange::Matrix(FIELD)), follows()];
        let vertices = || vec![by_vertex(&scene, |p| FIELD.point(p)), follows()];
        for value in [0.0, 0.3] {
            let a = rendered(&scene, value, affine());
            let b = rendered(&scene, value, vertices());
            let still = rendered(&scene, value, vec![by_vertex(&scene, |p| FIELD.point(p))]);
            let [a, b, still] = [&a, &b, &still].map(|r| &r.derivatives[0].total);
            let size = a.rms_value();
            let off = |o: &drt_estimators::Layer| {
                let pairs = a.pixels.iter().zip(&o.pixels);
                let square = |(a, o): (&drt_estimators::Estimate, &drt_estimators::Estimate)| {
                    let d = a.mean - o.mean;
                    d.dot(d)
                };
                (pairs.map(square).sum::<f64>() / a.pixels.len() as f64).sqrt() / size
            };
            let (same, other) = (off(b), off(still));
            println!("value {value}: {same:.1e}; a grid at rest {other:.1e}");
            // Line integrals take as many points as the grid's voxels ask for, which the one is placed
            // with and the other only seen through: elsewhere they agree up to noise.
            assert!(same < if value == 0.0 { 1e-12 } else { 0.05 } && other > 1.0);
        }
    }
}

/// At rest, the image does not know that the grid will ride.
#[test]
fn nothing_shows_at_rest() {
    let scene = smoke(0.2);
    let bend = |p: Vec3| vec3(p.y * p.z, 0.3 * p.x, p.x * p.x);
    let alone = rendered(&scene, 0.0, vec![by_vertex(&scene, bend)]);
    let following = rendered(&scene, 0.0, vec![by_vertex(&scene, bend), follows()]);
    assert!(alone.image.pixels.iter().zip(&following.image.pixels).all(|(a, b)| a.mean == b.mean));
}

#[test]
fn what_cannot_ride_says_why() {
    let scene = smoke(0.2);
    let reason = |value: f64, effects: Vec<Effect>| match prepared(
        &scene,
        &[parameter("p", value, effects)],
    ) {
        Err(Error::Effect { parameter, reason, .. }) => {
            assert_eq!(parameter, "p");
            reason.to_string()
        }
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("it should not work"),
    };
    let twist = || by_vertex(&scene, |p| vec3(5.0 * p.z, 0.0, -5.0 * p.x) * p.y);
    let far = reason(3.0, vec![twist(), follows()]);
    assert!(far.contains("deforms too far") && far.contains("nearer to zero"), "{far}");
    let vertex = GeometryChange::Vertex { index: 0, direction: Vec3::X };
    let own = reason(0.1, vec![moves("smoke", vertex)]);
    assert!(own.contains("no vertices"), "{own}");
}
