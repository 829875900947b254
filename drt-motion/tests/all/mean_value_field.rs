//! The mean value field inside a medium: exact on the surfaces, smooth off them.

use crate::common::*;
use drt_geom::{Mesh, procedural};
use drt_math::{Affine, Mat3, Rng, Vec3, vec3};
use drt_motion::Cause;
use drt_motion::mean_value::{
    MeanValueField, MeanValueGradient, MeanValueVelocities, MeanValueWeights,
};
use drt_motion::volume::{VolumeAdjoint, VolumeJet};

/// A bumpy body and a knot in a box, every third triangle wound the wrong way, with velocities that
/// know no symmetry, linear on the triangles.
struct Setting {
    soup: Vec<[Vec3; 3]>,
    corners: Vec<[Vec3; 3]>,
    field: MeanValueField,
    velocities: MeanValueVelocities,
}

fn wave(p: Vec3) -> Vec3 {
    vec3((2.0 * p.y).sin() + p.z, (3.0 * p.x + p.z).cos(), p.x * p.y - 0.5 * p.z)
}

impl Setting {
    fn new(scale: f64, offset: Vec3) -> Self {
        let at = |mesh: Mesh, size: f64, at: Vec3| {
            mesh.transform(&Affine { linear: Mat3::IDENTITY * size, translation: at }).soup()
        };
        let knot = procedural::TorusKnot { segments: 60, sides: 6, ..Default::default() };
        let mut soup = at(procedural::cube(), 3.0, Vec3::ZERO);
        soup.extend(at(procedural::bumpy_sphere(3, 0.3, 5.0), 0.8, vec3(-1.4, 0.3, 0.2)));
        soup.extend(at(procedural::torus_knot(&knot), 0.7, vec3(1.5, -0.5, 0.0)));
        for t in soup.iter_mut().step_by(3) {
            t.swap(1, 2);
        }
        let corners: Vec<[Vec3; 3]> = soup.iter().map(|t| t.map(wave)).collect();
        for t in &mut soup {
            *t = t.map(|p| p * scale + offset);
        }
        let field = MeanValueField::new(&soup).unwrap();
        let velocities = field.velocities(&corners).unwrap();
        Self { soup, corners, field, velocities }
    }

    fn jet(&self, x: Vec3) -> VolumeJet {
        let mut weights = MeanValueWeights::default();
        self.field.weights(x, &mut weights);
        self.field.jet(&weights, &self.velocities)
    }
}

#[test]
fn on_the_surface_the_velocities_are_met() {
    let mut rng = Rng::new(70, 0, 0);
    let mut worst: f64 = 0.0;
    for (scale, offset) in [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 1e6)] {
        let s = Setting::new(scale, Vec3::splat(offset));
        for round in 0..400 {
            let t = rng.next_u32() as usize % s.soup.len();
            let [r, q] = rng.next_2d();
            let mut w = [1.0 - r.sqrt(), r.sqrt() * (1.0 - q), r.sqrt() * q];
            match round % 4 {
                0 => w = [0.0, 1.0, 0.0],
                1 => w = [0.0, r, 1.0 - r],
                _ => {}
            }
            let mix = |c: [Vec3; 3]| c[0] * w[0] + c[1] * w[1] + c[2] * w[2];
            let off = random_vec(&mut rng) * if round % 3 == 0 { 1e-12 * scale } else { 0.0 };
            let jet = s.jet(mix(s.soup[t]) + off);
            let error = (jet.u - mix(s.corners[t])).max_abs();
            assert!(error < 1e-9 && jet.j_dot.is_finite(), "{scale} {offset} {w:?} {error:e}");
            if offset == 0.0 {
                worst = worst.max(error);
            }
        }
    }
    assert!(worst < 1e-10);
    println!("largest error on the surface {worst:e}");
}

/// Divergence by differences of fourth order.
fn divergence(u: impl Fn(Vec3) -> Vec3, x: Vec3, h: f64) -> f64 {
    let slope = |h: f64| {
        let along = |axis: Vec3| (u(x + axis * h) - u(x - axis * h)).dot(axis) / (2.0 * h);
        along(Vec3::X) + along(Vec3::Y) + along(Vec3::Z)
    };
    (4.0 * slope(h) - slope(2.0 * h)) / 3.0
}

#[test]
fn the_divergence_is_that_of_the_velocity() {
    let mut rng = Rng::new(71, 0, 0);
    let s = Setting::new(1.0, Vec3::ZERO);
    let mut worst: f64 = 0.0;
    for _ in 0..150 {
        let x = random_vec(&mut rng) * 4.0;
        let near = s.soup.iter().map(|t| (drt_geom::nearest_point(*t, x) - x).length());
        let distance = near.fold(f64::INFINITY, f64::min);
        let expected = divergence(|x| s.jet(x).u, x, 1e-3 * distance.min(0.5));
        let found = s.jet(x).j_dot;
        // Slopes are of the order of velocity over distance.
        let error = (found - expected).abs() * distance.min(1.0);
        assert!(error < 2e-8, "{x:?} {distance} {found} {expected}");
        worst = worst.max(error);
    }
    println!("largest error of the divergence {worst:e} of velocity over distance");
}

#[test]
fn there_are_no_jumps_where_clusters_change_over() {
    let s = Setting::new(1.0, Vec3::ZERO);
    let mut counts = Vec::new();
    let mut weights = MeanValueWeights::default();
    let (from, to) = (vec3(-2.9, -2.8, 2.3), vec3(2.7, 2.6, 2.5));
    let n = 60_000;
    let at = |i: usize| from + (to - from) * (i as f64 / n as f64);
    let [mut a, mut b] = [s.jet(at(0)), s.jet(at(1))];
    let (mut bend, mut bend_of_divergence): (f64, f64) = (0.0, 0.0);
    for i in 2..n {
        s.field.weights(at(i), &mut weights);
        counts.push(weights.counts());
        let c = s.field.jet(&weights, &s.velocities);
        bend = bend.max((a.u - b.u * 2.0 + c.u).max_abs());
        bend_of_divergence = bend_of_divergence.max((a.j_dot - b.j_dot * 2.0 + c.j_dot).abs());
        (a, b) = (b, c);
    }
    counts.dedup();
    println!("{} changes, bends {bend:e} {bend_of_divergence:e}", counts.len());
    assert!(counts.len() > 100);
    // Second differences of smooth functions at steps of 1e-4 of the box.
    assert!(bend < 2e-7 && bend_of_divergence < 2e-7, "{bend:e} {bend_of_divergence:e}");
}

#[test]
fn acceleration_changes_little_and_constants_not_at_all() {
    let mut rng = Rng::new(72, 0, 0);
    let s = Setting::new(1.0, Vec3::ZERO);
    let exact = s.field.clone().exact();
    let shift = vec3(0.3, -0.2, 0.7);
    let constant = s.field.velocities(&vec![[shift; 3]; s.soup.len()]).unwrap();
    let linear = Affine { linear: random_affine(&mut rng).linear, translation: shift };
    let corners: Vec<_> = s.soup.iter().map(|t| t.map(|p| linear.point(p))).collect();
    let linear_data = s.field.velocities(&corners).unwrap();
    let mut w = MeanValueWeights::default();
    let (mut squared, mut bent): (f64, f64) = (0.0, 0.0);
    let n = 200;
    for _ in 0..n {
        let x = random_vec(&mut rng) * 3.0;
        s.field.weights(x, &mut w);
        let still = s.field.jet(&w, &constant);
        assert!((still.u - shift).max_abs() < 1e-12 && still.j_dot.abs() < 1e-9);
        let fast = s.field.jet(&w, &s.velocities);
        bent = bent.max((s.field.jet(&w, &linear_data).u - linear.point(x)).max_abs());
        exact.weights(x, &mut w);
        assert_eq!(w.counts()[1], 0);
        squared += (exact.jet(&w, &s.velocities).u - fast.u).length_squared();
        let given = exact.jet(&w, &linear_data);
        assert!((given.u - linear.point(x)).max_abs() < 1e-11);
        assert!((given.j_dot - linear.linear.trace()).abs() < 1e-8);
    }
    let rms = (squared / f64::from(n)).sqrt();
    println!("accelerated less exact: rms {rms:e}; linear functions off by at most {bent:e}");
    assert!(rms < 1e-3 && bent < 0.02);
}

#[test]
fn nested_surfaces_alternate_whatever_their_winding() {
    // Four balls, one in the other: the denominator must not vanish between any two.
    let mut soup = Vec::new();
    for (k, size) in [1.0, 0.8, 0.5, 0.45].into_iter().enumerate() {
        let mut ball = procedural::icosphere(2);
        if k % 3 == 0 {
            ball.flip();
        }
        let map = Affine { linear: Mat3::IDENTITY * size, translation: Vec3::X * 0.01 };
        soup.extend(ball.transform(&map).soup());
    }
    let corners: Vec<_> = soup.iter().map(|t| t.map(wave)).collect();
    let field = MeanValueField::new(&soup).unwrap();
    let velocities = field.velocities(&corners).unwrap();
    let largest = corners.iter().flatten().map(|v| v.length()).fold(0.0, f64::max);
    let mut w = MeanValueWeights::default();
    for i in 0..1000 {
        let x = vec3(1.5 * f64::from(i) / 1000.0, 0.013, -0.02);
        field.weights(x, &mut w);
        // Outside, weights may exceed 1.
        let bound = if x.length() < 0.95 { 1.2 } else { 4.0 };
        assert!(field.jet(&w, &velocities).u.length() < bound * largest, "{x:?}");
    }
}

#[test]
fn scattering_is_the_transpose_of_jets() {
    let mut rng = Rng::new(74, 0, 0);
    let s = Setting::new(1.0, Vec3::ZERO);
    let mut halves = [MeanValueGradient::zeros(&s.field), MeanValueGradient::zeros(&s.field)];
    let mut w = MeanValueWeights::default();
    let mut forward = 0.0;
    for i in 0..200 {
        let x = if i == 7 { s.soup[40][1] } else { random_vec(&mut rng) * 3.0 };
        let a = VolumeAdjoint { u: random_vec(&mut rng), j: random_vec(&mut rng).x };
        s.field.weights(x, &mut w);
        let jet = s.field.jet(&w, &s.velocities);
        forward += jet.u.dot(a.u) + jet.j_dot * a.j;
        s.field.scatter(&w, &a, &mut halves[i % 2]);
    }
    let [mut gradient, other] = halves;
    gradient.add(&other);
    let corners = s.field.finish(&gradient);
    let reverse: f64 =
        corners.iter().flatten().zip(s.corners.iter().flatten()).map(|(g, v)| g.dot(*v)).sum();
    assert!((forward - reverse).abs() < 1e-10 * forward.abs().max(1.0), "{forward} {reverse}");
}

#[test]
fn bodies_may_touch() {
    // Two cubes side by side, with a face in common, standing on the floor of a box.
    let at = |size: f64, at: Vec3| {
        let map = Affine { linear: Mat3::IDENTITY * size, translation: at };
        procedural::cube().transform(&map).soup()
    };
    let mut soup = at(3.0, Vec3::ZERO);
    soup.extend(at(0.5, vec3(-0.5, 0.0, -2.5)));
    soup.extend(at(0.5, vec3(0.5, 0.0, -2.5)).into_iter().map(|[a, b, c]| [b, a, c]));
    let corners: Vec<_> = soup.iter().map(|t| t.map(wave)).collect();
    let field = MeanValueField::new(&soup).unwrap();
    let velocities = field.velocities(&corners).unwrap();
    let mut w = MeanValueWeights::default();
    let largest = corners.iter().flatten().map(|v| v.length()).fold(0.0, f64::max);
    for i in 0..=1000 {
        let x = vec3(-2.9 + 5.8 * f64::from(i) / 1000.0, 0.2, -1.97);
        field.weights(x, &mut w);
        assert!(field.jet(&w, &velocities).u.length() < 1.1 * largest, "{x:?}");
        // Down to the floor, along a side of a cube.
        let x = vec3(1.0 + 1e-3, 0.2, -3.0 + 3.0 * f64::from(i) / 1000.0);
        field.weights(x, &mut w);
        assert!(field.jet(&w, &velocities).u.length() < 1.1 * largest, "{x:?}");
    }
    for (t, v) in soup.iter().zip(&corners).take(12) {
        field.weights(t[0], &mut w);
        assert!((field.jet(&w, &velocities).u - v[0]).max_abs() < 1e-12);
    }
}

#[test]
fn no_point_is_lost() {
    let mut rng = Rng::new(73, 0, 0);
    for (scale, offset) in [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 1e6)] {
        let s = Setting::new(scale, Vec3::splat(offset));
        let largest = s.corners.iter().flatten().map(|v| v.length()).fold(0.0, f64::max);
        for _ in 0..25_000 {
            let [a, b, c] = s.soup[rng.next_u32() as usize % s.soup.len()];
            let [r, q] = rng.next_2d();
            let size = [0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3][rng.next_u32() as usize % 6];
            let step = random_vec(&mut rng) * (size * scale);
            let x = match rng.next_u32() % 4 {
                0 => a.lerp(b, r).lerp(c, q) + step,
                1 => a + step,
                2 => a.lerp(b, r) + step,
                _ => a + (b - a) * (1.0 + r) + step,
            };
            let inside = (x - Vec3::splat(offset)).max_abs() <= 3.0 * scale;
            let jet = s.jet(x);
            assert!(jet.u.is_finite() && jet.j_dot.is_finite(), "{x:?}");
            assert!(!inside || jet.u.length() < 3.0 * largest, "{x:?} {:?}", jet.u);
        }
        for x in [1e9, 1e13, 1e100, 1e308, f64::INFINITY, f64::NAN] {
            let jet = s.jet(vec3(x, -x, 0.5 * x));
            assert!(jet.u.is_finite() && jet.j_dot.is_finite(), "{x}");
        }
    }
}

#[test]
fn surfaces_that_bound_nothing_are_refused() {
    let cause = |soup: &[[Vec3; 3]]| MeanValueField::new(soup).map(|_| ()).unwrap_err();
    let mut soup = procedural::cube().soup();
    let field = MeanValueField::new(&soup).unwrap();
    let short = Cause::TriangleCount { expected: 12, found: 11 };
    assert_eq!(field.velocities(&[[Vec3::X; 3]; 11]).unwrap_err(), short);
    assert!(field.velocities(&[[Vec3::X * f64::NAN; 3]; 12]).is_err());
    soup.extend([[Vec3::X, Vec3::Y, Vec3::Z], [Vec3::X, Vec3::Z, Vec3::Y]]);
    assert_eq!(cause(&soup), Cause::FlatSurface);
    soup.pop();
    assert!(matches!(cause(&soup), Cause::OpenSurface { .. }));
    soup[3][1].x = f64::NAN;
    assert!(matches!(cause(&soup), Cause::NotFinite { .. }));
    assert!(matches!(cause(&[]), Cause::OpenSurface { .. } | Cause::FlatSurface));
}
