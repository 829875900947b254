//! What many parameters do that each move little: memory and work are counted in stored vectors and in motions
//! felt on a triangle, which must not grow with the mesh.

use drt_geom::{Mesh, procedural};
use drt_math::{Vec3, vec3};
use drt_motion::SurfacePoint;
use drt_motion::parameter::{Applied, GeometryChange};
use drt_motion::surface::{MovedMesh, ReachedTriangles, SurfaceMotion, VertexVectors, move_mesh};

/// A parameter for every vertex of the file, at the same value.
fn vertex_by_vertex(mesh: &Mesh, theta: f64) -> MovedMesh {
    let direction = |index: u32| vec3(0.3, 1.0, -0.2) * (1.0 + f64::from(index % 7));
    let change = |index| GeometryChange::Vertex { index, direction: direction(index) };
    let changes: Vec<_> = (0..mesh.source_vertex_count).map(change).collect();
    let applied: Vec<_> = (changes.iter().enumerate())
        .map(|(parameter, change)| Applied { parameter, theta, change })
        .collect();
    move_mesh(mesh, &applied, changes.len()).unwrap()
}

fn parts(motion: &SurfaceMotion) -> (&VertexVectors, Option<&VertexVectors>) {
    let SurfaceMotion::Vertices { positions, normals } = motion else {
        panic!("a vertex moves, not {motion:?}");
    };
    (positions, normals.as_ref())
}

/// Away from the poles, where many triangles meet.
fn few_around(mesh: &Mesh, moved: &MovedMesh) -> Vec<usize> {
    let low = |p: &usize| {
        mesh.positions[parts(&moved.motions[*p]).0.stored().next().unwrap().0].z.abs() < 0.9
    };
    (0..moved.motions.len()).filter(low).collect()
}

#[test]
fn each_stores_what_it_moves_and_no_more() {
    for theta in [0.0, 1e-4] {
        let mut stored = Vec::new();
        for bands in [16, 48] {
            let mesh = procedural::uv_sphere(bands);
            let moved = vertex_by_vertex(&mesh, theta);
            let count = |v: &VertexVectors| v.stored().count();
            let most = few_around(&mesh, &moved).into_iter().map(|p| {
                let (positions, normals) = parts(&moved.motions[p]);
                count(positions) + count(normals.unwrap())
            });
            stored.push(most.max().unwrap());
        }
        assert_eq!(stored[0], stored[1], "what a vertex stores depends on the mesh at {theta}");
        assert!(stored[1] <= 20, "{stored:?} vectors of one vertex and its neighbours");
    }
}

/// The normals are those that all velocities together give, to the last bit.
#[test]
fn few_vertices_turn_normals_as_all_would() {
    let mesh = procedural::uv_sphere(24);
    let moved = vertex_by_vertex(&mesh, 1e-3);
    let smooth = moved.smooth.as_ref().unwrap();
    for motion in &moved.motions {
        let (positions, normals) = parts(motion);
        let all = smooth.rates(&moved.mesh, &Vec::from(positions.clone()));
        assert_eq!(Vec::from(normals.unwrap().clone()), all);
    }
}

/// On a triangle those motions are felt that move its corners, or turn their normals, whatever the number of the others.
#[test]
fn few_motions_are_felt_on_a_triangle() {
    for mesh in [procedural::uv_sphere(24), Mesh { normals: None, ..procedural::uv_sphere(24) }] {
        let mut moved = vertex_by_vertex(&mesh, 1e-3);
        moved.motions.push(SurfaceMotion::Affine(drt_math::Affine::translation(Vec3::X)));
        let reached = ReachedTriangles::new(&moved.mesh, &moved.motions);
        let mut felt = 0;
        for triangle in 0..mesh.triangles.len() as u32 {
            let on: Vec<usize> = reached.on(triangle).collect();
            felt += on.len();
            let point = SurfacePoint { triangle, bary: [0.3, 0.2] };
            for (n, motion) in moved.motions.iter().enumerate() {
                let jet = motion.jet(&moved.mesh, &point);
                let zero = jet.u == Vec3::ZERO && jet.ns_dot == Vec3::ZERO && jet.j_dot == 0.0;
                assert!(zero || on.contains(&n), "motion {n} on {triangle}: {jet:?}");
            }
        }
        let each = felt as f64 / mesh.triangles.len() as f64;
        // The poles have as many neighbours as there are meridians.
        assert!(each < 24.0, "{each} motions a triangle");
    }
}

/// One parameter that moves many vertices is stored as it was.
#[test]
fn many_vertices_are_stored_together() {
    let mesh = procedural::uv_sphere(16);
    let change =
        GeometryChange::VertexVelocity(vec![Vec3::X; mesh.source_vertex_count as usize].into());
    let applied = [Applied { parameter: 0, theta: 0.5, change: &change }];
    let moved = move_mesh(&mesh, &applied, 1).unwrap();
    let (positions, _) = parts(&moved.motions[0]);
    assert_eq!(positions.stored().count(), mesh.positions.len());
    assert!(ReachedTriangles::new(&mesh, &moved.motions).on(0).eq([0]));
}
