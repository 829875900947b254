//! Changes by parameters: tangents against finite differences of the changed medium, the chain rule
//! through later changes, and gradients as exact transposes.

use crate::common::*;
use drt_math::{Affine, Mat3, Rgb, Rng, Vec3, vec3};
use drt_medium::{
    CoefficientRates, FlowPlace, Grid, GridMedium, Homogeneous, Layout, Medium, MediumChange,
    MediumError, MediumGradient, MediumTangent, Phase, PhaseBlend, PhaseGradient, Property,
    UniformMedium, ValueChange, Volume, Wrap,
};

const MULTIPLY: ValueChange = ValueChange::Multiply(0.7);
const LOG: ValueChange = ValueChange::MultiplyLog(-0.6);
const ADD: ValueChange = ValueChange::Add(Rgb { r: 0.3, g: -0.1, b: 0.2 });
const ADD_GRAY: ValueChange = ValueChange::Add(Rgb { r: 0.4, g: 0.4, b: 0.4 });

/// Everything a grid: a density of one channel, albedo and emission placed elsewhere.
fn full(density_channels: usize) -> Medium {
    let turn = Mat3::rotation(vec3(0.0, 0.0, 1.0), 0.3);
    let place = Affine { linear: turn * Mat3::diagonal(vec3(2.0, 1.0, 1.5)), translation: Vec3::X };
    let grid = |size: [usize; 3], channels: usize, seed| {
        let values = random_values(channels * size.iter().product::<usize>(), seed);
        Grid::new(size, channels, values).expect("a valid grid")
    };
    let density = grid([5, 4, 3], density_channels, 1).with_placement(place).expect("a box");
    let wider = Affine { linear: place.linear * 1.3, translation: vec3(0.8, -0.1, -0.2) };
    let albedo = grid([3, 3, 2], 3, 2).with_wrap(Wrap::Mirror).with_placement(wider);
    let emission = grid([2, 6, 2], 1, 3).with_layout(Layout::NodeCentred).with_placement(place);
    let (albedo, emission) = (albedo.expect("a box"), emission.expect("a box"));
    let cosines = random_values(36, 4).into_iter().map(|v| 0.6 * v - 0.3).collect();
    let cosines = Grid::new([4, 3, 3], 1, cosines).expect("a valid grid").with_placement(wider);
    let g = GridMedium::new(density, 2.5, Volume::Grid(albedo), Volume::Grid(emission));
    let phase = Phase::henyey_greenstein_grid(cosines.expect("a box"));
    Medium::new(g.expect("a valid medium"), phase.expect("mean cosines"))
}

/// A grid with a blend of functions, one of which varies too, by a grid of weights.
fn blended() -> Medium {
    let full = full(1);
    let values = random_values(36, 5).into_iter().map(|v| 0.3 + 0.4 * v).collect();
    let grid = full.voxels(Property::G).expect("a grid");
    let weights = Grid::new(grid.size(), 1, values).expect("a valid grid");
    let weights = weights.with_placement(*grid.to_world()).expect("a box");
    let blend = PhaseBlend::varying(weights, [Phase::Rayleigh, full.phase.clone()]);
    Medium { phase: Phase::Blend(Box::new(blend.expect("weights"))), ..full }
}

/// The albedo and the emission of [`full`], under one extinction.
fn dyed() -> Medium {
    let full = full(1);
    let g = full.grid().expect("a grid");
    let sigma_t = Rgb::new(0.5, 1.0, 2.0);
    let u = UniformMedium::new(sigma_t, g.albedo().clone(), g.emission().clone());
    Medium::new(u.expect("a valid medium"), full.phase)
}

fn plain() -> Medium {
    let h = Homogeneous::new(Rgb::new(0.5, 1.0, 2.0), Rgb::splat(0.4), Rgb::new(1.0, 0.0, 3.0));
    Medium::new(h.expect("a valid medium"), Phase::Isotropic)
}

/// A turn by 0.8 theta about an axis through a pivot, and a drift.
fn turning(theta: f64) -> MediumChange {
    let (axis, pivot, drift) = (vec3(0.6, 0.8, 0.0), vec3(1.0, 0.5, 0.2), vec3(0.1, 0.2, -0.3));
    let turn = Affine::about(Mat3::rotation(axis, 0.8 * theta), pivot);
    let map = Affine { translation: turn.translation + drift * theta, ..turn };
    // d/dtheta of the moved point, as a function of where it is now.
    let spin = Mat3::skew(axis) * 0.8;
    let velocity = Affine { linear: spin, translation: drift - spin * (pivot + drift * theta) };
    MediumChange::Place { map, velocity }
}

type ChangeAt = fn(f64) -> MediumChange;

/// All at once, in an order in which each meets what came before.
const CHANGES: [ChangeAt; 16] = [
    |_| MediumChange::Value { property: Property::SigmaT, op: ADD_GRAY, voxels: None },
    |_| MediumChange::Value { property: Property::SigmaT, op: MULTIPLY, voxels: Some([2, 1, 1]) },
    |_| MediumChange::Value { property: Property::Emission, op: MULTIPLY, voxels: None },
    turning,
    |_| MediumChange::Value { property: Property::SigmaT, op: LOG, voxels: None },
    |_| MediumChange::Value { property: Property::SigmaT, op: ADD, voxels: Some([2, 1, 1]) },
    |_| MediumChange::Value { property: Property::Albedo, op: LOG, voxels: Some([1, 1, 1]) },
    |_| MediumChange::Value { property: Property::SigmaT, op: ADD, voxels: None },
    |_| MediumChange::Value { property: Property::Albedo, op: ADD, voxels: None },
    turning,
    |_| MediumChange::Value {
        property: Property::G,
        op: ValueChange::Add(Rgb { r: 0.2, g: 0.2, b: 0.2 }),
        voxels: None,
    },
    |_| MediumChange::Value {
        property: Property::G,
        op: ValueChange::MultiplyLog(0.3),
        voxels: None,
    },
    |_| MediumChange::Value { property: Property::G, op: ADD_GRAY, voxels: Some([2, 1, 1]) },
    |_| MediumChange::Value { property: Property::Weight, op: MULTIPLY, voxels: None },
    turning,
    |_| MediumChange::Value { property: Property::Weight, op: ADD_GRAY, voxels: Some([1, 1, 2]) },
];

/// Those that a medium has the properties for.
fn fitting(medium: &Medium) -> Vec<ChangeAt> {
    let fits = |c: &ChangeAt| medium.clone().apply(&c(0.0), 0.0).is_ok();
    CHANGES.into_iter().filter(fits).collect()
}

/// The medium after the changes, and its tangent with respect to their common parameter.
fn changed(start: &Medium, changes: &[ChangeAt], theta: f64) -> (Medium, MediumTangent) {
    let mut medium = start.clone();
    let mut tangent = MediumTangent::zero();
    for change in changes {
        let change = change(theta);
        medium.apply(&change, theta).expect("a change that fits");
        tangent.push_through(&change, theta);
        tangent = tangent.plus(&medium.tangent(&change, theta).expect("a change that fits"));
    }
    (medium, tangent)
}

/// The cosine at which phase functions are looked at.
const COSINE: f64 = 0.4;

/// Derivatives of the phase function there.
fn gradient(medium: &Medium, x: Vec3) -> PhaseGradient {
    let [wo, wi] = directions(COSINE);
    medium.phase_gradient(x, &medium.phase_at(x), wo, wi)
}

/// What a medium has at a point, or the rates of that.
#[derive(Clone, Copy, Debug)]
struct Local {
    coefficients: CoefficientRates,
    phase: f64,
}

fn local(medium: &Medium, x: Vec3) -> Local {
    let c = medium.coefficients(x);
    let (sigma_t, albedo, emission) = (c.sigma_t, c.albedo, c.emission);
    let coefficients = CoefficientRates { sigma_t, albedo, emission };
    Local { coefficients, phase: at_cosine(&medium.phase_at(x), COSINE) }
}

fn rates(tangent: &MediumTangent, medium: &Medium, x: Vec3) -> Local {
    let gradient = gradient(medium, x);
    let phase = tangent.phase_rate(medium, x, &gradient, &mut FlowPlace::default());
    Local { coefficients: tangent.rates(medium, x), phase }
}

/// Points inside the density box of the medium, away from its faces and from voxel planes.
fn points(medium: &Medium) -> Vec<Vec3> {
    let mut rng = Rng::new(6, 0, 0);
    let mut unit = || vec3(rng.next_f64(), rng.next_f64(), rng.next_f64()) * 0.96;
    let unit: Vec<_> = (0..60).map(|_| unit() + Vec3::splat(0.02)).collect();
    match medium.grid() {
        Some(g) => unit.into_iter().map(|u| g.density().to_world().point(u)).collect(),
        None => unit,
    }
}

fn difference(of: &Local, from: &Local) -> f64 {
    let (a, b) = (&of.coefficients, &from.coefficients);
    let fields = [a.sigma_t - b.sigma_t, a.albedo - b.albedo, a.emission - b.emission];
    fields.into_iter().map(Rgb::max_abs).fold((of.phase - from.phase).abs(), f64::max)
}

fn check_rates(start: &Medium, changes: &[ChangeAt], theta: f64) {
    let (medium, tangent) = changed(start, changes, theta);
    let h = 1e-6;
    let (above, below) =
        (changed(start, changes, theta + h).0, changed(start, changes, theta - h).0);
    for x in points(&medium) {
        let rates = rates(&tangent, &medium, x);
        let (up, down) = (local(&above, x), local(&below, x));
        let (a, b) = (up.coefficients, down.coefficients);
        let slope = |a: Rgb, b: Rgb| (a - b) / (2.0 * h);
        let coefficients = CoefficientRates {
            sigma_t: slope(a.sigma_t, b.sigma_t),
            albedo: slope(a.albedo, b.albedo),
            emission: slope(a.emission, b.emission),
        };
        let numeric = Local { coefficients, phase: (up.phase - down.phase) / (2.0 * h) };
        let error = difference(&rates, &numeric);
        assert!(error < 1e-6, "theta {theta}, {x:?}: {rates:?}, numeric {numeric:?}");
    }
}

#[test]
fn each_change_alone() {
    for change in CHANGES {
        for theta in [0.0, 0.35] {
            for medium in [full(1), full(3), dyed(), blended()] {
                if medium.clone().apply(&change(theta), theta).is_ok() {
                    check_rates(&medium, &[change], theta);
                }
            }
        }
    }
}

#[test]
fn all_changes_together_by_the_chain_rule() {
    for theta in [0.0, 0.35, -0.2] {
        for medium in [full(1), full(3), blended()] {
            check_rates(&medium, &fitting(&medium), theta);
        }
    }
}

#[test]
fn the_chain_rule_is_needed() {
    let theta = 0.35;
    let start = full(3);
    let changes = fitting(&start);
    let (medium, whole) = changed(&start, &changes, theta);
    let mut sum = MediumTangent::zero();
    let mut stepped = start;
    for change in changes {
        let change = change(theta);
        stepped.apply(&change, theta).expect("a change that fits");
        sum = sum.plus(&stepped.tangent(&change, theta).expect("a change that fits"));
    }
    let differs =
        |x: &Vec3| difference(&rates(&sum, &medium, *x), &rates(&whole, &medium, *x)) > 1e-3;
    assert!(points(&medium).iter().all(differs), "a plain sum of tangents passes");
}

#[test]
fn homogeneous_changes() {
    let whole: [ChangeAt; 5] = [
        |_| MediumChange::Value { property: Property::SigmaT, op: MULTIPLY, voxels: None },
        |_| MediumChange::Value { property: Property::Emission, op: ADD, voxels: None },
        |_| MediumChange::Value { property: Property::SigmaT, op: ADD, voxels: None },
        |_| MediumChange::Value { property: Property::G, op: ADD_GRAY, voxels: None },
        turning,
    ];
    check_rates(&plain(), &whole, 0.3);
}

#[test]
fn a_dyed_medium_changes_in_all_its_ways_together() {
    let changes = fitting(&dyed());
    assert_eq!(changes.len(), 12, "all but those of voxels that it has not");
    for theta in [0.0, 0.35, -0.2] {
        check_rates(&dyed(), &changes, theta);
    }
    let away = vec3(50.0, -3.0, 7.0);
    assert_ne!(dyed().coefficients(away).albedo, Rgb::ZERO, "its volumes end nowhere");
}

#[test]
fn gradients_are_the_transposes_of_rates() {
    let mut rng = Rng::new(9, 0, 0);
    let mut color = || Rgb::new(rng.next_f64() - 0.5, rng.next_f64() - 0.5, rng.next_f64() - 0.5);
    for start in [full(1), full(3), dyed(), plain(), blended()] {
        let (medium, tangent) = changed(&start, &fitting(&start), 0.35);
        let mut parts = [MediumGradient::zeros(&medium), MediumGradient::zeros(&medium)];
        let mut forward = 0.0;
        let mut size = 0.0;
        for (n, x) in points(&medium).into_iter().enumerate() {
            let adjoint = CoefficientRates { sigma_t: color(), albedo: color(), emission: color() };
            let of_phase = color().r;
            let here = rates(&tangent, &medium, x);
            let rate = here.coefficients.dot(&adjoint) + here.phase * of_phase;
            forward += rate;
            size += rate.abs();
            parts[n % 2].scatter(&medium, x, &adjoint);
            let gradient = gradient(&medium, x);
            parts[n % 2].scatter_phase(&medium, x, &gradient, of_phase);
        }
        let [mut gradient, other] = parts;
        gradient.add(other);
        let reverse = gradient.dot(&tangent);
        assert!((forward - reverse).abs() < 1e-13 * size, "{forward} forward, {reverse} reverse");
    }
}

#[test]
fn crossings_scatter_what_they_rate() {
    let medium = cloud(Layout::NodeCentred);
    let ray = ray_through(&medium, vec3(0.8, 0.3, -0.2));
    let motion = turning(0.0);
    let tangent = medium.tangent(&motion, 0.0).expect("a motion");
    let velocity = tangent.velocity;
    let adjoint = Rgb::new(0.3, -1.0, 2.0);
    let mut gradient = MediumGradient::zeros_without_voxels();
    let mut forward = 0.0;
    let grid = medium.grid().expect("a grid");
    assert_eq!(grid.crossings(&ray).count(), 2);
    for c in grid.crossings(&ray) {
        forward += c.depth_rate(velocity.point(ray.at(c.t))).dot(adjoint);
        gradient.scatter_crossing(&c, ray.at(c.t), adjoint);
    }
    assert!((gradient.dot(&tangent) - forward).abs() < 1e-13 * forward.abs());
}

#[test]
fn one_voxel_keeps_the_bounds() {
    use drt_medium::DensityField;
    use std::ops::ControlFlow;
    let mut medium = full(1);
    for voxel in [[0, 0, 0], [4, 3, 2], [2, 0, 1]] {
        let op = ValueChange::Add(Rgb::splat(50.0));
        medium
            .apply(
                &MediumChange::Value { property: Property::SigmaT, op, voxels: Some(voxel) },
                1.0,
            )
            .expect("a voxel");
    }
    let grid = medium.grid().expect("a grid");
    assert!(grid.largest_sigma_t() > 50.0);
    for x in points(&medium) {
        let ray = drt_medium::Ray::new(x - Vec3::Y * 3.0, Vec3::Y).until(6.0);
        grid.pieces(&ray, &mut |p| {
            let sigma = medium.sigma_t(ray.at(0.5 * (p.start + p.end)));
            assert!(sigma.r <= p.majorant.r + 1e-12 && sigma.r >= p.minorant.r - 1e-12);
            ControlFlow::Continue(())
        });
    }
}

#[test]
fn a_step_of_all_voxels_is_the_sum_of_single_ones() {
    let start = full(3);
    let count = start.grid().expect("a grid").density().values().len();
    let step = random_values(count, 8);
    let mut dye = dyed();
    let [before, by] =
        [dye.voxels(Property::Albedo).expect("a grid").values().to_vec(), step[..54].into()];
    dye.add_to_voxels(Property::Albedo, &by).expect("a fitting step");
    let sums = before.iter().zip(&by).map(|(v, s)| v + s);
    assert!(sums.eq(dye.voxels(Property::Albedo).expect("a grid").values().iter().copied()));
    assert!(dye.add_to_voxels(Property::SigmaT, &by).is_err());
    let (mut whole, mut single) = (start.clone(), start);
    whole.add_to_voxels(Property::SigmaT, &step).expect("a fitting step");
    for (n, s) in step.chunks_exact(3).enumerate() {
        let voxel = [n % 5, n / 5 % 4, n / 20];
        let op = ValueChange::Add(Rgb::new(s[0], s[1], s[2]));
        let change = MediumChange::Value { property: Property::SigmaT, op, voxels: Some(voxel) };
        single.apply(&change, 1.0).expect("a voxel");
    }
    let largest = |m: &Medium| m.grid().expect("a grid").largest_sigma_t();
    assert!((largest(&whole) - largest(&single)).abs() < 1e-14);
    for x in points(&whole) {
        assert!((whole.sigma_t(x) - single.sigma_t(x)).max_abs() < 1e-14);
    }
    assert!(whole.add_to_voxels(Property::SigmaT, &step[1..]).is_err());
    assert!(whole.add_to_voxels(Property::G, &step).is_err());
    let before = whole.voxels(Property::G).expect("a grid").values().to_vec();
    whole.add_to_voxels(Property::G, &step[..36]).expect("a fitting step");
    let sums = before.iter().zip(&step).map(|(v, s)| v + s);
    assert!(sums.eq(whole.voxels(Property::G).expect("a grid").values().iter().copied()));
    assert!(whole.add_to_voxels(Property::SigmaT, &vec![f64::NAN; count]).is_err());
}

#[test]
fn changes_that_do_not_fit_say_why() {
    let sigma = |op, voxels| MediumChange::Value { property: Property::SigmaT, op, voxels };
    let (mut h, mut g) = (plain(), full(1));
    let voxel = Some([0, 0, 3]);
    let property = Property::SigmaT;
    assert_eq!(h.apply(&sigma(ADD, voxel), 0.1), Err(MediumError::NotAGrid { property }),);
    assert_eq!(
        g.apply(&sigma(ADD, voxel), 0.1),
        Err(MediumError::NoSuchVoxel { property, voxel: [0, 0, 3], size: [5, 4, 3] }),
    );
    assert!(g.apply(&sigma(MULTIPLY, None), f64::INFINITY).is_err());
    assert!(g.apply(&sigma(ValueChange::MultiplyLog(1e3), Some([0, 0, 0])), 10.0).is_err());
    assert_eq!(
        g.apply(&MediumChange::Value { property: Property::G, op: ADD, voxels: None }, 1.0),
        Err(MediumError::NotScalar { property: Property::G })
    );
    let mut wide = g.clone();
    wide.apply(&MediumChange::Value { property: Property::G, op: ADD_GRAY, voxels: None }, 5.0)
        .expect("finite values");
    assert!(wide.check(Property::G).is_err() && g.check(Property::G).is_ok());
    let of_weight = MediumChange::Value { property: Property::Weight, op: ADD_GRAY, voxels: None };
    assert_eq!(g.apply(&of_weight, 0.1), Err(MediumError::NoWeight));
    let property = Property::G;
    assert_eq!(
        h.apply(&MediumChange::Value { property: Property::G, op: ADD_GRAY, voxels: voxel }, 0.1),
        Err(MediumError::NotAGrid { property })
    );
    let property = Property::SigmaT;
    let nan = ValueChange::Add(Rgb::new(f64::NAN, 1.0, 1.0));
    assert!(g.apply(&sigma(nan, None), 1.0).is_err());
    assert!(h.apply(&sigma(nan, None), 1.0).is_err());
    let vanishing = ValueChange::Multiply(-1.0);
    g.apply(&sigma(vanishing, None), 1.0).expect("an empty medium");
    assert_eq!(
        g.tangent(&sigma(vanishing, None), 1.0),
        Err(MediumError::VanishingFactor { property }),
    );
    g.apply(&sigma(ADD_GRAY, None), 1.0).expect("a term on an empty medium");
    assert!((g.sigma_t(points(&g)[0]).r - 0.4).abs() < 1e-15);
    let flat = Affine { linear: Mat3::ZERO, translation: Vec3::ZERO };
    let collapse = MediumChange::Place { map: flat, velocity: flat };
    assert_eq!(g.apply(&collapse, 0.0), Err(MediumError::SingularPlacement));
    let rayleigh = &mut Medium { phase: Phase::Rayleigh, ..plain() };
    let of_g = MediumChange::Value { property: Property::G, op: ADD_GRAY, voxels: None };
    assert_eq!(rayleigh.apply(&of_g, 0.1), Err(MediumError::NoMeanCosine));
}

#[test]
fn changes_that_leave_the_physical_range_are_found() {
    let down = |voxels| MediumChange::Value {
        property: Property::SigmaT,
        op: ValueChange::Add(Rgb::splat(-1.0)),
        voxels,
    };
    let mut fog = Medium::new(
        Homogeneous::new(Rgb::splat(0.5), Rgb::splat(0.5), Rgb::ZERO).unwrap(),
        Phase::Isotropic,
    );
    assert_eq!(down(None).pushes(0.0), None);
    assert_eq!(down(None).pushes(1.0), Some(Property::SigmaT));
    fog.apply(&down(None), 0.5).unwrap();
    fog.check(Property::SigmaT).unwrap();
    fog.apply(&down(None), 0.5).unwrap();
    let error = fog.check(Property::SigmaT).unwrap_err().to_string();
    assert!(error.contains("sigma_t is -0.5; it must be finite and not negative"), "{error}");
    let brighter = MediumChange::Value {
        property: Property::Albedo,
        op: ValueChange::Multiply(3.0),
        voxels: None,
    };
    assert_eq!(brighter.pushes(1.0), Some(Property::Albedo));
    fog.apply(&brighter, 1.0).unwrap();
    assert!(fog.check(Property::Albedo).is_err() && fog.check(Property::Emission).is_ok());
    let thinner = MediumChange::Value {
        property: Property::SigmaT,
        op: ValueChange::MultiplyLog(-3.0),
        voxels: None,
    };
    assert_eq!(thinner.pushes(1.0), None, "it keeps its sign");
}
