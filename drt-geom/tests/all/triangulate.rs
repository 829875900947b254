//! Polygons cut into triangles: fans where they serve, and every other shape exactly covered.

use core::f64::consts::TAU;

use drt_geom::{PolygonError, newell_normal, triangulate};
use drt_math::{Mat3, Rng, Vec3, vec3};

fn flat(points: &[[f64; 2]]) -> Vec<Vec3> {
    points.iter().map(|p| vec3(p[0], p[1], 0.0)).collect()
}

/// Covered once: no triangle is turned over, and the areas add up.
fn assert_covers(corners: &[Vec3], triangles: &[[u32; 3]]) {
    let whole = newell_normal(corners.iter().copied());
    let n = whole.normalize();
    let mut sum = 0.0;
    for t in triangles {
        let part = newell_normal(t.map(|i| corners[i as usize])).dot(n);
        assert!(part >= -1e-12 * whole.length(), "{t:?} is turned over");
        sum += part;
    }
    assert!((sum / whole.length() - 1.0).abs() < 1e-9, "{sum} of {}", whole.length());
}

#[test]
fn convex_polygons_are_fans_as_in_mitsuba() {
    let quad = flat(&[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]]);
    assert_eq!(triangulate(&quad), Ok(vec![[0, 1, 2], [0, 2, 3]]));
    let gon: Vec<_> = (0..9).map(|i| (TAU * f64::from(i) / 9.0).sin_cos()).collect();
    let gon: Vec<_> = gon.iter().map(|(s, c)| vec3(*s, 0.2, *c)).collect();
    assert_eq!(triangulate(&gon).unwrap(), (1..8).map(|i| [0, i, i + 1]).collect::<Vec<_>>());
    // Corners on a straight edge change nothing.
    let tee = flat(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]]);
    assert_eq!(triangulate(&tee).unwrap().len(), 3);
}

#[test]
fn an_arrowhead_is_not_a_fan() {
    let arrow = [[2.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.0, -1.0]];
    for first in 0..4 {
        let mut corners = flat(&arrow);
        corners.rotate_left(first);
        let triangles = triangulate(&corners).unwrap();
        assert_eq!(triangles.len(), 2);
        assert_covers(&corners, &triangles);
        // Both hold the notch.
        let notch = (2 + 4 - first as u32) % 4;
        assert!(triangles.iter().all(|t| t.contains(&notch)), "{first} {triangles:?}");
    }
}

#[test]
fn random_star_shapes_in_any_plane_at_any_scale() {
    let mut rng = Rng::new(1, 0, 0);
    for n in [5, 8, 30, 300] {
        for scale in [1.0, 1e-6, 1e6, 1e-120, 1e120] {
            for reversed in [false, true] {
                let turn = Mat3::rotation(vec3(0.48, 0.6, 0.64), 6.0 * rng.next_f64());
                let mut corners: Vec<_> = (0..n)
                    .map(|i| {
                        let (s, c) = (TAU * f64::from(i) / f64::from(n)).sin_cos();
                        let r = 0.1 + rng.next_f64();
                        turn * vec3(r * c, r * s, 0.3) * scale
                    })
                    .collect();
                if reversed {
                    corners.reverse();
                }
                let triangles = triangulate(&corners).unwrap();
                assert_eq!(triangles.len(), n as usize - 2);
                let unit: Vec<_> = corners.iter().map(|c| *c / scale).collect();
                assert_covers(&unit, &triangles);
            }
        }
    }
}

#[test]
fn a_hole_joined_to_the_rim_by_a_bridge() {
    let keyhole = flat(&[
        [0.0, 0.0],
        [4.0, 0.0],
        [4.0, 4.0],
        [0.0, 4.0],
        [0.0, 0.0],
        [1.0, 1.0],
        [1.0, 3.0],
        [3.0, 3.0],
        [3.0, 1.0],
        [1.0, 1.0],
    ]);
    let triangles = triangulate(&keyhole).unwrap();
    assert_eq!(triangles.len(), 8);
    assert_covers(&keyhole, &triangles);
}

#[test]
fn what_cannot_be_cut_is_refused() {
    assert_eq!(triangulate(&[Vec3::X, Vec3::Y]), Err(PolygonError::TooFewCorners(2)));
    let bow = flat(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.2], [-1.0, 0.5]]);
    assert_eq!(triangulate(&bow), Err(PolygonError::Crossing));
    let pentagram: Vec<_> = (0..5).map(|i| (TAU * f64::from(2 * i) / 5.0).sin_cos()).collect();
    let pentagram: Vec<_> = pentagram.iter().map(|(s, c)| vec3(*c, *s, 0.0)).collect();
    assert_eq!(triangulate(&pentagram), Err(PolygonError::Crossing));
    let mut nan = flat(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
    nan[2].y = f64::NAN;
    assert_eq!(triangulate(&nan), Err(PolygonError::NotFinite));
}

#[test]
fn polygons_without_area_do_no_harm() {
    for corners in [vec![Vec3::X; 5], (0..5).map(|i| Vec3::X * f64::from(i)).collect()] {
        assert_eq!(triangulate(&corners).unwrap().len(), 3);
    }
}

/// Outlines of very many corners, one with pockets everywhere and one with holes, take about as long as sorting their corners.
#[test]
fn many_corners_are_cut_in_time() {
    let star = |corners: u32| -> Vec<_> {
        let corner = |i: u32| {
            let (s, c) = (TAU * f64::from(i) / f64::from(corners)).sin_cos();
            let r = if i.is_multiple_of(2) { 1.0 } else { 0.7 };
            [r * c, r * s]
        };
        flat(&(0..corners).map(corner).collect::<Vec<_>>())
    };
    // A sheet with square holes in a row, each joined to the lower rim by a bridge.
    let sheet = |holes: u32| -> Vec<_> {
        let mut corners = Vec::new();
        for i in 0..holes {
            let x = f64::from(i);
            corners.extend([[x, 0.0], [x, 1.0], [x, 2.0], [x + 0.5, 2.0], [x + 0.5, 1.0]]);
            corners.extend([[x, 1.0], [x, 0.0]]);
        }
        let end = f64::from(holes);
        corners.extend([[end, 0.0], [end, 3.0], [-1.0, 3.0], [-1.0, 0.0]]);
        flat(&corners)
    };
    let start = std::time::Instant::now();
    assert_eq!(triangulate(&star(100_000)).unwrap().len(), 100_000 - 2);
    assert_eq!(triangulate(&sheet(10_000)).unwrap().len(), 70_000 + 4 - 2);
    let seconds = start.elapsed().as_secs_f64();
    assert!(seconds < 20.0, "{seconds}");
    assert_covers(&sheet(4), &triangulate(&sheet(4)).unwrap());
    assert_covers(&star(40), &triangulate(&star(40)).unwrap());
}
