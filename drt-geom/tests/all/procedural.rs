//! Every procedural shape: closed where it should be, outward, with the measures geometry gives it.

use core::f64::consts::PI;

use drt_geom::procedural::*;
use drt_geom::{Mesh, Topology};
use drt_math::Vec3;

fn assert_closed_and_outward(name: &str, m: &Mesh) {
    let t = Topology::of(m);
    assert!(t.is_closed(), "{name}: open");
    assert!(t.is_consistently_oriented(), "{name}: orientation");
    assert!(m.volume() > 0.0, "{name}: inside out");
    assert_eq!(m.drop_degenerate().1, 0, "{name}: degenerate triangles");
    assert!(Mesh::new(m.positions.clone(), m.triangles.clone()).is_ok(), "{name}");
}

#[test]
fn closed_shapes_are_closed_and_outward() {
    for n in 0..4 {
        assert_closed_and_outward("icosphere", &icosphere(n));
        assert_closed_and_outward("uv_sphere", &uv_sphere(2 + n));
        assert_closed_and_outward("bumpy_sphere", &bumpy_sphere(2 + n, 0.3, 8.0));
    }
    assert_closed_and_outward("cube", &cube());
    for (p, q) in [(2, 3), (3, 2), (1, 0), (5, 7)] {
        let knot = TorusKnot { p, q, tube: 0.05, ..TorusKnot::default() };
        assert_closed_and_outward("torus_knot", &torus_knot(&knot));
    }
    for seed in 0..4 {
        let tree = branching_tree(&BranchingTree { seed, ..BranchingTree::default() });
        assert_closed_and_outward("branching_tree", &tree);
    }
}

#[test]
fn a_flipped_triangle_is_noticed() {
    let mut m = cube();
    m.triangles[3].swap(0, 1);
    assert!(!Topology::of(&m).is_consistently_oriented());
    m.triangles.pop();
    assert!(!Topology::of(&m).is_closed());
}

#[test]
fn flat_shapes_face_up_and_have_their_area() {
    let spikes = star(5, 0.4, 1.0);
    let star_area = 5.0 * 0.4 * (PI / 5.0).sin();
    let shapes = [
        ("rectangle", rectangle(), 4.0),
        ("grid", grid(7, 3), 4.0),
        ("disk", disk(64), 32.0 * (PI / 32.0).sin()),
        ("star", spikes, star_area),
    ];
    for (name, m, area) in shapes {
        assert!((m.surface_area() - area).abs() < 1e-14 * area * 10.0, "{name}");
        for i in 0..m.triangles.len() as u32 {
            assert_eq!(m.normal(i), Vec3::Z, "{name}");
        }
        let t = Topology::of(&m);
        assert!(!t.is_closed() && t.is_consistently_oriented(), "{name}");
    }
}

#[test]
fn spheres_converge_to_the_sphere() {
    let volume = |n| icosphere(n).volume();
    let (coarse, fine) = (4.0 / 3.0 * PI - volume(3), 4.0 / 3.0 * PI - volume(4));
    assert!((coarse / fine - 4.0).abs() < 0.05, "second order: {}", coarse / fine);
    let uv = uv_sphere(200);
    assert!((uv.volume() / (4.0 / 3.0 * PI) - 1.0).abs() < 3e-4);
    for (p, n) in uv.positions.iter().zip(uv.normals.as_ref().unwrap()) {
        assert!((p.length() - 1.0).abs() < 1e-15 && p == n);
    }
    assert_eq!(icosphere(3).triangles.len(), 20 * 64);
    assert_eq!(cube().volume(), 8.0);
}

#[test]
fn a_tube_has_the_volume_of_its_length() {
    let ring =
        TorusKnot { p: 1, q: 0, major: 1.0, minor: 0.0, tube: 0.2, segments: 512, sides: 64 };
    let torus = 2.0 * PI * PI * 0.04;
    assert!((torus_knot(&ring).volume() / torus - 1.0).abs() < 2e-3);
}

#[test]
fn trees_depend_on_the_seed_only() {
    let tree = |seed| branching_tree(&BranchingTree { seed, ..BranchingTree::default() });
    assert_eq!(tree(3), tree(3));
    assert_ne!(tree(3), tree(4));
}
