//! Mean value coordinates against their definition, on and off the surface.

mod common;

use common::*;
use drt_geom::{Mesh, procedural};
use drt_math::{Affine, Dual, Mat3, Real, Rng, Vec3, fm, vec3};
use drt_motion::{Cage, MeanValueWeight};

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
