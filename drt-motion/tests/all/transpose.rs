//! Every map from a motion to rates, against its transpose.

use crate::common::*;
use drt_geom::Mesh;
use drt_math::{Affine, Rng, Vec3};
use drt_motion::parameter::Applied;
use drt_motion::surface::{
    AffineGradient, JetAdjoint, SurfaceJet, VertexGradient, in_file_order, move_mesh,
};
use drt_motion::volume::{VolumeAdjoint, VolumeMotion};
use drt_motion::{GeometryChange, SurfaceMotion, SurfacePoint};

fn random_adjoint(rng: &mut Rng) -> JetAdjoint {
    JetAdjoint { u: random_vec(rng), n: random_vec(rng), ns: random_vec(rng), j: random_vec(rng).x }
}

fn pair(jet: &SurfaceJet, a: &JetAdjoint) -> f64 {
    jet.u.dot(a.u) + jet.n_dot.dot(a.n) + jet.ns_dot.dot(a.ns) + jet.j_dot * a.j
}

/// Points with adjoints, the gradient they scatter, and their pairing with a motion's jets.
struct Samples(Vec<(SurfacePoint, JetAdjoint)>);

impl Samples {
    fn new(rng: &mut Rng, mesh: &Mesh) -> Self {
        Self((0..30).map(|_| (random_point(rng, mesh), random_adjoint(rng))).collect())
    }
    fn gradient(&self, mesh: &Mesh) -> VertexGradient {
        let mut gradient = VertexGradient::zeros(mesh);
        for (point, adjoint) in &self.0 {
            gradient.scatter(mesh, point, adjoint);
        }
        gradient
    }
    fn forward(&self, mesh: &Mesh, motion: &SurfaceMotion) -> f64 {
        self.0.iter().map(|(point, a)| pair(&motion.jet(mesh, point), a)).sum()
    }
}

#[track_caller]
fn assert_equal(forward: f64, reverse: f64) {
    assert!((forward - reverse).abs() <= 1e-12 * forward.abs().max(1.0), "{forward} {reverse}");
}

#[test]
fn jets() {
    let mut rng = Rng::new(30, 0, 0);
    for round in 0..40 {
        let mut mesh = sheet(&mut rng, 4);
        let n = mesh.positions.len();
        if round % 2 == 0 {
            mesh = mesh.with_normals(random_vecs(&mut rng, n)).unwrap();
        }
        let samples = Samples::new(&mut rng, &mesh);
        let gradient = samples.gradient(&mesh);
        let vertices = SurfaceMotion::Vertices {
            positions: random_vecs(&mut rng, n).into(),
            normals: mesh.normals.is_some().then(|| random_vecs(&mut rng, n).into()),
        };
        let affine = SurfaceMotion::Affine(random_affine(&mut rng));
        for motion in [&vertices, &affine, &SurfaceMotion::Rest] {
            assert_equal(samples.forward(&mesh, motion), gradient.dot(&mesh, motion));
        }
        let mut fault = gradient.clone();
        fault.positions[7] = -fault.positions[7];
        let (right, wrong) = (gradient.dot(&mesh, &vertices), fault.dot(&mesh, &vertices));
        assert!(gradient.positions[7] == Vec3::ZERO || (right - wrong).abs() > 1e-6);
    }
}

#[test]
fn velocities_alone() {
    let mut rng = Rng::new(31, 0, 0);
    let mesh = sheet(&mut rng, 4).with_smooth_normals();
    let mut short = VertexGradient::zeros(&mesh);
    let mut long = short.clone();
    for _ in 0..30 {
        let (point, u) = (random_point(&mut rng, &mesh), random_vec(&mut rng));
        short.scatter_velocity(&mesh, &point, u);
        long.scatter(&mesh, &point, &JetAdjoint { u, ..JetAdjoint::default() });
    }
    assert_eq!(short, long);
    short.add(&long);
    let motion = SurfaceMotion::Affine(random_affine(&mut rng));
    assert_equal(short.dot(&mesh, &motion), 2.0 * long.dot(&mesh, &motion));
}

/// The gradient with respect to all vertices at once, against one parameter that moves them all.
#[test]
fn all_vertices_of_a_file() {
    let mut rng = Rng::new(32, 0, 0);
    let mesh = sheet(&mut rng, 5).with_smooth_normals();
    let velocities = random_vecs(&mut rng, mesh.source_vertex_count as usize);
    let change = GeometryChange::VertexVelocity(velocities.clone().into());
    let applied = [Applied { parameter: 0, theta: 0.05, change: &change }];
    let moved = move_mesh(&mesh, &applied, 1).unwrap();
    let samples = Samples::new(&mut rng, &moved.mesh);
    let gradient = samples.gradient(&moved.mesh);

    let per_vertex = gradient.finish(&moved.mesh, moved.smooth.as_ref().unwrap());
    let per_file_vertex = in_file_order(&moved.mesh, &per_vertex);
    let reverse = inner(&per_file_vertex, &velocities);
    assert_equal(samples.forward(&moved.mesh, &moved.motions[0]), reverse);
    assert!((inner(&gradient.positions, &velocities) - reverse).abs() > 1e-3);
}

#[test]
fn affine_coefficients() {
    let mut rng = Rng::new(33, 0, 0);
    let mesh = sheet(&mut rng, 4).with_smooth_normals();
    let gradient = Samples::new(&mut rng, &mesh).gradient(&mesh).to_affine(&mesh);
    for row in 0..3 {
        for column in 0..3 {
            let mut field = Affine::ZERO;
            let unit = [Vec3::X, Vec3::Y, Vec3::Z][row];
            field.linear.cols[column] = unit;
            assert_equal(gradient.linear.cols[column][row], gradient.dot(&field));
        }
    }
}

#[test]
fn volume_jets() {
    let mut rng = Rng::new(34, 0, 0);
    let field = random_affine(&mut rng);
    let motion = VolumeMotion::Affine(field);
    let mut gradient = AffineGradient::default();
    let mut forward = 0.0;
    for _ in 0..30 {
        let x = random_vec(&mut rng);
        let adjoint = VolumeAdjoint { u: random_vec(&mut rng), j: random_vec(&mut rng).x };
        let jet = motion.jet(x);
        assert_eq!((jet.u, jet.j_dot), (motion.velocity(x), motion.divergence(x)));
        forward += jet.u.dot(adjoint.u) + jet.j_dot * adjoint.j;
        gradient.scatter(x, &adjoint);
    }
    assert_equal(forward, gradient.dot(&field));
}
