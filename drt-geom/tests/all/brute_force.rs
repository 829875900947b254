//! Every query, in trees by each builder and by portable instructions, against each triangle asked alone: the same hits, bit for bit.

use crate::common::{BruteForce, direction, point, soup};
use drt_geom::{BvhBuilder, Hit, Ray, Skip, TriangleBvh};
use drt_math::{Rng, Vec3, vec3};

fn assert_agreement(triangles: &[[Vec3; 3]], rays: impl Iterator<Item = Ray>) -> usize {
    let brute = BruteForce::new(triangles);
    let built = TriangleBvh::build(triangles).unwrap();
    let binned = TriangleBvh::build_by(BvhBuilder::Binned, triangles).unwrap();
    let trees = [built.clone().portable(), built, binned];
    let mut out = Vec::new();
    let mut total = 0;
    for ray in rays {
        let expected = brute.all(&ray);
        total += expected.len();
        for tree in &trees {
            assert_eq!(tree.closest(&ray, Skip::NOTHING), expected.first().copied(), "{ray:?}");
            assert_eq!(tree.any(&ray, Skip::NOTHING, |_| true), !expected.is_empty(), "{ray:?}");
            assert!(!tree.crossings(&ray, Skip::NOTHING, |_| false, &mut out));
            assert_eq!(out, expected, "{ray:?}");
            let end = expected.get(1).copied();
            let blocks = |p| end.is_some_and(|e: Hit| e.prim == p);
            assert_eq!(tree.closest_through(&ray, Skip::NOTHING, blocks, &mut out), end);
            assert_eq!(out, expected[..expected.len().min(1)], "{ray:?}");
            let mut all: Vec<Hit> = Vec::new();
            tree.all(&ray, Skip::NOTHING, |h| all.push(h));
            assert_eq!(all.len(), expected.len(), "{ray:?}");
            if let [first, second, ..] = expected[..] {
                let next = tree.closest(&ray, Skip::one(first.prim));
                assert_eq!(next, Some(second), "{ray:?}");
                let third = tree.closest(&ray, Skip::two(second.prim, first.prim));
                assert_eq!(third, expected.get(2).copied(), "{ray:?}");
                let blocked = tree.crossings(&ray, Skip::NOTHING, |p| p == second.prim, &mut out);
                assert!(blocked && out.is_empty());
                assert!(!tree.any(&ray, Skip::one(second.prim), |p| p == second.prim));
            }
        }
    }
    total
}

#[test]
fn random_soups_at_many_places_and_scales() {
    let places = [
        (1.0, 0.0),
        (1e-6, 0.0),
        (1e6, 0.0),
        (1.0, 1e3),
        (1.0, 1e6),
        (1e-6, 1.0),
        (1e6, 1e9),
        (1e-50, 0.0),
        (1e50, 0.0),
    ];
    let mut hits = 0;
    for (seed, (scale, offset)) in (0..).zip(places) {
        let shift = vec3(1.0, -0.5, 0.25) * offset;
        let place = |p: Vec3| p * scale + shift;
        let triangles: Vec<_> = soup(150, 0.5, seed).iter().map(|t| t.map(place)).collect();
        let mut rng = Rng::new(seed, 1, 0);
        let rays = (0..12_000).map(|i| {
            let (from, to) = (place(point(&mut rng) * 1.5), place(point(&mut rng) * 1.5));
            match i % 3 {
                0 => Ray::segment(from, to),
                1 => Ray::new(from, (to - from) * 1e-3),
                _ => Ray::new(from + (from - to) * 1e3, to - from),
            }
        });
        hits += assert_agreement(&triangles, rays);
    }
    assert!(hits > 150_000, "{hits}");
}

#[test]
fn long_thin_and_very_unequal_triangles() {
    let mut rng = Rng::new(5, 0, 0);
    let mut triangles = soup(60, 1e-4, 6);
    triangles.extend(soup(60, 3.0, 7));
    triangles.extend((0..60).map(|_| {
        let (a, d) = (point(&mut rng), direction(&mut rng));
        [a, a + d * 2.0, a + d + point(&mut rng) * 1e-5]
    }));
    let mut aim = Rng::new(8, 0, 0);
    let targets = triangles.clone();
    let rays = (0..10_000).map(|i| {
        let [a, b, c] = targets[i % targets.len()];
        let from = point(&mut aim) * 2.0;
        Ray::new(from, (a + b + c) * (1.0 / 3.0) - from)
    });
    assert!(assert_agreement(&triangles, rays) > 50_000);
}

#[test]
fn coincident_and_degenerate_triangles() {
    let mut triangles = soup(40, 0.8, 9);
    let [a, b, c] = triangles[3];
    triangles.extend([[b, c, a], [a, c, b], [a, b, c], [a, a, b], [a, b, (a + b) * 0.5]]);
    let mut rng = Rng::new(10, 0, 0);
    let rays = (0..5_000).map(|_| Ray::new(point(&mut rng), direction(&mut rng)));
    assert!(assert_agreement(&triangles, rays) > 1_000);

    // All four copies are reported, the lowest first.
    let bvh = TriangleBvh::build(&triangles).unwrap();
    let middle = (a + b + c) * (1.0 / 3.0);
    let n = (b - a).cross(c - a).normalize();
    let mut hits = Vec::new();
    bvh.crossings(
        &Ray::segment(middle + n * 1e-3, middle - n * 1e-3),
        Skip::NOTHING,
        |_| false,
        &mut hits,
    );
    let prims: Vec<_> = hits.iter().map(|h| h.prim).collect();
    let mut sorted = prims.clone();
    sorted.sort_unstable();
    assert_eq!(sorted, [3, 40, 41, 42]);
}

/// A coordinate as scenes made by hand have them, often the same.
fn notch(rng: &mut Rng) -> f64 {
    f64::from(rng.next_u32() % 9) * 0.25 - 1.0
}

#[test]
fn rays_through_corners_and_edges_within_planes_and_along_axes() {
    let mut hits = 0;
    for seed in 0..6 {
        let mut rng = Rng::new(seed, 3, 0);
        let corner = |rng: &mut Rng| vec3(notch(rng), notch(rng), notch(rng));
        let mut triangles: Vec<_> = (0..120).map(|_| [0; 3].map(|_| corner(&mut rng))).collect();
        // Boxes without thickness.
        triangles.extend((0..60).map(|i| {
            let plane = notch(&mut rng);
            [0; 3].map(|_| {
                let mut v = corner(&mut rng).to_array();
                v[i % 3] = plane;
                Vec3::from(v)
            })
        }));
        let targets = triangles.clone();
        let rays = (0..8_000).map(|i| {
            let [a, b, c] = targets[i % targets.len()];
            let on_edge = a.lerp(b, notch(&mut rng));
            let within = (a + b + c) * (1.0 / 3.0);
            let sign = if i % 2 == 0 { 0.0 } else { -0.0 };
            let tiny = [0.0, -0.0, 1e-300, -1e-300, 1e-38, -1e-20][i % 6];
            match rng.next_u32() % 9 {
                // From corner to corner, edge to edge, within the plane.
                0 => Ray::segment(a, corner(&mut rng)),
                1 => Ray::segment(a, b),
                2 => Ray::new(on_edge, within - on_edge),
                3 => Ray::new(on_edge - (c - on_edge) * 2.0, c - on_edge),
                // Along an axis, or hardly off it, through corners and edges.
                4 => Ray::new(vec3(a.x, a.y, -3.0), vec3(sign, tiny, 1.0)),
                5 => Ray::new(vec3(3.0, on_edge.y, on_edge.z), vec3(-1.0, tiny, sign)),
                6 => Ray::new(vec3(a.x, 1e9, b.z), vec3(tiny, -1e9, -sign)),
                // Very short and very long directions.
                7 => Ray::new(corner(&mut rng), (within - point(&mut rng)) * 1e-200),
                _ => Ray::new(point(&mut rng) * 1e6, (within - point(&mut rng) * 1e6) * 1e150),
            }
        });
        hits += assert_agreement(&triangles, rays);
    }
    assert!(hits > 100_000, "{hits}");
}

#[test]
fn hits_lie_where_they_say() {
    let triangles = soup(200, 0.5, 11);
    let bvh = TriangleBvh::build(&triangles).unwrap();
    let mut rng = Rng::new(12, 0, 0);
    for _ in 0..20_000 {
        let ray = Ray::new(point(&mut rng), direction(&mut rng) * 0.3);
        let Some(hit) = bvh.closest(&ray, Skip::NOTHING) else { continue };
        let [u, v] = hit.bary;
        assert!(u >= 0.0 && v >= 0.0 && u + v <= 1.0 + 1e-15);
        let distance = (hit.point(triangles[hit.prim as usize]) - ray.at(hit.t)).length();
        assert!(distance < 1e-12, "{distance}");
    }
}

#[test]
fn refitted_trees_are_as_good_as_new() {
    let before = soup(300, 0.3, 13);
    let mut after = soup(300, 0.5, 14);
    // Coincident triangles part, and a triangle loses its area.
    let mut before_twin = before.clone();
    before_twin[7] = before_twin[8];
    for (start, degenerate) in [(&before, false), (&before_twin, false), (&before, true)] {
        if degenerate {
            after[5] = [after[5][0]; 3];
        }
        let fresh = TriangleBvh::build(&after).unwrap();
        for mut tree in
            [TriangleBvh::build(start).unwrap(), TriangleBvh::build(start).unwrap().portable()]
        {
            tree.refit(&after).unwrap();
            assert_eq!(tree.bounds(), fresh.bounds());
            let mut rng = Rng::new(15, 0, 0);
            for _ in 0..3_000 {
                let ray = Ray::new(point(&mut rng), direction(&mut rng));
                assert_eq!(tree.closest(&ray, Skip::NOTHING), fresh.closest(&ray, Skip::NOTHING));
            }
            assert!(tree.refit(&after[1..]).is_err());
            let mut broken = after.clone();
            broken[0][0].y = f64::NAN;
            assert!(tree.refit(&broken).is_err());
            let ray = Ray::new(Vec3::ZERO, Vec3::X);
            assert_eq!(tree.closest(&ray, Skip::NOTHING), fresh.closest(&ray, Skip::NOTHING));
        }
    }
}
