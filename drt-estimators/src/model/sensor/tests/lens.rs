//! Thin lenses and parts of films.

use drt_math::{Affine, Mat3, Rgb, vec3};

use super::*;
use crate::model::sensor::Aperture;

fn camera() -> Sensor {
    let filter = Filter::new(FilterKind::BOX).unwrap();
    let at = [vec3(1.0, -2.0, 0.5), vec3(0.3, 0.4, -3.0), vec3(0.1, 1.0, 0.2)];
    Sensor::look_at(at, Lens::with_fov(50.0), [40, 30], filter).unwrap()
}

fn focused() -> Sensor {
    camera().with_aperture(Aperture { radius: 0.4, focus_distance: 2.5 }).unwrap()
}

#[test]
fn rays_of_an_image_point_meet_where_it_is_sharp() {
    let (lens, pinhole) = (focused(), camera());
    let pixel = [7.3, 21.9];
    let through = |camera: &Sensor| {
        let ray = camera.ray(pixel);
        let depth = 2.5 / ray.dir.dot(camera.pinhole().forward);
        ray.origin + ray.dir * depth
    };
    for at in [[0.0, 0.0], [1.0, 0.0], [-0.3, 0.8]] {
        let one = lens.at_lens(at);
        assert!((through(&one) - through(&pinhole)).max_abs() < 1e-12);
        let to = one.position() - lens.position();
        let p = lens.pinhole();
        let expected = p.right * (0.4 * at[0]) + p.up * (0.4 * at[1]);
        assert!((to - expected).max_abs() < 1e-12);
    }
}

/// Of what a point is seen as, against differences of the camera itself.
#[test]
fn gradients_are_carried_back_to_the_camera() {
    let camera = focused();
    let (at, x, adjoints) = ([0.6, -0.5], vec3(0.7, 0.1, -3.4), [0.8, -1.1, 0.6]);
    let number = |camera: &Sensor| {
        let seen = camera.at_lens(at).view(x);
        adjoints[0] * seen.pixel[0]
            + adjoints[1] * seen.pixel[1]
            + adjoints[2] * seen.importance.ln()
    };
    let one = camera.at_lens(at);
    let (_, by) = one.view_gradient(&one.view(x), [adjoints[0], adjoints[1]], adjoints[2]);
    let by = camera.lens_gradient(at, by);
    let field =
        Affine { linear: Mat3::skew(vec3(0.2, -0.6, 0.3)), translation: vec3(3.0, 1.0, 2.0) };
    let h = 1e-5;
    let close = |found: f64, expected: f64| {
        assert!((found - expected).abs() < 1e-6 * (1.0 + expected.abs()), "{found} {expected}");
        assert!(expected.abs() > 1e-2);
    };
    let moved = |s: f64| {
        let axis = vec3(0.2, -0.6, 0.3);
        let linear = Mat3::rotation(axis.normalize(), axis.length() * s);
        number(&camera.moved(&Affine { linear, translation: field.translation * s }).unwrap())
    };
    close(by.dot(&camera.velocity(&field)), (moved(h) - moved(-h)) / (2.0 * h));
    for name in ["fov", "aperture_radius", "focus_distance", "principal_point_offset_x"] {
        let value = camera.property(name).unwrap().r;
        let with = |v: f64| number(&camera.with_property(name, Rgb::splat(v)).unwrap());
        let tangent = camera.property_tangent(name, Rgb::ONE).unwrap();
        close(by.dot(&tangent), (with(value + h) - with(value - h)) / (2.0 * h));
    }
}

#[test]
fn parts_of_films_keep_their_pixels() {
    let size = Affine { linear: Mat3::IDENTITY * 2.0, translation: vec3(0.0, 0.0, 1.0) };
    let filter = Filter::new(FilterKind::BOX).unwrap();
    let parallel = Sensor::orthographic(&size, Lens::default(), [40, 30], filter).unwrap();
    for whole in [camera(), focused(), parallel] {
        let part = whole.cropped([10, 4], [8, 12]).unwrap();
        let again = part.cropped([2, 1], [3, 3]).unwrap();
        for (camera, by) in [(&part, [10.0, 4.0]), (&again, [12.0, 5.0])] {
            let (a, b) = (whole.ray([14.3 + by[0], 2.5 + by[1]]), camera.ray([14.3, 2.5]));
            assert!((a.origin - b.origin).max_abs() < 1e-12);
            assert!((a.dir - b.dir).max_abs() < 1e-12);
        }
        // With half as many pixels it shows the same.
        let half = part.with_film([4, 6]).unwrap();
        let (a, b) = (part.ray([3.0, 5.0]), half.ray([1.5, 2.5]));
        assert!((a.origin - b.origin).max_abs() < 1e-12);
        assert!((a.dir - b.dir).max_abs() < 1e-12);
        assert!(whole.cropped([33, 0], [8, 1]).is_err());
        assert!(whole.cropped([0, 0], [0, 1]).is_err());
    }
}

#[test]
fn lenses_are_positive_and_on_perspective_cameras() {
    for (radius, focus_distance) in [(0.0, 1.0), (1.0, -1.0), (f64::NAN, 1.0), (1.0, f64::INFINITY)]
    {
        assert!(camera().with_aperture(Aperture { radius, focus_distance }).is_err());
    }
    let meter = Sensor::irradiance_meter(vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 1.0)).unwrap();
    assert!(meter.with_aperture(Aperture { radius: 1.0, focus_distance: 1.0 }).is_err());
    assert!(camera().property("aperture_radius").is_err());
}
