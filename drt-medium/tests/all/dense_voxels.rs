//! One voxel far denser than all others: what lies beside it costs little more than without it.

use crate::common::*;
use std::ops::ControlFlow;

use drt_math::{Moments, Rgb, Rng, Vec3, vec3};
use drt_medium::{
    CoefficientGradients, Coefficients, DensityField, DistanceSample, Filter, Grid, GridMedium,
    Layout, Medium, MediumKind, Piece, Ray, TrackingStats, Volume, tracking,
};

const SIDE: usize = 64;
const DENSE: [usize; 3] = [30, 21, 43];

fn medium(density: f64, layout: Layout, filter: Filter) -> Medium {
    let mut values = vec![0.0; SIDE * SIDE * SIDE];
    values[(DENSE[2] * SIDE + DENSE[1]) * SIDE + DENSE[0]] = density;
    let grid = Grid::new([SIDE; 3], 1, values).expect("valid");
    grid_medium(grid.with_layout(layout).with_filter(filter), 1.0, Rgb::ONE)
}

/// The middle of the dense voxel in the unit cube.
fn middle(layout: Layout) -> Vec3 {
    DENSE
        .map(|i| match layout {
            Layout::VoxelCentred => (i as f64 + 0.5) / SIDE as f64,
            Layout::NodeCentred => i as f64 / (SIDE - 1) as f64,
        })
        .into()
}

const KINDS: [(Layout, Filter); 4] = [
    (Layout::VoxelCentred, Filter::Trilinear),
    (Layout::VoxelCentred, Filter::Nearest),
    (Layout::NodeCentred, Filter::Trilinear),
    (Layout::NodeCentred, Filter::Nearest),
];

/// What a walk costs at most, in lookups: a piece of a halved one took eight at either end.
fn cost(stats: &TrackingStats) -> u64 {
    stats.lookups + 16 * stats.pieces
}

#[test]
fn rays_beside_a_dense_voxel_are_not_slowed() {
    for (layout, filter) in KINDS {
        for (density, most) in [(1.0, 1000), (1e9, 2000), (1e20, 2500)] {
            let medium = medium(density, layout, filter);
            let mut stats = TrackingStats::default();
            let rays = 2000;
            for i in 0..rays {
                let mut rng = Rng::new(7, 0, i);
                // Within two voxels of it, most of them through the same cell of the bounds.
                let mut near = || (rng.next_f64() - 0.5) * 4.0 / SIDE as f64;
                let at = middle(layout) + vec3(near(), near(), near());
                let from = vec3(rng.next_f64(), rng.next_f64(), -0.5);
                let dir = (at - from).normalize();
                medium.sample_distance(
                    &Ray::new(from, dir).until(4.0),
                    Rgb::ONE,
                    0.0,
                    &mut rng,
                    &mut stats,
                );
                medium.transmittance(&Ray::new(from, dir).until(4.0), &mut rng, &mut stats);
            }
            let each = cost(&stats) / u64::from(rays);
            let TrackingStats { pieces, lookups } = stats;
            println!(
                "{density:e} {layout:?} {filter:?}: {pieces} pieces, {lookups} lookups, {each} a ray"
            );
            assert!(each < most, "{density:e} {layout:?} {filter:?}: {each} lookups a ray");
        }
    }
}

/// A ray that is not stopped ends, too: where one channel is as dense as that and the others are empty, and where only
/// means are asked for.
#[test]
fn cuts_of_a_ray_are_bounded() {
    let mut values = vec![0.0; 3 * 8];
    values[3] = 1e20;
    let grid = Grid::new([2; 3], 3, values).expect("valid");
    let medium = grid_medium(grid, 1.0, Rgb::ONE);
    let field = medium.grid().expect("a grid");
    let ray = Ray::new(vec3(0.1, 0.1, -1.0), vec3(0.3, 0.2, 1.0).normalize()).until(4.0);
    let (mut pieces, mut means) = (0, 0);
    let count = |n: &mut u32| {
        *n += 1;
        ControlFlow::Continue(())
    };
    field.pieces(&ray, &mut |_| count(&mut pieces));
    field.means(&ray, &mut |_| count(&mut means));
    println!("{pieces} pieces, {means} for means");
    assert!((100..1100).contains(&pieces), "{pieces} pieces");
    assert!(means <= 4, "{means} pieces for means");
    let mut stats = TrackingStats::default();
    let through = medium.transmittance(&ray, &mut Rng::new(1, 2, 3), &mut stats);
    println!("{stats:?}");
    assert_eq!(through, Rgb::new(0.0, 1.0, 1.0));
    assert!(cost(&stats) < 30_000, "{stats:?}");
}

/// A distance in an empty channel is found in few steps beside one so dense that its collisions could not be counted, where the
/// dense one is the same everywhere and where it rises from nothing, and without bias.
#[test]
fn dense_channels_do_not_hold_up_empty_ones() {
    let uniform = [[1e20, 0.0, 0.5]; 8].concat();
    let mut rising = vec![0.0; 3 * 8];
    rising[3] = 1e20;
    // A ray takes hundreds of times as long where the dense channel rises.
    let cases = [(uniform, 0.5, 8.0, 40_000), (rising, 0.0, 3000.0, 5000)];
    for (values, blue, most, count) in cases {
        let grid = Grid::new([2; 3], 3, values).expect("valid");
        let medium = grid_medium(grid, 1.0, Rgb::ONE);
        let ray = Ray::new(vec3(0.1, 0.1, -1.0), vec3(0.3, 0.2, 1.0).normalize()).until(4.0);
        let length = clipped(&ray);
        for defensive in [0.0, 0.25] {
            let mut passed = [Moments::default(); 3];
            let mut stats = TrackingStats::default();
            for i in 0..count {
                let mut rng = Rng::new(3, 1, i);
                let sample =
                    medium.sample_distance(&ray, Rgb::ONE, defensive, &mut rng, &mut stats);
                let weight = match sample {
                    DistanceSample::Pass { weight } => weight,
                    DistanceSample::Scatter { .. } => Rgb::ZERO,
                };
                assert!(weight.is_finite());
                passed.iter_mut().zip(weight.to_array()).for_each(|(m, w)| m.push(w));
            }
            let each = stats.lookups as f64 / f64::from(count);
            println!("defensive {defensive}: {each} lookups a ray, {} pieces", stats.pieces);
            assert!(each < most, "{each} lookups a ray");
            let exact = [0.0, 1.0, (-blue * length).exp()];
            for (m, exact) in passed.iter().zip(exact) {
                let off = (m.mean() - exact).abs();
                assert!(off <= 4.0 * m.standard_error() + 1e-12, "{} beside {exact}", m.mean());
            }
            // The fault that would be planted: without the weight of what is left, half of green is lost.
            assert!((0.5 * passed[1].mean() - 1.0).abs() > 8.0 * passed[1].standard_error());
        }
    }
}

/// How much of a ray is in the unit cube.
fn clipped(ray: &Ray) -> f64 {
    let (mut enter, mut leave) = (0.0, ray.t_max);
    for k in 0..3 {
        let face = |at: f64| (at - ray.origin[k]) / ray.dir[k];
        enter = f64::max(enter, f64::min(face(0.0), face(1.0)));
        leave = f64::min(leave, f64::max(face(0.0), face(1.0)));
    }
    leave - enter
}

/// A grid's field with the fault that is planted: its bounds are the values where pieces start.
#[derive(Debug)]
struct OneEnd<'a>(&'a GridMedium);

impl DensityField for OneEnd<'_> {
    fn coefficients(&self, x: Vec3) -> Coefficients {
        self.0.coefficients(x)
    }
    fn gradients(&self, x: Vec3) -> CoefficientGradients {
        self.0.gradients(x)
    }
    fn pieces(&self, ray: &Ray, visit: &mut dyn FnMut(&Piece) -> ControlFlow<()>) {
        self.0.pieces(ray, &mut |piece| {
            let start = self.0.sigma_t(ray.at(piece.start));
            visit(&Piece { majorant: start, minorant: start, ..*piece })
        });
    }
}

/// Optical depth by the voxel's box, in which the nearest value is that of the voxel.
fn depth_of_box(density: f64, layout: Layout, ray: &Ray) -> f64 {
    let width = match layout {
        Layout::VoxelCentred => 1.0 / SIDE as f64,
        Layout::NodeCentred => 1.0 / (SIDE - 1) as f64,
    };
    let (mut enter, mut leave) = (0.0, ray.t_max);
    for k in 0..3 {
        let face = |side: f64| (middle(layout)[k] + side * width - ray.origin[k]) / ray.dir[k];
        enter = f64::max(enter, f64::min(face(-0.5), face(0.5)));
        leave = f64::min(leave, f64::max(face(-0.5), face(0.5)));
    }
    density * f64::max(leave - enter, 0.0)
}

/// Estimates of how much gets through: transmittances, and shares of the distances that pass.
fn through<F: DensityField>(field: &F, ray: &Ray) -> [Moments; 2] {
    let count = 40_000;
    let transmittance =
        estimate(count, |rng, stats| tracking::transmittance(field, ray, rng, stats).r);
    let passes = estimate(count, |rng, stats| {
        let s = tracking::sample_distance(field, ray, Rgb::ONE, 0.0, rng, stats);
        f64::from(u8::from(matches!(s, DistanceSample::Pass { .. })))
    });
    [transmittance, passes]
}

/// What is cut up is tracked without bias, too: on a ray for which pieces are halved and light still gets through.
#[test]
fn what_gets_past_a_dense_voxel_is_right() {
    const DENSITY: f64 = 1e5;
    for (layout, filter) in KINDS {
        let medium = medium(DENSITY, layout, filter);
        let MediumKind::Grid(grid) = &medium.kind else { unreachable!() };
        let dir = vec3(0.6, 0.3, 0.74).normalize();
        let beside = |offset: f64| {
            let at = middle(layout) + vec3(1.0, 0.3, 0.0) * (offset / SIDE as f64);
            Ray::new(at - dir * 2.0, dir).until(4.0)
        };
        let depth = |ray: &Ray| match filter {
            Filter::Nearest => depth_of_box(DENSITY, layout, ray),
            _ => optical_depth(&medium, ray).r,
        };
        // One mean free path of the outskirts, found by bisection.
        let (mut thick, mut thin) = (0.0, 3.0);
        for _ in 0..60 {
            let offset = 0.5 * (thick + thin);
            *(if depth(&beside(offset)) > 1.0 { &mut thick } else { &mut thin }) = offset;
        }
        let ray = beside(thick);
        let truth = (-depth(&ray)).exp();
        let (mut pieces, mut shortest) = (0, f64::INFINITY);
        grid.pieces(&ray, &mut |piece| {
            pieces += 1;
            shortest = f64::min(shortest, piece.end - piece.start);
            ControlFlow::Continue(())
        });
        println!("{layout:?} {filter:?}: offset {thick}, {pieces} pieces, shortest {shortest:e}");
        let right = through(grid, &ray);
        if filter == Filter::Nearest {
            // Bounds are exact, and transmittances in closed form.
            assert!((right[0].mean() - truth).abs() < 1e-9, "{} for {truth}", right[0].mean());
            assert_agrees("passes", &right[1], truth, 0.01);
            continue;
        }
        // Cells of nearest values are cut, but not halved.
        let flat = GridMedium::new(
            grid.density().clone().with_filter(Filter::Nearest),
            1.0,
            Volume::Constant(Rgb::ONE),
            Volume::Constant(Rgb::ZERO),
        );
        let mut cut = 0;
        flat.expect("valid").pieces(&ray, &mut |_| {
            cut += 1;
            ControlFlow::Continue(())
        });
        assert!(pieces > cut, "{pieces} pieces, {cut} without halvings");
        for (name, e) in ["transmittance", "passes"].iter().zip(&right) {
            assert_agrees(name, e, truth, 0.01);
        }
        let wrong = through(&OneEnd(grid), &ray);
        for (right, wrong) in right.iter().zip(&wrong) {
            println!("planted: {} for {truth}", wrong.mean());
            assert_rejects("bounds by one end", right, wrong.mean());
        }
    }
}

/// The nearest voxel's box stops what enters it and nothing else.
#[test]
fn the_box_of_a_dense_voxel_is_sharp() {
    for layout in [Layout::VoxelCentred, Layout::NodeCentred] {
        let medium = medium(1e5, layout, Filter::Nearest);
        for (offset, truth) in [(0.4, 0.0), (0.6, 1.0)] {
            let at = middle(layout) + vec3(offset, 0.4, 0.0) / SIDE as f64;
            let ray = Ray::new(vec3(at.x, at.y, -0.5), Vec3::Z).until(4.0);
            for e in through(medium.grid().expect("a grid"), &ray) {
                assert_eq!((e.mean(), e.standard_error()), (truth, 0.0), "{layout:?} {offset}");
            }
        }
    }
}
