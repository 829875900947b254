//! Nothing that counts is out of reach.

use alloc::vec::Vec;

use crate::procedural;
use drt_math::{Rng, Vec3, vec3};

use crate::edges::tree::tests::setup::*;
use crate::edges::tree::*;

/// Points that amount to something but are never drawn, of all that amount to something.
fn lost(
    tree: &mut Drawing<'_>,
    segments: &[Segment],
    view: &Viewpoint,
    asked: &Viewpoint,
) -> [u32; 2] {
    let mut count = [0; 2];
    for (edge, s) in segments.iter().enumerate() {
        for u in [0.02, 0.5, 0.97] {
            let amount = kernel(s, u, view);
            if amount > 0.0 && amount.is_finite() {
                count[0] += u32::from(tree.pdf(asked, &ALL, edge, u) <= 0.0);
                count[1] += 1;
            }
        }
    }
    count
}

/// Points anywhere in a scene, in planes of its faces, on its faces, close to its edges, far off.
fn around(segments: &[Segment], extent: f64, rng: &mut Rng) -> Vec<Viewpoint> {
    let mut any = || segments[(rng.next_f64() * segments.len() as f64) as usize];
    let chosen: Vec<Segment> = (0..8).map(|_| any()).collect();
    let mut views = Vec::new();
    for s in &chosen {
        let n = s.faces[0];
        let tangent = (s.b - s.a).normalize();
        let across = n.cross(tangent);
        let middle = s.a.lerp(s.b, 0.3);
        let length = (s.b - s.a).length();
        let points = [
            middle + in_cube(rng) * extent,
            middle + across * (extent * (rng.next_f64() - 0.5)),
            middle + across * (0.1 * length),
            middle + direction(rng) * (1e-6 * length),
            middle + in_cube(rng) * (1e4 * extent),
            s.b + tangent * (0.5 * length),
        ];
        for x in points {
            views.push(Viewpoint::new(x, None));
            views.push(Viewpoint::new(x, Some((n, false))));
            views.push(Viewpoint::new(x, Some((-n, false))));
            views.push(Viewpoint::new(x, Some((direction(rng), true))));
        }
    }
    views
}

fn scenes(rng: &mut Rng) -> Vec<(f64, Vec<Segment>)> {
    let ball = segments(&procedural::icosphere(2), (1.0, [0.0; 2]));
    let far = moved(&procedural::bumpy_sphere(2, 0.3, 4.0), 1.0, Vec3::splat(1e6));
    let cubes = (0..30).flat_map(|_| {
        let cube = moved(&procedural::cube(), 0.1, in_cube(rng) * 2.0);
        segments(&cube, (0.0, [1.0, 0.0]))
    });
    let cubes: Vec<Segment> = cubes.collect();
    // Faces of all sorts, weights of all sizes.
    let soup = (0..300).map(|i| {
        let a = in_cube(rng);
        let b = a + in_cube(rng) * 0.3;
        let normal = |rng: &mut Rng| direction(rng).cross(b - a).normalize();
        let faces = [normal(rng), normal(rng)];
        let discontinuity = f64::powi(10.0, -(i % 40));
        Segment { a, b, faces, open: i % 7 == 0, discontinuity, crease: [discontinuity, 0.5] }
    });
    let soup: Vec<Segment> = soup.collect();
    [(3.0, still_life()), (2.0, ball), (2.0, segments(&far, PRIORS)), (3.0, cubes), (2.0, soup)]
        .into()
}

#[test]
fn every_segment_that_counts_can_be_drawn() {
    let mut rng = Rng::new(21, 0, 0);
    for (extent, segments) in scenes(&mut rng) {
        let tree = EdgeTree::new(&segments).unwrap();
        let mut tree = Drawing::new(&tree);
        let mut seen = 0;
        for view in around(&segments, extent, &mut rng) {
            let [lost, of] = lost(&mut tree, &segments, &view, &view);
            assert_eq!(lost, 0, "of {of}, from {view:?}");
            seen += of;
        }
        assert!(seen > 3000, "{seen}");
    }
}

/// Points in the cone to a sphere that amount to something but are never drawn on a look there, of all
/// that do.
fn lost_before(
    tree: &mut Drawing<'_>,
    segments: &[Segment],
    view: &Viewpoint,
    (center, radius): (Vec3, f64),
    asked: &Way,
) -> [u32; 2] {
    let mut count = [0; 2];
    let to = center - view.x;
    for (edge, s) in segments.iter().enumerate() {
        for u in [0.02, 0.5, 0.97] {
            let y = s.a.lerp(s.b, u) - view.x;
            let dir = y.normalize();
            let off = (to - dir * to.dot(dir)).length();
            let before = to.dot(dir) > 0.0 && off < radius * (1.0 - 1e-6);
            let near = y.length() < to.length() + radius;
            let amount = kernel(s, u, view);
            if before && near && amount > 0.0 && amount.is_finite() {
                count[0] += u32::from(tree.pdf(view, &[*asked], edge, u) <= 0.0);
                count[1] += 1;
            }
        }
    }
    count
}

#[test]
fn nor_is_what_counts_before_a_light_lost() {
    let mut rng = Rng::new(22, 0, 0);
    let (mut seen, mut missed) = (0, 0);
    for (extent, segments) in scenes(&mut rng) {
        let tree = EdgeTree::new(&segments).unwrap();
        let mut tree = Drawing::new(&tree);
        for view in around(&segments, extent, &mut rng) {
            let any = segments[(rng.next_f64() * segments.len() as f64) as usize];
            let light = (any.a + in_cube(&mut rng) * 0.3, 0.02 + 0.5 * rng.next_f64());
            let way = view.toward(1.0, light.0, light.1);
            let [lost, of] = lost_before(&mut tree, &segments, &view, light, &way);
            assert_eq!(lost, 0, "of {of}, from {view:?} towards {light:?}");
            seen += of;
            // Planted: a smaller light.
            let smaller = view.toward(1.0, light.0, 0.9 * light.1);
            missed += lost_before(&mut tree, &segments, &view, light, &smaller)[0];
        }
    }
    assert!(seen > 3000 && missed > 100, "{seen} {missed}");
}

#[test]
fn a_wrong_side_would_be_noticed() {
    let segments = still_life();
    let tree = EdgeTree::new(&segments).unwrap();
    let mut tree = Drawing::new(&tree);
    let (x, n) = (vec3(0.1, 0.2, 1.3), vec3(0.6, 0.0, -0.8));
    let view = Viewpoint::new(x, Some((n, false)));
    let [missed, of] = lost(&mut tree, &segments, &view, &Viewpoint::new(x, Some((-n, false))));
    assert!(missed > of / 2, "{missed} of {of}");
    let [missed, of] = lost(&mut tree, &segments, &view, &Viewpoint::new(-x, Some((n, false))));
    assert!(missed > 0, "{missed} of {of}");
}

#[test]
fn segments_without_use_are_left_out() {
    let good = still_life()[0];
    let bad = [
        Segment { b: good.a, ..good },
        Segment { a: vec3(f64::NAN, 0.0, 0.0), ..good },
        Segment { faces: [good.faces[0], Vec3::ZERO / 0.0], ..good },
        Segment { discontinuity: 0.0, crease: [0.0; 2], ..good },
        Segment { discontinuity: f64::INFINITY, ..good },
        Segment { discontinuity: -1.0, ..good },
    ];
    assert!(EdgeTree::new(&[]).is_none());
    assert!(EdgeTree::new(&bad).is_none());
    let mut all = bad.to_vec();
    all.push(good);
    let tree = EdgeTree::new(&all).unwrap();
    let mut tree = Drawing::new(&tree);
    let view = Viewpoint::new(vec3(0.3, 0.2, 2.0), None);
    let c = tree.sample(&view, &ALL, &mut Rng::new(1, 0, 0)).unwrap();
    assert_eq!(c.edge, bad.len());
    assert_eq!(tree.pdf(&view, &ALL, 0, 0.5), 0.0);
    assert_eq!(tree.pdf(&view, &ALL, 99, 0.5), 0.0);
    for x in [f64::NAN, f64::INFINITY, 1e200] {
        for normal in [None, Some((Vec3::Z, true)), Some((Vec3::Z, false))] {
            let nowhere = Viewpoint::new(vec3(x, 0.0, 0.0), normal);
            assert!(tree.sample(&nowhere, &ALL, &mut Rng::new(1, 0, 0)).is_none());
        }
    }
}

#[test]
fn segments_in_one_place_or_plane_are_like_others() {
    let one = Segment { open: true, ..still_life()[0] };
    let twins = alloc::vec![one; 10_000];
    let flat: Vec<Segment> = segments(&procedural::grid(60, 60), PRIORS);
    let line = (0..5000).map(|i| Segment { b: one.a + vec3(1.0, 0.0, 0.0) * f64::from(i), ..one });
    for segments in [twins, flat, line.collect()] {
        let tree = EdgeTree::new(&segments).unwrap();
        assert!(tree.bundles.len() < segments.len() / 4 + 2, "{}", tree.bundles.len());
        assert!(tree.families.len() < segments.len() / 32 + 2, "{}", tree.families.len());
        let mut tree = Drawing::new(&tree);
        let view = Viewpoint::new(vec3(0.2, 0.1, 0.7), None);
        let mut rng = Rng::new(3, 0, 0);
        let mut hit: Vec<usize> =
            (0..2000).map(|_| tree.sample(&view, &ALL, &mut rng).unwrap().edge).collect();
        hit.sort_unstable();
        hit.dedup();
        assert!(hit.len() > segments.len().min(200) / 2, "{}", hit.len());
    }
}
