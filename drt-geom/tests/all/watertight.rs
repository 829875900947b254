//! No ray slips through a closed surface, and none of the traps catches one that obvhs 0.4 has.

use crate::common::{direction, point};
use drt_geom::procedural::{cube, grid, icosphere};
use drt_geom::{BvhError, Ray, Skip, TriangleBvh};
use drt_math::{Affine, Mat3, Rng, Vec3, vec3};

fn both(triangles: &[[Vec3; 3]]) -> [TriangleBvh; 2] {
    [TriangleBvh::build(triangles).unwrap(), TriangleBvh::build(triangles).unwrap().portable()]
}

#[test]
fn nothing_leaves_a_sphere_through_edges_or_vertices() {
    let mut rng = Rng::new(1, 0, 0);
    for (scale, offset) in [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 1e6), (1e-6, 1.0)] {
        let linear = Mat3::diagonal(Vec3::splat(scale));
        let shift = vec3(1.0, -0.3, 2.0) * offset;
        let m = icosphere(3).transform(&Affine { linear, translation: shift });
        for bvh in both(&m.soup()) {
            for t in &m.triangles {
                let corners = t.map(|v| m.positions[v as usize]);
                let s = rng.next_f64();
                for target in [corners[0], corners[0].lerp(corners[1], s)] {
                    let from = shift + point(&mut rng) * (0.4 * scale);
                    assert!(bvh.closest(&Ray::new(from, target - from), Skip::NOTHING).is_some());
                }
            }
        }
    }
}

/// A ray through an edge or a vertex crosses one of the faces there, never two or none.
#[test]
fn each_edge_belongs_to_one_of_its_faces() {
    let mut rng = Rng::new(7, 0, 0);
    for m in [icosphere(3), cube()] {
        let bvh = TriangleBvh::of(&m).unwrap();
        for i in 0..25_000 {
            let prim = i % m.triangles.len() as u32;
            let [a, b, _] = m.triangle(prim);
            let from = if i % 2 == 0 { point(&mut rng) * 0.4 } else { Vec3::ZERO };
            for target in [a, a.lerp(b, rng.next_f64()), (a + b) * 0.5] {
                let mut hits = 0;
                bvh.all(&Ray::new(from, target - from), Skip::NOTHING, |_| hits += 1);
                assert_eq!(hits, 1);
            }
        }
    }
}

#[test]
fn rays_exactly_through_a_grids_vertices_and_edges_hit_it_once() {
    let m = grid(16, 16);
    for bvh in both(&m.soup()) {
        for i in -31..32 {
            for j in -31..32 {
                // Vertices, midpoints of edges and of diagonals; all exact in binary.
                let target = vec3(f64::from(i) / 32.0, f64::from(j) / 32.0, 0.0);
                for d in [vec3(0.0, 0.0, -1.0), vec3(0.25, -0.5, -2.0), vec3(0.0, 1.0, -1.0)] {
                    let mut hits = Vec::new();
                    bvh.all(&Ray::new(target - d, d), Skip::NOTHING, |h| hits.push(h.t));
                    assert_eq!(hits, [1.0]);
                }
            }
        }
    }
}

/// obvhs drops what is nearer than t = 1e-4.
#[test]
fn near_hits_are_kept() {
    let m = grid(8, 8);
    for bvh in both(&m.soup()) {
        let mut rng = Rng::new(2, 0, 0);
        for height in [1e-5, 1e-8, 1e-12, 1e-15, 1e-300] {
            for length in [1e-6, 1.0, 1e6] {
                for _ in 0..200 {
                    let p = point(&mut rng);
                    let ray = Ray::new(vec3(p.x, p.y, height), vec3(0.0, 0.0, -length));
                    let hit = bvh.closest(&ray, Skip::NOTHING).expect("below");
                    assert!((hit.t * length / height - 1.0).abs() < 1e-12);
                }
            }
        }
    }
}

/// obvhs mistakes the side of a direction coordinate of -0 or whose inverse has another sign, and
/// tilts axis-parallel rays.
#[test]
fn rays_along_axes_hit() {
    let m = icosphere(4);
    let mut rng = Rng::new(3, 0, 0);
    for bvh in both(&m.soup()) {
        for _ in 0..3_000 {
            let p = point(&mut rng) * 0.6;
            for z in [-1.0, 1.0] {
                for tiny in [0.0, -0.0, 1e-8, -1e-8, 1e-20, 1e-34, -1e-34, -1e-38, -1e-300] {
                    let d = [vec3(tiny, tiny, z), vec3(z, tiny, tiny), vec3(tiny, z, tiny)];
                    for (k, d) in d.into_iter().enumerate() {
                        let mut from = [p.x, p.y, p.z];
                        from[(k + 2) % 3] = -100.0 * z;
                        let ray = Ray::new(from, d);
                        let mut count = 0;
                        bvh.all(&ray, Skip::NOTHING, |_| count += 1);
                        assert!(count >= 2, "{ray:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn rays_from_far_away_hit() {
    let mut rng = Rng::new(4, 0, 0);
    for offset in [0.0, 1e3, 1e6] {
        let shift = vec3(-1.0, 1.0, 0.5) * offset;
        let m = cube().transform(&Affine::translation(shift));
        for bvh in both(&m.soup()) {
            for distance in [1e2, 1e4, 1e6, 1e8] {
                for _ in 0..2_000 {
                    let target = shift + point(&mut rng) * 0.9;
                    let from = target + direction(&mut rng) * distance;
                    let ray = Ray::new(from, target - from);
                    assert!(bvh.closest(&ray, Skip::NOTHING).is_some(), "{ray:?}");
                }
            }
        }
    }
}

#[test]
fn many_coincident_triangles_build_fast_and_are_all_found() {
    let one = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let mut triangles = vec![one; 50_000];
    // Nested boxes are as bad for a bottom-up builder as equal ones.
    triangles.extend((1..50_000).map(|i| one.map(|v| v * (1.0 + f64::from(i) * 1e-5))));
    let ray = Ray::new(vec3(0.1, 0.1, 1.0), -Vec3::Z);
    for bvh in both(&triangles) {
        let mut count = 0;
        bvh.all(&ray, Skip::NOTHING, |_| count += 1);
        assert_eq!(count, triangles.len());
        assert_eq!(bvh.closest(&ray, Skip::two(0, 1)).unwrap().prim, 2);
    }
}

#[test]
fn empty_flat_and_unusable_scenes() {
    let ray = Ray::new(Vec3::ZERO, Vec3::Z);
    for bvh in both(&[]) {
        assert_eq!(bvh.closest(&ray, Skip::NOTHING), None);
        assert_eq!(bvh.closest_point(Vec3::ZERO), None);
        assert!(!bvh.inside(Vec3::ZERO) && bvh.bounds().is_empty());
    }
    for bvh in both(&[[Vec3::X; 3], [Vec3::ZERO, Vec3::X, Vec3::X * 2.0]]) {
        assert_eq!(bvh.closest(&ray, Skip::NOTHING), None);
    }
    for bad in [f64::NAN, f64::INFINITY, -1e101] {
        let triangles =
            [[Vec3::ZERO, Vec3::X, Vec3::Y], [Vec3::ZERO, vec3(0.0, bad, 0.0), Vec3::Y]];
        let error = TriangleBvh::build(&triangles).unwrap_err();
        assert_eq!(error, BvhError::BadCoordinate { prim: 1 });
    }
    for bvh in both(&cube().soup()) {
        for ray in [
            Ray::new(vec3(f64::NAN, 0.0, 0.0), Vec3::X),
            Ray::new(Vec3::ZERO, Vec3::ZERO),
            Ray::new(Vec3::ZERO, vec3(f64::INFINITY, 0.0, 0.0)),
            Ray { t_max: f64::NAN, ..Ray::new(Vec3::ZERO, Vec3::X) },
            Ray { t_max: 0.0, ..Ray::new(Vec3::ZERO, Vec3::X) },
            Ray { t_max: -1.0, ..Ray::new(Vec3::ZERO, Vec3::X) },
        ] {
            assert_eq!(bvh.closest(&ray, Skip::NOTHING), None, "{ray:?}");
        }
    }
}
