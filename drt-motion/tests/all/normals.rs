//! Recomputed vertex normals, their rates and the transpose of those.

use crate::common::*;
use drt_geom::{Mesh, weld};
use drt_math::{Real, Rng, Vec3, vec3};
use drt_motion::surface::SmoothNormals;

/// Angle-weighted mean normals written for any scalar, with the angles from arc cosines.
fn mean_normals<T: Real>(mesh: &Mesh, x: &[Vec3<T>]) -> Vec<Vec3<T>> {
    let welded = weld(&mesh.positions);
    let mut sums = vec![Vec3::<T>::zero(); x.len()];
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| x[i as usize]);
        let n = (b - a).cross(c - a).normalize();
        for (i, [at, p, q]) in t.iter().zip([[a, b, c], [b, c, a], [c, a, b]]) {
            let angle = (p - at).normalize().dot((q - at).normalize()).acos();
            sums[welded[*i as usize] as usize] += n * angle;
        }
    }
    welded.iter().map(|&w| sums[w as usize].normalize()).collect()
}

#[test]
fn as_the_mesh_itself_smooths() {
    let mut rng = Rng::new(10, 0, 0);
    for n in [1, 2, 5, 9] {
        let mesh = sheet(&mut rng, n).with_smooth_normals();
        let found = SmoothNormals::new(&mesh).normals(&mesh);
        assert_close(&found, mesh.normals.as_ref().unwrap(), 1e-14);
    }
}

#[test]
fn rates_are_those_of_duals() {
    let mut rng = Rng::new(11, 0, 0);
    for _ in 0..20 {
        let mesh = sheet(&mut rng, 6).with_smooth_normals();
        let velocities = random_vecs(&mut rng, mesh.positions.len());
        let x: Vec<_> = mesh.positions.iter().zip(&velocities).map(|(x, v)| rate(*x, *v)).collect();
        let expected: Vec<_> = mean_normals(&mesh, &x).into_iter().map(derivative).collect();
        let found = SmoothNormals::new(&mesh).rates(&mesh, &velocities);
        assert_close(&found, &expected, 1e-10);
    }
}

#[test]
fn rates_and_their_transpose() {
    let mut rng = Rng::new(12, 0, 0);
    for _ in 0..20 {
        let mesh = sheet(&mut rng, 6).with_smooth_normals();
        let n = mesh.positions.len();
        let smooth = SmoothNormals::new(&mesh);
        let (v, g) = (random_vecs(&mut rng, n), random_vecs(&mut rng, n));
        let mut back = vec![Vec3::ZERO; n];
        smooth.rates_transposed(&mesh, &g, &mut back);
        let (forward, reverse) = (inner(&smooth.rates(&mesh, &v), &g), inner(&v, &back));
        assert!((forward - reverse).abs() < 1e-12 * forward.abs().max(1.0));
    }
}

#[test]
fn creases_stay_sharp_and_cancelling_faces_keep_their_normal() {
    // Two squares of a cube that meet in an edge, each with its own flat normals.
    let p = |x, y, z| vec3(x, y, z);
    let positions = vec![
        p(0.0, 0.0, 0.0),
        p(1.0, 0.0, 0.0),
        p(1.0, 1.0, 0.0),
        p(0.0, 1.0, 0.0),
        p(0.0, 0.0, 0.0),
        p(0.0, 1.0, 0.0),
        p(0.0, 1.0, -1.0),
        p(0.0, 0.0, -1.0),
    ];
    let triangles = vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
    let normals = [[Vec3::Z; 4], [-Vec3::X; 4]].concat();
    let mesh = Mesh::new(positions, triangles).unwrap().with_normals(normals.clone()).unwrap();
    assert_close(&SmoothNormals::new(&mesh).normals(&mesh), &normals, 1e-15);

    let sheet = Mesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2], [0, 2, 1]]).unwrap();
    let sheet = sheet.with_normals(vec![Vec3::Z; 3]).unwrap();
    let smooth = SmoothNormals::new(&sheet);
    assert_eq!(smooth.normals(&sheet), vec![Vec3::Z; 3]);
    assert!(smooth.rates(&sheet, &[Vec3::Z, Vec3::ZERO, Vec3::X]).iter().all(|r| r.is_finite()));
}
