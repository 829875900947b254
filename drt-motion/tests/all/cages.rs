//! Meshes carried by cages.

use std::sync::Arc;

use crate::common::*;
use drt_geom::{Mesh, procedural};
use drt_math::{Affine, Mat3, Rng, Vec3, vec3};
use drt_motion::GeometryChange;
use drt_motion::mean_value::{Cage, CageWeights};
use drt_motion::parameter::Applied;
use drt_motion::surface::{JetAdjoint, VertexGradient, move_mesh};

/// A cube around everything.
fn cage() -> Arc<Mesh> {
    procedural::cube()
        .transform(&Affine { linear: Mat3::IDENTITY * 4.0, translation: vec3(1.0, 1.0, 0.0) })
        .into()
}

fn all_vertices(cage: &Mesh, velocity: impl Fn(Vec3) -> Vec3) -> Arc<[(u32, Vec3)]> {
    let vertices = 0..cage.positions.len() as u32;
    let mut moves: Vec<(u32, Vec3)> =
        vertices.map(|i| (cage.source_vertex(i), velocity(cage.positions[i as usize]))).collect();
    moves.sort_by_key(|(i, _)| *i);
    moves.dedup_by_key(|(i, _)| *i);
    moves.into()
}

#[test]
fn a_linear_motion_of_the_cage_is_that_of_the_mesh() {
    let mut rng = Rng::new(80, 0, 0);
    let mesh = sheet(&mut rng, 4);
    let cage = cage();
    let field = random_affine(&mut rng);
    let change = GeometryChange::Cage {
        vertices: all_vertices(&cage, |p| field.point(p)),
        mesh: Arc::clone(&cage),
    };
    let theta = 0.7;
    let moved = move_mesh(&mesh, &[Applied { parameter: 0, theta, change: &change }], 1).unwrap();
    let expected: Vec<_> = mesh.positions.iter().map(|&x| x + field.point(x) * theta).collect();
    assert_close(&moved.mesh.positions, &expected, 1e-13);
}

#[test]
fn one_vertex_moves_by_its_coordinate_wherever_else_the_mesh_was_moved() {
    let mut rng = Rng::new(81, 0, 0);
    let mesh = sheet(&mut rng, 4).with_smooth_normals();
    let mesh_cage = cage();
    let prepared = Cage::new(&mesh_cage).unwrap();
    let weights = CageWeights::new(&prepared, &mesh.positions);
    let lift = |index| GeometryChange::Cage {
        mesh: Arc::clone(&mesh_cage),
        vertices: [(index, vec3(0.3, 0.1, 2.0))].into(),
    };
    let turn = GeometryChange::Rotate { axis: Vec3::Z, pivot: Vec3::X };
    let (first, second) = (lift(1), lift(6));
    let changes = [
        Applied { parameter: 1, theta: 0.4, change: &turn },
        Applied { parameter: 0, theta: 0.2, change: &first },
        Applied { parameter: 2, theta: -0.3, change: &second },
    ];
    let moved = move_mesh(&mesh, &changes, 3).unwrap();
    let turned = turn.affine(0.4).unwrap();
    for (i, &x) in mesh.positions.iter().enumerate() {
        let w = weights.of_point(i);
        let by = vec3(0.3, 0.1, 2.0) * (0.2 * w[1] - 0.3 * w[6]);
        assert!((moved.mesh.positions[i] - (turned.point(x) + by)).max_abs() < 1e-14);
    }
}

#[test]
fn seams_stay_closed() {
    let mut rng = Rng::new(82, 0, 0);
    let mesh = sheet(&mut rng, 4);
    let change = GeometryChange::Cage { mesh: cage(), vertices: [(3, Vec3::Z)].into() };
    let moved = move_mesh(&mesh, &[Applied { parameter: 0, theta: 1.0, change: &change }], 1);
    let moved = moved.unwrap().mesh;
    let copy = mesh.positions.len() - 1;
    let source = mesh.source_vertex(copy as u32);
    let original = (0..copy as u32).find(|&i| mesh.source_vertex(i) == source).unwrap();
    assert_ne!(moved.positions[copy], mesh.positions[copy]);
    assert_eq!(moved.positions[copy], moved.positions[original as usize]);

    // The cage's own copies: a cube of six separate sides, whose file has eight vertices.
    let cube = cage();
    let corners = cube.triangles.iter().flatten();
    let positions = corners.clone().map(|&i| cube.positions[i as usize]).collect();
    let welded = drt_geom::weld(&cube.positions);
    let mut names: Vec<u32> = welded.clone();
    names.sort_unstable();
    names.dedup();
    let name = |i: u32| names.binary_search(&welded[i as usize]).unwrap() as u32;
    let source = corners.map(|&i| name(i)).collect();
    let triangles = (0..cube.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    let split = Mesh::new(positions, triangles.collect()).unwrap();
    let split = split.with_source(source, names.len() as u32).unwrap();
    let weights = CageWeights::new(&Cage::new(&split).unwrap(), &mesh.positions);
    let whole = CageWeights::new(&Cage::new(&cube).unwrap(), &mesh.positions);
    for i in 0..mesh.positions.len() {
        let mut summed = vec![0.0; names.len()];
        for (v, w) in whole.of_point(i).iter().enumerate() {
            summed[name(v as u32) as usize] += w;
        }
        assert!(relative_error(weights.of_point(i), &summed) < 1e-14);
    }
}

#[test]
fn gathering_is_the_transpose_of_spreading() {
    let mut rng = Rng::new(83, 0, 0);
    let mesh = sheet(&mut rng, 4).with_smooth_normals();
    let cage_mesh = Arc::new(procedural::bumpy_sphere(1, 0.3, 3.0));
    let weights = CageWeights::new(&Cage::new(&cage_mesh).unwrap(), &mesh.positions);
    let v = random_vecs(&mut rng, cage_mesh.positions.len());
    let g = random_vecs(&mut rng, mesh.positions.len());
    let (forward, reverse) = (inner(&weights.spread(&v), &g), inner(&v, &weights.gather(&g)));
    assert!((forward - reverse).abs() < 1e-12 * forward.abs().max(1.0));

    // Down to the cage from what depends on the moved mesh's surface, normals included.
    let vertices = v.iter().enumerate().map(|(i, v)| (i as u32, *v)).collect();
    let change = GeometryChange::Cage { mesh: cage_mesh, vertices };
    let moved = move_mesh(&mesh, &[Applied { parameter: 0, theta: 0.0, change: &change }], 1);
    let moved = moved.unwrap();
    let mut gradient = VertexGradient::zeros(&moved.mesh);
    let mut forward = 0.0;
    for _ in 0..40 {
        let point = random_point(&mut rng, &moved.mesh);
        let a = JetAdjoint {
            u: random_vec(&mut rng),
            n: random_vec(&mut rng),
            ns: random_vec(&mut rng),
            j: 0.4,
        };
        gradient.scatter(&moved.mesh, &point, &a);
        let jet = moved.motions[0].jet(&moved.mesh, &point);
        forward += jet.u.dot(a.u) + jet.n_dot.dot(a.n) + jet.ns_dot.dot(a.ns) + jet.j_dot * a.j;
    }
    let per_vertex = gradient.finish(&moved.mesh, moved.smooth.as_ref().unwrap());
    let reverse = inner(&weights.gather(&per_vertex), &v);
    assert!((forward - reverse).abs() < 1e-11 * forward.abs().max(1.0), "{forward} {reverse}");
}

#[test]
fn a_cage_without_moving_vertices_moves_nothing() {
    let mesh = sheet(&mut Rng::new(84, 0, 0), 2);
    let change = GeometryChange::Cage { mesh: cage(), vertices: [].into() };
    let moved = move_mesh(&mesh, &[Applied { parameter: 0, theta: 1.0, change: &change }], 1);
    let moved = moved.unwrap();
    assert_eq!(moved.mesh.positions, mesh.positions);
    assert!(moved.motions[0].is_rest());
}
