//! Parameters as data: which changes reach a target, and files.

use drt_math::Vec3;
use drt_motion::parameter::{Applied, geometry_changes, property_changes};
use drt_motion::{Cause, Change, Effect, GeometryChange, Parameter, PropertyChange, ValueChange};

fn effect<T>(target: T, change: Change<T>) -> Effect<T> {
    Effect { target, change }
}

fn shift(x: f64) -> GeometryChange {
    GeometryChange::Translate(Vec3::X * x)
}

fn parameter<T>(name: &str, value: f64, effects: Vec<Effect<T>>) -> Parameter<T> {
    Parameter { name: name.into(), value, effects }
}

#[test]
fn changes_come_in_order_and_followers_ride_along() {
    let parameters = [
        parameter(
            "a",
            0.5,
            vec![
                effect("grid", Change::Geometry(shift(1.0))),
                effect("cube", Change::Geometry(shift(2.0))),
                effect("grid", Change::Follow("cube")),
                effect("cube", Change::Geometry(shift(3.0))),
            ],
        ),
        // The grid follows under "a" alone.
        parameter("b", 0.0, vec![effect("cube", Change::Geometry(shift(4.0)))]),
    ];
    let shifts = |target| -> Vec<(usize, f64, f64)> {
        let changes = geometry_changes(&parameters, &target).unwrap();
        let shift = |c: &Applied<'_, GeometryChange>| c.change.velocity(0.0).unwrap().translation.x;
        changes.iter().map(|c| (c.parameter, c.theta, shift(c))).collect()
    };
    assert_eq!(shifts("cube"), [(0, 0.5, 2.0), (0, 0.5, 3.0), (1, 0.0, 4.0)]);
    assert_eq!(shifts("grid"), [(0, 0.5, 1.0), (0, 0.5, 2.0), (0, 0.5, 3.0)]);
    assert_eq!(shifts("lamp"), []);
}

#[test]
fn following_in_a_circle() {
    let follow = |a, b| effect(a, Change::Follow(b));
    let parameters = [parameter("p", 0.0, vec![follow(1, 2), follow(2, 3), follow(3, 1)])];
    let error = geometry_changes(&parameters, &1).unwrap_err();
    assert_eq!((error.cause, error.change), (Cause::FollowCycle, "follow"));
    let chain = [parameter("p", 0.0, vec![follow(1, 2), follow(2, 3), follow(3, 4)])];
    assert!(geometry_changes(&chain, &1).unwrap().is_empty());
}

fn property(op: ValueChange) -> PropertyChange {
    PropertyChange { property: "sigma_t".into(), op, voxels: None, texels: None }
}

#[test]
fn properties_are_found_by_name() {
    let change = property(ValueChange::Multiply(1.0));
    let parameters = [
        parameter("m", 0.1, vec![effect("cube", Change::Geometry(shift(1.0)))]),
        parameter("s", 0.2, vec![effect("fog", Change::Property(change.clone()))]),
    ];
    let found = property_changes(&parameters, &"fog", "sigma_t");
    assert_eq!(found, [Applied { parameter: 1, theta: 0.2, change: &change }]);
    assert!(property_changes(&parameters, &"fog", "albedo").is_empty());
    assert!(property_changes(&parameters, &"cube", "sigma_t").is_empty());
}

#[cfg(feature = "serde")]
#[test]
fn files_give_back_what_was_written() {
    use crate::common::*;
    use drt_math::{Rgb, Rng};
    use drt_motion::SurfaceMotion;
    use drt_motion::volume::VolumeMotion;

    fn round_trip<T>(value: &T)
    where
        T: serde::Serialize + serde::de::DeserializeOwned + PartialEq + std::fmt::Debug,
    {
        let text = serde_json::to_string(value).unwrap();
        assert_eq!(&serde_json::from_str::<T>(&text).unwrap(), value);
    }
    let mut rng = Rng::new(51, 0, 0);
    let v = random_vec(&mut rng);
    let geometry = [
        GeometryChange::Translate(v),
        GeometryChange::Rotate { axis: v, pivot: Vec3::Y },
        GeometryChange::Scale { factor: v, pivot: Vec3::Y },
        GeometryChange::Matrix(random_affine(&mut rng)),
        GeometryChange::VertexVelocity(random_vecs(&mut rng, 5).into()),
        GeometryChange::Vertex { index: 3, direction: v },
        GeometryChange::Cage {
            mesh: drt_geom::procedural::cube().into(),
            vertices: [(5, v)].into(),
        },
    ];
    let values =
        [ValueChange::Add(Rgb::ONE), ValueChange::Multiply(2.0), ValueChange::MultiplyLog(3.0)];
    let changes = geometry
        .into_iter()
        .map(Change::Geometry)
        .chain(values.map(property).map(Change::Property))
        .chain([Change::Follow("cube".to_string())]);
    let effects = changes.map(|c| effect("grid".to_string(), c)).collect();
    round_trip(&parameter("p", 0.25, effects));

    round_trip(&SurfaceMotion::Rest);
    round_trip(&SurfaceMotion::Affine(random_affine(&mut rng)));
    round_trip(&SurfaceMotion::Vertices {
        positions: random_vecs(&mut rng, 4).into(),
        normals: Some(random_vecs(&mut rng, 4).into()),
    });
    round_trip(&VolumeMotion::Affine(random_affine(&mut rng)));
}
