//! Random meshes and comparisons shared by the tests.

use drt_geom::Mesh;
use drt_math::{Affine, Dual, Mat3, Rng, Vec3, vec3};
use drt_motion::SurfacePoint;

/// A scalar with its derivative along the motion.
pub(crate) type Rate = Dual<f64, 1>;

pub(crate) fn rate(value: Vec3, derivative: Vec3) -> Vec3<Rate> {
    let dual = |v, d| Rate::new(v, [d]);
    vec3(dual(value.x, derivative.x), dual(value.y, derivative.y), dual(value.z, derivative.z))
}

pub(crate) fn derivative(v: Vec3<Rate>) -> Vec3 {
    vec3(v.x.eps[0], v.y.eps[0], v.z.eps[0])
}

pub(crate) fn random_vec(rng: &mut Rng) -> Vec3 {
    [(); 3].map(|()| 2.0 * rng.next_f64() - 1.0).into()
}

pub(crate) fn random_vecs(rng: &mut Rng, n: usize) -> Vec<Vec3> {
    (0..n).map(|_| random_vec(rng)).collect()
}

pub(crate) fn random_affine(rng: &mut Rng) -> Affine {
    Affine {
        linear: Mat3 { cols: [random_vec(rng), random_vec(rng), random_vec(rng)] },
        translation: random_vec(rng),
    }
}

pub(crate) fn random_point(rng: &mut Rng, mesh: &Mesh) -> SurfacePoint {
    let [r, s] = rng.next_2d();
    let triangle = (rng.next_f64() * mesh.triangles.len() as f64) as u32;
    SurfacePoint { triangle, bary: [r.sqrt() * (1.0 - s), r.sqrt() * s] }
}

/// A rough sheet of 2 n² triangles, cut along its middle: the vertices there exist twice, as where
/// texture coordinates jump, and both copies stem from one vertex of the file, whose order is
/// reversed.
pub(crate) fn sheet(rng: &mut Rng, n: u32) -> Mesh {
    let columns = n + 1;
    let file_count = columns * columns;
    let mut positions: Vec<Vec3> = (0..file_count)
        .map(|i| {
            let at = vec3(f64::from(i % columns), f64::from(i / columns), 0.0);
            at + random_vec(rng) * 0.3
        })
        .collect();
    let mut source: Vec<u32> = (0..file_count).map(|i| file_count - 1 - i).collect();
    let copies = |row: u32| file_count + row;
    for row in 0..columns {
        let original = (row * columns + n / 2) as usize;
        positions.push(positions[original]);
        source.push(source[original]);
    }
    let mut triangles = Vec::new();
    for row in 0..n {
        for column in 0..n {
            let corner = |r: u32, c: u32| {
                if column >= n / 2 && c == n / 2 { copies(r) } else { r * columns + c }
            };
            let [a, b] = [corner(row, column), corner(row, column + 1)];
            let [d, c] = [corner(row + 1, column), corner(row + 1, column + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    Mesh::new(positions, triangles).unwrap().with_source(source, file_count).unwrap()
}

/// Largest difference relative to the largest entry.
pub(crate) fn relative_error(found: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let size = expected.iter().fold(1e-300, |m: f64, e| m.max(e.abs()));
    let error = |(f, e): (&f64, &f64)| {
        let d = (f - e).abs();
        if d.is_nan() { f64::INFINITY } else { d }
    };
    found.iter().zip(expected).map(error).fold(0.0, f64::max) / size
}

pub(crate) fn flat<'a>(vectors: impl IntoIterator<Item = &'a Vec3>) -> Vec<f64> {
    vectors.into_iter().flat_map(|v| v.to_array()).collect()
}

#[track_caller]
pub(crate) fn assert_close(found: &[Vec3], expected: &[Vec3], tolerance: f64) {
    let error = relative_error(&flat(found), &flat(expected));
    assert!(error <= tolerance, "relative error {error:e} above {tolerance:e}");
}

pub(crate) fn inner(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

/// The derivative of `f` at 0 by central differences of two steps, fourth order.
pub(crate) fn finite_difference(f: impl Fn(f64) -> Vec<Vec3>) -> Vec<Vec3> {
    let central = |h: f64| -> Vec<Vec3> {
        f(h).iter().zip(f(-h)).map(|(a, b)| (*a - b) * (0.5 / h)).collect()
    };
    let h = 2e-3;
    central(h).iter().zip(central(2.0 * h)).map(|(a, b)| (*a * 4.0 - b) * (1.0 / 3.0)).collect()
}
