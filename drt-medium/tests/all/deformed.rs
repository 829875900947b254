//! Grids seen through a deformation of space: a cloud bent into the shape of a V.

use std::ops::ControlFlow;
use std::sync::Arc;

use crate::common::{
    assert_agrees, assert_rejects, directions, estimate, grid_medium, placement, random_values,
};
use drt_math::{Affine, Mat3, Rgb, RgbVec, Rng, Vec3, vec3};
use drt_medium::{
    CoefficientRates, DepthEstimate, DistanceSample, Flow, FlowBasis, FlowPlace, Grid, Homogeneous,
    Layout, Medium, MediumError, MediumGradient, MediumTangent, NodeWeights, Phase, Ray, SpaceMap,
    TrackingStats,
};

/// Where the cloud is folded.
const FOLD: f64 = 0.4;

/// Y = y + k |x - FOLD|.
#[derive(Debug)]
struct Bend(f64);

impl Bend {
    fn side(&self, right: bool) -> Affine {
        let k = if right { self.0 } else { -self.0 };
        let mut linear = Mat3::IDENTITY;
        linear.cols[0].y = k;
        Affine { linear, translation: vec3(0.0, -k * FOLD, 0.0) }
    }
}

impl SpaceMap for Bend {
    fn material(&self, x: Vec3) -> Option<(Vec3, Mat3)> {
        let map = self.side(x.x > FOLD);
        Some((map.point(x), map.linear))
    }

    fn stretches(&self, ray: &Ray, visit: &mut dyn FnMut(f64, f64, &Affine) -> ControlFlow<()>) {
        let fold = ((FOLD - ray.origin.x) / ray.dir.x).clamp(0.0, ray.t_max);
        for (start, end) in [(0.0, fold), (fold, ray.t_max)] {
            let right = ray.at(0.5 * (start + end)).x > FOLD;
            if end > start && visit(start, end, &self.side(right)).is_break() {
                return;
            }
        }
    }
}

/// How space moves with k: one node, at one.
#[derive(Debug)]
struct Bending;

impl FlowBasis for Bending {
    fn weights(&self, x: Vec3) -> NodeWeights {
        NodeWeights { nodes: [0; 4], weights: [(x.x - FOLD).abs(), 0.0, 0.0, 0.0] }
    }
}

fn cloud() -> Medium {
    let values = random_values(3 * 6 * 4 * 5, 3).into_iter().map(|v| 0.2 + v).collect();
    let place = placement(vec3(-1.0, -0.3, -0.5), vec3(1.8, 0.3, 0.5));
    let grid = Grid::new([6, 4, 5], 3, values).expect("a grid").with_layout(Layout::NodeCentred);
    let grid = grid.with_placement(place).expect("a proper box");
    grid_medium(grid, 0.8, Rgb::new(0.9, 0.5, 0.2))
}

fn bent(k: f64) -> Medium {
    let mut medium = cloud();
    medium.deform(Arc::new(Bend(k))).expect("a grid");
    medium
}

fn bending() -> MediumTangent {
    let flow = Flow { basis: Arc::new(Bending), nodes: Arc::new([vec3(0.0, -1.0, 0.0)]) };
    MediumTangent { flows: vec![flow], ..MediumTangent::zero() }
}

/// Rays through the middle of the cloud, and one through both of its arms but not between them.
fn rays() -> Vec<Ray> {
    let mut rays = Vec::from([vec3(0.9, 0.3, -0.2), vec3(-0.3, 0.8, 0.4)].map(|d| {
        let dir = d.normalize();
        Ray::new(vec3(0.4, 0.3, 0.0) - dir * 3.0, dir).until(6.0)
    }));
    rays.push(Ray::new(vec3(-3.0, -0.4, 0.05), vec3(1.0, 0.003, 0.001).normalize()).until(7.0));
    // Ends inside.
    rays.push(Ray { t_max: 3.1, ..rays[0] });
    rays
}

/// The optical depth, between the places where the medium begins and ends.
fn depth(medium: &Medium, ray: &Ray) -> Rgb {
    let there = |t: f64| medium.sigma_t(ray.at(t)).max_channel() > 0.0;
    let n = 4000;
    let at = |i: usize| ray.t_max * i as f64 / n as f64;
    let mut ends = vec![0.0];
    for i in 0..n {
        let (mut a, mut b) = (at(i), at(i + 1));
        if there(a) != there(b) {
            let first = there(a);
            for _ in 0..60 {
                let m = 0.5 * (a + b);
                if there(m) == first { a = m } else { b = m }
            }
            ends.push(0.5 * (a + b));
        }
    }
    ends.push(ray.t_max);
    let part = |w: &[f64]| {
        let step = (w[1] - w[0]) / 20_000.0;
        let middle = |i: i32| medium.sigma_t(ray.at(w[0] + step * (f64::from(i) + 0.5)));
        (0..20_000).fold(Rgb::ZERO, |sum, i| sum + middle(i) * step)
    };
    ends.windows(2).map(part).fold(Rgb::ZERO, |sum, p| sum + p)
}

#[test]
fn walks_are_unbiased() {
    let medium = bent(0.8);
    for ray in rays() {
        let truth = (-depth(&medium, &ray)).exp();
        let stats = &mut TrackingStats::default();
        let passed = estimate(100_000, |rng, _| medium.transmittance(&ray, rng, stats).g);
        assert_agrees("transmittance", &passed, truth.g, 0.01);
        assert_rejects("transmittance", &passed, truth.g * 1.05 + 0.02);
        let stopped = estimate(100_000, |rng, stats| {
            let Ray { origin, dir, t_max } = ray;
            match medium.sample_distance(
                &Ray::new(origin, dir).until(t_max),
                Rgb::ONE,
                0.1,
                rng,
                stats,
            ) {
                DistanceSample::Scatter { t, weight, .. } => (weight * medium.sigma_t(ray.at(t))).g,
                DistanceSample::Pass { .. } => 0.0,
            }
        });
        assert_agrees("collisions", &stopped, 1.0 - truth.g, 0.01);
    }
}

#[test]
fn gradients_are_differences() {
    let medium = bent(0.8);
    let (h, mut seen, mut jumps) = (1e-6, 0, 0);
    for ray in rays() {
        for i in 0..200 {
            let x = ray.at(ray.t_max * (f64::from(i) + 0.3) / 200.0);
            let g = medium.gradients(x).sigma_t;
            if g == RgbVec::ZERO {
                continue;
            }
            seen += 1;
            let off = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| {
                let [a, b] = [-h, h].map(|h| medium.sigma_t(x + axis * h));
                ((b - a) * (0.5 / h) - g.dot(axis)).max_abs()
            });
            jumps += u32::from(off.into_iter().any(|off| off > 1e-6));
        }
    }
    assert!(seen > 50 && jumps < 5, "{jumps} of {seen}");
}

#[test]
fn faces_are_met_as_often_as_they_are() {
    let ray = rays()[2];
    let count = |medium: &Medium| {
        let (mut count, mut depth) = (0, 0.0);
        medium.crossings(&ray, |c| {
            count += 1;
            depth += c.cosine.signum() * c.t;
            assert!((c.normal.length() - 1.0).abs() < 1e-12);
        });
        (count, depth)
    };
    let [straight, slightly, strongly] = [0.0, 0.1, 0.8].map(|k| count(&bent(k)));
    assert_eq!((straight.0, slightly.0, strongly.0), (0, 4, 4));
    // Out less in: what the ray has of the medium.
    let medium = bent(0.8);
    let points = (0..200_000).map(|i| ray.at(ray.t_max * (f64::from(i) + 0.5) / 200_000.0));
    let inside = points.filter(|x| medium.gradients(*x).sigma_t != RgbVec::ZERO).count();
    let length = ray.t_max * inside as f64 / 200_000.0;
    assert!((strongly.1 - length).abs() < 1e-3 * ray.t_max, "{} {length}", strongly.1);
}

#[test]
fn depths_change_as_their_differences() {
    let (k, h) = (0.8, 1e-4);
    let [low, medium, high] = [k - h, k, k + h].map(bent);
    let tangent = bending();
    for ray in rays() {
        let truth = (depth(&high, &ray) - depth(&low, &ray)) * (0.5 / h);
        let points = &mut Vec::new();
        let rate =
            estimate(40_000, |rng, _| medium.optical_depth_rate(&ray, &tangent, rng, points).g);
        assert_agrees("rate of the depth", &rate, truth.g, 0.03 * (1.0 + truth.g.abs()));
    }
}

#[test]
fn the_unbent_cloud_is_the_cloud() {
    let (plain, through) = (cloud(), bent(0.0));
    let tangent = bending();
    for ray in rays() {
        for i in 0..50 {
            let x = ray.at(ray.t_max * f64::from(i) / 50.0);
            assert_eq!(plain.coefficients(x), through.coefficients(x));
            let [a, b] = [&plain, &through].map(|m| tangent.rates(m, x).sigma_t);
            assert!((a - b).max_abs() < 1e-12);
        }
    }
}

#[test]
fn gradients_by_nodes_are_the_transposes() {
    let medium = bent(0.8);
    let mut tangent = bending();
    let rng = &mut Rng::new(4, 0, 0);
    let map = Affine { linear: Mat3::skew(vec3(0.1, 0.4, -0.2)), translation: Vec3::X };
    tangent.velocity = map;
    let basis = tangent.flows[0].basis.clone();
    let mut gradient = MediumGradient::zeros(&medium).with_flow(basis, 1);
    let (mut forward, mut points) = (0.0, Vec::new());
    for (n, ray) in rays().into_iter().enumerate() {
        let values = random_values(6, n as u64);
        let (a, b) = (Rgb::new(values[0], values[1], values[2]), Rgb::splat(values[3]));
        let x = ray.at(0.45 * ray.t_max);
        let adjoint = CoefficientRates { sigma_t: a, albedo: b, ..CoefficientRates::ZERO };
        forward += tangent.rates(&medium, x).dot(&adjoint);
        gradient.scatter(&medium, x, &adjoint);
        points.clear();
        medium.line_points(&ray, rng, &mut points);
        let depth = DepthEstimate::inside(&medium, ray, &points, true).with_faces(&medium);
        forward += depth.rate(&medium, &tangent).dot(a);
        gradient.scatter_depth(&medium, &depth, a);
    }
    let reverse = gradient.dot(&tangent);
    assert!((forward - reverse).abs() < 1e-12 * forward.abs(), "{forward} {reverse}");
}

/// The grid of a phase function is bent like the others, and moves like them; also where there are no others.
#[test]
fn phase_functions_are_bent() {
    let values = random_values(60, 4).into_iter().map(|v| 1.4 * v - 0.7).collect();
    let place = placement(vec3(-1.2, -0.9, -0.6), vec3(2.0, 0.9, 0.6));
    let cosines = Grid::new([5, 4, 3], 1, values).expect("a grid").with_placement(place);
    let phase = Phase::henyey_greenstein_grid(cosines.expect("a proper box"));
    let phase = phase.expect("mean cosines");
    let plain = Homogeneous::new(Rgb::ONE, Rgb::splat(0.5), Rgb::ZERO).expect("coefficients");
    let kinds = [cloud().kind, plain.into()];
    let (k, h, cosine) = (0.3, 1e-6, 0.6);
    let (tangent, place) = (bending(), &mut FlowPlace::default());
    for kind in kinds {
        let bent = |k: f64| {
            let mut medium = Medium::new(kind.clone(), phase.clone());
            medium.deform(Arc::new(Bend(k))).expect("it can be deformed");
            medium
        };
        let [low, medium, high] = [k - h, k, k + h].map(bent);
        let basis = tangent.flows[0].basis.clone();
        let mut gradient = MediumGradient::zeros(&medium).with_flow(basis, 1);
        let [mut forward, mut jumps] = [0.0; 2];
        for i in 0..50 {
            let x = vec3(-0.8 + 0.05 * f64::from(i), 0.1, 0.07);
            if medium.grid().is_some() && !medium.contains(x) {
                continue;
            }
            let [wo, wi] = directions(cosine);
            let here = medium.phase_gradient(x, &medium.phase_at(x), wo, wi);
            let rate = tangent.phase_rate(&medium, x, &here, place);
            let [a, b] = [&low, &high].map(|m| m.phase_at(x).eval(wo, wi));
            let off = (rate - (b - a) / (2.0 * h)).abs();
            jumps += f64::from(u8::from(off > 1e-6));
            forward += rate;
            gradient.scatter_phase(&medium, x, &here, 1.0);
        }
        // Where a plane between voxels is passed, the slopes of both sides differ.
        assert!(jumps < 3.0 && forward.abs() > 0.1, "{jumps} jumps, {forward}");
        assert!((gradient.dot(&tangent) - forward).abs() < 1e-12 * forward.abs());
    }
}

#[test]
fn flows_go_with_what_is_placed_later() {
    let mut tangent = bending();
    let map = Affine::about(Mat3::rotation(Vec3::Z, 0.5), vec3(1.0, 2.0, 0.0));
    let x = vec3(0.9, 0.2, 0.1);
    let before = tangent.flows[0].velocity(x);
    let place = drt_medium::MediumChange::Place { map, velocity: Affine::ZERO };
    tangent.push_through(&place, 0.3);
    let after = tangent.flows[0].velocity(map.point(x));
    assert!((after - map.vector(before)).max_abs() < 1e-14);
    let twice = tangent.clone().plus(&tangent);
    assert_eq!(twice.flows.len(), 1);
    assert!((twice.flows[0].velocity(map.point(x)) - after * 2.0).max_abs() < 1e-14);
}

#[test]
fn a_deformed_grid_is_left_alone() {
    let mut medium = bent(0.3);
    assert_eq!(medium.place(&Affine::IDENTITY), Err(MediumError::Deformed));
    assert_eq!(medium.deform(Arc::new(Bend(0.1))), Err(MediumError::Deformed));
}
