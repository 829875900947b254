mod lens;
mod mitsuba;
mod motion;
mod orthographic;

use alloc::vec::Vec;

use drt_math::testing::z_score;
use drt_math::{Affine, Dual, Mat3, Moments, Ray, Real, Rng, Vec3, vec3};

use crate::model::filter::{Filter, FilterKind};
use crate::model::sensor::{
    FovAxis, Lens, Pinhole, Sensor, SensorError, SensorGradient, SensorTangent, look_at,
};

fn filter() -> Filter {
    Filter::new(FilterKind::TENT).unwrap()
}

fn random_vec(rng: &mut Rng) -> Vec3 {
    vec3(rng.next_f64(), rng.next_f64(), rng.next_f64()) * 2.0 - Vec3::splat(1.0)
}

fn random_rotation(rng: &mut Rng) -> Mat3 {
    Mat3::rotation(random_vec(rng).normalize(), 6.0 * rng.next_f64())
}

/// A camera anywhere, mirrored every other time.
fn random_sensor(rng: &mut Rng) -> Sensor {
    let mut linear = random_rotation(rng);
    if rng.next_f64() < 0.5 {
        linear.cols[0] = -linear.cols[0];
    }
    let axes = [FovAxis::X, FovAxis::Y, FovAxis::Diagonal, FovAxis::Smaller, FovAxis::Larger];
    let lens = Lens {
        fov_axis: axes[(rng.next_f64() * 5.0) as usize],
        principal_point_offset: rng.next_2d().map(|u| u - 0.5),
        ..Lens::with_fov(20.0 + 100.0 * rng.next_f64())
    };
    let film = rng.next_2d().map(|u| 1 + (u * 300.0) as u32);
    let to_world = Affine { linear, translation: random_vec(rng) * 5.0 };
    Sensor::from_to_world(&to_world, lens, film, filter()).unwrap()
}

fn random_pixel(sensor: &Sensor, rng: &mut Rng) -> [f64; 2] {
    let u = rng.next_2d();
    [0, 1].map(|k| u[k] * f64::from(sensor.film()[k]))
}

#[test]
fn projection_inverts_rays() {
    let mut rng = Rng::new(1, 0, 0);
    for _ in 0..500 {
        let sensor = random_sensor(&mut rng);
        let pixel = random_pixel(&sensor, &mut rng);
        let ray = sensor.ray(pixel);
        assert!((ray.dir.length() - 1.0).abs() < 1e-14);
        let [near, far] = [near(&sensor, &ray), ray.t_max];
        let t = near + (10.0 - near) * rng.next_f64();
        let seen = sensor.project(ray.origin + ray.dir * t).unwrap();
        for k in 0..2 {
            assert!((seen.pixel[k] - pixel[k]).abs() < 1e-9, "{pixel:?} {seen:?}");
        }
        for (t, visible) in
            [(0.999, false), (1.001, true), (0.999 * far / near, true), (1.001 * far / near, false)]
        {
            let x = ray.origin + ray.dir * (t * near);
            assert_eq!(sensor.project(x).is_some(), visible);
        }
        assert!(sensor.project(ray.origin - ray.dir).is_none());
        assert!(sensor.project(ray.origin).is_none());
    }
}

/// Looking along -z with +y up, +x is to the right and y grows upwards: pixel (0, 0) is top left.
#[test]
fn the_image_is_upright() {
    let view = [vec3(0.0, 0.0, 5.0), Vec3::ZERO, Vec3::Y];
    let sensor = Sensor::look_at(view, Lens::with_fov(90.0), [20, 10], filter()).unwrap();
    let at = |x: Vec3| sensor.project(x).unwrap().pixel;
    let close = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() + (a[1] - b[1]).abs() < 1e-12;
    assert!(close(at(Vec3::ZERO), [10.0, 5.0]));
    assert!(close(at(vec3(5.0, 0.0, 0.0)), [20.0, 5.0]));
    assert!(close(at(vec3(-5.0, 2.5, 0.0)), [0.0, 0.0]));
    let p = sensor.pinhole();
    assert!((p.right.cross(p.up) + p.forward).max_abs() < 1e-15);
}

/// How far along its ray a perspective camera's near clip plane is.
fn near(sensor: &Sensor, ray: &Ray) -> f64 {
    let lens = sensor.lens();
    ray.t_max * lens.near / lens.far
}

/// Quadrilateral of random points before the camera, with its area in pixels.
fn random_quad(sensor: &Sensor, rng: &mut Rng) -> ([Vec3; 3], f64) {
    let mut corner = |_| {
        let ray = sensor.ray(random_pixel(sensor, rng));
        ray.origin + ray.dir * (1.0 + 4.0 * rng.next_f64())
    };
    let triangle = [0, 1, 2].map(&mut corner);
    let [a, b, c] = triangle.map(|x| sensor.project(x).unwrap().pixel);
    let area = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
    (triangle, area.abs())
}

/// dx dy of the image is importance times the solid angle: the pixels a triangle covers are the
/// integral over it of importance |n·w|/r².
#[test]
fn importance_is_the_density_of_pixels_in_solid_angle() {
    let mut rng = Rng::new(2, 0, 0);
    for _ in 0..5 {
        let sensor = random_sensor(&mut rng);
        let ([a, b, c], area) = random_quad(&sensor, &mut rng);
        let normal = (b - a).cross(c - a) * 0.5;
        let (mut right, mut wrong) = (Moments::ZERO, Moments::ZERO);
        for _ in 0..100_000 {
            let [u, v] = rng.next_2d();
            let [u, v] = if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] };
            let x = a + (b - a) * u + (c - a) * v;
            let d = x - sensor.position();
            let r = d.length();
            let p = sensor.project(x).unwrap();
            let geometric = normal.dot(d).abs() / (r * r * r);
            right.push(p.importance * geometric / area);
            // With a cosine at the pinhole, as if it were a surface.
            wrong.push(p.importance * geometric / area * p.depth / r);
        }
        assert!(z_score(&right, 1.0).abs() < 4.0, "{right:?}");
        assert!(right.standard_error() < 0.01, "{right:?}");
        assert!(z_score(&wrong, 1.0).abs() > 4.0, "{wrong:?}");
    }
}

const LANES: usize = 18;
type D = Dual<f64, LANES>;

fn variables(v: Vec3, first: usize) -> Vec3<D> {
    vec3(D::variable(v.x, first), D::variable(v.y, first + 1), D::variable(v.z, first + 2))
}

/// A pinhole whose every number is an independent variable; lanes 0 to 2 are left to the point.
fn dual_pinhole(p: &Pinhole) -> Pinhole<D> {
    Pinhole {
        position: variables(p.position, 3),
        right: variables(p.right, 6),
        up: variables(p.up, 9),
        forward: variables(p.forward, 12),
        pixel_size: D::variable(p.pixel_size, 15),
        principal: [D::variable(p.principal[0], 16), D::variable(p.principal[1], 17)],
    }
}

fn flatten(point: Vec3, g: &SensorGradient) -> Vec<f64> {
    [point, g.position, g.right, g.up, g.forward]
        .into_iter()
        .flat_map(Vec3::to_array)
        .chain([g.pixel_size, g.principal[0], g.principal[1]])
        .collect()
}

#[test]
fn projection_gradients_are_those_of_duals() {
    let mut rng = Rng::new(3, 0, 0);
    for _ in 0..300 {
        let sensor = random_sensor(&mut rng);
        let ray = sensor.ray(random_pixel(&sensor, &mut rng));
        let x = ray.origin + ray.dir * (near(&sensor, &ray) * (1.5 + 500.0 * rng.next_f64()));
        let adjoints = random_vec(&mut rng);
        let p = sensor.project(x).unwrap();
        let (point, camera) =
            sensor.pinhole().projection_gradient(&p, [adjoints.x, adjoints.y], adjoints.z);
        let dual = dual_pinhole(sensor.pinhole()).project(variables(x, 0));
        let sum = dual.pixel[0] * adjoints.x
            + dual.pixel[1] * adjoints.y
            + dual.importance.ln() * adjoints.z;
        let scale = sum.eps.iter().fold(0.0, |m: f64, e| m.max(e.abs()));
        for (mine, dual) in flatten(point, &camera).iter().zip(sum.eps) {
            assert!((mine - dual).abs() < 1e-11 * scale, "{mine} {dual}");
        }
    }
}

fn random_tangent(rng: &mut Rng) -> SensorTangent {
    SensorTangent {
        position: random_vec(rng),
        right: random_vec(rng),
        up: random_vec(rng),
        forward: random_vec(rng),
        pixel_size: rng.next_f64(),
        principal: rng.next_2d(),
        ..SensorTangent::default()
    }
}

#[test]
fn direction_rates_are_those_of_duals() {
    let mut rng = Rng::new(4, 0, 0);
    for _ in 0..200 {
        let sensor = random_sensor(&mut rng);
        let pixel = random_pixel(&sensor, &mut rng);
        let tangent = random_tangent(&mut rng);
        let rate = sensor.pinhole().direction_rate(pixel, &tangent);
        let dual = dual_pinhole(sensor.pinhole()).view(pixel.map(D::from)).normalize();
        for (k, mine) in rate.to_array().into_iter().enumerate() {
            // A direction's lanes as the gradient of one of its coordinates.
            let e = dual[k].eps;
            let v = |i: usize| vec3(e[i], e[i + 1], e[i + 2]);
            let gradient = SensorGradient {
                position: v(3),
                right: v(6),
                up: v(9),
                forward: v(12),
                pixel_size: e[15],
                principal: [e[16], e[17]],
                ..SensorGradient::default()
            };
            let expected = gradient.dot(&tangent);
            assert!((mine - expected).abs() < 1e-10 * (1.0 + expected.abs()));
        }
    }
}

#[test]
fn footprints_hold_every_pixel_that_counts() {
    let view = [Vec3::Z, Vec3::ZERO, Vec3::Y];
    let mut rng = Rng::new(5, 0, 0);
    for kind in [FilterKind::BOX, FilterKind::TENT, FilterKind::MITCHELL, FilterKind::GAUSSIAN] {
        let filter = Filter::new(kind).unwrap();
        let sensor = Sensor::look_at(view, Lens::default(), [9, 6], filter.clone()).unwrap();
        for _ in 0..200 {
            let [u, v] = rng.next_2d();
            let point = [13.0 * u - 2.0, 10.0 * v - 2.0];
            let found: Vec<_> = sensor.footprint(point).collect();
            let mut expected = 0;
            for (i, j) in (0..6).flat_map(|j| (0..9).map(move |i| (i, j))) {
                let offset = [point[0] - f64::from(i) - 0.5, point[1] - f64::from(j) - 0.5];
                let weight = filter.eval(offset[0], offset[1]);
                let hit: Vec<_> = found.iter().filter(|p| p.pixel == [i, j]).collect();
                assert!(hit.len() <= 1 && (weight == 0.0 || hit.len() == 1));
                for p in hit {
                    assert!((p.weight - weight).abs() < 1e-13, "{} {weight}", p.weight);
                    let gradient = filter.gradient(offset[0], offset[1]);
                    let off = |k: usize| (p.gradient[k] - gradient[k]).abs();
                    assert!(off(0) < 1e-13 && off(1) < 1e-13, "{:?} {gradient:?}", p.gradient);
                    expected += 1;
                }
            }
            assert_eq!(found.len(), expected);
            let inside = (2.0..7.0).contains(&point[0]) && (2.0..4.0).contains(&point[1]);
            if inside && kind != FilterKind::GAUSSIAN {
                let total: f64 = found.iter().map(|p| p.weight).sum();
                assert!((total - 1.0).abs() < 1e-12);
            }
        }
        for off in
            [[-5.0, 3.0], [3.0, 20.0], [f64::NAN, 3.0], [3.0, f64::INFINITY], [-1e300, 1e300]]
        {
            assert_eq!(sensor.footprint(off).count(), 0);
        }
    }
}

#[test]
fn unusable_cameras_are_named() {
    let film = [4, 3];
    let build = |m: &Affine, lens| Sensor::from_to_world(m, lens, film, filter());
    for fov in [0.0, -10.0, 180.0, 200.0, f64::NAN] {
        let error = build(&Affine::IDENTITY, Lens::with_fov(fov)).unwrap_err();
        assert!(matches!(error, SensorError::FieldOfView(_)), "{error}");
    }
    let lens = Lens::default();
    for clip in [[0.0, 1.0], [2.0, 1.0], [f64::NAN, 1.0]] {
        let lens = Lens { near: clip[0], far: clip[1], ..lens };
        assert!(matches!(build(&Affine::IDENTITY, lens), Err(SensorError::Clip { .. })));
    }
    let off = Lens { principal_point_offset: [f64::NAN, 0.0], ..lens };
    assert!(matches!(build(&Affine::IDENTITY, off), Err(SensorError::NotFinite(_))));
    for linear in [Mat3::ZERO, Mat3::IDENTITY * 2.0, Mat3::diagonal(vec3(1.0, 1.001, 1.0))] {
        let error = build(&Affine { linear, ..Affine::IDENTITY }, lens).unwrap_err();
        assert_eq!(error, SensorError::NotRigid);
    }
    let nan = Affine::translation(vec3(0.0, f64::NAN, 0.0));
    assert_eq!(build(&nan, lens), Err(SensorError::NotFinite("to_world")));
    let sensor = build(&Affine::IDENTITY, lens).unwrap();
    assert_eq!(sensor.with_film([0, 3]), Err(SensorError::FilmSize([0, 3])));
    assert_eq!(look_at(Vec3::X, Vec3::X, Vec3::Y), Err(SensorError::NoDirection));
    for up in [Vec3::ZERO, Vec3::X, Vec3::X * -3.0] {
        assert_eq!(look_at(Vec3::ZERO, Vec3::X, up), Err(SensorError::NoUp));
    }
    let scaled = look_at(Vec3::ZERO, Vec3::X * 1e-200, Vec3::Y * 1e200).unwrap();
    assert!((scaled.linear.determinant() - 1.0).abs() < 1e-14);
}
