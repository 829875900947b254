//! Edge classes against shapes whose edges are known.

use core::f64::consts::{FRAC_PI_2, PI};

use drt_geom::procedural::{TorusKnot, cube, grid, icosphere, torus_knot};
use drt_geom::{EdgeClass, Mesh, NONE, Topology};
use drt_math::{Affine, Mat3, Rng, Vec3, vec3};

fn count(t: &Topology, class: EdgeClass) -> usize {
    t.edges.iter().filter(|e| e.class == class).count()
}

/// Every triangle with vertices of its own.
fn unwelded(m: &Mesh) -> Mesh {
    let positions: Vec<_> = m.soup().into_iter().flatten().collect();
    let triangles = (0..m.triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Mesh::new(positions, triangles).unwrap()
}

#[test]
fn a_cube_has_twelve_ridges_at_any_scale_and_place() {
    for (scale, offset) in [(1.0, 0.0), (1e-6, 0.0), (1e6, 1e3), (1e-40, 0.0), (1e40, 0.0)] {
        let linear = Mat3::rotation(vec3(0.6, 0.0, 0.8), 0.7) * Mat3::diagonal(Vec3::splat(scale));
        let m = cube().transform(&Affine { linear, translation: Vec3::splat(offset) });
        for m in [m.clone(), unwelded(&m)] {
            let t = Topology::of(&m);
            assert!(t.is_closed() && t.is_consistently_oriented());
            assert_eq!(t.edges.len(), 18);
            assert_eq!(count(&t, EdgeClass::Convex), 12, "scale {scale}");
            assert_eq!(count(&t, EdgeClass::Flat), 6, "scale {scale}");
            for e in &t.edges {
                let expected = if e.class == EdgeClass::Flat { PI } else { 1.5 * PI };
                assert!((e.widest_angle - expected).abs() < 1e-9);
                assert_eq!(e.can_be_silhouette(), e.class == EdgeClass::Convex);
            }
        }
    }
}

#[test]
fn inside_out_ridges_are_valleys() {
    let mut m = cube();
    m.flip();
    let t = Topology::of(&m);
    assert_eq!(count(&t, EdgeClass::Concave), 12);
    assert!(
        t.edges.iter().filter(|e| e.class == EdgeClass::Concave).all(|e| e.can_be_silhouette())
    );
}

#[test]
fn edges_know_their_faces() {
    let m = torus_knot(&TorusKnot { segments: 60, sides: 7, ..TorusKnot::default() });
    let t = Topology::of(&m);
    assert!(count(&t, EdgeClass::Concave) > 50 && count(&t, EdgeClass::Convex) > 500);
    for (index, e) in (0..).zip(&t.edges) {
        for side in 0..2 {
            let face = e.faces[side];
            let corners = m.triangles[face as usize];
            assert!(t.face_edges[face as usize].contains(&index));
            assert!(corners.contains(&e.opposite[side]));
            assert!(!e.vertices.contains(&e.opposite[side]));
        }
        let first = m.triangles[e.faces[0] as usize];
        let k = first.iter().position(|&v| v == e.vertices[0]).unwrap();
        assert_eq!(first[(k + 1) % 3], e.vertices[1]);
        // The class is that of the opposite vertex over the first face's plane.
        let origin = m.positions[e.vertices[0] as usize];
        let height = m.normal(e.faces[0]).dot(m.positions[e.opposite[1] as usize] - origin);
        assert_eq!(e.class == EdgeClass::Convex, height < -1e-7, "{e:?} {height}");
    }
    for edges in &t.face_edges {
        assert!(!edges.contains(&NONE));
    }
}

#[test]
fn rims_of_a_grid() {
    let t = Topology::of(&grid(4, 3));
    assert_eq!(count(&t, EdgeClass::Boundary), 14);
    assert_eq!(count(&t, EdgeClass::Flat), t.edges.len() - 14);
    for e in t.edges.iter().filter(|e| e.class == EdgeClass::Boundary) {
        assert!(e.faces[1] == NONE && e.opposite[1] == NONE && e.can_be_silhouette());
    }
    assert!(!t.is_closed());
    assert!(!Topology::of(&Mesh::default()).is_closed());
}

/// `n` faces around the edge from the origin to z, at the given angles.
fn book(angles: &[f64]) -> Mesh {
    let mut positions = vec![Vec3::ZERO, Vec3::Z];
    positions.extend(angles.iter().map(|a| vec3(a.cos(), a.sin(), 0.3)));
    let pages =
        (0..angles.len() as u32).map(|i| if i % 2 == 0 { [0, 1, i + 2] } else { [1, 0, i + 2] });
    Mesh::new(positions, pages.collect()).unwrap()
}

fn spine(angles: &[f64]) -> (Mesh, drt_geom::Edge) {
    let m = book(angles);
    let t = Topology::of(&m);
    let e = *t.edges.iter().find(|e| e.class != EdgeClass::Boundary).unwrap();
    (m, e)
}

#[test]
fn books_of_many_pages() {
    // All pages within half a turn: silhouettes, with the outermost pages as the pair.
    let (_, e) = spine(&[0.0, 0.8, 1.2, 0.3]);
    assert_eq!(e.class, EdgeClass::NonManifold);
    assert_eq!(e.faces, [0, 2]);
    assert!((e.widest_angle - (2.0 * PI - 1.2)).abs() < 1e-12 && e.can_be_silhouette());
    // Pages all round hide each other from everywhere.
    let (_, e) = spine(&[0.0, 2.0, 4.0]);
    assert!(e.class == EdgeClass::NonManifold && !e.can_be_silhouette());
    // A wall on a floor, and a page against its own copy.
    let (_, e) = spine(&[0.0, FRAC_PI_2, PI]);
    assert!(!e.can_be_silhouette());
    let (_, e) = spine(&[0.5, 0.5]);
    assert!((e.widest_angle - 2.0 * PI).abs() < 1e-12 && e.can_be_silhouette());
}

/// The two-face test on the pair is the all-faces test, for every direction.
#[test]
fn the_pair_stands_for_all_pages() {
    let mut rng = Rng::new(1, 0, 0);
    for _ in 0..200 {
        let n = 2 + (rng.next_f64() * 4.0) as usize;
        let width = rng.next_f64() * 6.2;
        let angles: Vec<_> = (0..n).map(|_| width * rng.next_f64()).collect();
        let (m, e) = spine(&angles);
        let mut grazing = 0;
        for i in 0..360 {
            let phi = (f64::from(i) + rng.next_f64()) * PI / 180.0;
            let across = vec3(-phi.sin(), phi.cos(), 0.0);
            let side = |v: u32| m.positions[v as usize].dot(across) > 0.0;
            let all = (2..2 + n as u32).map(side).collect::<Vec<_>>();
            let one_sided = all.iter().all(|s| *s == all[0]);
            let pair = side(e.opposite[0]) == side(e.opposite[1]);
            assert_eq!(one_sided, pair && e.can_be_silhouette());
            grazing += i32::from(one_sided);
        }
        let expected = 360.0 * f64::max(0.0, (e.widest_angle - PI) / PI);
        assert!((f64::from(grazing) - expected).abs() < 6.0, "{grazing} {expected}");
    }
}

#[test]
fn nearly_flat_is_flat_only_within_the_tolerance() {
    for (angle, flat) in [(1e-8, true), (5e-7, true), (2e-6, false), (1e-3, false)] {
        for sign in [-1.0, 1.0] {
            let (_, e) = spine(&[0.0, PI + sign * angle]);
            let class = if flat {
                EdgeClass::Flat
            } else if sign > 0.0 {
                EdgeClass::Convex
            } else {
                EdgeClass::Concave
            };
            assert_eq!(e.class, class, "{angle} {sign}");
        }
    }
}

#[test]
fn spheres_have_no_flat_edges() {
    let t = Topology::of(&icosphere(4));
    assert_eq!(count(&t, EdgeClass::Convex), t.edges.len());
    assert_eq!(t.edges.len(), 30 * 256);
}
