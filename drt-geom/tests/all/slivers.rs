//! Tetrahedra that stand small motions of their corners.

use std::collections::BTreeMap;

use drt_geom::procedural::{bumpy_sphere, icosphere};
use drt_geom::{
    Mesh, TetLocator, TetMesh, TetVertexOrigin, Tetrahedralization, TetrahedralizeInput,
    tetrahedralize,
};
use drt_math::{Affine, Mat3, Vec3, vec3};

/// A cube of n × n cells per side, turned: all corners of a cell lie on one circle but for rounding.
fn turned_cube(n: u32) -> Mesh {
    let mut numbers = BTreeMap::new();
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    let mut vertex = |axis: usize, side: u32, i: u32, j: u32| {
        let mut at = [side; 3];
        (at[(axis + 1) % 3], at[(axis + 2) % 3]) = (i, j);
        *numbers.entry(at).or_insert_with(|| {
            let [x, y, z] = at.map(|k| 2.0 * f64::from(k) / f64::from(n) - 1.0);
            positions.push(vec3(x, y, z));
            positions.len() as u32 - 1
        })
    };
    for axis in 0..3 {
        for side in [0, n] {
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
                let [a, b, c, d] = corners.map(|(i, j)| vertex(axis, side, i, j));
                for [p, q, r] in [[a, b, c], [a, c, d]] {
                    triangles.push(if side == 0 { [p, r, q] } else { [p, q, r] });
                }
            }
        }
    }
    let turn = Mat3::rotation(vec3(0.3, 1.0, 0.2).normalize(), 0.7);
    let place = Affine { linear: turn, translation: vec3(0.1, 0.2, 0.3) };
    Mesh::new(positions, triangles).expect("a mesh").transform(&place)
}

fn filled(surface: &Mesh) -> Tetrahedralization {
    let input = TetrahedralizeInput { surfaces: &[surface], points: &[], margin: 0.5 };
    tetrahedralize(&input).expect("tetrahedra")
}

/// Whether space keeps its sides when what lies on the surface is bent.
fn stands(made: &Tetrahedralization, by: f64) -> bool {
    let bend = |p: Vec3| vec3(-p.x * p.z, 0.0, 0.5 * p.x * p.x) * by;
    let on = |o: &TetVertexOrigin| matches!(o, TetVertexOrigin::Surface { .. });
    let moved = made.mesh.positions.iter().zip(&made.origins);
    let positions = moved.map(|(p, o)| if on(o) { *p + bend(*p) } else { *p }).collect();
    TetLocator::new(&TetMesh { positions, tets: made.mesh.tets.clone() }).is_ok()
}

#[test]
fn slivers_go() {
    let bodies =
        [turned_cube(2), turned_cube(3), turned_cube(4), icosphere(2), bumpy_sphere(2, 0.3, 3.0)];
    for (n, body) in bodies.iter().enumerate() {
        let before = filled(body);
        let mut made = before.clone();
        made.remove_slivers(&[body]);
        made.mesh.validate().expect("still a mesh");
        // Without slivers on them the sides are known again by their place.
        made.mesh.conformity(body).expect("still along the surface");
        assert_eq!(made.origins.len(), made.mesh.positions.len());
        let count = before.mesh.positions.len();
        assert_eq!(made.mesh.positions[..count], before.mesh.positions[..]);
        let volume = |m: &TetMesh| (0..m.tets.len() as u32).map(|t| m.volume(t)).sum::<f64>();
        let (a, b) = (volume(&before.mesh), volume(&made.mesh));
        assert!((a - b).abs() < 1e-12 * a);
        for by in [-0.15, 0.15] {
            assert!(stands(&made, by), "body {n} bent by {by}");
        }
        // What was there did not stand it: the test can fail.
        assert!(n >= 3 || !stands(&before, 1e-6), "body {n} had no slivers");
    }
}
