//! Mean value coordinates against their definition, on and off the surface.

use crate::common::*;
use drt_geom::{Mesh, procedural};
use drt_math::{Affine, Dual, Mat3, Real, Rng, Vec3, fm, vec3};
use drt_motion::mean_value::{Cage, MeanValueWeight};

type D3 = Dual<f64, 3>;

fn join(meshes: &[Mesh]) -> Mesh {
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for m in meshes {
        let base = positions.len() as u32;
        positions.extend_from_slice(&m.positions);
        triangles.extend(m.triangles.iter().map(|t| t.map(|i| i + base)));
    }
    Mesh::new(positions, triangles).unwrap()
}

fn placed(mesh: &Mesh, scale: f64, offset: Vec3) -> Mesh {
    mesh.transform(&Affine { linear: Mat3::IDENTITY * scale, translation: offset })
}

/// Convex, with flat sides, not convex, knotted, and nested three deep, wound anyhow.
fn cages() -> Vec<(&'static str, Mesh)> {
    let shell = join(&[
        placed(&procedural::cube(), 1.0, Vec3::ZERO),
        placed(&procedural::icosphere(1), 0.6, Vec3::ZERO),
        placed(&procedural::cube(), 0.2, vec3(0.1, 0.0, -0.1)),
    ]);
    let mut wound = procedural::cube();
    for t in wound.triangles.iter_mut().step_by(3) {
        t.swap(0, 1);
    }
    vec![
        ("cube", procedural::cube()),
        ("wound", wound),
        ("ball", procedural::icosphere(1)),
        ("bumpy", procedural::bumpy_sphere(2, 0.5, 4.0)),
        (
            "knot",
            procedural::torus_knot(&procedural::TorusKnot {
                segments: 40,
                sides: 6,
                ..procedural::TorusKnot::default()
            }),
        ),
        ("nested", shell),
    ]
}

fn coordinates(cage: &Cage, x: Vec3) -> Vec<MeanValueWeight> {
    let mut out = Vec::new();
    cage.coordinates(x, &mut out);
    out
}

fn angle(y: D3, x: D3) -> D3 {
    // Turned near the x axis first, for there is no arc tangent of two dual numbers.
    let (s, c) = fm::sin_cos(fm::atan2(y.re, x.re));
    ((y * c - x * s) / (x * c + y * s)).atan() + fm::atan2(y.re, x.re)
}

/// Ju, Schaefer and Warren 2005, §3.2, with derivatives by dual numbers.
fn reference(mesh: &Mesh, x: Vec3) -> Vec<D3> {
    let x = vec3(D3::variable(x.x, 0), D3::variable(x.y, 1), D3::variable(x.z, 2));
    let mut w = vec![D3::zero(); mesh.positions.len()];
    for t in &mesh.triangles {
        let d = t.map(|i| mesh.positions[i as usize].lift() - x);
        let c = [0, 1, 2].map(|k| d[(k + 1) % 3].cross(d[(k + 2) % 3]));
        let mut m = Vec3::zero();
        for k in 0..3 {
            let sine = c[k].length();
            let theta = angle(sine, d[(k + 1) % 3].dot(d[(k + 2) % 3]));
            m += c[k] * (theta / sine * 0.5);
        }
        let det = d[0].dot(c[0]);
        for k in 0..3 {
            w[t[k] as usize] += m.dot(c[k]) / det;
        }
    }
    let sum = w.iter().fold(D3::zero(), |s, w| s + *w);
    w.iter().map(|w| *w / sum).collect()
}

/// The least height over a triangle's plane, relative to the distance: what the digits of the
/// reference depend on.
fn least_height(mesh: &Mesh, x: Vec3) -> f64 {
    let height = |t| {
        let [a, b, c] = mesh.triangle(t).map(|p| p - x);
        let n = (b - a).cross(c - a).normalize();
        n.dot(a).abs() / a.length().max(b.length()).max(c.length())
    };
    (0..mesh.triangles.len() as u32).map(height).fold(1.0, f64::min)
}

#[test]
fn weights_and_gradients_are_those_of_the_definition() {
    let mut rng = Rng::new(50, 0, 0);
    let mut worst: [f64; 2] = [0.0; 2];
    // The parts of "nested" and "wound" do not alternate as they stand in the mesh.
    for (name, mesh) in cages().into_iter().filter(|(n, _)| !["nested", "wound"].contains(n)) {
        let cage = Cage::new(&mesh).unwrap();
        for _ in 0..200 {
            let x = random_vec(&mut rng) * 1.5;
            let found = coordinates(&cage, x);
            let expected = reference(&mesh, x);
            let values = relative_error(
                &found.iter().map(|w| w.value).collect::<Vec<_>>(),
                &expected.iter().map(|w| w.re).collect::<Vec<_>>(),
            );
            let gradients = relative_error(
                &flat(&found.iter().map(|w| w.gradient).collect::<Vec<_>>()),
                &flat(&expected.iter().map(|w| w.eps.into()).collect::<Vec<Vec3>>()),
            );
            let height = least_height(&mesh, x);
            let allowed = [1e-14 / height, 1e-14 / (height * height)].map(|e| e.max(1e-10));
            assert!(
                values < allowed[0] && gradients < allowed[1],
                "{name} {x:?} {values:e} {gradients:e}"
            );
            if height > 0.004 {
                worst = [worst[0].max(values), worst[1].max(gradients)];
            }
        }
    }
    println!("largest error of values {:e}, gradients {:e}", worst[0], worst[1]);
}

/// Largest violations of Σ λ = 1, Σ λ p = x, and their gradients: 0 and the identity.
fn linear_errors(mesh: &Mesh, w: &[MeanValueWeight], x: Vec3) -> [f64; 2] {
    let mut sum = -1.0;
    let mut point = Vec3::ZERO;
    let mut slope = Vec3::ZERO;
    let mut map = Mat3::IDENTITY * -1.0;
    let size = mesh.bounds().extent().max_abs();
    let from = mesh.bounds().center();
    for (w, &p) in w.iter().zip(&mesh.positions) {
        sum += w.value;
        point += (p - from) * w.value;
        slope += w.gradient;
        for k in 0..3 {
            map.cols[k] += (p - from) * w.gradient[k];
        }
    }
    let value = sum.abs().max((point - (x - from)).max_abs() / size);
    let gradient = map.cols.iter().fold(slope.max_abs() * size, |m, c| m.max(c.max_abs()));
    [value, gradient]
}

#[test]
fn linear_functions_come_back() {
    let mut rng = Rng::new(51, 0, 0);
    let mut worst: [f64; 2] = [0.0; 2];
    for (name, mesh) in cages() {
        for (scale, offset) in [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 1e6)] {
            let mesh = placed(&mesh, scale, Vec3::splat(offset));
            let cage = Cage::new(&mesh).unwrap();
            for _ in 0..100 {
                let x = random_vec(&mut rng) * (1.7 * scale) + Vec3::splat(offset);
                let [value, gradient] = linear_errors(&mesh, &coordinates(&cage, x), x);
                assert!(value < 1e-10 && gradient < 1e-8, "{name} {x:?} {value:e} {gradient:e}");
                worst = [worst[0].max(value), worst[1].max(gradient)];
            }
        }
    }
    println!("largest error of linear functions {:e}, of their gradients {:e}", worst[0], worst[1]);
}

/// A cube with a vertex 1e-8 off the middle of an edge, in one of the sides: two triangles there are
/// needles, one of them with three long edges.
fn needles() -> Mesh {
    let cube = procedural::cube();
    let [a, b, c] = cube.triangles[0];
    let p = |i: u32| cube.positions[i as usize];
    let mut positions = cube.positions.clone();
    let mut triangles = cube.triangles.clone();
    let m = positions.len() as u32;
    let middle = (p(a) + p(b)) * 0.5;
    positions.push(middle + (p(c) - middle) * 1e-8);
    triangles[0] = [a, b, m];
    triangles.extend([[b, c, m], [c, a, m]]);
    Mesh::new(positions, triangles).unwrap()
}

/// A point of a triangle: a corner, on an edge, or inside.
fn on_triangle(rng: &mut Rng, corners: [Vec3; 3]) -> (Vec3, [f64; 3]) {
    let [r, s] = rng.next_2d();
    let k = rng.next_u32() as usize % 3;
    let mut w = [0.0; 3];
    match rng.next_u32() % 3 {
        0 => w[k] = 1.0,
        1 => (w[k], w[(k + 1) % 3]) = (r, 1.0 - r),
        _ => w = [1.0 - r.sqrt(), r.sqrt() * (1.0 - s), r.sqrt() * s],
    }
    (corners[0] * w[0] + corners[1] * w[1] + corners[2] * w[2], w)
}

/// The least height of a triangle.
fn thinnest(mesh: &Mesh) -> f64 {
    let height = |t| {
        let [a, b, c] = mesh.triangle(t);
        2.0 * mesh.area(t) / (b - a).length().max((c - b).length()).max((a - c).length())
    };
    (0..mesh.triangles.len() as u32).map(height).fold(f64::INFINITY, f64::min)
}

#[test]
fn on_and_next_to_the_surface_the_data_are_met() {
    let mut rng = Rng::new(52, 0, 0);
    let mut cages = cages();
    cages.push(("needles", needles()));
    let mut worst: f64 = 0.0;
    for (name, mesh) in cages {
        for (scale, offset) in [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 1e6)] {
            let mesh = placed(&mesh, scale, Vec3::splat(offset));
            let cage = Cage::new(&mesh).unwrap();
            let thinnest = thinnest(&mesh);
            let data = random_vecs(&mut rng, mesh.positions.len());
            // The coordinates of a point are rounded to this.
            let rounding = f64::EPSILON * (scale + offset);
            for _ in 0..200 {
                let t = rng.next_u32() % mesh.triangles.len() as u32;
                let (on, w) = on_triangle(&mut rng, mesh.triangle(t));
                let off = [0.0, 1e-14, 1e-13, 1e-12, 1e-10][rng.next_u32() as usize % 5];
                let x = on + random_vec(&mut rng) * (off * scale);
                let corners = mesh.triangles[t as usize];
                let expected = (0..3).fold(Vec3::ZERO, |s, k| s + data[corners[k] as usize] * w[k]);
                let weights = coordinates(&cage, x);
                let found =
                    weights.iter().zip(&data).fold(Vec3::ZERO, |s, (w, v)| s + *v * w.value);
                let error = (found - expected).max_abs();
                // A field that bends as sharply as the triangle is thin.
                let allowed = 1e-11 + 50.0 * (off * scale + rounding) / thinnest;
                assert!(error < allowed, "{name} {scale} {offset} {x:?} {w:?} {off:e}: {error:e}");
                if off == 0.0 && offset == 0.0 && name != "needles" {
                    worst = worst.max(error);
                }
                assert!(weights.iter().all(|w| w.gradient.is_finite()));
            }
            for (i, &p) in mesh.positions.iter().enumerate() {
                let w = coordinates(&cage, p);
                let copies = mesh.positions.iter().zip(&w).filter(|(q, _)| **q == p);
                assert_eq!(copies.map(|(_, w)| w.value).sum::<f64>(), 1.0, "{name} {i}");
            }
        }
    }
    println!("largest error on the surface {worst:e}");
}

#[test]
fn no_point_is_lost() {
    let mut rng = Rng::new(53, 0, 0);
    let mut cages = cages();
    cages.push(("needles", needles()));
    let mut worst: f64 = 0.0;
    let mut count = 0;
    for (name, mesh) in &cages {
        for (scale, offset) in [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 1e6)] {
            let mesh = placed(mesh, scale, Vec3::splat(offset));
            let cage = Cage::new(&mesh).unwrap();
            let rounds = if mesh.triangles.len() > 100 { 1_500 } else { 5_500 };
            for _ in 0..rounds {
                let t = rng.next_u32() % mesh.triangles.len() as u32;
                let [a, b, c] = mesh.triangle(t);
                let (on, _) = on_triangle(&mut rng, [a, b, c]);
                let size = [1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 1.0, 1e3][rng.next_u32() as usize % 7];
                let step = random_vec(&mut rng) * (size * scale);
                let x = match rng.next_u32() % 4 {
                    0 => on + step,
                    // In the plane of the triangle, and on the line of an edge.
                    1 => on + (b - a) * step.x + (c - a) * step.y,
                    2 => a + (b - a) * (1.0 + step.x.abs()),
                    _ => a.lerp(b, step.x) + mesh.normal(t) * step.y,
                };
                let w = coordinates(&cage, x);
                count += 1;
                assert!(w.iter().all(|w| w.value.is_finite() && w.gradient.is_finite()), "{x:?}");
                let distance = (x - mesh.bounds().center()).max_abs() / scale;
                let [value, _] = linear_errors(&mesh, &w, x);
                let rounding = 1e-10 * (1.0 + distance * distance) + 1e-15 * offset;
                assert!(value < rounding, "{name} {scale} {offset} {x:?} {size:e}: {value:e}");
                worst = worst.max(value / (1.0 + distance * distance));
            }
        }
        let cage = Cage::new(mesh).unwrap();
        for x in [1e9, 1e13, 1e100, 1e308, f64::INFINITY, f64::NAN] {
            let w = coordinates(&cage, vec3(x, -x, 0.5 * x));
            assert!(w.iter().all(|w| w.value.is_finite() && w.gradient.is_finite()), "{x}");
        }
    }
    assert!(count >= 100_000);
    println!("{count} points, error of linear functions at most {worst:e}");
}
