//! Nearest points against each triangle alone, and inside against closed forms.

use crate::common::{direction, inside_triangle, point, soup};
use drt_geom::procedural::{TorusKnot, bumpy_sphere, cube, icosphere, torus_knot};
use drt_geom::{Hit, Mesh, TriangleBvh};
use drt_math::{Affine, Rng, Vec3, vec3};

#[test]
fn the_nearest_point_is_the_nearest_of_all_triangles() {
    for (seed, size) in [(1, 0.05), (2, 0.5), (3, 3.0)] {
        let mut triangles = soup(150, size, seed);
        let [a, b, c] = triangles[70];
        triangles.extend([[b, c, a], [c, b, a]]);
        let alone: Vec<_> =
            triangles.iter().map(|t| TriangleBvh::build(&[*t]).unwrap().portable()).collect();
        let trees = [
            TriangleBvh::build(&triangles).unwrap(),
            TriangleBvh::build(&triangles).unwrap().portable(),
        ];
        let mut rng = Rng::new(seed, 1, 0);
        for _ in 0..2_000 {
            let p = point(&mut rng) * 3.0;
            let least = alone
                .iter()
                .map(|b| b.closest_point(p).unwrap().distance)
                .fold(f64::INFINITY, f64::min);
            for tree in &trees {
                let c = tree.closest_point(p).unwrap();
                assert_eq!(c.distance, least);
                assert_eq!(Some(c), trees[0].closest_point(p));
                let hit = Hit { t: 0.0, prim: c.prim, bary: c.bary };
                assert_eq!(c.point, hit.point(triangles[c.prim as usize]));
                assert_eq!((c.point - p).length(), c.distance);
            }
        }
    }
}

#[test]
fn no_point_of_the_triangle_is_nearer() {
    let mut rng = Rng::new(4, 0, 0);
    for t in soup(100, 1.0, 5) {
        let bvh = TriangleBvh::build(&[t]).unwrap();
        for _ in 0..20 {
            let p = point(&mut rng) * 2.0;
            let c = bvh.closest_point(p).unwrap();
            let [u, v] = c.bary;
            assert!(u >= 0.0 && v >= 0.0 && u + v <= 1.0 + 1e-15);
            for _ in 0..50 {
                let other = Hit { t: 0.0, prim: 0, bary: inside_triangle(&mut rng) }.point(t);
                assert!((other - p).length() >= c.distance * (1.0 - 1e-12));
            }
        }
    }
}

#[test]
fn a_sphere_is_nearest_along_the_radius() {
    for (scale, offset) in [(1.0, 0.0), (1e-6, 0.0), (1e6, 1e3), (1.0, 1e6)] {
        let shift = vec3(1.0, 2.0, -0.5) * offset;
        let map =
            Affine { linear: drt_math::Mat3::diagonal(Vec3::splat(scale)), translation: shift };
        let bvh = TriangleBvh::of(&icosphere(4).transform(&map)).unwrap();
        let mut rng = Rng::new(6, 0, 0);
        for _ in 0..500 {
            let d = direction(&mut rng);
            let p = shift + d * (3.0 * scale);
            let c = bvh.closest_point(p).unwrap();
            assert!((c.distance / scale - 2.0).abs() < 2e-3);
            assert!((c.point - shift - d * scale).length() < 0.1 * scale);
        }
    }
}

fn assert_inside(m: &Mesh, inside: impl Fn(Vec3) -> Option<bool>, seed: u64) {
    let trees = [TriangleBvh::of(m).unwrap(), TriangleBvh::build(&m.soup()).unwrap().portable()];
    let mut rng = Rng::new(seed, 0, 0);
    let mut counts = [0; 2];
    for _ in 0..20_000 {
        let p = point(&mut rng) * 1.7;
        let Some(expected) = inside(p) else { continue };
        counts[usize::from(expected)] += 1;
        for bvh in &trees {
            assert_eq!(bvh.inside(p), expected, "{p:?}");
            assert_eq!(bvh.winding_number(p), i32::from(expected), "{p:?}");
        }
    }
    assert!(counts.iter().all(|&c| c > 200), "{counts:?}");
}

#[test]
fn inside_matches_closed_forms() {
    let ball = |r: f64| (!(0.99..=1.01).contains(&r)).then_some(r < 1.0);
    assert_inside(&icosphere(4), |p| ball(p.length()), 7);
    assert_inside(&cube(), |p| Some(p.max_abs() < 1.0), 8);
    let bumpy = |p: Vec3| {
        let d = p.normalize();
        let bump = d.to_array().map(|c| (6.0 * c).sin());
        let r = p.length() / (1.0 + 0.4 * bump[0] * bump[1] * bump[2]);
        (!(0.97..=1.03).contains(&r)).then_some(r < 1.0)
    };
    assert_inside(&bumpy_sphere(5, 0.4, 6.0), bumpy, 9);
    let torus =
        TorusKnot { p: 1, q: 0, minor: 0.0, tube: 0.5, segments: 128, sides: 64, major: 1.0 };
    let tube = |p: Vec3| {
        let r = (p.x.hypot(p.y) - 1.0).hypot(p.z) / 0.5;
        (!(0.98..=1.01).contains(&r)).then_some(r < 1.0)
    };
    assert_inside(&torus_knot(&torus), tube, 10);
}

/// Where edges and vertices line up with the grid of points asked.
#[test]
fn inside_on_the_grid_of_the_vertices() {
    let bvh = TriangleBvh::of(&cube()).unwrap();
    for i in -6..=6 {
        for j in -6..=6 {
            for k in -6..=6 {
                let p = vec3(f64::from(i), f64::from(j), f64::from(k)) * 0.25;
                if p.max_abs() != 1.0 {
                    assert_eq!(bvh.inside(p), p.max_abs() < 1.0, "{p:?}");
                }
            }
        }
    }
}

#[test]
fn winding_counts_layers_and_sides() {
    let mut soup = icosphere(2).soup();
    let mut reversed = icosphere(2);
    reversed.flip();
    let half = |t: &[Vec3; 3]| t.map(|v| v * 0.5);
    soup.extend(icosphere(2).soup().iter().map(half));
    let double = TriangleBvh::build(&soup).unwrap();
    assert_eq!(double.winding_number(Vec3::ZERO), 2);
    assert_eq!(double.winding_number(vec3(0.7, 0.0, 0.0)), 1);
    let mut shell = icosphere(2).soup();
    shell.extend(reversed.soup().iter().map(half));
    let shell = TriangleBvh::build(&shell).unwrap();
    assert!(!shell.inside(Vec3::ZERO) && shell.inside(vec3(0.7, 0.0, 0.0)));
    let inside_out = TriangleBvh::of(&reversed).unwrap();
    assert_eq!(inside_out.winding_number(vec3(0.1, 0.2, 0.3)), -1);
}
