//! Rays that start or end on a surface: they never meet it where they should not, and always where
//! they should.

use crate::common::{direction, inside_triangle};
use drt_geom::procedural::{TorusKnot, cube, icosphere, torus_knot, uv_sphere};
use drt_geom::{Hit, Mesh, Ray, Skip, Topology, TriangleBvh, ray_plane};
use drt_math::{Affine, Mat3, Rng, Vec3, vec3};

const PLACES: [(f64, f64); 9] = [
    (1.0, 0.0),
    (1e-6, 0.0),
    (1e6, 0.0),
    (1.0, 1e3),
    (1e-3, 1e3),
    (1e6, 1e3),
    (1.0, 1e6),
    (1e-3, 1e6),
    (1e6, 1e6),
];

fn placed(m: &Mesh, scale: f64, offset: f64) -> Mesh {
    let linear = Mat3::diagonal(Vec3::splat(scale));
    m.transform(&Affine { linear, translation: vec3(1.0, -0.7, 0.3) * offset })
}

/// A closed convex surface of long thin triangles, askew.
fn flattened(thickness: f64) -> Mesh {
    let turn = Mat3::rotation(vec3(0.36, 0.48, 0.8), 0.8);
    let squash = turn * Mat3::diagonal(vec3(1.0, thickness, 1.0 / thickness));
    icosphere(2).transform(&Affine::about(squash, Vec3::ZERO))
}

/// A point of the surface and the triangles around it.
struct Start {
    point: Vec3,
    prim: u32,
    around: Vec<u32>,
}

/// Points inside triangles, on edges and at vertices, as interpolation makes them.
fn starts(m: &Mesh, rng: &mut Rng) -> Vec<Start> {
    let mut at_vertex = vec![Vec::new(); m.positions.len()];
    for (prim, t) in (0..).zip(&m.triangles) {
        for &v in t {
            at_vertex[v as usize].push(prim);
        }
    }
    let topology = Topology::of(m);
    let mut starts = Vec::new();
    for prim in 0..m.triangles.len() as u32 {
        let corners = m.triangle(prim);
        let mut start = |bary: [f64; 2], around: Vec<u32>| {
            let hit = Hit { t: 0.0, prim, bary };
            starts.push(Start { point: hit.point(corners), prim, around });
        };
        start(inside_triangle(rng), vec![prim]);
        let s = rng.next_f64();
        for (k, bary) in [[s, 0.0], [1.0 - s, s], [0.0, s]].into_iter().enumerate() {
            let edge = topology.edges[topology.face_edges[prim as usize][k] as usize];
            start(bary, edge.faces.to_vec());
        }
        for (k, bary) in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].into_iter().enumerate() {
            start(bary, at_vertex[m.triangles[prim as usize][k] as usize].clone());
        }
    }
    starts
}

/// A direction on one side of all the triangles, by more than rounding.
fn aim(m: &Mesh, start: &Start, side: f64, rng: &mut Rng) -> Option<Vec3> {
    (0..64)
        .map(|_| direction(rng))
        .find(|d| start.around.iter().all(|&f| side * m.normal(f).dot(*d) > 1e-7))
}

#[test]
fn a_convex_surface_is_left_freely_and_entered_surely() {
    let mut rng = Rng::new(1, 0, 0);
    for shape in [icosphere(2), cube()] {
        for (scale, offset) in PLACES {
            let m = placed(&shape, scale, offset);
            let trees =
                [TriangleBvh::of(&m).unwrap(), TriangleBvh::build(&m.soup()).unwrap().portable()];
            for start in starts(&m, &mut rng) {
                for bvh in &trees {
                    let skip = Skip::one(start.prim);
                    let out = aim(&m, &start, 1.0, &mut rng).unwrap();
                    let hit = bvh.closest(&Ray::new(start.point, out * 1e-3), skip);
                    assert_eq!(hit, None, "scale {scale} offset {offset}");
                    let inward = aim(&m, &start, -1.0, &mut rng).unwrap();
                    let ray = Ray::new(start.point, inward * 1e3);
                    let hit = bvh.closest(&ray, skip).expect("the far side");
                    assert!(!start.around.contains(&hit.prim));
                    // The segment between both points is free, seen from either end.
                    let far = hit.point(m.triangle(hit.prim));
                    let ends = Skip::two(start.prim, hit.prim);
                    assert!(!bvh.any(&Ray::segment(start.point, far), ends, |_| true));
                    assert!(!bvh.any(&Ray::segment(far, start.point), ends, |_| true));
                }
            }
        }
    }
}

#[test]
fn naming_the_own_triangle_is_not_even_needed() {
    let mut rng = Rng::new(2, 0, 0);
    for (scale, offset) in PLACES {
        let m = placed(&icosphere(2), scale, offset);
        let bvh = TriangleBvh::of(&m).unwrap();
        for start in starts(&m, &mut rng) {
            let out = aim(&m, &start, 1.0, &mut rng).unwrap();
            assert_eq!(bvh.closest(&Ray::new(start.point, out), Skip::NOTHING), None);
        }
    }
}

/// Slivers, whose planes are known least.
#[test]
fn long_thin_surfaces_are_left_freely() {
    let mut rng = Rng::new(5, 0, 0);
    for thickness in [1e-1, 1e-2, 1e-3, 1e-4, 1e-5] {
        for (scale, offset) in PLACES {
            let m = placed(&flattened(thickness), scale, offset);
            let bvh = TriangleBvh::of(&m).unwrap();
            for start in starts(&m, &mut rng) {
                // At the tips such directions are rare.
                let Some(out) = aim(&m, &start, 1.0, &mut rng) else { continue };
                let hit = bvh.closest(&Ray::new(start.point, out), Skip::one(start.prim));
                assert_eq!(hit, None, "{thickness} {scale} {offset}");
            }
        }
    }
}

#[test]
fn grazing_rays_too() {
    let mut rng = Rng::new(3, 0, 0);
    for (scale, offset) in PLACES {
        let m = placed(&icosphere(1), scale, offset);
        let bvh = TriangleBvh::of(&m).unwrap();
        for start in starts(&m, &mut rng).iter().filter(|s| s.around.len() == 1) {
            let n = m.normal(start.prim);
            // As flat as can be: lower, and a start rounded to below the surface still is below when
            // the ray comes to the edge, and so meets the neighbour's back.
            let rounding = 1e-16 * f64::max(1.0, offset / scale);
            for lift in [1e6, 1e7, 1e8, 1e9].map(|k| k * rounding) {
                let d = direction(&mut rng).reject(n).normalize() + n * lift;
                let skip = Skip::one(start.prim);
                assert_eq!(bvh.closest(&Ray::new(start.point, d), skip), None, "{lift}");
            }
        }
    }
}

/// Points that a ray finds within rounding of an edge, not on it: a camera on the axis of a sphere whose meridians lie on
/// the borders of its pixels makes such. They are nearer to the edge than rounding may put them behind their own triangle.
#[test]
fn points_right_beside_an_edge_are_left_freely() {
    let mut rng = Rng::new(7, 0, 0);
    for (scale, offset) in PLACES {
        let m = placed(&uv_sphere(32), scale, offset);
        let bvh = TriangleBvh::of(&m).unwrap();
        let center = vec3(1.0, -0.7, 0.3) * offset;
        let mut found = 0;
        for _ in 0..2000 {
            let across = rng.next_f64() * 1.8 - 0.9;
            let target = if rng.next_f64() < 0.5 { [across, 0.0] } else { [0.0, across] };
            let [eye, aim] = [[0.0, 0.0, 4.0], [target[0], target[1], 0.3]]
                .map(|[x, y, z]| center + vec3(x, y, z) * scale);
            let Some(hit) = bvh.closest(&Ray::new(eye, aim - eye), Skip::NOTHING) else { continue };
            let (x, n) = (hit.point(m.triangle(hit.prim)), m.normal(hit.prim));
            let out = direction(&mut rng);
            if out.dot(n) > 1e-2 {
                found += 1;
                let met = bvh.closest(&Ray::new(x, out), Skip::one(hit.prim));
                assert_eq!(met, None, "scale {scale} offset {offset}");
            }
        }
        assert!(found > 500, "{found}");
    }
}

/// What this file would find in a query with a plain `t > 0`: it can fail.
#[test]
fn a_plain_test_meets_the_neighbours() {
    let mut rng = Rng::new(4, 0, 0);
    let m = placed(&icosphere(2), 1.0, 1e3);
    let mut wrong = 0;
    for start in starts(&m, &mut rng).iter().filter(|s| s.around.len() > 1) {
        let out = aim(&m, start, 1.0, &mut rng).unwrap();
        wrong += start
            .around
            .iter()
            .filter(|&&f| f != start.prim)
            .filter(|&&f| {
                let (t, [u, v]) = ray_plane(start.point, out, m.triangle(f));
                t > 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0
            })
            .count();
    }
    assert!(wrong > 10, "{wrong}");
}

/// Near a valley's edge the other face is met, however near it is.
#[test]
fn hits_near_the_start_are_not_lost() {
    for angle in [0.1_f64, 1.0, 1.57, 3.0] {
        let (s, c) = angle.sin_cos();
        let floor = [vec3(0.0, -1.0, 0.0), vec3(0.0, 1.0, 0.0), vec3(1.0, 0.0, 0.0)];
        let wall = [vec3(0.0, 1.0, 0.0), vec3(0.0, -1.0, 0.0), vec3(c, 0.0, s)];
        let bvh = TriangleBvh::build(&[floor, wall]).unwrap();
        for exponent in 1..=13 {
            let x = 10.0_f64.powi(-exponent);
            let toward = vec3(-(0.5 * angle).sin(), 0.0, (0.5 * angle).cos());
            let ray = Ray::new(vec3(x, 0.01, 0.0), toward);
            let hit = bvh.closest(&ray, Skip::one(0)).expect("the wall");
            let exact = x * s / (c * toward.z - s * toward.x).abs();
            assert!((hit.t / exact - 1.0).abs() < 1e-2, "{angle} {x}: {} {exact}", hit.t);
        }
    }
}

/// Rays between random points of a winding surface: blocked or not, the same from both ends.
#[test]
fn visibility_is_mutual() {
    let m = torus_knot(&TorusKnot { segments: 96, sides: 10, ..TorusKnot::default() });
    let bvh = TriangleBvh::of(&m).unwrap();
    let mut rng = Rng::new(6, 0, 0);
    let mut pick = || {
        let prim = (rng.next_f64() * m.triangles.len() as f64) as u32;
        let hit = Hit { t: 0.0, prim, bary: inside_triangle(&mut rng) };
        (hit.point(m.triangle(prim)), prim)
    };
    let mut seen = 0;
    for _ in 0..50_000 {
        let ((a, i), (b, j)) = (pick(), pick());
        let forth = bvh.any(&Ray::segment(a, b), Skip::two(i, j), |_| true);
        let back = bvh.any(&Ray::segment(b, a), Skip::two(i, j), |_| true);
        assert_eq!(forth, back);
        seen += u32::from(!forth);
    }
    assert!(seen > 500, "{seen}");
}

/// Rays meet the triangle with the lowest number among those that coincide, whichever way rounding falls.
#[test]
fn coincident_surfaces_are_met_in_their_order() {
    let mut rng = Rng::new(8, 0, 0);
    let (mut rays, mut by_rounding) = (0, 0);
    // Farther out, rounding is more than the part of a distance in which hits count as near.
    for (scale, offset) in PLACES.into_iter().filter(|(scale, offset)| offset / scale < 1e8) {
        let turn = Mat3::rotation(vec3(0.36, 0.48, 0.8), 0.7);
        let place =
            |x: f64, y: f64| (turn * vec3(x, y, 0.0)) * scale + vec3(1.0, -0.7, 0.3) * offset;
        let large = [place(-2.0, -2.0), place(2.0, -2.0), place(0.0, 3.0)];
        let small = [place(-0.5, -0.4), place(0.6, -0.5), place(0.1, 0.7)];
        for first in [[small, large], [large, small]] {
            let bvh = TriangleBvh::build(&first).unwrap();
            for _ in 0..500 {
                let [u, v] = inside_triangle(&mut rng);
                let aim = small[0] * (1.0 - u - v) + small[1] * u + small[2] * v;
                let from = aim + direction(&mut rng) * (3.0 * scale);
                let ray = Ray::new(from, aim - from);
                let Some(hit) = bvh.foremost(&ray, Skip::NOTHING) else { continue };
                rays += 1;
                assert_eq!(hit.prim, 0, "scale {scale} offset {offset}");
                let closest = bvh.closest(&ray, Skip::NOTHING).unwrap();
                by_rounding += u32::from(closest.prim != 0);
            }
        }
    }
    assert!(rays > 7000 && by_rounding > 1000, "{by_rounding} of {rays}");
    // A gap is a gap.
    let sheet = |z: f64| [vec3(-1.0, -1.0, z), vec3(1.0, -1.0, z), vec3(0.0, 1.0, z)];
    let bvh = TriangleBvh::build(&[sheet(0.0), sheet(1e-12)]).unwrap();
    let ray = Ray::new(vec3(0.1, 0.0, 2.0), vec3(0.01, 0.02, -1.0));
    assert_eq!(bvh.foremost(&ray, Skip::NOTHING).unwrap().prim, 1);
}
