//! Lookups in grids: positions of the values, wrap modes, filters, placements, gradients.

use crate::common::*;
use drt_math::{Affine, Mat3, Rgb, Rng, Vec3, vec3};
use drt_medium::{Filter, Grid, Layout, MediumError, Wrap};

fn line(values: &[f64]) -> Grid {
    Grid::new([values.len(), 1, 1], 1, values.to_vec()).expect("a valid grid")
}

fn at(grid: &Grid, x: f64) -> f64 {
    grid.value(vec3(x, 0.5, 0.5)).g
}

#[test]
fn values_sit_where_the_layout_says() {
    let values = [2.0, 5.0, -1.0, 4.0];
    let (voxels, nodes) = (line(&values), line(&values).with_layout(Layout::NodeCentred));
    for (i, v) in values.into_iter().enumerate() {
        assert!((at(&voxels, (i as f64 + 0.5) / 4.0) - v).abs() < 1e-14);
        assert!((at(&nodes, i as f64 / 3.0) - v).abs() < 1e-14);
    }
    assert!((at(&voxels, 0.25) - 3.5).abs() < 1e-14);
    assert!((at(&nodes, 0.5) - 2.0).abs() < 1e-14);
}

#[test]
fn wrap_modes_continue_the_values() {
    let values = [1.0, 2.0, 3.0];
    let sampled = |wrap| {
        let grid = line(&values).with_wrap(wrap);
        [-5, -4, -3, -2, -1, 0, 1, 2, 3, 4, 5, 6].map(|i| at(&grid, (f64::from(i) + 0.5) / 3.0))
    };
    let near = |a: [f64; 12], b: [f64; 12]| (0..12).all(|i| (a[i] - b[i]).abs() < 1e-12);
    let clamp = [1., 1., 1., 1., 1., 1., 2., 3., 3., 3., 3., 3.];
    assert!(near(sampled(Wrap::Clamp), clamp));
    let repeat = [2., 3., 1., 2., 3., 1., 2., 3., 1., 2., 3., 1.];
    assert!(near(sampled(Wrap::Repeat), repeat));
    let mirror = [2., 3., 3., 2., 1., 1., 2., 3., 3., 2., 1., 1.];
    assert!(near(sampled(Wrap::Mirror), mirror));
}

#[test]
fn the_nearest_filter_takes_whole_voxels() {
    let grid = line(&[1.0, 2.0, 3.0, 4.0]).with_filter(Filter::Nearest);
    for (x, v) in [(0.01, 1.0), (0.24, 1.0), (0.26, 2.0), (0.74, 3.0), (0.99, 4.0)] {
        assert_eq!(at(&grid, x), v);
    }
    assert_eq!(grid.gradient(vec3(0.4, 0.5, 0.5)).r, Vec3::ZERO);
}

#[test]
fn gradients_are_those_of_the_interpolant() {
    let mut rng = Rng::new(2, 0, 0);
    let random = |rng: &mut Rng| vec3(rng.next_f64(), rng.next_f64(), rng.next_f64());
    for layout in [Layout::VoxelCentred, Layout::NodeCentred] {
        for wrap in [Wrap::Clamp, Wrap::Repeat, Wrap::Mirror] {
            let turn = Mat3::rotation(vec3(0.0, 0.6, 0.8), 0.4) * Mat3::diagonal(vec3(3., 2., 1.));
            let place = Affine { linear: turn, translation: vec3(1.0, -2.0, 0.5) };
            let grid = Grid::new([5, 4, 3], 3, random_values(180, 4))
                .expect("a valid grid")
                .with_layout(layout)
                .with_wrap(wrap)
                .with_placement(place)
                .expect("a proper box");
            for _ in 0..200 {
                let x = place.point(random(&mut rng) * 1.4 - Vec3::splat(0.2));
                let direction = random(&mut rng) - Vec3::splat(0.5);
                let h = 1e-7;
                let rise = grid.value(x + direction * h) - grid.value(x - direction * h);
                let slope = grid.gradient(x).dot(direction);
                let difference = (rise / (2.0 * h) - slope).max_abs();
                assert!(difference < 1e-6 * (1.0 + slope.max_abs()), "{difference} at {x:?}");
            }
        }
    }
}

#[test]
fn far_away_points_are_harmless() {
    for wrap in [Wrap::Clamp, Wrap::Repeat, Wrap::Mirror] {
        let grid = line(&[1.0, 2.0]).with_wrap(wrap);
        for x in [1e300, -1e300, 1e17, -1e9] {
            assert!((1.0..=2.0).contains(&at(&grid, x)), "{wrap:?} {x}");
        }
    }
}

#[test]
fn a_medium_ends_at_its_box() {
    let medium = grid_medium(Grid::constant(Rgb::splat(2.0)).expect("finite"), 1.5, Rgb::ONE);
    assert_eq!(medium.sigma_t(vec3(0.2, 0.9, 0.5)), Rgb::splat(3.0));
    assert_eq!(medium.sigma_t(vec3(0.2, 1.1, 0.5)), Rgb::ZERO);
    assert_eq!(medium.coefficients(vec3(0.2, 1.1, 0.5)).sigma_t, Rgb::ZERO);
}

#[test]
fn bad_grids_are_refused_with_the_place() {
    let shape = Grid::new([2, 0, 1], 1, vec![]);
    assert!(matches!(shape, Err(MediumError::GridShape { .. })));
    let count = Grid::new([2, 2, 2], 1, vec![0.0; 7]);
    assert!(matches!(count, Err(MediumError::ValueCount { expected: 8, found: 7, .. })));
    let overflow = Grid::new([usize::MAX, 2, 2], 3, vec![]);
    assert!(matches!(overflow, Err(MediumError::ValueCount { .. })));
    let mut values = vec![0.0; 24];
    values[3 * 3 + 2] = f64::NAN;
    let nan = Grid::new([2, 2, 2], 3, values).expect_err("NaN");
    let text = nan.to_string();
    assert!(text.contains("[1, 1, 0], channel 2"), "{text}");
    let flat = Affine { linear: Mat3::diagonal(vec3(1.0, 0.0, 1.0)), translation: Vec3::ZERO };
    assert_eq!(line(&[1.0]).with_placement(flat), Err(MediumError::SingularPlacement));
}
