//! One voxel far denser than all others: what lies beside it costs no more than without it.

mod common;

use common::*;
use drt_math::{Rgb, Rng, Vec3, vec3};
use drt_medium::{DistanceSample, Filter, Grid, Layout, Medium, TrackingStats};

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

#[test]
fn rays_beside_a_dense_voxel_are_not_slowed() {
    for (layout, filter) in KINDS {
        let medium = medium(1e9, layout, filter);
        let mut stats = TrackingStats::default();
        let rays = 2000;
        for i in 0..rays {
            let mut rng = Rng::new(7, 0, i);
            // Within two voxels of it, most of them through the same cell of the bounds.
            let mut near = || (rng.next_f64() - 0.5) * 4.0 / SIDE as f64;
            let at = middle(layout) + vec3(near(), near(), near());
            let from = vec3(rng.next_f64(), rng.next_f64(), -0.5);
            let dir = (at - from).normalize();
            medium.sample_distance(from, dir, 4.0, Rgb::ONE, 0.0, &mut rng, &mut stats);
            medium.transmittance(from, dir, 4.0, &mut rng, &mut stats);
        }
        let each = stats.lookups / u64::from(rays);
        println!(
            "{layout:?} {filter:?}: {each} lookups and {} pieces",
            stats.pieces / u64::from(rays)
        );
        assert!(each < 2000, "{layout:?} {filter:?}: {each} lookups a ray");
    }
}

/// What is cut up is tracked without bias, too: a density at which cells are cut and light still gets through.
#[test]
fn what_gets_past_a_dense_voxel_is_right() {
    for (layout, filter) in KINDS {
        let medium = medium(3e3, layout, filter);
        // Through its outskirts, on which a trilinear one is thin.
        let at = middle(layout) + vec3(0.93, 0.4, 0.0) / SIDE as f64;
        let from = vec3(at.x, at.y, -0.5);
        let ray = drt_medium::Ray::new(from, Vec3::Z, 4.0);
        let truth = (-optical_depth(&medium, &ray).r).exp();
        let through = estimate(100_000, |rng, stats| {
            medium.transmittance(ray.origin, ray.dir, ray.t_max, rng, stats).r
        });
        let passes = estimate(100_000, |rng, stats| {
            let s = medium.sample_distance(from, Vec3::Z, 4.0, Rgb::ONE, 0.0, rng, stats);
            f64::from(u8::from(matches!(s, DistanceSample::Pass { .. })))
        });
        for (name, e) in [("transmittance", through), ("passes", passes)] {
            if filter == Filter::Nearest && truth == 1.0 {
                continue;
            }
            assert_agrees(name, &e, truth, 0.02);
        }
    }
}
