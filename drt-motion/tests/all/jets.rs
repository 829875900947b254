//! Surface jets against dual numbers.

use crate::common::*;
use drt_geom::Mesh;
use drt_math::{Affine, Mat3, Real, Rng, Vec3};
use drt_motion::surface::{SurfaceElement, SurfaceJet};
use drt_motion::{SurfaceMotion, SurfacePoint};

/// The jet by differentiating position, normals and area of the moving triangle itself.
fn dual_jet(
    mesh: &Mesh,
    point: &SurfacePoint,
    position: impl Fn(usize) -> Vec3<Rate>,
    normal: impl Fn(usize) -> Vec3<Rate>,
) -> SurfaceJet {
    let corners = mesh.triangles[point.triangle as usize].map(|i| i as usize);
    let [w0, w1, w2] = point.weights().map(Rate::from);
    let [a, b, c] = corners.map(position);
    let area = (b - a).cross(c - a);
    let length = area.length();
    let shading = if mesh.normals.is_some() {
        let [na, nb, nc] = corners.map(normal);
        na * w0 + nb * w1 + nc * w2
    } else {
        area
    };
    SurfaceJet {
        u: derivative(a * w0 + b * w1 + c * w2),
        n_dot: derivative(area.normalize()),
        ns_dot: derivative(shading.normalize()),
        j_dot: (length / length.re()).eps[0],
    }
}

fn error(found: &SurfaceJet, expected: &SurfaceJet) -> f64 {
    let numbers = |j: &SurfaceJet| {
        let mut v = flat(&[j.u, j.n_dot, j.ns_dot]);
        v.push(j.j_dot);
        v
    };
    relative_error(&numbers(found), &numbers(expected))
}

#[test]
fn vertex_motion() {
    let mut rng = Rng::new(1, 0, 0);
    let mut fault_seen: f64 = 0.0;
    for round in 0..200 {
        let mut mesh = sheet(&mut rng, 4);
        let n = mesh.positions.len();
        if round % 2 == 0 {
            mesh = mesh.with_normals(random_vecs(&mut rng, n)).unwrap();
        }
        let velocities = random_vecs(&mut rng, n);
        let rates = random_vecs(&mut rng, n);
        let motion = SurfaceMotion::Vertices {
            positions: velocities.clone().into(),
            normals: mesh.normals.is_some().then(|| rates.clone().into()),
        };
        motion.check(&mesh).unwrap();
        let point = random_point(&mut rng, &mesh);
        let expected = dual_jet(
            &mesh,
            &point,
            |i| rate(mesh.positions[i], velocities[i]),
            |i| rate(mesh.normals.as_ref().unwrap()[i], rates[i]),
        );
        let found = motion.jet(&mesh, &point);
        assert!(error(&found, &expected) < 1e-10);
        assert_close(&[motion.velocity(&mesh, &point)], &[expected.u], 1e-14);
        let fault = SurfaceJet { j_dot: -found.j_dot, ..found };
        fault_seen = fault_seen.max(error(&fault, &expected));
    }
    assert!(fault_seen > 0.1, "a Jacobian of the wrong sign passes");
}

#[test]
fn affine_motion() {
    let mut rng = Rng::new(2, 0, 0);
    for round in 0..200 {
        let mut mesh = sheet(&mut rng, 4);
        if round % 2 == 0 {
            let n = mesh.positions.len();
            mesh = mesh.with_normals(random_vecs(&mut rng, n)).unwrap();
        }
        let field = random_affine(&mut rng);
        let motion = SurfaceMotion::Affine(field);
        let point = random_point(&mut rng, &mesh);
        let expected = dual_jet(
            &mesh,
            &point,
            |i| rate(mesh.positions[i], field.point(mesh.positions[i])),
            |i| {
                // Normals of x + eps A x turn by (I + eps A)⁻ᵀ.
                let unit = Mat3::<f64>::IDENTITY.cols;
                let map = Mat3 { cols: [0, 1, 2].map(|c| rate(unit[c], field.linear.cols[c])) };
                map.inverse().transpose_mul(mesh.normals.as_ref().unwrap()[i].lift()).normalize()
            },
        );
        assert!(error(&motion.jet(&mesh, &point), &expected) < 1e-10);
        assert_close(&[motion.velocity(&mesh, &point)], &[expected.u], 1e-14);
    }
}

#[test]
fn a_rigid_motion_keeps_areas_and_turns_normals() {
    let mut rng = Rng::new(3, 0, 0);
    let mesh = sheet(&mut rng, 4).with_smooth_normals();
    let w = random_vec(&mut rng);
    let motion =
        SurfaceMotion::Affine(Affine { linear: Mat3::skew(w), translation: random_vec(&mut rng) });
    let point = random_point(&mut rng, &mesh);
    let element = SurfaceElement::new(&mesh, &point);
    let jet = motion.jet_of(&element);
    assert!(jet.j_dot.abs() < 1e-15);
    assert_close(&[jet.n_dot], &[w.cross(element.normal())], 1e-14);
    assert_close(&[jet.ns_dot], &[w.cross(element.shading_normal())], 1e-14);
}

#[test]
fn motions_add_up() {
    let mut rng = Rng::new(4, 0, 0);
    let mesh = sheet(&mut rng, 4).with_smooth_normals();
    let n = mesh.positions.len();
    let mut vertices = || SurfaceMotion::Vertices {
        positions: random_vecs(&mut rng, n).into(),
        normals: Some(random_vecs(&mut rng, n).into()),
    };
    let motions = [
        vertices(),
        vertices(),
        SurfaceMotion::Affine(random_affine(&mut rng)),
        SurfaceMotion::Affine(random_affine(&mut rng)),
        SurfaceMotion::Rest,
    ];
    let point = random_point(&mut rng, &mesh);
    let element = SurfaceElement::new(&mesh, &point);
    for a in &motions {
        for b in &motions {
            let (ja, jb) = (a.jet_of(&element), b.jet_of(&element));
            let sum = SurfaceJet {
                u: ja.u + jb.u,
                n_dot: ja.n_dot + jb.n_dot,
                ns_dot: ja.ns_dot + jb.ns_dot,
                j_dot: ja.j_dot + jb.j_dot,
            };
            let found = a.plus(b, &mesh).jet_of(&element);
            assert!(found == sum || error(&found, &sum) < 1e-13);
        }
    }
}

#[test]
fn a_triangle_without_area_gives_no_nan() {
    let line = vec![Vec3::ZERO, Vec3::X, Vec3::X * 2.0];
    let mesh = Mesh::new(line, vec![[0, 1, 2]]).unwrap();
    let motion = SurfaceMotion::Vertices {
        positions: vec![Vec3::X, Vec3::Y, Vec3::Z].into(),
        normals: None,
    };
    let jet = motion.jet(&mesh, &SurfacePoint { triangle: 0, bary: [0.25, 0.25] });
    assert_eq!((jet.n_dot, jet.ns_dot, jet.j_dot), (Vec3::ZERO, Vec3::ZERO, 0.0));
}
