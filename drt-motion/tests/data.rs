//! Parameters as data: which changes reach a target, values of properties, and files.

mod common;

use common::*;
use drt_math::{Affine, Rgb, Rng, Vec3};
use drt_motion::{
    Applied, Cause, Change, Effect, GeometryChange, Parameter, PropertyChange, SurfaceMotion,
    ValueChange, VolumeMotion, change_value, geometry_changes, inside_motion, property_changes,
};

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
    PropertyChange { property: "sigma_t".into(), op, voxels: None }
}

#[test]
fn a_value_and_its_rate() {
    let value = Rgb::new(0.5, 1.0, 2.0);
    let h = 1e-5;
    for op in [
        ValueChange::Add(Rgb::new(1.0, -2.0, 0.3)),
        ValueChange::Multiply(0.7),
        ValueChange::MultiplyLog(-1.3),
    ] {
        for theta in [-0.4, 0.0, 0.8] {
            let slope = (op.at(value, theta + h) - op.at(value, theta - h)) / (2.0 * h);
            let after = op.at(value, theta);
            assert!((op.rate(after, theta) - slope).max_abs() < 1e-9);
            assert!((op.map_rate(theta).value(value) - slope).max_abs() < 1e-9);
        }
    }
}

#[test]
fn changes_of_one_value_compose() {
    let ops = [
        property(ValueChange::Multiply(0.5)),
        property(ValueChange::Add(Rgb::new(1.0, 2.0, 3.0))),
        property(ValueChange::MultiplyLog(0.9)),
        PropertyChange { voxels: Some([1, 0, 2]), ..property(ValueChange::Add(Rgb::ONE)) },
    ];
    let value = Rgb::new(0.3, 0.6, 0.9);
    let at = |values: [f64; 2], voxel| {
        let applied: Vec<_> = ops
            .iter()
            .enumerate()
            .map(|(i, change)| Applied { parameter: i % 2, theta: values[i % 2], change })
            .collect();
        change_value(&applied, voxel, 2).unwrap()
    };
    let h = 1e-5;
    // theta = -2 wipes the value out: its rate survives.
    for theta in [0.3, -2.0] {
        for voxel in [None, Some([1, 0, 2]), Some([0, 0, 0])] {
            let here = at([theta, -0.2], voxel);
            for (p, d) in [[h, 0.0], [0.0, h]].into_iter().enumerate() {
                let plus = at([theta + d[0], -0.2 + d[1]], voxel).map.value(value);
                let minus = at([theta - d[0], -0.2 - d[1]], voxel).map.value(value);
                let slope = (plus - minus) / (2.0 * h);
                assert!((here.rates[p].value(value) - slope).max_abs() < 1e-8);
            }
        }
        assert_eq!(at([theta, 0.1], None), at([theta, 0.1], Some([0, 0, 0])));
        assert_ne!(at([theta, 0.1], None).map, at([theta, 0.1], Some([1, 0, 2])).map);
    }
}

#[test]
fn values_that_cannot_be() {
    let change = property(ValueChange::MultiplyLog(1.0));
    let applied = |parameter, theta| [Applied { parameter, theta, change: &change }];
    let cause = |p, theta| change_value(&applied(p, theta), None, 1).unwrap_err().cause;
    assert!(matches!(cause(0, f64::NAN), Cause::NotFinite { .. }));
    assert!(matches!(cause(0, 1e4), Cause::NotFinite { .. }));
    assert_eq!(cause(1, 0.0), Cause::ParameterIndex { count: 1 });
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

#[test]
fn the_inside_follows_a_boundary_that_moves_as_one() {
    let mut rng = Rng::new(50, 0, 0);
    let field = random_affine(&mut rng);
    let (affine, other) = (SurfaceMotion::Affine(field), random_affine(&mut rng));
    let other = SurfaceMotion::Affine(other);
    let rest = SurfaceMotion::Rest;
    let still = SurfaceMotion::Affine(Affine::ZERO);
    let vertices =
        SurfaceMotion::Vertices { positions: random_vecs(&mut rng, 3).into(), normals: None };

    let choice = |boundary: &[&SurfaceMotion]| {
        let inside = inside_motion(boundary);
        (inside.motion, inside.flux)
    };
    assert_eq!(choice(&[]), (VolumeMotion::Static, false));
    assert_eq!(choice(&[&rest, &still]), (VolumeMotion::Static, false));
    assert_eq!(choice(&[&affine, &affine]), (VolumeMotion::Affine(field), false));
    for mixed in [[&affine, &rest], [&rest, &affine], [&affine, &other], [&vertices, &vertices]] {
        assert_eq!(choice(&mixed), (VolumeMotion::Static, true));
    }
    assert!(VolumeMotion::Static.is_rest() && VolumeMotion::Affine(Affine::ZERO).is_rest());
    let jet = VolumeMotion::Static.jet(Vec3::X);
    assert_eq!((jet.u, jet.j_dot), (Vec3::ZERO, 0.0));
}

#[cfg(feature = "serde")]
#[test]
fn files_give_back_what_was_written() {
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
