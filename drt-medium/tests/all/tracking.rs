//! Sampling of distances and estimates of transmittance, judged against exact quadrature.

use crate::common::*;
use drt_math::testing::{SIGNIFICANCE, chi_square};
use drt_math::{Rgb, Rng, Vec3, vec3};
use drt_medium::{
    DistanceSample, Grid, Homogeneous, Layout, Medium, Phase, Ray, TrackingStats, Wrap,
};
use proptest::prelude::*;

const CHROMATIC: Rgb = Rgb { r: 0.0, g: 0.5, b: 20.0 };

fn homogeneous(sigma_t: Rgb) -> Medium {
    let h = Homogeneous::new(sigma_t, Rgb::ONE, Rgb::ZERO).expect("a valid medium");
    Medium::new(h, Phase::Isotropic)
}

fn sample(
    medium: &Medium,
    ray: &Ray,
    channels: Rgb,
    defensive: f64,
    rng: &mut Rng,
) -> DistanceSample {
    let stats = &mut TrackingStats::default();
    medium.sample_distance(ray, channels, defensive, rng, stats)
}

/// Counts of plain gray free flights per cell of equal width, and of passes.
fn flights(medium: &Medium, ray: &Ray, length: f64, count: u32) -> Vec<u64> {
    const CELLS: usize = 48;
    let mut counts = vec![0; CELLS + 1];
    for i in 0..count {
        let cell = match sample(medium, ray, Rgb::ONE, 0.0, &mut Rng::new(3, 1, i)) {
            DistanceSample::Scatter { t, .. } => (t / length * CELLS as f64) as usize,
            DistanceSample::Pass { .. } => CELLS,
        };
        counts[cell] += 1;
    }
    counts
}

#[test]
fn delta_tracking_follows_the_collision_density() {
    let (medium, ray) = (p07(), p07_ray());
    let (length, count) = (4.0, 400_000);
    let counts = flights(&medium, &ray, length, count);
    let cells = counts.len() - 1;
    let passing = |cell: usize, scale: f64| {
        let t_max = length * cell as f64 / cells as f64;
        (-optical_depth(&medium, &Ray { t_max, ..ray }).r * scale).exp()
    };
    let expected = |scale: f64| {
        let cell = |n| passing(n, scale) - passing(n + 1, scale);
        let mut all: Vec<f64> = (0..cells).map(cell).collect();
        all.push(passing(cells, scale));
        all.into_iter().map(|p| p * f64::from(count)).collect::<Vec<_>>()
    };
    let value = chi_square(&counts, &expected(1.0));
    assert!(value > SIGNIFICANCE, "p-value {value}");
    let fault = chi_square(&counts, &expected(1.01));
    assert!(fault < SIGNIFICANCE, "1 % more extinction passes with p-value {fault}");
}

/// Weighted events must estimate `∫ sigma h T dt` for a test function h, and weighted passes the
/// transmittance, in every channel, whatever density was sampled.
fn check_distances(what: &str, medium: &Medium, ray: &Ray, channels: Rgb, defensive: f64) {
    let h = |t: f64| (1.7 * t).sin() + 1.5;
    let depth = |t: f64| match medium.homogeneous() {
        Some(m) => m.coefficients().sigma_t * t,
        None => optical_depth(medium, &Ray { t_max: t, ..*ray }),
    };
    let length = if ray.t_max.is_finite() { ray.t_max } else { 6.0 };
    let cells = 4000;
    let mut truth = Rgb::ZERO;
    let mut before = Rgb::ZERO;
    for n in 0..cells {
        let t = length * f64::from(n + 1) / f64::from(cells);
        let after = depth(t);
        let middle = t - 0.5 * length / f64::from(cells);
        truth += ((-before).exp() - (-after).exp()) * h(middle);
        before = after;
    }
    let through = (-depth(length)).exp();
    let count = 200_000;
    for channel in 0..3 {
        let scattered =
            estimate(count, |rng, _| match sample(medium, ray, channels, defensive, rng) {
                DistanceSample::Scatter { t, weight, .. } => {
                    (weight * medium.sigma_t(ray.at(t))).to_array()[channel] * h(t)
                }
                DistanceSample::Pass { .. } => 0.0,
            });
        let truth = truth.to_array()[channel];
        assert_agrees(&format!("{what}, scattered"), &scattered, truth, 0.02);
        let passed =
            estimate(count, |rng, _| match sample(medium, ray, channels, defensive, rng) {
                DistanceSample::Scatter { .. } => 0.0,
                DistanceSample::Pass { weight } => weight.to_array()[channel],
            });
        let through = through.to_array()[channel];
        if through > 1e-3 {
            assert_agrees(&format!("{what}, passed"), &passed, through, 0.02);
        }
        if truth > 0.0 {
            assert_rejects(what, &scattered, 1.2 * truth);
        }
    }
}

#[test]
fn distances_in_chromatic_homogeneous_media() {
    let medium = homogeneous(CHROMATIC);
    let ray = Ray::new(Vec3::ZERO, Vec3::X).until(3.0);
    for channels in [Rgb::ONE, Rgb::new(1.0, 0.2, 3.0)] {
        check_distances("plain", &medium, &ray, channels, 0.0);
        check_distances("defensive", &medium, &ray, channels, 0.2);
    }
    let infinite = Ray::new(Vec3::ZERO, Vec3::X);
    let opaque = homogeneous(Rgb::new(3.0, 5.0, 20.0));
    check_distances("infinite", &opaque, &infinite, Rgb::ONE, 0.0);
    check_distances("infinite, defensive", &opaque, &infinite, Rgb::ONE, 0.2);
}

#[test]
fn distances_in_chromatic_grids() {
    let constant = Grid::constant(CHROMATIC).expect("finite");
    let medium = grid_medium(constant, 1.0, Rgb::ONE);
    let ray = Ray::new(vec3(-0.2, 0.4, 0.3), vec3(1.0, 0.2, 0.1).normalize());
    check_distances("constant grid", &medium, &ray, Rgb::ONE, 0.0);
    let cloud = cloud(Layout::VoxelCentred);
    let ray = ray_through(&cloud, vec3(0.8, 0.3, -0.2));
    check_distances("cloud", &cloud, &ray, Rgb::new(1.0, 0.5, 2.0), 0.0);
    check_distances("cloud, defensive", &cloud, &ray, Rgb::ONE, 0.2);
}

#[test]
fn every_sample_has_the_density_it_says() {
    let medium = homogeneous(CHROMATIC);
    let (channels, defensive) = (Rgb::new(0.5, 1.0, 0.2), 0.3);
    for t_max in [2.5, f64::INFINITY] {
        let ray = Ray::new(Vec3::ZERO, Vec3::Y).until(t_max);
        let h = medium.homogeneous().expect("homogeneous");
        let mut total = h.pass_probability(t_max, channels, defensive);
        // t = x / (1 - x) for the infinite ray.
        let cells = 200_000;
        for n in 0..cells {
            let x = (f64::from(n) + 0.5) / f64::from(cells);
            let (t, dt) = match t_max.is_finite() {
                true => (x * t_max, t_max),
                false => (x / (1.0 - x), (1.0 - x).powi(-2)),
            };
            total += medium.free_flight_pdf(&ray, t, channels, defensive) * dt / f64::from(cells);
        }
        assert!((total - 1.0).abs() < 1e-5, "{total}");
        for i in 0..1000 {
            let s = sample(&medium, &ray, channels, defensive, &mut Rng::new(1, 0, i));
            if let DistanceSample::Scatter { t, weight, pdf } = s {
                let again = medium.free_flight_pdf(&ray, t, channels, defensive);
                assert_eq!(pdf, Some(again));
                let through = h.transmittance(t);
                assert!((weight * again - through).max_abs() < 1e-14);
            }
        }
    }
}

#[test]
fn extreme_homogeneous_segments_stay_finite() {
    for sigma in [0.0, 1e-300, 1e-5, 1.0, 1e5, 1e300] {
        for t_max in [1e-300, 1.0, 1e300, f64::INFINITY] {
            for other in [0.0, 1.0, sigma] {
                for defensive in [0.0, 0.5] {
                    let medium = homogeneous(Rgb::new(sigma, other, 0.0));
                    let ray = Ray::new(Vec3::ZERO, Vec3::Z).until(t_max);
                    for i in 0..20 {
                        let rng = &mut Rng::new(2, 0, i);
                        let s = sample(&medium, &ray, Rgb::new(1.0, 1.0, 0.0), defensive, rng);
                        let (DistanceSample::Scatter { weight, .. }
                        | DistanceSample::Pass { weight }) = s;
                        let sane = weight.is_finite() || !(1e-200..=1e200).contains(&t_max);
                        assert!(sane, "{sigma} {other} {t_max} {defensive}: {s:?}");
                        let nan = weight.to_array().iter().any(|w| w.is_nan());
                        assert!(!nan, "{sigma} {other} {t_max} {defensive}: {s:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn channels_without_throughput_get_finite_weights() {
    let medium = homogeneous(Rgb::new(0.0, 5.0, 6.0));
    let ray = Ray::new(Vec3::ZERO, Vec3::Z);
    let channels = Rgb::new(0.0, 1.0, 1.0);
    for t_max in [1e-3, 4.0, 1e3, f64::INFINITY] {
        for i in 0..200 {
            let s = sample(&medium, &Ray { t_max, ..ray }, channels, 0.0, &mut Rng::new(4, 0, i));
            let (DistanceSample::Scatter { weight, .. } | DistanceSample::Pass { weight }) = s;
            assert!((weight * channels).is_finite(), "{s:?}");
        }
    }
}

#[test]
fn ratio_tracking_is_the_transmittance_in_every_channel() {
    for layout in [Layout::VoxelCentred, Layout::NodeCentred] {
        let medium = cloud(layout);
        let ray = ray_through(&medium, vec3(0.1, 0.9, 0.3));
        let truth = (-optical_depth(&medium, &ray)).exp().to_array();
        for (channel, truth) in truth.into_iter().enumerate() {
            let e = estimate(300_000, |rng, stats| {
                let t = medium.transmittance(&ray, rng, stats);
                t.to_array()[channel]
            });
            assert_agrees("cloud transmittance", &e, truth, 0.003);
        }
    }
}

#[test]
fn empty_voxels_need_defensive_sampling() {
    // Light scattered with albedo one: F = ∫ sigma T dt = 1 - T(box), so adding to the extinction
    // everywhere gives dF = T(box), the box being one long. Half of the box is empty, and the part
    // of dF that comes from there has no vertex to sit on in plain free flight.
    let values = vec![2., 2., 2., 2., 0., 0., 0., 0.];
    let medium = grid_medium(Grid::new([8, 1, 1], 1, values).expect("valid"), 1.0, Rgb::ONE);
    let ray = Ray::new(vec3(-0.5, 0.5, 0.5), Vec3::X);
    let truth = (-1.0_f64).exp();
    let derivative = |defensive: f64| {
        estimate(400_000, |rng, _| match sample(&medium, &ray, Rgb::ONE, defensive, rng) {
            // sigma' T + sigma T', with sigma' = 1 in the box, which starts at t = 1/2.
            DistanceSample::Scatter { t, weight, .. } => {
                weight.r * (1.0 - medium.sigma_t(ray.at(t)).r * (t - 0.5))
            }
            DistanceSample::Pass { .. } => 0.0,
        })
    };
    for defensive in [0.1, 0.3] {
        assert_agrees("empty half", &derivative(defensive), truth, 0.01 * truth);
    }
    // Empty from 4.5/8 of the box on, where T has reached its last value.
    let plain = derivative(0.0);
    assert_agrees("without the empty half", &plain, truth * 4.5 / 8.0, 0.01 * truth);
    assert_rejects("plain free flight", &plain, truth);
}

#[test]
fn line_points_integrate_over_the_box() {
    let medium = cloud(Layout::VoxelCentred);
    let ray = ray_through(&medium, vec3(0.8, 0.3, -0.2));
    let truth = optical_depth(&medium, &ray).b;
    let mut points = Vec::new();
    let e = estimate(200_000, |rng, _| {
        points.clear();
        medium.line_points(&ray, rng, &mut points);
        points.iter().map(|&(t, w)| medium.sigma_t(ray.at(t)).b * w).sum()
    });
    assert_agrees("line points", &e, truth, 0.005 * truth);
}

#[test]
fn homogeneous_media_and_constant_grids_agree() {
    let (sigma, albedo) = (Rgb::new(0.7, 1.1, 2.0), Rgb::splat(0.5));
    let grid = grid_medium(Grid::constant(sigma).expect("finite"), 1.0, albedo);
    let ray = Ray::new(vec3(-0.5, 0.5, 0.5), Vec3::X);
    let stats = &mut TrackingStats::default();
    let t = grid.transmittance(&ray, &mut Rng::new(0, 0, 0), stats);
    assert!((t - (-sigma).exp()).max_abs() < 1e-14, "the control takes all: {t:?}");
    // The gap between the channels' majorant and minorant is zero: nothing is looked up.
    assert_eq!(stats.lookups, 0);
}

#[test]
fn approximate_densities_follow_the_mean_extinction() {
    let medium = p07();
    let ray = p07_ray();
    let counts = flights(&medium, &ray, 4.0, 100_000);
    let cells = counts.len() - 1;
    for (n, &count) in counts[..cells].iter().enumerate().filter(|c| *c.1 > 1000).skip(1) {
        let t = (n as f64 + 0.5) * 4.0 / cells as f64;
        let pdf = medium.free_flight_pdf(&ray, t, Rgb::ONE, 0.0) * 4.0 / cells as f64;
        let seen = count as f64 / 1e5;
        assert!((0.5..2.0).contains(&(pdf / seen)), "at {t}: {pdf} for {seen}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 200, ..ProptestConfig::default() })]

    /// Bounds hold along every ray, and the pieces tile the part of the ray in the box.
    #[test]
    fn bounds_hold_along_rays(
        seed in 0_u64..1000,
        size in [1_usize..20, 1_usize..9, 1_usize..6],
        nodes: bool,
        wrap in 0_usize..3,
        origin in [-1.0..2.0, -1.0..2.0, -1.0..2.0_f64],
        target in [0.0..1.0, 0.0..1.0, 0.0..1.0_f64],
        axis_parallel in 0_usize..4,
    ) {
        use std::ops::ControlFlow;
        use drt_medium::DensityField;
        let values = random_values(3 * size.iter().product::<usize>(), seed);
        let grid = Grid::new(size, 3, values).expect("a valid grid")
            .with_layout(if nodes { Layout::NodeCentred } else { Layout::VoxelCentred })
            .with_wrap([Wrap::Clamp, Wrap::Repeat, Wrap::Mirror][wrap]);
        let medium = grid_medium(grid, 1.3, Rgb::ONE);
        let mut dir = Vec3::from(target) - Vec3::from(origin);
        match axis_parallel {
            0 => dir = vec3(dir.x, 0.0, -0.0),
            1 => dir = vec3(0.0, dir.y, 0.0),
            2 => dir = vec3(dir.x, dir.y, 1e-17),
            _ => {}
        }
        let ray = Ray::new(origin, dir.normalize()).until(2.0);
        let grid = medium.grid().expect("a grid");
        let mut end = None;
        let mut covered = 0.0;
        grid.pieces(&ray, &mut |p| {
            assert!(p.end > p.start && end.is_none_or(|e| e == p.start));
            end = Some(p.end);
            covered += p.end - p.start;
            for i in 0..20 {
                let s = medium.sigma_t(ray.at(p.start + (p.end - p.start) * f64::from(i) / 19.0));
                let above = (s - p.majorant).max_channel();
                let below = (p.minorant - s).max_channel();
                // Just outside the box, by rounding, there is nothing.
                assert!(above < 1e-12 && (below < 1e-12 || s.is_zero()), "{s:?} on {p:?}");
            }
            ControlFlow::Continue(())
        });
        let inside = (0..4000).filter(|&i| grid.contains(ray.at((f64::from(i) + 0.5) / 2000.0)));
        prop_assert!((inside.count() as f64 / 2000.0 - covered).abs() < 2e-3);
    }
}
