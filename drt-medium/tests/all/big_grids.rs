//! Grids of so many voxels that rays take their empty parts in long steps, and gradients keep points.

use std::ops::ControlFlow;

use drt_math::{Affine, Mat3, Rgb, Rng, ValueChange, Vec3, vec3};
use drt_medium::{
    CoefficientRates, DensityField, Filter, Grid, GridMedium, Layout, Medium, MediumChange,
    MediumGradient, MediumTangent, Piece, Property, Ray, TrackingStats, Wrap, tracking,
};

use crate::common::*;

const SIZE: [usize; 3] = [90, 70, 101];

/// Two small clouds in a box that is empty elsewhere, turned and placed off the origin.
fn clouds(layout: Layout, filter: Filter, wrap: Wrap) -> Medium {
    let [nx, ny, nz] = SIZE;
    let values = (0..nx * ny * nz).map(|n| {
        let p = vec3((n % nx) as f64, (n / nx % ny) as f64, (n / nx / ny) as f64);
        let near = |x, y, z, r: f64| f64::max(1.0 - (p - vec3(x, y, z)).length() / r, 0.0);
        3.0 * near(25.0, 30.0, 40.0, 18.0) + near(60.0, 45.0, 80.0, 14.0)
    });
    let turn = Mat3::rotation(vec3(0.6, 0.0, 0.8), 0.7);
    let stretch = turn * Mat3::diagonal(vec3(2.0, 1.5, 2.5));
    let place = Affine { linear: stretch, translation: vec3(-0.3, 0.2, 0.1) };
    let grid = Grid::new(SIZE, 1, values.collect()).expect("a valid grid");
    let grid = grid.with_layout(layout).with_filter(filter).with_wrap(wrap);
    grid_medium(grid.with_placement(place).expect("a proper box"), 2.0, Rgb::splat(0.8))
}

fn plain() -> Medium {
    clouds(Layout::VoxelCentred, Filter::Trilinear, Wrap::Clamp)
}

/// A ray from a point around the box to one in it, some along the axes of the grid and on its planes.
fn ray(medium: &Medium, rng: &mut Rng, aligned: bool) -> Ray {
    let place = medium.grid().expect("a grid").density().to_world();
    let mut random = || vec3(rng.next_f64(), rng.next_f64(), rng.next_f64());
    let (mut from, mut to) = (random() * 3.0 - Vec3::splat(1.0), random());
    if aligned {
        let on_plane = |x: f64| (x * 8.0).floor() / 8.0;
        to = vec3(on_plane(to.x), on_plane(to.y), to.z);
        from = vec3(to.x, to.y, -1.0);
    }
    let (from, to) = (place.point(from), place.point(to));
    Ray::new(from, (to - from).normalize()).until(4.0)
}

fn pieces(medium: &Medium, ray: &Ray) -> Vec<Piece> {
    let mut pieces = Vec::new();
    medium.grid().expect("a grid").pieces(ray, &mut |piece| {
        pieces.push(*piece);
        ControlFlow::Continue(())
    });
    pieces
}

#[test]
fn pieces_cover_a_ray_without_gaps_and_bound_it() {
    let mut rng = Rng::new(4, 0, 0);
    let (mut crossed, mut above_half) = (0, 0);
    for layout in [Layout::VoxelCentred, Layout::NodeCentred] {
        for filter in [Filter::Trilinear, Filter::Nearest] {
            for wrap in [Wrap::Clamp, Wrap::Repeat] {
                let medium = clouds(layout, filter, wrap);
                for n in 0..400 {
                    let ray = ray(&medium, &mut rng, n % 4 == 0);
                    let covered = medium.grid().expect("a grid").covered(&ray);
                    let pieces = pieces(&medium, &ray);
                    assert_eq!(covered.is_some(), !pieces.is_empty());
                    let Some((start, end)) = covered else { continue };
                    crossed += 1;
                    assert_eq!((pieces[0].start, pieces[pieces.len() - 1].end), (start, end));
                    assert!(pieces.windows(2).all(|pair| pair[0].end == pair[1].start));
                    for p in &pieces {
                        let sigma =
                            medium.sigma_t(ray.at(p.start + (p.end - p.start) * rng.next_f64())).g;
                        let rounding = 1e-12 * p.majorant.g;
                        assert!(
                            sigma <= p.majorant.g + rounding && sigma >= p.minorant.g - rounding
                        );
                        above_half += usize::from(sigma > 0.5 * p.majorant.g);
                    }
                }
            }
        }
    }
    // A majorant of half the size would have been found.
    assert!(crossed > 1000 && above_half > 1000, "{crossed} rays, {above_half} points");
}

#[test]
fn empty_space_takes_few_steps() {
    let medium = plain();
    let place = medium.grid().expect("a grid").density().to_world();
    let steps = |from: Vec3, to: Vec3| {
        let (from, to) = (place.point(from), place.point(to));
        pieces(&medium, &Ray::new(from, (to - from).normalize()).until((to - from).length())).len()
    };
    let empty = steps(vec3(0.95, 0.1, -0.1), vec3(0.9, 0.15, 1.1));
    let cloud = steps(vec3(0.28, 0.43, -0.1), vec3(0.28, 0.43, 1.1));
    assert!(empty <= 9 && cloud >= 15, "{empty} and {cloud}");
}

#[test]
fn light_gets_through_as_it_should() {
    let medium = plain();
    let field = medium.grid().expect("a grid");
    let place = field.density().to_world();
    let (from, to) = (place.point(vec3(0.1, 0.35, -0.1)), place.point(vec3(0.7, 0.65, 1.1)));
    let ray = Ray::new(from, (to - from).normalize()).until((to - from).length());
    let truth = (-optical_depth(&medium, &ray).g).exp();
    assert!((0.05..0.6).contains(&truth), "{truth}");
    let ratio = estimate(100_000, |rng, stats| tracking::transmittance(field, &ray, rng, stats).g);
    let passed =
        estimate(100_000, |rng, stats: &mut TrackingStats| {
            match tracking::sample_distance(field, &ray, Rgb::ONE, 0.0, rng, stats) {
                tracking::DistanceSample::Pass { weight } => weight.g,
                tracking::DistanceSample::Scatter { .. } => 0.0,
            }
        });
    for (what, estimate) in [("transmittance", ratio), ("share that passes", passed)] {
        assert_agrees(what, &estimate, truth, 0.01 * truth);
        // As if one coarse cell of the denser cloud were missed.
        assert_rejects(what, &estimate, 1.15 * truth);
    }
}

#[test]
fn one_voxel_brings_all_bounds_up_to_date() {
    let mut medium = plain();
    let voxels = [[0, 0, 0], [89, 69, 100], [63, 20, 15], [64, 40, 31]];
    for voxel in voxels {
        let op = ValueChange::Add(Rgb::splat(50.0));
        medium
            .apply(
                &MediumChange::Value { property: Property::SigmaT, op, voxels: Some(voxel) },
                1.0,
            )
            .expect("a voxel");
    }
    let changed = medium.grid().expect("a grid");
    let (albedo, emission) = (changed.albedo().clone(), changed.emission().clone());
    let anew = GridMedium::new(changed.density().clone(), changed.scale(), albedo, emission);
    let anew = Medium::new(anew.expect("a valid medium"), medium.phase.clone());
    let mut rng = Rng::new(6, 0, 0);
    for _ in 0..200 {
        let ray = ray(&medium, &mut rng, false);
        assert_eq!(pieces(&medium, &ray), pieces(&anew, &ray));
    }
    assert_eq!(changed.largest_sigma_t(), anew.grid().expect("a grid").largest_sigma_t());
    assert!(changed.largest_sigma_t() > plain().grid().expect("a grid").largest_sigma_t());
}

/// What points send to voxels, in one sum and in the sums of several batches.
#[test]
fn gradients_of_few_and_of_many_points_are_transposes_of_rates() {
    for (side, count) in [(8, 40), (8, 4000), (60, 4000), (60, 90_000)] {
        for channels in [1, 3] {
            let values = random_values(side * side * side * channels, 5);
            let grid = Grid::new([side; 3], channels, values).expect("a valid grid");
            let medium = grid_medium(grid, 2.0, Rgb::splat(0.5));
            let mut tangent = MediumTangent::zero();
            for (n, voxel) in
                [[1, 2, 3], [side - 1, 0, 4], [5, 5, side - 1]].into_iter().enumerate()
            {
                // A single channel stands for all three.
                let rate = if channels == 1 { Rgb::ONE } else { Rgb::new(1.0, 2.0, 0.5) };
                tangent.sigma_t.voxels.insert(voxel, rate * (n + 1) as f64);
            }
            let mut rng = Rng::new(7, 0, 0);
            let mut random = || vec3(rng.next_f64(), rng.next_f64(), rng.next_f64());
            let (mut forward, mut size) = (0.0, 0.0);
            let mut all = MediumGradient::zeros(&medium);
            let mut batches = [(); 3].map(|()| MediumGradient::zeros(&medium));
            for n in 0..count {
                // Half of them around the voxels that change.
                let x = if n % 2 == 0 { random() } else { random() * (6.0 / side as f64) };
                let sigma_t = Rgb::from((random() - Vec3::splat(0.5)).to_array());
                let adjoint = CoefficientRates { sigma_t, ..CoefficientRates::ZERO };
                let rate = tangent.rates(&medium, x).dot(&adjoint);
                (forward, size) = (forward + rate, size + rate.abs());
                all.scatter(&medium, x, &adjoint);
                batches[3 * n / count].scatter(&medium, x, &adjoint);
            }
            let [mut together, b, c] = batches;
            together.add(b);
            together.add(c);
            for gradient in [&all, &together] {
                let reverse = gradient.dot(&tangent);
                let apart = (forward - reverse).abs();
                assert!(size > 0.0 && apart < 1e-12 * size, "{forward} forward, {reverse} reverse");
                let voxels = gradient.sigma_t.voxels.as_ref().expect("a grid");
                let mut numbers = vec![0.5; side * side * side * channels];
                voxels.add_to(&mut numbers, 3.0);
                let sums = voxels.values();
                assert!(numbers.iter().zip(&*sums).all(|(a, g)| (a - 0.5 - 3.0 * g).abs() < 1e-12));
            }
        }
    }
}
