use drt_math::Rgb;

use crate::model::sensor::tests::*;

fn random_mat3(rng: &mut Rng) -> Mat3 {
    Mat3 { cols: [0; 3].map(|_| random_vec(rng)) }
}

fn frame(s: &Sensor) -> [Vec3; 4] {
    let p = s.pinhole();
    [p.position, p.right, p.up, p.forward]
}

fn tangent_frame(t: &SensorTangent) -> [Vec3; 4] {
    [t.position, t.right, t.up, t.forward]
}

#[test]
fn velocities_are_derivatives_of_motions() {
    let mut rng = Rng::new(10, 0, 0);
    let h = 1e-5;
    for _ in 0..100 {
        let sensor = random_sensor(&mut rng);
        let field = Affine { linear: random_mat3(&mut rng), translation: random_vec(&mut rng) };
        let at =
            |theta: f64| frame(&sensor.moved(&Affine::IDENTITY.plus(&field.times(theta))).unwrap());
        let tangent = tangent_frame(&sensor.velocity(&field));
        for ((plus, minus), rate) in at(h).into_iter().zip(at(-h)).zip(tangent) {
            let difference = (plus - minus) / (2.0 * h);
            assert!((difference - rate).max_abs() < 1e-7 * (1.0 + rate.max_abs()));
        }
    }
}

#[test]
fn moving_in_steps_is_moving_at_once() {
    let mut rng = Rng::new(11, 0, 0);
    for _ in 0..100 {
        let sensor = random_sensor(&mut rng);
        let [a, b] = [0; 2].map(|_| Affine {
            linear: Mat3::IDENTITY + random_mat3(&mut rng) * 0.5,
            translation: random_vec(&mut rng),
        });
        let steps = sensor.moved(&a).unwrap().moved(&b).unwrap();
        let once = sensor.moved(&b.after(&a)).unwrap();
        for (s, o) in frame(&steps).into_iter().zip(frame(&once)) {
            assert!((s - o).max_abs() < 1e-9, "{s:?} {o:?}");
        }
    }
}

/// Moving camera and scene together changes nothing.
#[test]
fn a_common_rigid_motion_has_no_rate() {
    let mut rng = Rng::new(12, 0, 0);
    for _ in 0..100 {
        let sensor = random_sensor(&mut rng);
        let turn = Affine::about(Mat3::skew(random_vec(&mut rng)), random_vec(&mut rng));
        let field = Affine { linear: turn.linear, translation: random_vec(&mut rng) };
        let ray = sensor.ray(random_pixel(&sensor, &mut rng));
        let x = ray.origin + ray.dir * 3.0;
        let p = sensor.project(x).unwrap();
        let tangent = sensor.velocity(&field);
        for (pixel, importance) in [([1.0, 0.0], 0.0), ([0.0, 1.0], 0.0), ([0.0, 0.0], 1.0)] {
            let (point, camera) = sensor.pinhole().projection_gradient(&p, pixel, importance);
            let [alone, along] = [camera.dot(&tangent), point.dot(field.point(x))];
            assert!((alone + along).abs() < 1e-11 * (1.0 + along.abs()), "{alone} {along}");
        }
    }
}

#[test]
fn property_rates_are_finite_differences() {
    let mut rng = Rng::new(13, 0, 0);
    let h = 1e-5;
    for _ in 0..50 {
        let sensor = random_sensor(&mut rng);
        for name in ["fov", "principal_point_offset_x", "principal_point_offset_y"] {
            let value = sensor.property(name).unwrap();
            let at = |theta: f64| {
                let changed = sensor.with_property(name, value + Rgb::splat(theta)).unwrap();
                let p = *changed.pinhole();
                [p.pixel_size, p.principal[0], p.principal[1]]
            };
            let t = sensor.property_tangent(name, Rgb::ONE).unwrap();
            assert!(!t.is_zero());
            let rates = [t.pixel_size, t.principal[0], t.principal[1]];
            for ((plus, minus), rate) in at(h).into_iter().zip(at(-h)).zip(rates) {
                let difference = (plus - minus) / (2.0 * h);
                assert!((difference - rate).abs() < 1e-6 * (1.0 + rate.abs()));
            }
        }
    }
}

#[test]
fn unusable_changes_are_named() {
    let mut rng = Rng::new(14, 0, 0);
    let sensor = random_sensor(&mut rng);
    assert_eq!(sensor.moved(&Affine::ZERO), Err(SensorError::Flattened));
    let far = Affine::translation(Vec3::splat(f64::INFINITY));
    assert!(matches!(sensor.moved(&far), Err(SensorError::NotFinite(_))));
    assert_eq!(sensor.property("radiance"), Err(SensorError::UnknownProperty("radiance".into())));
    let uneven = Rgb::new(1.0, 2.0, 1.0);
    assert_eq!(sensor.property_tangent("fov", uneven), Err(SensorError::NotScalar("fov")));
    let wide = sensor.with_property("fov", Rgb::splat(180.0));
    assert_eq!(wide, Err(SensorError::FieldOfView(180.0)));
}
