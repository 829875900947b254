//! Microflakes: their phase function against its area, samples, duals and Mitsuba, and extinction by direction
//! against closed forms, quadrature and finite differences.

use crate::common::*;
use drt_math::testing::{SIGNIFICANCE, sphere_chi_square};
use drt_math::{Affine, Dual, Mat3, Rgb, Rng, Vec3, vec3, warp};
use drt_medium::{
    DepthEstimate, DistanceSample, Flakes, FlowPlace, Grid, Homogeneous, Medium, MediumChange,
    MediumError, MediumGradient, MediumTangent, Phase, PhaseBlend, Property, Ray, Sggx,
    TrackingStats, ValueChange,
};

fn flakes(diagonal: [f64; 3], off_diagonal: [f64; 3]) -> Flakes {
    Flakes { diagonal: diagonal.into(), off_diagonal: off_diagonal.into() }
}

/// Grains, fibres and sheets, some of them askew.
fn some() -> [Flakes; 4] {
    let askew = Mat3::rotation(vec3(0.6, 0.0, 0.8), 0.7);
    [
        flakes([1.0, 1.0, 1.0], [0.0; 3]),
        flakes([4.0, 1.0, 0.25], [0.0; 3]),
        flakes([0.5, 0.5, 0.02], [0.0; 3]).turned(&askew),
        flakes([0.04, 0.03, 1.0], [0.0; 3]).turned(&askew),
    ]
}

fn uniform(s: Flakes) -> Phase {
    Phase::Sggx(Box::new(Sggx::new(s).expect("a distribution")))
}

/// Flakes that differ from voxel to voxel.
fn varying(place: Affine) -> Sggx {
    let size = [3, 2, 2];
    let mut rng = Rng::new(9, 0, 0);
    let (mut diagonal, mut off_diagonal) = (Vec::new(), Vec::new());
    for _ in 0..12 {
        let axes = [0; 3].map(|_| 0.1 + rng.next_f64());
        let turn = Mat3::rotation(warp::uniform_sphere(rng.next_2d()), 3.0 * rng.next_f64());
        let s = flakes(axes, [0.0; 3]).turned(&turn);
        diagonal.extend(s.diagonal.to_array());
        off_diagonal.extend(s.off_diagonal.to_array());
    }
    let grid = |values| {
        let grid = Grid::new(size, 3, values).expect("a grid");
        grid.with_placement(place).expect("a box")
    };
    Sggx::varying(grid(diagonal), grid(off_diagonal)).expect("distributions")
}

/// A cloud of flakes in a box.
fn cloud() -> Medium {
    let place = placement(vec3(-1.0, 0.0, 0.0), vec3(1.0, 1.5, 1.0));
    let density = Grid::new([4, 3, 2], 1, random_values(24, 3)).expect("a grid");
    let density = density.with_placement(place).expect("a box");
    let medium = grid_medium(density, 3.0, Rgb::splat(0.8));
    Medium { phase: Phase::Sggx(Box::new(varying(place))), ..medium }
}

fn near(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * (1e-3 + b.abs())
}

#[test]
fn scatters_what_it_shows_and_is_sampled_as_evaluated() {
    let from = vec3(0.48, -0.6, 0.64);
    for s in some() {
        let p = &uniform(s);
        let p = p.at(Vec3::ZERO);
        let area = p.projected_area(from);
        assert!(near(area, s.projected_area(from), 1e-15));
        let total = estimate(200_000, |rng, _| {
            let to = warp::uniform_sphere(rng.next_2d());
            p.eval(from, to) * 4.0 * std::f64::consts::PI
        });
        let precision = 0.02 * area;
        assert_agrees("all that is scattered", &total, area, precision);
        assert_rejects("all that is scattered", &total, 1.1 * area);
        let draw = |i| p.sample(from, Rng::new(1, 2, i).next_2d());
        let directions = (0..200_000).map(|i| {
            let (to, pdf) = draw(i);
            assert!((to.length() - 1.0).abs() < 1e-12);
            assert!(near(pdf * area, p.eval(from, to), 1e-9));
            to
        });
        let value = sphere_chi_square(directions, |to| p.pdf(from, to));
        assert!(value > SIGNIFICANCE, "{s:?}: p-value {value}");
        if s == some()[0] {
            continue;
        }
        // Planted: flakes that are seen from elsewhere.
        let other = vec3(0.48, 0.6, 0.64);
        let directions = (0..200_000).map(|i| draw(i).0);
        let value = sphere_chi_square(directions, |to| p.pdf(other, to));
        assert!(value < SIGNIFICANCE, "{s:?} as seen from elsewhere: p-value {value}");
    }
}

#[test]
fn reciprocal_and_even_where_flakes_are() {
    let mut rng = Rng::new(4, 0, 0);
    for _ in 0..200 {
        let [wo, wi] = [0; 2].map(|_| warp::uniform_sphere(rng.next_2d()));
        for s in some() {
            let (there, back) = (s.scattered(wo, wi), s.scattered(wi, wo));
            assert_eq!(there, back);
            assert!(near(s.pdf(wo, wi) * s.projected_area(wo), there, 1e-12));
            assert_eq!(s.projected_area(wo), s.projected_area(-wo));
        }
        let even = uniform(some()[0]);
        let isotropic = Phase::Isotropic.at(Vec3::ZERO).eval(wo, wi);
        assert!((even.at(Vec3::ZERO).eval(wo, wi) - isotropic).abs() < 1e-15);
        assert!((even.at(Vec3::ZERO).projected_area(wo) - 1.0).abs() < 1e-15);
    }
    let straight = uniform(some()[0]).at(Vec3::ZERO).eval(Vec3::Y, -Vec3::Y);
    assert!((straight - 0.25 / std::f64::consts::PI).abs() < 1e-15);
}

/// Values of `eval_pdf` and `projected_area` of Mitsuba 3.9.1, which computes in single precision.
#[test]
fn values_are_those_of_mitsuba() {
    let s = some()[1];
    let (wi, wo) = (vec3(0.6, 0.8, 0.0), vec3(0.0, 0.6, 0.8));
    assert!((s.projected_area(wi) - 1.4422205686569214).abs() < 1e-6);
    assert!((s.pdf(wi, wo) - 0.022747837007045746).abs() < 1e-7);
}

#[test]
fn derivatives_are_those_of_duals() {
    type D = Dual<f64, 12>;
    let mut rng = Rng::new(5, 0, 0);
    for s in some() {
        let p = &uniform(s);
        let p = p.at(Vec3::ZERO);
        for _ in 0..100 {
            let [wo, wi] = [0; 2].map(|_| warp::uniform_sphere(rng.next_2d()));
            let seeded = |v: Vec3, lane: usize| -> Vec3<D> {
                let [x, y, z] = v.to_array();
                [D::variable(x, lane), D::variable(y, lane + 1), D::variable(z, lane + 2)].into()
            };
            let moving =
                Flakes { diagonal: seeded(s.diagonal, 0), off_diagonal: seeded(s.off_diagonal, 3) };
            let compare = |value: D, by: &drt_medium::PhaseGradient| {
                let parts = [by.flakes.diagonal, by.flakes.off_diagonal, by.wo, by.wi];
                for (part, lanes) in parts.into_iter().zip(value.eps.chunks(3)) {
                    for (own, truth) in part.to_array().into_iter().zip(lanes) {
                        assert!(near(own, *truth, 1e-10), "{s:?}: {own} {truth}");
                    }
                }
            };
            let (out, in_) = (seeded(wo, 6), seeded(wi, 9));
            compare(moving.scattered(out, in_), &p.gradient(wo, wi));
            compare(moving.projected_area(out), &p.area_gradient(wo));
            // Flakes that turn.
            let step = 1e-6;
            for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
                let [up, down] =
                    [step, -step].map(|a| s.turned(&Mat3::rotation(axis, a)).scattered(wo, wi));
                let own = p.gradient(wo, wi).turn.dot(axis);
                assert!((own - (up - down) / (2.0 * step)).abs() < 1e-6 * (1.0 + own.abs()));
            }
        }
    }
}

/// `exp(-σ sqrt(wᵀ S w) t)`, by transmittance, by passing, and with the flakes given by equal voxels.
#[test]
fn a_slab_lets_light_through_by_its_direction() {
    let h = Homogeneous::new(Rgb::new(0.7, 1.1, 0.0), Rgb::splat(0.5), Rgb::ZERO);
    let s = some()[2];
    let plain = Medium::new(h.expect("a medium"), uniform(s));
    let equal = |v: Vec3| Grid::new([2, 1, 1], 3, [v.to_array(); 2].concat()).expect("a grid");
    let grids = Sggx::varying(equal(s.diagonal), equal(s.off_diagonal)).expect("flakes");
    let voxels = Medium { phase: Phase::Sggx(Box::new(grids)), ..plain.clone() };
    let (t, stats) = (1.3, &mut TrackingStats::default());
    for dir in [Vec3::X, Vec3::Z, vec3(0.48, -0.6, 0.64)] {
        let area = s.projected_area(dir);
        let truth = Rgb::new(0.7, 1.1, 0.0).map(|sigma| (-sigma * area * t).exp());
        for medium in [&plain, &voxels] {
            let rng = &mut Rng::new(1, 1, 1);
            let through = medium.transmittance(&Ray::new(Vec3::ZERO, dir).until(t), rng, stats);
            assert!((through - truth).max_abs() < 1e-9, "{through:?} {truth:?}");
            let passing = estimate(40_000, |rng, stats| {
                let channels = Rgb::new(1.0, 1.0, 1.0);
                match medium.sample_distance(
                    &Ray::new(Vec3::ZERO, dir).until(t),
                    channels,
                    0.0,
                    rng,
                    stats,
                ) {
                    DistanceSample::Pass { weight } => weight.g,
                    DistanceSample::Scatter { .. } => 0.0,
                }
            });
            assert_agrees("passing", &passing, truth.g, 0.01);
            // Planted: an extinction without a direction.
            assert_rejects("passing", &passing, (-1.1 * t).exp());
        }
    }
}

/// Points of the middles of equal parts of a ray: the same rule for every medium.
fn middles(length: f64, parts: u32) -> Vec<(f64, f64)> {
    let w = length / f64::from(parts);
    (0..parts).map(|i| ((f64::from(i) + 0.5) * w, w)).collect()
}

fn through() -> Ray {
    Ray::new(vec3(-0.9, 0.1, 0.15), vec3(2.0, 1.5, 0.9).normalize()).until(1.6)
}

#[test]
fn a_varying_cloud_lets_through_what_quadrature_says() {
    let (medium, ray) = (cloud(), through());
    let points = middles(ray.t_max, 4000);
    let depth = DepthEstimate::inside(&medium, ray, &points, false).depth().r;
    let truth = (-depth).exp();
    let through = estimate(40_000, |rng, stats| medium.transmittance(&ray, rng, stats).r);
    assert_agrees("through the cloud", &through, truth, 0.01);
    let free = estimate(40_000, |rng, stats| {
        let sample = medium.sample_distance(&ray, Rgb::ONE, 0.1, rng, stats);
        match sample {
            DistanceSample::Pass { weight } => weight.r,
            DistanceSample::Scatter { .. } => 0.0,
        }
    });
    assert_agrees("free flight", &free, truth, 0.01);
    let isotropic = Medium { phase: Phase::Isotropic, ..medium };
    let even = DepthEstimate::inside(&isotropic, ray, &points, false).depth().r;
    assert_rejects("through an even cloud", &through, (-even).exp());
}

/// All that a cloud's flakes can do by a parameter.
fn changes() -> Vec<MediumChange> {
    let add = ValueChange::Add(Rgb::new(0.3, -0.1, 0.2));
    let (all, one) = (None, Some([1, 0, 1]));
    let turn = Mat3::rotation(vec3(0.0, 0.6, 0.8), 0.5);
    vec![
        MediumChange::Value { property: Property::SggxDiagonal, op: add, voxels: all },
        MediumChange::Value { property: Property::SggxOffDiagonal, op: add, voxels: all },
        MediumChange::Value {
            property: Property::SggxDiagonal,
            op: ValueChange::Multiply(0.4),
            voxels: all,
        },
        MediumChange::Value { property: Property::SggxDiagonal, op: add, voxels: one },
        MediumChange::Value { property: Property::SggxOffDiagonal, op: add, voxels: one },
        MediumChange::Value { property: Property::SigmaT, op: add, voxels: all },
        MediumChange::Value {
            property: Property::SigmaT,
            op: ValueChange::Multiply(0.4),
            voxels: Some([2, 1, 0]),
        },
        // Both turn what has been turned.
        MediumChange::Place { map: Affine::about(turn, Vec3::X), velocity: Affine::ZERO },
        MediumChange::Value { property: Property::SggxOffDiagonal, op: add, voxels: one },
        MediumChange::Value { property: Property::SggxDiagonal, op: add, voxels: all },
    ]
}

/// A motion at a parameter's value, and its velocity there.
fn motion(theta: f64) -> MediumChange {
    let axis = vec3(0.6, 0.0, 0.8);
    let (turn, size) = (Mat3::rotation(axis, 0.7 * theta), (0.2 * theta).exp());
    let pivot = vec3(0.2, -0.1, 0.3);
    let moved = Affine::translation(vec3(0.1, 0.3, -0.2) * theta);
    let map = moved.after(&Affine::about(turn * size, pivot));
    let linear = Mat3::skew(axis * 0.7) + Mat3::IDENTITY * 0.2;
    let centre = moved.point(pivot);
    let translation = vec3(0.1, 0.3, -0.2) - linear * centre;
    MediumChange::Place { map, velocity: Affine { linear, translation } }
}

/// What depends on flakes, in one number: an optical depth by a fixed rule, and a value of the phase function.
fn looked_at(medium: &Medium, points: &[(f64, f64)]) -> [f64; 2] {
    let (x, ray) = (vec3(0.1, 0.7, 0.4), through());
    let depth = DepthEstimate::inside(medium, ray, points, false).depth().g;
    let [wo, wi] = [vec3(0.48, -0.6, 0.64), vec3(0.0, 0.6, 0.8)];
    [depth, medium.phase_at(x).eval(wo, wi)]
}

#[test]
fn tangents_are_those_of_differences_and_gradients_their_transposes() {
    let points = middles(through().t_max, 4000);
    let x = vec3(0.1, 0.7, 0.4);
    let [wo, wi] = [vec3(0.48, -0.6, 0.64), vec3(0.0, 0.6, 0.8)];
    let mut medium = cloud();
    for change in changes().into_iter().map(|c| (c, 0.0)).chain([(motion(0.3), 0.3)]) {
        let (change, theta) = change;
        let base = medium.clone();
        let at = |theta: f64| {
            let mut changed = base.clone();
            let change = if matches!(change, MediumChange::Place { .. }) && theta != 0.0 {
                motion(theta)
            } else {
                change
            };
            changed.apply(&change, theta).expect("fits");
            changed
        };
        medium = at(theta);
        let tangent = medium.tangent(&change, theta).expect("fits");
        if tangent.is_zero() {
            continue;
        }
        let ray = through();
        // The rule has points on one side of a face each, so that its differences do not see faces move.
        let inside = DepthEstimate::inside(&medium, ray, &points, true);
        let by = medium.phase_gradient(x, &medium.phase_at(x), wo, wi);
        let rates = [
            inside.rate(&medium, &tangent).g,
            tangent.phase_rate(&medium, x, &by, &mut FlowPlace::default()),
        ];
        let step = 1e-5;
        let [up, down] = [step, -step].map(|s| looked_at(&at(theta + s), &points));
        for k in 0..2 {
            let difference = (up[k] - down[k]) / (2.0 * step);
            assert!(
                (rates[k] - difference).abs() < 2e-4 * (1.0 + difference.abs()),
                "{change:?}, {k}: {} {difference}",
                rates[k]
            );
        }
        // The transpose.
        let inside = inside.with_faces(&medium);
        let rates = [inside.rate(&medium, &tangent).g, rates[1]];
        let mut gradient = MediumGradient::zeros(&medium);
        gradient.scatter_depth(&medium, &inside, Rgb::new(0.0, 0.7, 0.0));
        gradient.scatter_phase(&medium, x, &by, -1.3);
        let (own, truth) = (gradient.dot(&tangent), 0.7 * rates[0] - 1.3 * rates[1]);
        assert!((own - truth).abs() < 1e-11 * (1.0 + truth.abs()), "{change:?}: {own} {truth}");
    }
}

/// The faces of a box that moves, where the extinction along the ray jumps.
#[test]
fn faces_count_by_the_area_that_flakes_show() {
    let ray = Ray { t_max: 3.0, ..through() };
    let (step, points) = (1e-3, middles(ray.t_max, 400_000));
    let at = |theta: f64| {
        let mut medium = cloud();
        medium.apply(&motion(theta), theta).expect("fits");
        medium
    };
    let medium = at(0.0);
    let tangent = medium.tangent(&motion(0.0), 0.0).expect("fits");
    let [up, down] =
        [step, -step].map(|s| DepthEstimate::inside(&at(s), ray, &points, false).depth().g);
    let difference = (up - down) / (2.0 * step);
    let rates = |medium: &Medium| {
        let depth = DepthEstimate::inside(medium, ray, &points, true);
        [depth.clone(), depth.with_faces(medium)].map(|d| d.rate(medium, &tangent).g)
    };
    let [inside, whole] = rates(&medium);
    assert!((whole - difference).abs() < 0.01, "{whole} {difference}");
    // Planted: faces that count as in a medium that looks the same from everywhere.
    let [without, with] = rates(&Medium { phase: Phase::Isotropic, ..medium });
    let wrong = inside + with - without;
    assert!((wrong - difference).abs() > 0.05, "{wrong} passes for {difference}");
}

/// The gradient by the ends of a segment through flakes that are the same everywhere: of `σ sqrt(dᵀ S d)`.
#[test]
fn depth_changes_as_the_ends_of_a_segment_move() {
    let h = Homogeneous::new(Rgb::ONE, Rgb::ZERO, Rgb::ZERO).expect("a medium");
    let s = some()[2];
    let medium = Medium::new(h, uniform(s));
    let ray = through();
    let [start, end] = medium.optical_depth_gradient(&ray, &mut Rng::new(0, 0, 0), &mut Vec::new());
    let truth = s.area_by_direction(ray.dir);
    assert!((end.g - truth).max_abs() < 1e-9 && (start.g + truth).max_abs() < 1e-9);
    // Planted: as if the flakes turned with the segment.
    assert!((ray.dir * s.projected_area(ray.dir) - truth).max_abs() > 1e-2);
}

#[test]
fn what_makes_no_flakes_is_refused_by_its_place() {
    let message = |s: Flakes| Sggx::new(s).unwrap_err().to_string();
    let text = message(flakes([1.0, 1.0, 1.0], [1.2, 0.0, 0.0]));
    assert!(text.contains("the matrix S of SGGX with") && text.contains("[1.2, 0.0, 0.0]"));
    for diagonal in [[1.0, 1.0, 0.0], [-1.0, 1.0, 1.0], [1.0, f64::NAN, 1.0]] {
        assert!(Sggx::new(flakes(diagonal, [0.0; 3])).is_err(), "{diagonal:?}");
    }
    assert!(Sggx::new(flakes([0.0; 3], [0.0; 3])).is_ok());
    let grid = |values: &[f64]| Grid::new([2, 1, 1], 3, values.to_vec()).expect("a grid");
    let [good, bad] = [[0.0; 6], [0.0, 0.0, 0.0, 2.0, 0.0, 0.0]].map(|o| grid(&o));
    let diagonal = grid(&[1.0; 6]);
    assert!(Sggx::varying(diagonal.clone(), good.clone()).is_ok());
    let text = Sggx::varying(diagonal.clone(), bad).unwrap_err().to_string();
    assert!(text.contains("at voxel [1, 0, 0]"), "{text}");
    let elsewhere = good.with_placement(Affine::translation(Vec3::X)).expect("a box");
    assert_eq!(Sggx::varying(diagonal, elsewhere), Err(MediumError::SggxGrids));

    let parts = [uniform(some()[1]), Phase::Isotropic];
    assert_eq!(PhaseBlend::new(0.5, parts), Err(MediumError::SggxInBlend));
    let mut medium = cloud();
    let stretch = Affine { linear: Mat3::diagonal(vec3(2.0, 1.0, 1.0)), translation: Vec3::ZERO };
    assert_eq!(medium.clone().place(&stretch), Err(MediumError::SggxMotion));
    let stretch = MediumChange::Place { map: Affine::IDENTITY, velocity: stretch };
    assert_eq!(medium.tangent(&stretch, 0.0), Err(MediumError::SggxMotion));
    // A step that takes a voxel out of what flakes can be.
    let step = vec![-1.0; 36];
    medium.add_to_voxels(Property::SggxDiagonal, &step).expect("a fitting step");
    let refused = medium.check(Property::SggxDiagonal);
    assert!(matches!(refused, Err(MediumError::SggxMatrix { voxel: Some(_), .. })));
    let isotropic = Medium { phase: Phase::Isotropic, ..medium };
    let change = MediumChange::Value {
        property: Property::SggxDiagonal,
        op: ValueChange::Multiply(1.0),
        voxels: None,
    };
    assert_eq!(isotropic.tangent(&change, 0.0), Err(MediumError::NoSggx));
    assert!(MediumTangent::zero().is_zero());
}
