//! What makes tetrahedra a mesh, and a mesh one that follows a surface.

use crate::common::point;
use crate::common::tets::{jittered, slivers};
use drt_geom::{
    Aabb, ConformityError, Mesh, NONE, TetMesh, TetMeshError, Topology, procedural, weld,
};
use drt_math::{Rng, Vec3, vec3};

/// The boundary as a surface of its own, which shares no vertex numbers with the mesh.
fn boundary(mesh: &TetMesh) -> Mesh {
    let neighbours = mesh.neighbours().unwrap();
    let faces = TetMesh::boundary_faces(&neighbours);
    let corners: Vec<Vec3> =
        faces.flat_map(|(t, k)| mesh.face(t, k).map(|v| mesh.positions[v as usize])).collect();
    let triangles = (0..corners.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Mesh::new(corners, triangles).unwrap()
}

#[test]
fn neighbours_share_their_faces() {
    let mesh = slivers(3, 1e6, 1);
    mesh.validate().unwrap();
    let neighbours = mesh.neighbours().unwrap();
    let mut inner = 0;
    for (tet, across) in neighbours.iter().enumerate() {
        for (k, &other) in across.iter().enumerate() {
            let mut face = mesh.face(tet as u32, k);
            face.sort_unstable();
            if other == NONE {
                let on_side = |axis: usize| {
                    let x = face.map(|v| mesh.positions[v as usize][axis]);
                    x[0].abs() == 1.0 && x == [x[0]; 3]
                };
                assert!((0..3).any(on_side));
                continue;
            }
            inner += 1;
            let back = neighbours[other as usize].iter().position(|t| *t == tet as u32).unwrap();
            let mut same = mesh.face(other, back);
            same.sort_unstable();
            assert_eq!(same, face);
        }
    }
    assert!(inner > 600, "{inner}");
}

#[test]
fn the_boundary_is_closed_and_encloses_the_volumes() {
    let mesh = jittered(3, 2);
    let surface = boundary(&mesh);
    let volume: f64 = (0..mesh.tets.len() as u32).map(|t| mesh.volume(t)).sum();
    assert!((volume - 8.0).abs() < 1e-13 && (surface.volume() - 8.0).abs() < 1e-13);
    let topology = Topology::of(&surface);
    assert!(topology.is_closed() && topology.is_consistently_oriented());
}

#[test]
fn faults_are_named() {
    let good = jittered(2, 3);
    let fault = |change: &dyn Fn(&mut TetMesh)| {
        let mut mesh = good.clone();
        change(&mut mesh);
        mesh.validate().expect_err("a fault")
    };
    assert_eq!(good.validate(), Ok(()));
    assert_eq!(TetMesh::default().validate(), Ok(()));
    let found = fault(&|m| m.positions[4].y = f64::NAN);
    assert_eq!(found, TetMeshError::BadPosition { vertex: 4 });
    let found = fault(&|m| m.tets[9][2] = 27);
    assert_eq!(found, TetMeshError::IndexOutOfRange { tet: 9, index: 27, count: 27 });
    let found = fault(&|m| m.tets[9].swap(1, 2));
    assert_eq!(found, TetMeshError::Inverted { tet: 9 });
    let found = fault(&|m| m.tets[9][1] = m.tets[9][0]);
    assert_eq!(found, TetMeshError::Flat { tet: 9 });
    let found = fault(&|m| m.positions.push(Vec3::ZERO));
    assert_eq!(found, TetMeshError::UnreferencedVertex { vertex: 27 });
    let found = fault(&|m| m.tets.push(m.tets[5]));
    assert!(matches!(found, TetMeshError::Overlap { tets: [5, 48] }), "{found}");
    let found = fault(&|m| {
        // A third one on a face between two.
        let neighbours = m.neighbours().unwrap();
        let k = neighbours[20].iter().position(|t| *t != NONE).unwrap();
        let [a, b, c] = m.face(20, k);
        m.positions.push(vec3(9.0, 9.0, 9.0));
        m.tets.push([a, b, c, 27]);
        m.orient();
    });
    assert!(matches!(found, TetMeshError::FaceSharedByThree { tets: [_, _, 48], .. }), "{found}");
    let repeated = TetMesh { tets: vec![[0, 1, 2, 2]], ..good.clone() };
    assert_eq!(repeated.neighbours(), Err(TetMeshError::RepeatedVertex { tet: 0, vertex: 2 }));
}

#[test]
fn overlaps_are_seen_wherever_they_are() {
    // Two parts that share no vertices: side by side, and moved into each other by little or much.
    let together = |shift: Vec3| {
        let mut mesh = jittered(2, 4);
        let other = jittered(3, 5);
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(other.positions.iter().map(|p| *p + shift));
        mesh.tets.extend(other.tets.iter().map(|t| t.map(|v| v + first)));
        mesh.validate()
    };
    assert_eq!(together(Vec3::X * 2.0), Ok(()));
    assert_eq!(together(vec3(2.0, 1.9, 0.1)), Ok(()));
    let mut rng = Rng::new(6, 0, 0);
    for _ in 0..200 {
        let depth = 10.0_f64.powf(-12.0 * rng.next_f64());
        let turn = point(&mut rng) * 1.5;
        let found = together(vec3(2.0 - depth, turn.y, turn.z));
        assert!(
            matches!(found, Err(TetMeshError::Overlap { tets: [_, 48..=209] })),
            "{depth} {found:?}"
        );
    }
    assert!(matches!(together(Vec3::ZERO), Err(TetMeshError::Overlap { .. })));
    let mut twice = jittered(2, 4);
    twice.positions.extend(twice.positions.clone());
    twice.tets.extend(twice.tets.clone().iter().map(|t| t.map(|v| v + 27)));
    assert!(matches!(twice.validate(), Err(TetMeshError::Overlap { .. })));
}

#[test]
fn parts_that_only_touch_are_cracked() {
    let mut mesh = jittered(2, 4);
    let mirrored: Vec<_> = mesh.positions.iter().map(|p| vec3(2.0 - p.x, p.y, p.z)).collect();
    mesh.tets.extend(mesh.tets.clone().iter().map(|[a, b, c, d]| [b, a, c, d].map(|v| v + 27)));
    mesh.positions.extend(mirrored);
    let found = mesh.validate();
    assert!(matches!(found, Err(TetMeshError::Crack { tets: [0..48, 48..=95] })), "{found:?}");
    let merged = weld(&mesh.positions);
    mesh.tets.iter_mut().flatten().for_each(|v| *v = merged[*v as usize]);
    assert!(matches!(mesh.validate(), Err(TetMeshError::UnreferencedVertex { .. })));
    let neighbours = mesh.neighbours().unwrap();
    assert_eq!(TetMesh::boundary_faces(&neighbours).count(), 2 * 5 * 8);
}

#[test]
fn inverted_files_are_oriented() {
    let good = jittered(2, 7);
    let mut mesh = good.clone();
    mesh.tets.iter_mut().step_by(3).for_each(|t| t.swap(0, 2));
    assert_eq!((mesh.orient(), mesh.orient()), (16, 0));
    assert_eq!(mesh.validate(), Ok(()));
    // At any size the sign is that of the volume.
    for scale in [1e-90, 1e-30, 1e30, 1e90] {
        let mut tiny = good.clone();
        tiny.positions.iter_mut().for_each(|p| *p *= scale);
        assert_eq!((tiny.orient(), tiny.validate()), (0, Ok(())));
    }
}

/// Two cells of tetrahedra above another two, and what is between them.
fn layers() -> (TetMesh, Mesh) {
    let bounds = Aabb { min: vec3(0.0, 0.0, -1.0), max: vec3(2.0, 2.0, 1.0) };
    let mesh = procedural::tet_grid([4, 4, 4], &bounds);
    let corners = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
    let positions = corners.iter().map(|[x, y]| vec3(*x, *y, 0.0)).collect();
    // The diagonal along which cells are cut too.
    (mesh, Mesh::new(positions, vec![[0, 1, 2], [0, 2, 3]]).unwrap())
}

#[test]
fn vertices_on_a_surface_know_their_place() {
    let (mesh, surface) = layers();
    let places = mesh.conformity(&surface).unwrap();
    assert_eq!(places.len(), 25);
    for (vertex, place) in &places {
        let [a, b, c] = surface.triangle(place.triangle);
        let [u, v] = place.bary;
        let p = a * (1.0 - u - v) + b * u + c * v;
        assert!((p - mesh.positions[*vertex as usize]).max_abs() < 1e-15);
    }
    let cube = jittered(3, 8);
    let places = cube.conformity(&procedural::cube()).map(|p| p.len());
    assert!(matches!(places, Err(ConformityError::FaceStraddles { .. })), "{places:?}");
    let places = cube.conformity(&boundary(&cube)).unwrap();
    assert_eq!(places.len(), 56);
    let nothing = Mesh::default();
    assert_eq!(cube.conformity(&nothing), Ok(vec![]));
}

#[test]
fn surfaces_that_are_not_followed_are_named() {
    let (mesh, surface) = layers();
    let mut other_diagonal = surface.clone();
    other_diagonal.triangles = vec![[0, 1, 3], [1, 2, 3]];
    let found = mesh.conformity(&other_diagonal).unwrap_err();
    assert!(matches!(found, ConformityError::FaceStraddles { triangle: 0..2, .. }), "{found}");
    let mut beyond = surface.clone();
    beyond.positions[2].x = 2.5;
    let found = mesh.conformity(&beyond).unwrap_err();
    assert!(matches!(
        found,
        ConformityError::FaceStraddles { .. } | ConformityError::NotCovered { .. }
    ));
    let mut lifted = surface.clone();
    lifted.positions.iter_mut().for_each(|p| p.z = 1e-6);
    let found = mesh.conformity(&lifted).unwrap_err();
    assert_eq!(found, ConformityError::NotCovered { triangle: 0, covered: 0.0 });
    let mut holed = mesh.clone();
    let on_plane =
        |t: &[u32; 4]| t.iter().filter(|v| mesh.positions[**v as usize].z == 0.0).count() == 3;
    let place = holed.tets.iter().position(on_plane).unwrap();
    let face = holed.tets[place];
    let same = |t: &[u32; 4]| {
        t.iter().filter(|v| face.contains(v) && mesh.positions[**v as usize].z == 0.0).count() == 3
    };
    holed.tets.retain(|t| !same(t));
    let found = holed.conformity(&surface).unwrap_err();
    let covered = 15.0 / 16.0;
    assert!(
        matches!(found, ConformityError::NotCovered { covered: c, .. } if c == covered),
        "{found}"
    );
}
