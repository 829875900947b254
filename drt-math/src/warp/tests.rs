use alloc::vec::Vec;
use core::f64::consts::PI;

use super::*;
use crate::testing::{SIGNIFICANCE, interval_chi_square, rectangle_chi_square, sphere_chi_square};
use crate::{Rng, Vec3, fm, vec3};

const N: u32 = 400_000;

fn planar<P>(seed: u64, warp: impl Fn([f64; 2]) -> P) -> Vec<P> {
    let mut rng = Rng::new(seed, 0, 0);
    (0..N).map(|_| warp(rng.next_2d())).collect()
}

fn linear(seed: u64, warp: impl Fn(f64) -> f64) -> Vec<f64> {
    planar(seed, |u| warp(u[0]))
}

/// The warp follows its density, and a density off by two percent is told apart.
#[track_caller]
fn assert_sphere(warp: impl Fn([f64; 2]) -> Vec3, pdf: impl Fn(Vec3) -> f64) {
    let samples = planar(11, warp);
    assert!(samples.iter().all(|w| (w.length() - 1.0).abs() < 1e-14 && pdf(*w) > 0.0));
    let p = |pdf: &dyn Fn(Vec3) -> f64| sphere_chi_square(samples.iter().copied(), pdf);
    assert!(p(&pdf) > SIGNIFICANCE, "p = {}", p(&pdf));
    assert!(p(&|w| 0.98 * pdf(w)) < SIGNIFICANCE, "p = {}", p(&|w| 0.98 * pdf(w)));
    assert!(p(&|w| pdf(w) * (1.0 + 0.05 * w.x)) < SIGNIFICANCE);
}

#[track_caller]
fn assert_interval(range: [f64; 2], warp: impl Fn(f64) -> f64, pdf: impl Fn(f64) -> f64) {
    let samples = linear(12, warp);
    let p = |pdf: &dyn Fn(f64) -> f64| interval_chi_square(samples.iter().copied(), range, pdf);
    assert!(p(&pdf) > SIGNIFICANCE, "p = {}", p(&pdf));
    let tilt = |x: f64| 0.95 + 0.1 * (x - range[0]) / (range[1] - range[0]);
    assert!(p(&|x| pdf(x) * tilt(x)) < SIGNIFICANCE);
}

#[test]
fn disk_and_triangle_are_uniform() {
    let p = rectangle_chi_square(
        planar(1, concentric_disk),
        [-1.0, -1.0],
        [1.0, 1.0],
        concentric_disk_pdf,
    );
    assert!(p > SIGNIFICANCE, "{p}");
    let corners = planar(2, |u| {
        let [a, b, _] = uniform_triangle(u);
        [a, b]
    });
    let pdf = |[a, b]: [f64; 2]| uniform_triangle_pdf([a, b, 1.0 - a - b]);
    let p = rectangle_chi_square(corners.iter().copied(), [0.0, 0.0], [1.0, 1.0], pdf);
    assert!(p > SIGNIFICANCE, "{p}");
    let p = rectangle_chi_square(corners, [0.0, 0.0], [1.0, 1.0], |[a, b]| {
        pdf([a, b]) * (1.0 + 0.05 * (a - b))
    });
    assert!(p < SIGNIFICANCE, "{p}");
}

#[test]
fn directions_follow_their_densities() {
    assert_sphere(cosine_hemisphere, cosine_hemisphere_pdf);
    assert_sphere(uniform_sphere, |_| uniform_sphere_pdf());
    assert_sphere(uniform_hemisphere, uniform_hemisphere_pdf);
    for cos_max in [-0.6, 0.3, 0.9] {
        extern crate std;
        std::eprintln!("{cos_max}");
        assert_sphere(|u| uniform_cone(u, cos_max), |w| uniform_cone_pdf(w, cos_max));
    }
}

#[test]
fn narrow_cones_stay_narrow() {
    let cos_max = 1.0 - 1e-12;
    for cos in [-0.7, 0.1, 0.3, cos_max] {
        assert!(uniform_cone_pdf(uniform_cone([1.0 - 1e-16, 0.3], cos), cos) > 0.0);
    }
    for w in planar(3, |u| uniform_cone(u, cos_max)) {
        assert!(fm::sqrt(w.x * w.x + w.y * w.y) <= fm::sqrt(2.01e-12) && w.is_finite());
    }
}

#[test]
fn intervals_follow_their_densities() {
    assert_interval([-1.5, 1.5], |u| tent(u, 1.5), |x| tent_pdf(x, 1.5));
    assert_interval([0.0, PI], sin_squared_polar, sin_squared_polar_pdf);
    for (sigma, t_max) in [(0.0, 2.0), (1e-9, 2.0), (0.7, 2.0), (9.0, 2.0)] {
        assert_interval(
            [0.0, t_max],
            |u| truncated_exponential(u, sigma, t_max),
            |t| truncated_exponential_pdf(t, sigma, t_max),
        );
    }
}

#[test]
fn truncated_exponential_is_continuous_down_to_no_extinction() {
    for u in [1e-16, 0.3, 0.999_999] {
        for sigma in [1e-320, 1e-200, 1e-30, 1e-17, 1e-16, 1e-12] {
            let t = truncated_exponential(u, sigma, 5.0);
            assert!((t / (5.0 * u) - 1.0).abs() < 1e-11, "{u} {sigma} {t}");
            assert!((truncated_exponential_pdf(t, sigma, 5.0) * 5.0 - 1.0).abs() < 1e-11);
        }
    }
    let t = truncated_exponential(0.5, 2.0, f64::INFINITY);
    assert!((t - 0.5 * core::f64::consts::LN_2).abs() < 1e-15);
    assert!((truncated_exponential_pdf(t, 2.0, f64::INFINITY) - 1.0).abs() < 1e-15);
    assert!(truncated_exponential(1.0 - 1e-16, 1e6, 3.0) <= 3.0);
}

#[test]
fn sin_squared_inverts_its_distribution_to_rounding() {
    let cdf = |t: f64| (t - 0.5 * fm::sin(2.0 * t)) / PI;
    for i in 1..2000 {
        let u = f64::from(i) / 2000.0;
        assert!((cdf(sin_squared_polar(u)) - u).abs() < 4e-16, "{u}");
    }
    // Near the poles theta^3 = 3 pi u / 2, and the two halves mirror each other.
    for u in [1e-300, 1e-30, 1e-18] {
        let theta = sin_squared_polar(u);
        assert!((theta / fm::cbrt(1.5 * PI * u) - 1.0).abs() < 1e-11, "{u} {theta}");
    }
    assert_eq!(sin_squared_polar(0.0), 0.0);
    assert_eq!(sin_squared_polar(1.0), PI);
    assert!((sin_squared_polar(0.5) - 0.5 * PI).abs() < 1e-8);
}

#[test]
fn equiangular_follows_its_density() {
    let direction = vec3(2.0, -1.0, 0.5).normalize();
    for (point, t_min) in [
        (vec3(1.0, 0.2, 0.3), 0.0),
        (vec3(-3.0, 0.2, 0.3), 0.2),
        (vec3(9.0, -3.0, 0.3), 0.0),
        (direction * -0.5, 0.0),
        (direction * 5.0 + vec3(1e-7, 0.0, 0.0), 0.0),
        (vec3(1e7, 3e7, -2e7), 0.0),
    ] {
        let along = Equiangular::new(Vec3::ZERO, direction, point, t_min, 4.0);
        assert_interval([t_min, 4.0], |u| along.sample(u), |t| along.pdf(t));
    }
    // An endless ray: count what falls on its first part.
    let along = Equiangular::new(Vec3::ZERO, direction, vec3(1.0, 0.2, 0.3), 0.0, f64::INFINITY);
    assert_interval([0.0, 6.0], |u| along.sample(u), |t| along.pdf(t));
}

#[test]
fn equiangular_bears_a_point_on_the_ray() {
    let endless = Equiangular::new(Vec3::ZERO, Vec3::X, Vec3::ZERO, 0.0, f64::INFINITY);
    assert!(endless.sample(0.5).is_finite() && endless.pdf(endless.sample(0.5)).is_finite());
    for x in [-1.0, 0.0, 0.5, 2.0, 3.0] {
        let along = Equiangular::new(Vec3::ZERO, Vec3::X, vec3(x, 0.0, 0.0), 0.0, 2.0);
        for u in [1e-16, 0.25, 0.5, 1.0 - 1e-16] {
            let t = along.sample(u);
            assert!((0.0..=2.0).contains(&t), "{x} {u} {t}");
            assert!(along.pdf(t).is_finite() && along.pdf(t) > 0.0);
        }
    }
}

#[test]
fn spherical_triangles_follow_their_densities() {
    let octant = SphericalTriangle::new(Vec3::ZERO, [Vec3::Y, Vec3::X, Vec3::Z]).unwrap();
    assert!((octant.solid_angle() - 0.5 * PI).abs() < 1e-15);
    let eye = vec3(0.1, -0.2, 0.3);
    let wide = [vec3(3.0, 0.1, 0.2), vec3(-2.0, 1.5, -0.1), vec3(-1.0, -2.0, 0.9)];
    let slim = [vec3(1.0, 1.0, 0.0), vec3(1.0, -1.0, 0.1), vec3(1.0, 0.3, 0.4)];
    for corners in [wide, slim] {
        let triangle = SphericalTriangle::new(eye, corners).unwrap();
        let near = |w: Vec3| if triangle.pdf(w) > 0.0 { triangle.pdf(w) } else { 0.0 };
        let samples = planar(5, |u| triangle.sample(u));
        let p = sphere_chi_square(samples.iter().copied(), near);
        assert!(p > SIGNIFICANCE, "{p} {}", triangle.solid_angle());
        let p = sphere_chi_square(samples, |w| near(w) * (1.0 + 0.06 * w.x));
        assert!(p < SIGNIFICANCE, "{p}");
    }
}

#[test]
fn small_spherical_triangles_keep_their_digits() {
    // Far away the projection is parallel: the solid angle is area times cosine over distance
    // squared, and the samples' barycentric coordinates are uniform.
    for distance in [1e3, 1e5] {
        let eye = vec3(0.0, 0.0, -distance);
        let corners = [vec3(0.0, 0.0, 0.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0)];
        let triangle = SphericalTriangle::new(eye, corners).unwrap();
        let parallel = 0.5 / (distance * distance);
        assert!(
            (triangle.solid_angle() / parallel - 1.0).abs() < 4.0 / (distance * distance) + 1e-9
        );
        let p = rectangle_chi_square(
            planar(6, |u| {
                let w = triangle.sample(u);
                [distance * w.x / w.z, distance * w.y / w.z]
            }),
            [0.0, 0.0],
            [1.0, 1.0],
            |[x, y]| if x + y <= 1.0 { 2.0 } else { 0.0 },
        );
        assert!(p > SIGNIFICANCE, "{distance} {p}");
    }
}

#[test]
fn triangles_without_solid_angle_are_refused() {
    let [o, x, y] = [Vec3::ZERO, Vec3::X, Vec3::Y];
    assert_eq!(SphericalTriangle::new(o, [x, y, vec3(1.0, 1.0, 0.0)]), None);
    assert_eq!(SphericalTriangle::new(o, [x, x, y]), None);
    assert_eq!(SphericalTriangle::new(x, [x, y, Vec3::Z]), None);
    assert_eq!(SphericalTriangle::new(o, [x, y, vec3(f64::NAN, 0.0, 0.0)]), None);
}
