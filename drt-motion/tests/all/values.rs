//! Changes of numbers and colours, against differences.

use drt_math::Rgb;
use drt_motion::parameter::{Applied, change_value};
use drt_motion::{Cause, PropertyChange, ValueChange};

fn property(op: ValueChange) -> PropertyChange {
    PropertyChange { property: "sigma_t".into(), op, voxels: None, texels: None }
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
