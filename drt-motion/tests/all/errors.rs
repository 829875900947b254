//! What cannot be applied says so, and why.

use crate::common::*;
use drt_geom::{Mesh, procedural};
use drt_math::{Affine, Mat3, Rng, Vec3, vec3};
use drt_motion::parameter::Applied;
use drt_motion::surface::{move_affine, move_mesh};
use drt_motion::{Cause, GeometryChange, MotionError, SurfaceMotion};

fn triangle() -> Mesh {
    Mesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap()
}

fn apply(change: &GeometryChange, theta: f64) -> Result<(), MotionError> {
    move_mesh(&triangle(), &[Applied { parameter: 1, theta, change }], 2).map(|_| ())
}

#[track_caller]
fn cause(change: &GeometryChange, theta: f64) -> Cause {
    let error = apply(change, theta).unwrap_err();
    assert_eq!((error.parameter, error.change), (1, change.kind()));
    error.cause
}

#[test]
fn a_wrong_vertex_count_names_both() {
    let change = GeometryChange::VertexVelocity(vec![Vec3::X; 4].into());
    let error = apply(&change, 0.0).unwrap_err();
    assert_eq!(
        error.to_string(),
        "parameter 1, `vertex_velocity`: expected 3 velocities, one per vertex of the mesh file in \
         its order, found 4"
    );
    let change = GeometryChange::Vertex { index: 3, direction: Vec3::X };
    assert_eq!(cause(&change, 0.0), Cause::VertexIndex { index: 3, count: 3 });
}

#[test]
fn cages_that_carry_nothing() {
    let cage = |mesh: &Mesh, vertex, v: Vec3| GeometryChange::Cage {
        mesh: mesh.clone().into(),
        vertices: [(vertex, v)].into(),
    };
    let cube = procedural::cube();
    let count = cube.source_vertex_count as usize;
    let missing = Cause::CageVertexIndex { index: count as u32, count };
    assert_eq!(cause(&cage(&cube, count as u32, Vec3::X), 0.0), missing);
    assert!(matches!(
        cause(&cage(&cube, 0, Vec3::X * f64::NAN), 0.0),
        Cause::NotFinite { what: "the direction" }
    ));

    let mut open = cube.clone();
    open.triangles.pop();
    let error = apply(&cage(&open, 0, Vec3::X), 0.0).unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("parameter 1, `cage`: the surface is not closed: the edge from vertex ")
    );
    let mut broken = cube.clone();
    broken.positions[0].x = f64::INFINITY;
    assert!(matches!(cause(&cage(&broken, 0, Vec3::X), 0.0), Cause::NotFinite { .. }));
    let plane = Affine { linear: Mat3::diagonal(vec3(1.0, 1.0, 0.0)), translation: Vec3::ZERO };
    assert_eq!(cause(&cage(&cube.transform(&plane), 0, Vec3::X), 0.0), Cause::FlatSurface);

    // The projective plane: a Möbius strip, and a fan from its rim to one point.
    let n = 5;
    let positions = (0..=n).map(|i| {
        let phi = f64::from(i) * core::f64::consts::TAU / f64::from(n);
        if i == n { Vec3::Z } else { vec3(phi.cos(), phi.sin(), 0.1 * f64::from(i)) }
    });
    let strip = (0..n).map(|i| [i, (i + 1) % n, (i + 2) % n]);
    let rim = (0..n).map(|i| [i, (i + 2) % n, n]);
    let mesh =
        Mesh::new(positions.collect(), strip.chain(rim).map(|t| t.map(|i| i as u32)).collect());
    assert_eq!(cause(&cage(&mesh.unwrap(), 0, Vec3::X), 0.0), Cause::OneSidedSurface);
}

#[test]
fn a_zero_axis() {
    let turn = |axis| GeometryChange::Rotate { axis, pivot: Vec3::ZERO };
    assert_eq!(cause(&turn(Vec3::ZERO), 0.5), Cause::ZeroAxis);
    // Lengths whose squares leave the range of numbers are directions all the same.
    for size in [1e-300, 1e300, f64::MIN_POSITIVE / 4.0] {
        apply(&turn(Vec3::Z * size), 0.5).unwrap();
        let map = turn(Vec3::Z * size).affine(0.5).unwrap();
        assert_close(&map.linear.cols, &Mat3::rotation(Vec3::Z, 0.5).cols, 1e-15);
    }
}

#[test]
fn numbers_that_are_not_finite() {
    for bad in [f64::NAN, f64::INFINITY] {
        let v = vec3(0.0, bad, 0.0);
        let matrix = Affine { linear: Mat3::diagonal(v), translation: Vec3::ZERO };
        for change in [
            GeometryChange::Translate(v),
            GeometryChange::Rotate { axis: v, pivot: Vec3::ZERO },
            GeometryChange::Rotate { axis: Vec3::X, pivot: v },
            GeometryChange::Scale { factor: v, pivot: Vec3::ZERO },
            GeometryChange::Scale { factor: Vec3::X, pivot: v },
            GeometryChange::Matrix(matrix),
            GeometryChange::VertexVelocity(vec![Vec3::X, v, Vec3::X].into()),
            GeometryChange::Vertex { index: 0, direction: v },
        ] {
            assert!(matches!(cause(&change, 0.0), Cause::NotFinite { .. }));
        }
        let fine = GeometryChange::Translate(Vec3::X);
        assert!(matches!(cause(&fine, bad), Cause::NotFinite { .. }));
    }
    let far = GeometryChange::Translate(Vec3::X * 1e300);
    assert!(matches!(cause(&far, 1e10), Cause::NotFinite { .. }));
    let huge = GeometryChange::Scale { factor: Vec3::X, pivot: Vec3::ZERO };
    assert!(matches!(cause(&huge, 1e4), Cause::NotFinite { .. }));
    let lift = GeometryChange::Vertex { index: 0, direction: Vec3::X * 1e200 };
    assert!(matches!(cause(&lift, 1e200), Cause::NotFinite { .. }));
}

#[test]
fn maps_that_collapse_or_mirror() {
    let shrink =
        GeometryChange::Matrix(Affine { linear: Mat3::IDENTITY * -1.0, translation: Vec3::ZERO });
    apply(&shrink, 0.5).unwrap();
    assert_eq!(cause(&shrink, 1.0), Cause::Collapsed { theta: 1.0, determinant: 0.0 });
    assert_eq!(cause(&shrink, 2.0), Cause::Collapsed { theta: 2.0, determinant: -1.0 });
}

#[test]
fn frames_have_no_vertices_and_indices_have_an_end() {
    let change = GeometryChange::Vertex { index: 0, direction: Vec3::X };
    let error = move_affine(&[Applied { parameter: 0, theta: 0.0, change: &change }], 1);
    assert_eq!(error.unwrap_err().cause, Cause::NotAffine);
    let change = GeometryChange::Translate(Vec3::X);
    let applied = [Applied { parameter: 2, theta: 0.0, change: &change }];
    assert_eq!(move_affine(&applied, 2).unwrap_err().cause, Cause::ParameterIndex { count: 2 });
}

#[test]
fn motions_that_do_not_fit_their_mesh() {
    let mesh = sheet(&mut Rng::new(40, 0, 0), 2);
    let n = mesh.positions.len();
    let motion = |n| SurfaceMotion::Vertices { positions: vec![Vec3::X; n].into(), normals: None };
    assert_eq!(motion(n).check(&mesh), Ok(()));
    let short = Cause::MotionLength { expected: n, found: n - 1 };
    assert_eq!(motion(n - 1).check(&mesh), Err(short));
    let field = Affine::IDENTITY.times(f64::NAN);
    assert!(SurfaceMotion::Affine(field).check(&mesh).is_err());
}
