//! The field around open sheets: exact on them and on their rims, smooth off them.

use crate::common::*;
use drt_geom::{Mesh, procedural};
use drt_math::{Affine, Mat3, Rng, Vec3, vec3};
use drt_motion::mean_value::{
    MeanValueField, MeanValueGradient, MeanValueVelocities, MeanValueWeights,
};
use drt_motion::volume::{VolumeAdjoint, VolumeJet};

struct Setting {
    soup: Vec<[Vec3; 3]>,
    corners: Vec<[Vec3; 3]>,
    field: MeanValueField,
    velocities: MeanValueVelocities,
}

fn wave(p: Vec3) -> Vec3 {
    vec3((2.0 * p.y).sin() + p.z, (3.0 * p.x + p.z).cos(), p.x * p.y - 0.5 * p.z)
}

/// Two sheets that pass through one another, cut into cells, beside a ball, in a box.
fn soup(cells: u32) -> Vec<[Vec3; 3]> {
    let at = |mesh: Mesh, linear: Mat3, at: Vec3| {
        mesh.transform(&Affine { linear, translation: at }).soup()
    };
    let turn = |angle| Mat3::rotation(vec3(0.3, 1.0, 0.2).normalize(), angle);
    let mut soup = at(procedural::cube(), Mat3::IDENTITY * 3.0, Vec3::ZERO);
    soup.extend(at(procedural::grid(cells, cells), turn(0.0), Vec3::ZERO));
    soup.extend(at(procedural::grid(cells, cells), turn(1.2), vec3(0.1, 0.0, 0.0)));
    soup.extend(at(procedural::icosphere(2), Mat3::IDENTITY * 0.4, vec3(-1.4, 1.3, 0.2)));
    soup
}

impl Setting {
    fn new(scale: f64, velocity: impl Fn(Vec3) -> Vec3) -> Self {
        let mut soup = soup(4);
        let corners: Vec<[Vec3; 3]> = soup.iter().map(|t| t.map(&velocity)).collect();
        for t in &mut soup {
            *t = t.map(|p| p * scale);
        }
        let field = MeanValueField::two_sided(&soup).unwrap();
        let velocities = field.velocities(&corners).unwrap();
        Self { soup, corners, field, velocities }
    }

    fn jet(&self, x: Vec3) -> VolumeJet {
        jet(&self.field, &self.velocities, x)
    }
}

fn jet(field: &MeanValueField, velocities: &MeanValueVelocities, x: Vec3) -> VolumeJet {
    let mut weights = MeanValueWeights::default();
    field.weights(x, &mut weights);
    field.jet(&weights, velocities)
}

#[test]
fn velocities_are_met_on_sheets_and_rims_from_all_sides() {
    let mut rng = Rng::new(90, 0, 0);
    for scale in [1.0, 1e-6, 1e6] {
        let s = Setting::new(scale, wave);
        for round in 0..600 {
            // Where sheets pass through one another, either velocity is right.
            let t = rng.next_u32() as usize % s.soup.len();
            let [r, q] = rng.next_2d();
            let mut w = [1.0 - r.sqrt(), r.sqrt() * (1.0 - q), r.sqrt() * q];
            match round % 4 {
                0 => w = [0.0, 1.0, 0.0],
                1 => w = [0.0, r, 1.0 - r],
                _ => {}
            }
            let mix = |c: [Vec3; 3]| c[0] * w[0] + c[1] * w[1] + c[2] * w[2];
            let x = mix(s.soup[t]);
            let crossed = x.length() < 2.0 * scale && (x / scale).cross(Vec3::Y).length() < 0.5;
            if crossed {
                continue;
            }
            let step = if round % 3 == 0 { 0.0 } else { 1e-5 * scale };
            let jet = s.jet(x + random_vec(&mut rng) * step);
            let error = (jet.u - mix(s.corners[t])).max_abs();
            assert!(error < 1e-4 && jet.j_dot.is_finite(), "{scale} {x:?} {error:e}");
            assert!(step > 0.0 || error < 1e-10, "{scale} {x:?} {error:e}");
        }
    }
}

#[test]
fn the_divergence_is_that_of_the_velocity() {
    let mut rng = Rng::new(91, 0, 0);
    let s = Setting::new(1.0, wave);
    let mut level = 0;
    for round in 0..300 {
        let mut x = random_vec(&mut rng) * 2.5;
        if round % 4 == 0 {
            // Level with a sheet, or nearly.
            x.z = [0.0, 1e-9, -1e-4, 0.01][round / 4 % 4];
        }
        let near = s.soup.iter().map(|t| (drt_geom::nearest_point(*t, x) - x).length());
        let distance = near.fold(f64::INFINITY, f64::min);
        if distance < 1e-3 {
            continue;
        }
        level += usize::from(round % 4 == 0);
        let slope = |h: f64| {
            let along = |axis: Vec3| (s.jet(x + axis * h).u - s.jet(x - axis * h).u).dot(axis);
            (along(Vec3::X) + along(Vec3::Y) + along(Vec3::Z)) / (2.0 * h)
        };
        let h = 1e-3 * distance.min(0.5);
        let expected = (4.0 * slope(h) - slope(2.0 * h)) / 3.0;
        let error = (s.jet(x).j_dot - expected).abs() * distance.min(1.0);
        assert!(error < 1e-7, "{x:?} {distance} {error:e}");
    }
    assert!(level > 40);
}

#[test]
fn cutting_a_sheet_changes_nothing() {
    // Velocities that are linear on the sheets are the same functions on finer ones.
    let linear = |p: Vec3| vec3(p.y + 0.3, p.z - p.x, 0.5 * p.x);
    let [coarse, fine] = [1, 6].map(|cells| {
        let soup = soup(cells);
        let corners: Vec<[Vec3; 3]> = soup.iter().map(|t| t.map(linear)).collect();
        let field = MeanValueField::two_sided(&soup).unwrap().exact();
        let velocities = field.velocities(&corners).unwrap();
        (field, velocities)
    });
    let mut rng = Rng::new(92, 0, 0);
    for _ in 0..200 {
        let x = random_vec(&mut rng) * 2.8;
        let [a, b] = [&coarse, &fine].map(|(field, v)| jet(field, v, x));
        assert!((a.u - b.u).max_abs() < 1e-11, "{x:?} {:e}", (a.u - b.u).max_abs());
        assert!((a.j_dot - b.j_dot).abs() < 1e-8 * (1.0 + a.j_dot.abs()));
    }
}

#[test]
fn acceleration_changes_little_and_constants_not_at_all() {
    let s = Setting::new(1.0, wave);
    let exact = s.field.clone().exact();
    let same = Setting::new(1.0, |_| vec3(0.3, -1.0, 0.7));
    let mut rng = Rng::new(93, 0, 0);
    let (mut worst, mut weights): (f64, _) = (0.0, MeanValueWeights::default());
    let mut most = 0;
    for _ in 0..300 {
        let x = random_vec(&mut rng) * 2.9;
        s.field.weights(x, &mut weights);
        most = most.max(weights.counts()[1]);
        worst = worst.max((s.jet(x).u - jet(&exact, &s.velocities, x).u).max_abs());
        let jet = same.jet(x);
        assert!((jet.u - vec3(0.3, -1.0, 0.7)).max_abs() < 1e-12 && jet.j_dot.abs() < 1e-10);
    }
    assert!(most > 0 && worst < 0.05, "{worst}");
}

#[test]
fn scattering_is_the_transpose_of_jets() {
    let s = Setting::new(1.0, wave);
    let mut rng = Rng::new(94, 0, 0);
    let mut gradient = MeanValueGradient::zeros(&s.field);
    let (mut weights, mut expected) = (MeanValueWeights::default(), 0.0);
    for _ in 0..40 {
        let x = random_vec(&mut rng) * 2.9;
        let adjoint = VolumeAdjoint { u: random_vec(&mut rng), j: random_vec(&mut rng).x };
        s.field.weights(x, &mut weights);
        let jet = s.field.jet(&weights, &s.velocities);
        expected += adjoint.u.dot(jet.u) + adjoint.j * jet.j_dot;
        s.field.scatter(&weights, &adjoint, &mut gradient);
    }
    let back = s.field.finish(&gradient);
    let pairs = back.iter().flatten().zip(s.corners.iter().flatten());
    let found: f64 = pairs.map(|(g, v)| g.dot(*v)).sum();
    assert!((found - expected).abs() < 1e-9 * expected.abs().max(1.0), "{found} {expected}");
}
