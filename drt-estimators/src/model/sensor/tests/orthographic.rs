//! Cameras of parallel rays; rays of Mitsuba 3.9.1 (`scalar_rgb`), single precision.

use drt_math::Rgb;

use crate::model::sensor::orthographic::{project, projection_gradient, ray_gradient};
use crate::model::sensor::tests::*;

fn lens() -> Lens {
    Lens { near: 0.5, far: 20.0, ..Lens::default() }
}

fn random_camera(rng: &mut Rng) -> Sensor {
    let mut linear = random_rotation(rng) * (0.3 + 3.0 * rng.next_f64());
    if rng.next_f64() < 0.5 {
        linear.cols[0] = -linear.cols[0];
    }
    let film = rng.next_2d().map(|u| 1 + (u * 300.0) as u32);
    let to_world = Affine { linear, translation: random_vec(rng) * 5.0 };
    Sensor::orthographic(&to_world, lens(), film, filter()).unwrap()
}

/// Scales of the film, and where the ray through pixel coordinates (1.25, 2) of 8 by 6 starts.
const RAYS: [([f64; 3], [f64; 3]); 3] = [
    ([1.0, 1.0, 1.0], [0.784252, 2.04642, 2.14183]),
    ([2.5, 2.5, 1.0], [0.0428146, 2.3946, 1.41166]),
    ([2.5, 2.5, 2.5], [0.460629, 2.11606, 0.854578]),
];

#[test]
fn rays_are_those_of_mitsuba() {
    let view = look_at(vec3(1.0, 2.0, 3.0), vec3(4.0, 0.0, -1.0), Vec3::Y).unwrap();
    for ([x, y, z], origin) in RAYS {
        let linear = view.linear * Mat3::diagonal(vec3(x, y, z));
        let sensor =
            Sensor::orthographic(&Affine { linear, ..view }, lens(), [8, 6], filter()).unwrap();
        let ray = sensor.ray([1.25, 2.0]);
        assert!((ray.origin - Vec3::from(origin)).max_abs() < 1e-5, "{ray:?}");
        assert!((ray.dir - vec3(0.557086, -0.371391, -0.742781)).max_abs() < 1e-6);
    }
}

#[test]
fn projection_inverts_rays() {
    let mut rng = Rng::new(21, 0, 0);
    for _ in 0..300 {
        let sensor = random_camera(&mut rng);
        let pixel = random_pixel(&sensor, &mut rng);
        let ray = sensor.ray(pixel);
        let t = ray.t_max * rng.next_f64();
        let x = ray.origin + ray.dir * t;
        let seen = sensor.project(x).unwrap();
        for (seen, pixel) in seen.pixel.iter().zip(pixel) {
            assert!((seen - pixel).abs() < 1e-9 * (1.0 + pixel));
        }
        assert!((seen.depth - t).abs() < 1e-12 * (1.0 + t));
        assert!((sensor.eye_of(x) - ray.origin).max_abs() < 1e-12);
        assert!(sensor.project(ray.origin - ray.dir * 1e-3).is_none());
        assert!(sensor.project(ray.origin + ray.dir * (1.001 * ray.t_max)).is_none());
        let again = sensor.with_film(sensor.film()).unwrap();
        assert!((again.ray(pixel).origin - ray.origin).max_abs() < 1e-12);
    }
}

/// The pixels that a triangle covers are the integral over it of importance |n·w|/r².
#[test]
fn importance_takes_the_distance_out() {
    let mut rng = Rng::new(22, 0, 0);
    for _ in 0..3 {
        let sensor = random_camera(&mut rng);
        let ([a, b, c], area) = random_quad(&sensor, &mut rng);
        let normal = (b - a).cross(c - a) * 0.5;
        let (mut right, mut wrong) = (Moments::ZERO, Moments::ZERO);
        for _ in 0..20_000 {
            let [u, v] = rng.next_2d();
            let [u, v] = if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] };
            let x = a + (b - a) * u + (c - a) * v;
            let d = x - sensor.eye_of(x);
            let (r, p) = (d.length(), sensor.project(x).unwrap());
            let geometric = normal.dot(d).abs() / (r * r * r);
            right.push(p.importance * geometric / area);
            // The density per area of a film one away, its 1/r² kept.
            wrong.push(sensor.view(x - d * (1.0 - 1.0 / r)).importance * geometric / area);
        }
        assert!((right.mean() - 1.0).abs() < 1e-9, "{right:?}");
        assert!(z_score(&wrong, 1.0).abs() > 4.0, "{wrong:?}");
    }
}

#[test]
fn gradients_are_those_of_duals() {
    let mut rng = Rng::new(23, 0, 0);
    for _ in 0..200 {
        let sensor = random_camera(&mut rng);
        let camera = sensor.pinhole();
        let pixel = random_pixel(&sensor, &mut rng);
        let ray = sensor.ray(pixel);
        let x = ray.origin + ray.dir * (1.0 + 5.0 * rng.next_f64());
        let (adjoints, film) = (random_vec(&mut rng), random_vec(&mut rng));
        let dual = dual_pinhole(camera);
        let close = |point: Vec3, gradient: &SensorGradient, sum: D| {
            let scale = sum.eps.iter().fold(0.0, |m: f64, e| m.max(e.abs()));
            for (mine, dual) in flatten(point, gradient).iter().zip(sum.eps) {
                assert!((mine - dual).abs() < 1e-11 * scale, "{mine} {dual}");
            }
        };
        let p = sensor.view(x);
        let (point, gradient) =
            projection_gradient(camera, &p, [adjoints.x, adjoints.y], adjoints.z);
        let seen = project(&dual, variables(x, 0));
        let sum = seen.pixel[0] * adjoints.x + seen.pixel[1] * adjoints.y;
        close(point, &gradient, sum + seen.importance.ln() * adjoints.z);
        // The film's point that sees x.
        let (point, gradient) = sensor.film_gradient(&p, film);
        let eye = variables(x, 0) - dual.forward * seen.depth;
        close(point, &gradient, eye.dot(film.lift::<D>()));
        // The ray of an image point.
        let gradient = ray_gradient(camera, ray.origin, film, adjoints);
        let [a, b] = dual.plane(pixel.map(D::from));
        let origin = dual.position + dual.right * a + dual.up * b;
        let sum = origin.dot(film.lift::<D>()) + dual.forward.dot(adjoints.lift::<D>());
        close(Vec3::ZERO, &gradient, sum);
    }
}

#[test]
fn velocities_are_derivatives_of_motions() {
    let mut rng = Rng::new(24, 0, 0);
    let h = 1e-5;
    for _ in 0..50 {
        let sensor = random_camera(&mut rng);
        let (axis, growth) = (random_vec(&mut rng).normalize(), rng.next_f64() - 0.5);
        let linear = Mat3::skew(axis) + Mat3::IDENTITY * growth;
        let field = Affine { linear, translation: random_vec(&mut rng) };
        let at = |theta: f64| {
            let grown = Mat3::rotation(axis, theta) * (1.0 + theta * growth);
            sensor.moved(&Affine { linear: grown, translation: field.translation * theta }).unwrap()
        };
        sensor.check_velocity(&field).unwrap();
        let tangent = sensor.velocity(&field);
        let (plus, minus) = (at(h), at(-h));
        let [p, m] = [plus.pinhole(), minus.pinhole()];
        let pairs = [
            (p.position - m.position, tangent.position),
            (p.right - m.right, tangent.right),
            (p.up - m.up, tangent.up),
            (p.forward - m.forward, tangent.forward),
            (Vec3::X * (p.pixel_size - m.pixel_size), Vec3::X * tangent.pixel_size),
        ];
        for (difference, rate) in pairs {
            let difference = difference / (2.0 * h);
            assert!((difference - rate).max_abs() < 1e-7 * (1.0 + rate.max_abs()));
        }
    }
}

#[test]
fn what_is_no_orthographic_camera_is_named() {
    let sensor = random_camera(&mut Rng::new(25, 0, 0));
    let build = |linear| {
        let to_world = Affine { linear, ..Affine::IDENTITY };
        Sensor::orthographic(&to_world, lens(), [4, 3], filter()).map(|_| ())
    };
    let mut sheared = Mat3::IDENTITY;
    sheared.cols[2].x = 0.3;
    for linear in [Mat3::diagonal(vec3(1.0, 2.0, 1.0)), sheared, Mat3::ZERO] {
        assert_eq!(build(linear), Err(SensorError::Oblong));
    }
    assert_eq!(build(Mat3::IDENTITY * 3.0), Ok(()));
    let stretch = Affine { linear: Mat3::diagonal(vec3(1.0, 0.0, 0.0)), ..Affine::ZERO };
    assert_eq!(sensor.check_velocity(&stretch), Err(SensorError::Oblong));
    assert_eq!(sensor.property("fov"), Err(SensorError::NoProperties("fov".into())));
    assert!(sensor.with_property("fov", Rgb::ONE).is_err());
    assert!(sensor.property_tangent("fov", Rgb::ONE).is_err());
}
