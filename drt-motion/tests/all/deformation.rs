//! Deformations that are linear on tetrahedra, against dual numbers and differences.

use std::ops::ControlFlow;

use drt_geom::procedural::icosphere;
use drt_geom::{TetMesh, TetrahedralizeInput, tet_barycentric, tetrahedralize};
use drt_math::{Dual, Mat3, Real, Rng, Vec3, vec3};
use drt_motion::deformation::{Deformation, DeformationError};

/// A ball in a box, put far from the origin and blown up or down.
fn tetrahedra(offset: Vec3, size: f64) -> TetMesh {
    let ball = icosphere(1);
    let input = TetrahedralizeInput { surfaces: &[&ball], points: &[], margin: 0.5 };
    let mut made = tetrahedralize(&input).expect("tetrahedra");
    made.remove_slivers(&[&ball]);
    let mut mesh = made.mesh;
    mesh.positions.iter_mut().for_each(|p| *p = *p * size + offset);
    mesh
}

/// A bend and a twist that die out towards the box, `theta` times.
fn bend(p: Vec3) -> Vec3 {
    let fade = f64::max(1.0 - p.length_squared() / 4.0, 0.0);
    vec3(p.y * p.z, -p.x * p.z, 0.5 * p.x * p.x) * fade
}

fn moved(mesh: &TetMesh, offset: Vec3, size: f64, theta: f64) -> (Vec<Vec3>, Vec<Vec3>) {
    let velocities: Vec<Vec3> =
        mesh.positions.iter().map(|p| bend((*p - offset) * (1.0 / size)) * size).collect();
    let positions = mesh.positions.iter().zip(&velocities).map(|(p, v)| *p + *v * theta);
    (positions.collect(), velocities)
}

fn random_point(rng: &mut Rng, half: f64) -> Vec3 {
    vec3(rng.next_f64(), rng.next_f64(), rng.next_f64()) * (2.0 * half) - Vec3::splat(half)
}

/// The map back in numbers of any kind, in the tetrahedron of a place.
fn material<T: Real>(
    mesh: &TetMesh,
    corners: [u32; 4],
    moved: [Vec3<T>; 4],
    x: Vec3<T>,
) -> Vec3<T> {
    let weights = tet_barycentric(moved, x);
    let unmoved = corners.map(|v| mesh.positions[v as usize].lift::<T>());
    (1..4).fold(unmoved[0] * weights[0], |sum, k| sum + unmoved[k] * weights[k])
}

#[test]
fn rates_are_those_of_dual_numbers() {
    type D = Dual<f64, 4>;
    let (offset, size) = (vec3(3.0, -2.0, 5.0), 1.7);
    let mesh = tetrahedra(offset, size);
    let theta = 0.3;
    let (positions, velocities) = moved(&mesh, offset, size, theta);
    let deformation =
        Deformation::new(&mesh, positions.clone()).expect("no tetrahedron turns over");
    let rng = &mut Rng::new(1, 0, 0);
    let mut worst = 0.0_f64;
    for _ in 0..2000 {
        let x = random_point(rng, 1.4) * size + offset;
        let place = deformation.place(x).expect("a point of the box");
        // Lane 3 is theta, the others the coordinates of x.
        let corners = place.corners.map(|v| {
            let (p, v) = (positions[v as usize], velocities[v as usize]);
            p.lift::<D>() + v.lift::<D>() * D::variable(0.0, 3)
        });
        let seen = vec3(D::variable(x.x, 0), D::variable(x.y, 1), D::variable(x.z, 2));
        let exact = material(&mesh, place.corners, corners, seen);
        let lanes = [exact.x, exact.y, exact.z];
        let lane = |k: usize| vec3(lanes[0].eps[k], lanes[1].eps[k], lanes[2].eps[k]);
        let inverse = Mat3 { cols: [lane(0), lane(1), lane(2)] };
        for (a, b) in inverse.cols.iter().zip(&place.inverse.cols) {
            worst = worst.max((*a - *b).max_abs());
        }
        worst = worst.max((lane(3) - place.material_rate(&velocities)).max_abs());
        worst = worst.max((exact.re() - place.material).max_abs());
    }
    println!("largest error {worst:.1e}");
    assert!(worst < 1e-10);
}

#[test]
fn the_map_back_is_the_inverse() {
    for (offset, size) in [(Vec3::ZERO, 1.0), (Vec3::splat(1e6), 1.0), (Vec3::ZERO, 1e-6)] {
        let mesh = tetrahedra(offset, size);
        let (positions, _) = moved(&mesh, offset, size, 0.3);
        let deformation = Deformation::new(&mesh, positions).expect("no tetrahedron turns over");
        let forward = deformation.inverse().expect("the unmoved tetrahedra");
        let rng = &mut Rng::new(2, 0, 0);
        let rounding = 1e-13 * (offset.max_abs() + size) * 100.0;
        for _ in 0..2000 {
            let material = random_point(rng, 1.4) * size + offset;
            let there = forward.place(material).expect("inside").material;
            let back = deformation.place(there).expect("inside");
            assert!((back.material - material).max_abs() < rounding);
        }
    }
}

#[test]
fn rates_are_differences_across_faces_too() {
    let mesh = tetrahedra(Vec3::ZERO, 1.0);
    let at = |theta| Deformation::new(&mesh, moved(&mesh, Vec3::ZERO, 1.0, theta).0).expect("fine");
    let (middle, low, high) = (at(0.2), at(0.2 - 1e-5), at(0.2 + 1e-5));
    let velocities = moved(&mesh, Vec3::ZERO, 1.0, 0.2).1;
    let rng = &mut Rng::new(3, 0, 0);
    let mut far = 0;
    for _ in 0..2000 {
        let x = random_point(rng, 1.4);
        let [low, high] = [&low, &high].map(|d| d.place(x).expect("inside").material);
        let difference = (high - low) * (0.5 / 1e-5);
        let rate = middle.place(x).expect("inside").material_rate(&velocities);
        far += u32::from((difference - rate).max_abs() > 1e-7);
    }
    // Where a face passed between.
    assert!(far < 5, "{far}");
}

#[test]
fn gradients_are_the_transpose() {
    let mesh = tetrahedra(Vec3::ZERO, 1.0);
    let (positions, velocities) = moved(&mesh, Vec3::ZERO, 1.0, 0.25);
    let deformation = Deformation::new(&mesh, positions).expect("fine");
    let rng = &mut Rng::new(4, 0, 0);
    let mut gradient = vec![Vec3::ZERO; velocities.len()];
    let (mut sum, mut size) = (0.0, 0.0);
    for _ in 0..500 {
        let place = deformation.place(random_point(rng, 1.4)).expect("inside");
        let adjoint = random_point(rng, 1.0);
        let part = adjoint.dot(place.material_rate(&velocities));
        (sum, size) = (sum + part, size + part.abs());
        place.scatter(adjoint, &mut gradient);
    }
    let paired: f64 = gradient.iter().zip(&velocities).map(|(g, v)| g.dot(*v)).sum();
    assert!((paired - sum).abs() < 1e-13 * size, "{paired} {sum}");
}

#[test]
fn stretches_cover_lines_with_their_maps() {
    for (offset, size) in [(Vec3::ZERO, 1.0), (Vec3::splat(1e4), 1e-2)] {
        let mesh = tetrahedra(offset, size);
        let (positions, _) = moved(&mesh, offset, size, 0.3);
        let deformation = Deformation::new(&mesh, positions).expect("fine");
        let rng = &mut Rng::new(5, 0, 0);
        let extent = mesh.bounds().extent().max_abs();
        for i in 0..300 {
            let target = random_point(rng, 1.0) * size + offset;
            // Along axes too, through vertices and edges of the box.
            let dir = match i % 4 {
                0 => Vec3::X,
                1 => (mesh.positions[i % mesh.positions.len()] - target).normalize(),
                _ => random_point(rng, 1.0).normalize(),
            };
            let origin = target - dir * (10.0 * extent);
            let (mut length, mut last) = (0.0, f64::NEG_INFINITY);
            deformation.stretches(origin, dir, f64::INFINITY, &mut |s| {
                assert!(s.end > s.start && s.start >= last);
                last = s.end;
                length += s.end - s.start;
                for part in [0.1, 0.5, 0.9] {
                    let x = origin + dir * (s.start + part * (s.end - s.start));
                    if let Some(place) = deformation.place(x) {
                        let off = (s.inverse.point(x) - place.material).max_abs();
                        assert!(off < 1e-10 * extent + 1e-9 * size, "{off}");
                    }
                }
                ControlFlow::Continue(())
            });
            let bounds = mesh.bounds();
            let inside = (0..10_000).filter(|k| {
                bounds.contains(origin + dir * (20.0 * extent * (f64::from(*k) + 0.5) / 1e4))
            });
            let expected = inside.count() as f64 * 20.0 * extent / 1e4;
            assert!((length - expected).abs() < 5e-3 * extent, "{length} {expected}");
        }
    }
}

#[test]
fn too_much_is_an_error() {
    let mesh = tetrahedra(Vec3::ZERO, 1.0);
    let (positions, _) = moved(&mesh, Vec3::ZERO, 1.0, 30.0);
    let found = Deformation::new(&mesh, positions);
    assert!(matches!(found, Err(DeformationError::TurnedOver { .. })));
    let few = Deformation::new(&mesh, Vec::new());
    assert!(matches!(few, Err(DeformationError::Count { found: 0, .. })));
}
