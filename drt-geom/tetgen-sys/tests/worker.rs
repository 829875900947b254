//! The worker: what it makes, and what becomes of input that it cannot take.

use std::time::Duration;

use tetgen_sys::{Error, Tetrahedra, tetrahedralize};

const LIMIT: Duration = Duration::from_secs(60);

/// The corners of a cube of the given half edge, and its faces over vertices from `base`.
fn cube(half: f64, base: u32) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let corner = |i: u32| [0, 1, 2].map(|k| if i >> k & 1 == 1 { half } else { -half });
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    ((0..8).map(corner).collect(), triangles.map(|t| t.map(|i| i + base)).collect())
}

fn nested() -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let ((mut points, mut triangles), inner) = (cube(1.0, 0), cube(0.5, 8));
    points.extend(inner.0);
    triangles.extend(inner.1);
    (points, triangles)
}

fn volume(t: &Tetrahedra) -> f64 {
    let of = |tet: &[u32; 4]| {
        let [a, b, c, d] = tet.map(|i| t.points[i as usize]);
        let [u, v, w] = [b, c, d].map(|p| [0, 1, 2].map(|k| p[k] - a[k]));
        (u[0] * (v[1] * w[2] - v[2] * w[1])
            + u[1] * (v[2] * w[0] - v[0] * w[2])
            + u[2] * (v[0] * w[1] - v[1] * w[0]))
            / 6.0
    };
    t.tets.iter().map(of).inspect(|v| assert!(*v > 0.0)).sum()
}

#[test]
fn a_cube_in_a_cube_is_filled() {
    let (points, triangles) = nested();
    let made = tetrahedralize(&points, &triangles, LIMIT).unwrap();
    assert_eq!(made.points[..points.len()], points);
    assert!((volume(&made) - 8.0).abs() < 1e-12);
    for triangle in triangles {
        assert!(made.tets.iter().any(|tet| triangle.iter().all(|i| tet.contains(i))));
    }
}

/// The plane z = 0 cuts the inner cube.
fn crossing() -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let (mut points, mut triangles) = nested();
    points.extend([[-0.8, -0.8, 0.0], [0.8, -0.8, 0.0], [0.0, 0.8, 0.0]]);
    triangles.push([16, 17, 18]);
    (points, triangles)
}

#[test]
fn what_the_library_dies_of_is_an_error_and_this_process_lives() {
    let (points, triangles) = crossing();
    let error = tetrahedralize(&points, &triangles, LIMIT).unwrap_err();
    assert!(matches!(error, Error::Refused { .. } | Error::Ended { .. }), "{error}");
}

#[test]
fn threads_have_workers_of_their_own() {
    let (good, bad) = (nested(), crossing());
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                for _ in 0..8 {
                    assert!(tetrahedralize(&good.0, &good.1, LIMIT).is_ok());
                    let error = tetrahedralize(&bad.0, &bad.1, LIMIT).unwrap_err();
                    let died = matches!(error, Error::Refused { .. } | Error::Ended { .. });
                    assert!(died, "{error}");
                }
            });
        }
    });
}

#[test]
fn too_long_is_an_error() {
    // Enough points to take a while, by a sequence without pattern.
    let mut state = 1_u64;
    let mut next = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let (mut points, triangles) = cube(1.0, 0);
    points.extend((0..200_000).map(|_| [next(), next(), next()]));
    let error = tetrahedralize(&points, &triangles, Duration::from_millis(20)).unwrap_err();
    assert!(matches!(error, Error::TimedOut { .. }), "{error}");
}

#[test]
fn nonsense_never_reaches_the_library() {
    let (mut points, mut triangles) = nested();
    triangles[3][1] = 16;
    let error = tetrahedralize(&points, &triangles, LIMIT).unwrap_err();
    assert!(matches!(error, Error::IndexOutOfRange { triangle: 3, index: 16, count: 16 }));
    points[5][2] = f64::NAN;
    let error = tetrahedralize(&points, &triangles, LIMIT).unwrap_err();
    assert!(matches!(error, Error::NotFinite { point: 5 }));
}

#[test]
fn the_code_of_the_library_says_what_was_wrong() {
    let (points, mut triangles) = nested();
    triangles.push(triangles[13]);
    let error = tetrahedralize(&points, &triangles, LIMIT).unwrap_err();
    assert!(matches!(error, Error::Refused { code: 3, .. }), "{error}");
}

#[test]
fn nothing_is_an_error() {
    assert!(tetrahedralize(&[], &[], LIMIT).is_err());
}
