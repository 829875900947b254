//! Vertex normals that turn by parameters of their own, against differences.

use drt_geom::procedural::uv_sphere;
use drt_math::{Affine, Mat3, Rng, Vec3, vec3};
use drt_motion::parameter::Applied;
use drt_motion::surface::move_mesh;
use drt_motion::{Cause, GeometryChange, SurfaceMotion};

fn changes(vectors: &[Vec3]) -> [GeometryChange; 3] {
    let shear = Affine {
        linear: Mat3::from_rows(vec3(0.2, 0.5, 0.0), vec3(0.0, -0.3, 0.4), vec3(0.3, 0.0, 0.1)),
        translation: vec3(0.3, 0.1, 0.0),
    };
    [
        GeometryChange::Rotate { axis: vec3(0.3, 1.0, 0.2), pivot: vec3(0.1, 0.0, 0.4) },
        GeometryChange::VertexNormals(vectors.into()),
        GeometryChange::Matrix(shear),
    ]
}

/// Before and after other changes, each of which turns the normals, too.
#[test]
fn rates_are_differences() {
    let mesh = uv_sphere(5).with_smooth_normals();
    let mut rng = Rng::new(1, 0, 0);
    let mut vector = || vec3(rng.next_f64(), rng.next_f64(), rng.next_f64()) - Vec3::splat(0.5);
    let vectors: Vec<Vec3> = (0..mesh.source_vertex_count).map(|_| vector()).collect();
    let list = changes(&vectors);
    let at = |values: [f64; 3]| {
        let applied: Vec<_> = (0..)
            .zip(values)
            .zip(&list)
            .map(|((parameter, theta), change)| Applied { parameter, theta, change })
            .collect();
        move_mesh(&mesh, &applied, 3).unwrap()
    };
    let values = [0.4, 0.3, -0.2];
    let moved = at(values);
    for k in 0..3 {
        let h = 1e-5;
        let [more, less] = [h, -h].map(|h| {
            let mut other = values;
            other[k] += h;
            at(other).mesh
        });
        let SurfaceMotion::Vertices { positions, normals: Some(normals) } =
            moved.motions[k].plus(&turning_of_nothing(&moved.mesh.positions), &moved.mesh)
        else {
            panic!("rates of vertices")
        };
        let [upper, lower] = [&more, &less].map(|m| m.normals.as_ref().unwrap());
        for i in 0..positions.len() {
            let x = (more.positions[i] - less.positions[i]) / (2.0 * h);
            let n = (upper[i] - lower[i]) / (2.0 * h);
            assert!((positions[i] - x).length() < 1e-8);
            assert!((normals[i] - n).length() < 1e-8, "{k}: {:?} {n:?}", normals[i]);
        }
    }
    assert!((moved.mesh.normals.as_ref().unwrap()[3].length() - 1.0).abs() < 1e-12);
}

fn turning_of_nothing(positions: &[Vec3]) -> SurfaceMotion {
    let rest = vec![Vec3::ZERO; positions.len()];
    SurfaceMotion::Vertices { positions: rest.clone().into(), normals: Some(rest.into()) }
}

#[test]
fn what_has_no_normals_of_its_own_is_refused() {
    let smooth = uv_sphere(4);
    let mut mesh = smooth.clone();
    mesh.normals = None;
    let count = mesh.source_vertex_count as usize;
    let turn = GeometryChange::VertexNormals(vec![Vec3::X; count].into());
    let pull = GeometryChange::Vertex { index: 0, direction: Vec3::X };
    let apply = |mesh, list: &[&GeometryChange]| {
        let applied: Vec<_> =
            list.iter().map(|c| Applied { parameter: 0, theta: 0.0, change: *c }).collect();
        move_mesh(mesh, &applied, 1).unwrap_err().cause
    };
    assert_eq!(apply(&mesh, &[&turn]), Cause::NoNormals);
    assert_eq!(apply(&smooth, &[&turn, &pull]), Cause::DeformedNormals);
    let few = GeometryChange::VertexNormals([Vec3::X].into());
    assert_eq!(apply(&smooth, &[&few]), Cause::VertexCount { expected: count, found: 1 });
    let normals = smooth.normals.clone().unwrap_or_default();
    let back: Vec<Vec3> = normals.iter().map(|n| -*n).collect();
    let away = GeometryChange::VertexNormals(back.into());
    let applied = [Applied { parameter: 0, theta: 1.0, change: &away }];
    assert_eq!(move_mesh(&smooth, &applied, 1).unwrap_err().cause, Cause::NoDirection);
}
