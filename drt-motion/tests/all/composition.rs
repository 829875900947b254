//! Several parameters and effects at nonzero values, against finite differences of the moved
//! geometry.

use crate::common::*;
use drt_geom::{Mesh, procedural};
use drt_math::{Affine, Mat3, Rng, Vec3};
use drt_motion::parameter::Applied;
use drt_motion::surface::{MovedMesh, move_affine, move_mesh};
use drt_motion::{GeometryChange, SurfaceMotion, SurfacePoint};

const PARAMETERS: usize = 4;

fn random_affine_change(rng: &mut Rng) -> GeometryChange {
    match rng.next_u32() % 4 {
        0 => GeometryChange::Translate(random_vec(rng)),
        1 => GeometryChange::Rotate { axis: random_vec(rng) * 3.0, pivot: random_vec(rng) },
        2 => GeometryChange::Scale { factor: random_vec(rng), pivot: random_vec(rng) },
        _ => {
            let Affine { linear, translation } = random_affine(rng);
            GeometryChange::Matrix(Affine { linear: linear * 0.5, translation })
        }
    }
}

fn random_change(rng: &mut Rng, mesh: &Mesh) -> GeometryChange {
    let count = mesh.source_vertex_count;
    match rng.next_u32() % 5 {
        2 => GeometryChange::Cage {
            mesh: procedural::icosphere(0).transform(&random_affine(rng)).into(),
            vertices: [2, 7, 2].map(|v| (v, random_vec(rng) * 0.2)).into(),
        },
        0 => GeometryChange::VertexVelocity(
            random_vecs(rng, count as usize).iter().map(|v| *v * 0.3).collect(),
        ),
        1 => GeometryChange::Vertex { index: rng.next_u32() % count, direction: random_vec(rng) },
        _ => random_affine_change(rng),
    }
}

/// Changes of random parameters, at the parameters' values.
struct Scene {
    values: [f64; PARAMETERS],
    changes: Vec<(usize, GeometryChange)>,
}

impl Scene {
    fn new(rng: &mut Rng, mut change: impl FnMut(&mut Rng) -> GeometryChange) -> Self {
        let values = [(); PARAMETERS].map(|()| 0.6 * rng.next_f64() - 0.3);
        let changes =
            (0..5).map(|_| ((rng.next_u32() as usize) % PARAMETERS, change(rng))).collect();
        Self { values, changes }
    }

    /// The changes with one parameter's value shifted.
    fn at(&self, shifted: usize, shift: f64) -> Vec<Applied<'_, GeometryChange>> {
        let theta = |p| self.values[p] + if p == shifted { shift } else { 0.0 };
        let applied = |(parameter, change)| Applied { parameter, theta: theta(parameter), change };
        self.changes.iter().map(|(p, c)| applied((*p, c))).collect()
    }

    fn mesh(&self, mesh: &Mesh, shifted: usize, shift: f64) -> MovedMesh {
        move_mesh(mesh, &self.at(shifted, shift), PARAMETERS).unwrap()
    }
}

/// Velocity, both normals' rates and relative growth of area, at a point of a moved mesh.
fn jet(moved: &MovedMesh, parameter: usize, point: &SurfacePoint) -> Vec<Vec3> {
    let jet = moved.motions[parameter].jet(&moved.mesh, point);
    vec![jet.u, jet.n_dot, jet.ns_dot, Vec3::X * jet.j_dot]
}

fn state(moved: &MovedMesh, point: &SurfacePoint, area: f64) -> Vec<Vec3> {
    let element = drt_motion::surface::SurfaceElement::new(&moved.mesh, point);
    let ratio = moved.mesh.area(point.triangle) / area;
    vec![element.position(), element.normal(), element.shading_normal(), Vec3::X * ratio]
}

#[test]
fn surfaces_move_as_the_meshes_do() {
    let mut rng = Rng::new(20, 0, 0);
    let mut fault_seen: f64 = 0.0;
    for round in 0..150 {
        let mut mesh = sheet(&mut rng, 3);
        if round % 2 == 0 {
            mesh = mesh.with_smooth_normals();
        }
        let affine = round % 3 == 0;
        let scene = Scene::new(&mut rng, |rng| {
            if affine { random_affine_change(rng) } else { random_change(rng, &mesh) }
        });
        let here = scene.mesh(&mesh, 0, 0.0);
        for parameter in 0..PARAMETERS {
            let point = random_point(&mut rng, &mesh);
            let area = here.mesh.area(point.triangle);
            let expected =
                finite_difference(|h| state(&scene.mesh(&mesh, parameter, h), &point, area));
            let found = jet(&here, parameter, &point);
            if expected.iter().all(|v| v.max_abs() < 1e-11) {
                assert!(found.iter().all(|v| v.max_abs() < 1e-11));
                continue;
            }
            assert_close(&found, &expected, 1e-7);

            // A velocity that later changes do not carry along.
            let last = scene.changes.iter().rposition(|(p, _)| *p == parameter);
            let cut = scene.at(0, 0.0);
            let cut = move_mesh(&mesh, &cut[..=last.unwrap()], PARAMETERS).unwrap();
            let fault = jet(&cut, parameter, &point);
            fault_seen = fault_seen.max(relative_error(&flat(&fault), &flat(&expected)));
        }
    }
    assert!(fault_seen > 0.1, "velocities that are not carried along pass");
}

#[test]
fn a_change_of_vertices_at_zero_is_no_jump() {
    let mut rng = Rng::new(21, 0, 0);
    // Normals that no smoothing would produce.
    let mesh = sheet(&mut rng, 4);
    let n = mesh.positions.len();
    let mesh = mesh.with_normals(random_vecs(&mut rng, n)).unwrap();
    let vertex = GeometryChange::Vertex { index: 12, direction: Vec3::Z };
    let turn = GeometryChange::Rotate { axis: Vec3::X, pivot: Vec3::Y };
    let normals_at = |theta: f64| {
        let changes = [
            Applied { parameter: 0, theta: 0.3, change: &turn },
            Applied { parameter: 1, theta, change: &vertex },
        ];
        move_mesh(&mesh, &changes, 2).unwrap().mesh.normals.unwrap()
    };
    assert_close(&normals_at(1e-9), &normals_at(0.0), 1e-8);
}

#[test]
fn frames_move_as_points_placed_by_them() {
    let mut rng = Rng::new(22, 0, 0);
    for _ in 0..100 {
        let scene = Scene::new(&mut rng, random_affine_change);
        let point = random_vec(&mut rng);
        let frame = |p, h| move_affine(&scene.at(p, h), PARAMETERS).unwrap();
        let here = frame(0, 0.0);
        for p in 0..PARAMETERS {
            let expected = finite_difference(|h| vec![frame(p, h).map.point(point)]);
            let found = here.velocities[p].point(here.map.point(point));
            assert!((found - expected[0]).max_abs() < 1e-8 * expected[0].max_abs().max(1.0));
        }
    }
}

#[test]
fn split_copies_move_with_their_file_vertex() {
    let mut rng = Rng::new(23, 0, 0);
    let mesh = sheet(&mut rng, 4);
    let copy = mesh.positions.len() as u32 - 1;
    let index = mesh.source_vertex(copy);
    let change = GeometryChange::Vertex { index, direction: Vec3::Z };
    let moved =
        move_mesh(&mesh, &[Applied { parameter: 0, theta: 2.0, change: &change }], 1).unwrap();
    let lifted: Vec<u32> = (0..=copy)
        .filter(|&i| moved.mesh.positions[i as usize] != mesh.positions[i as usize])
        .collect();
    assert_eq!(lifted.len(), 2);
    assert!(lifted.iter().all(|&i| mesh.source_vertex(i) == index));
}

#[test]
fn kinds_of_motion_are_kept_as_simple_as_they_are() {
    let mut rng = Rng::new(24, 0, 0);
    let mesh = sheet(&mut rng, 4).with_smooth_normals();
    let turn = GeometryChange::Rotate { axis: Vec3::Z, pivot: Vec3::X };
    let shift = GeometryChange::Translate(Vec3::X);
    let still = GeometryChange::Translate(Vec3::ZERO);
    let vertex = GeometryChange::Vertex { index: 0, direction: Vec3::Z };
    let applied = |parameter, theta, change| Applied { parameter, theta, change };
    let motions = |changes: &[_]| move_mesh(&mesh, changes, 3).unwrap().motions;

    let m = motions(&[applied(0, 0.5, &turn), applied(1, 0.1, &shift), applied(2, 0.1, &still)]);
    assert!(matches!(m[0], SurfaceMotion::Affine(_)));
    assert!(matches!(m[1], SurfaceMotion::Affine(Affine { linear: Mat3::ZERO, .. })));
    assert_eq!(m[2], SurfaceMotion::Rest);

    let m = motions(&[applied(2, 0.1, &vertex), applied(0, 0.5, &turn), applied(1, 0.1, &shift)]);
    assert!(matches!(m[0], SurfaceMotion::Affine(_)));
    assert!(matches!(m[1], SurfaceMotion::Affine(_)));
    assert!(matches!(m[2], SurfaceMotion::Vertices { normals: Some(_), .. }));

    // Vertices moved singly after a turn no longer turn about one axis.
    let m = motions(&[applied(0, 0.5, &turn), applied(2, 0.1, &vertex)]);
    assert!(matches!(m[0], SurfaceMotion::Vertices { .. }));

    // Recomputed normals are weighed by angles, which a stretch changes.
    let stretch = GeometryChange::Scale { factor: Vec3::X, pivot: Vec3::ZERO };
    let m = motions(&[applied(0, 0.0, &stretch), applied(1, 0.0, &vertex)]);
    assert!(matches!(m[0], SurfaceMotion::Vertices { .. }));
}
