//! Mitsuba 3.9.1 (`scalar_rgb`), its rays and a rendering; single precision.

use crate::model::sensor::tests::*;

fn mitsuba_view() -> Affine {
    look_at(vec3(1.0, 2.0, 3.0), vec3(4.0, 0.0, -1.0), Vec3::Y).unwrap()
}

/// A row of [`RAYS`]: field of view, its axis, film, principal point offset, direction of the ray
/// through pixel coordinates (1.25, 2).
type Row = (f64, FovAxis, [u32; 2], [f64; 2], [f64; 3]);

const CENTRED: [f64; 2] = [0.0, 0.0];

const RAYS: [Row; 11] = [
    (50.0, FovAxis::X, [8, 6], CENTRED, [0.30910435, -0.24905941, -0.9178365]),
    (50.0, FovAxis::X, [5, 9], CENTRED, [0.42072743, 0.05459146, -0.90554297]),
    (50.0, FovAxis::Y, [8, 6], CENTRED, [0.22735174, -0.20669644, -0.9516237]),
    (50.0, FovAxis::Y, [5, 9], CENTRED, [0.49100882, -0.12569362, -0.862039]),
    (50.0, FovAxis::Diagonal, [8, 6], CENTRED, [0.3595445, -0.27475223, -0.89176166]),
    (50.0, FovAxis::Diagonal, [5, 9], CENTRED, [0.5011516, -0.15619995, -0.8511453]),
    (50.0, FovAxis::Smaller, [8, 6], CENTRED, [0.22735174, -0.20669644, -0.9516237]),
    (50.0, FovAxis::Smaller, [5, 9], CENTRED, [0.42072743, 0.05459146, -0.90554297]),
    (50.0, FovAxis::Larger, [8, 6], CENTRED, [0.30910435, -0.24905941, -0.9178365]),
    (50.0, FovAxis::Larger, [5, 9], CENTRED, [0.49100882, -0.12569362, -0.862039]),
    (50.0, FovAxis::X, [8, 6], [0.1, -0.2], [0.40902236, -0.126067, -0.90377414]),
];

#[test]
fn rays_are_those_of_mitsuba() {
    for (fov, fov_axis, film, principal_point_offset, direction) in RAYS {
        let lens = Lens { fov_axis, principal_point_offset, ..Lens::with_fov(fov) };
        let sensor = Sensor::from_to_world(&mitsuba_view(), lens, film, filter()).unwrap();
        let mine = sensor.ray([1.25, 2.0]).dir;
        assert!((mine - Vec3::from(direction)).max_abs() < 1e-6, "{lens:?} {mine:?}");
    }
}

#[test]
fn the_default_lens_is_mitsubas() {
    let lens = Lens::default();
    let sensor = Sensor::from_to_world(&mitsuba_view(), lens, [8, 6], filter()).unwrap();
    let direction = vec3(0.3741862, -0.2821422, -0.88339144);
    assert!((sensor.ray([1.25, 2.0]).dir - direction).max_abs() < 1e-6);
    let lens = Lens { fov: Lens::fov_of_focal_length(35.0), ..lens };
    let sensor = Sensor::from_to_world(&mitsuba_view(), lens, [8, 6], filter()).unwrap();
    let direction = vec3(0.2940257, -0.24131095, -0.92483395);
    assert!((sensor.ray([1.25, 2.0]).dir - direction).max_abs() < 1e-6);
}

/// Mitsuba starts rays on the near plane and measures their length from there.
#[test]
fn clip_planes_are_those_of_mitsuba() {
    let lens =
        Lens { principal_point_offset: [0.1, -0.2], near: 0.5, far: 20.0, ..Lens::with_fov(50.0) };
    let sensor = Sensor::from_to_world(&mitsuba_view(), lens, [8, 6], filter()).unwrap();
    let ray = sensor.ray([1.25, 2.0]);
    let start = ray.origin + ray.dir * near(&sensor, &ray);
    assert!((start - vec3(1.2161881, 1.9333675, 2.5223117)).max_abs() < 1e-6);
    assert!((ray.t_max - near(&sensor, &ray) - 20.613_385).abs() < 1e-4);
}

#[test]
fn a_mirrored_to_world_mirrors_the_image() {
    let mirror = Affine { linear: Mat3::diagonal(vec3(-1.0, 1.0, 1.0)), ..Affine::IDENTITY };
    let sensor = Sensor::from_to_world(&mirror, Lens::with_fov(50.0), [8, 6], filter()).unwrap();
    let expected = vec3(-0.30341843, 0.11033398, 0.9464479);
    assert!((sensor.ray([1.25, 2.0]).dir - expected).max_abs() < 1e-6);
}

/// A glowing rectangle, 4096 samples per pixel with a box filter: pixels covered and centroid.
#[test]
fn a_rectangle_is_where_mitsuba_renders_it() {
    let corners = [
        vec3(3.14019, 1.15, -1.65),
        vec3(3.65981, 1.15, -1.35),
        vec3(3.65981, 1.45, -1.35),
        vec3(3.14019, 1.45, -1.65),
    ];
    let view = [vec3(1.0, 2.0, 3.0), vec3(4.0, 0.0, -1.0), vec3(0.1, 1.0, 0.2)];
    let offset = Lens {
        fov_axis: FovAxis::Diagonal,
        principal_point_offset: [-0.2, -0.15],
        ..Lens::with_fov(40.0)
    };
    let larger = Lens { fov_axis: FovAxis::Larger, ..Lens::with_fov(70.0) };
    for (lens, area, centroid) in [
        (Lens::with_fov(50.0), 35.873, [17.665, 9.786]),
        (offset, 91.979, [21.844, 8.438]),
        (larger, 15.937, [22.456, 14.536]),
    ] {
        let sensor = Sensor::look_at(view, lens, [64, 48], filter()).unwrap();
        let q = corners.map(|x| sensor.project(x).unwrap().pixel);
        // Area and first moments of the polygon, by Green's theorem.
        let (mut twice, mut moment) = (0.0, [0.0; 2]);
        for (p, n) in q.iter().zip(q.iter().cycle().skip(1)) {
            let cross = p[0] * n[1] - n[0] * p[1];
            twice += cross;
            moment = [0, 1].map(|k| moment[k] + cross * (p[k] + n[k]) / 6.0);
        }
        assert!((0.5 * twice.abs() - area).abs() < 0.003 * area, "{twice}");
        for k in 0..2 {
            let mine = moment[k] / (0.5 * twice);
            assert!((mine - centroid[k]).abs() < 0.01, "{mine} {}", centroid[k]);
        }
    }
}
