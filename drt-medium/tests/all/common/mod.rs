//! Media with known answers, and exact quadrature through grids.

use drt_math::{Affine, Mat3, Moments, Real, Rgb, Rng, Vec3, testing, vec3};
use drt_medium::{
    Grid, GridMedium, Layout, LocalPhase, Medium, MediumKind, Phase, Ray, TrackingStats, Volume,
};

/// Judged in standard errors: four.
pub(crate) const Z: f64 = 4.0;

/// Mean of `count` runs of an estimator, from a fixed seed.
pub(crate) fn estimate(
    count: u32,
    mut run: impl FnMut(&mut Rng, &mut TrackingStats) -> f64,
) -> Moments {
    let mut stats = TrackingStats::default();
    (0..count).map(|i| run(&mut Rng::new(8, 11, i), &mut stats)).collect()
}

/// Fails unless the estimate agrees with the truth and its standard error is at most `precision`;
/// says what it saw.
pub(crate) fn assert_agrees(what: &str, estimate: &Moments, truth: f64, precision: f64) {
    let (mean, error) = (estimate.mean(), estimate.standard_error());
    let z = testing::z_score(estimate, truth);
    println!("{what}: {mean:.6} ± {error:.6}, truth {truth:.6}, z = {z:.2}");
    assert!(error <= precision, "{what}: too noisy to tell, {mean} ± {error}");
    assert!(z.abs() < Z, "{what}: {mean} ± {error}, truth {truth}, z = {z}");
}

/// Fails if a wrong value would have been accepted: the test could not fail.
pub(crate) fn assert_rejects(what: &str, estimate: &Moments, wrong: f64) {
    let z = testing::z_score(estimate, wrong);
    assert!(z.abs() > Z, "{what}: the planted fault {wrong} passes with z = {z}");
}

/// Unit directions, in which light leaves and from which it comes, that it goes straight on between if the cosine is one.
pub(crate) fn directions<T: Real>(cosine: T) -> [Vec3<T>; 2] {
    let (zero, sine) = (T::zero(), (T::one() - cosine.squared()).max(T::zero()).sqrt());
    [vec3(zero, zero, T::one()), vec3(sine, zero, -cosine)]
}

/// The value of a phase function at a cosine.
pub(crate) fn at_cosine<T: Real>(phase: &LocalPhase<'_>, cosine: T) -> T {
    let [wo, wi] = directions(cosine);
    phase.eval(wo, wi)
}

/// A box from its corners, as a placement of the unit cube.
pub(crate) fn placement(lo: Vec3, hi: Vec3) -> Affine {
    Affine { linear: Mat3::diagonal(hi - lo), translation: lo }
}

pub(crate) fn grid_medium(density: Grid, scale: f64, albedo: Rgb) -> Medium {
    let (albedo, emission) = (Volume::Constant(albedo), Volume::Constant(Rgb::ZERO));
    let grid = GridMedium::new(density, scale, albedo, emission).expect("a valid medium");
    Medium::new(grid, Phase::Isotropic)
}

/// Values drawn from [0, 1), the same for every run.
pub(crate) fn random_values(count: usize, seed: u64) -> Vec<f64> {
    let mut rng = Rng::new(seed, 0, 0);
    (0..count).map(|_| rng.next_f64()).collect()
}

/// The grid of the oracle `P07_grid_transmittance`, `VALUES[i][j][k]` with i along x.
const P07_VALUES: [[[f64; 3]; 4]; 3] = [
    [[1.325, 1.815, 1.596], [0.605, 0.74, 1.772], [0.209, 1.678, 1.635], [1.042, 0.745, 0.701]],
    [[0.659, 1.001, 1.108], [1.196, 1.992, 1.627], [1.32, 1.98, 0.588], [0.488, 1.303, 0.279]],
    [[0.264, 1.127, 1.039], [1.851, 1.333, 1.125], [1.094, 0.646, 0.221], [0.546, 1.446, 0.561]],
];
pub(crate) const P07_RADIANCE: f64 = 2.0;
pub(crate) const P07_VALUE: f64 = 0.170_009_925_192_13;

pub(crate) fn p07() -> Medium {
    let [nx, ny, nz] = [3, 4, 3];
    let mut values = Vec::new();
    for k in 0..nz {
        for j in 0..ny {
            for plane in P07_VALUES.iter().take(nx) {
                values.push(plane[j][k]);
            }
        }
    }
    let grid = Grid::new([nx, ny, nz], 1, values)
        .expect("a valid grid")
        .with_layout(Layout::NodeCentred)
        .with_placement(placement(Vec3::ZERO, vec3(2.0, 1.5, 1.0)))
        .expect("a proper box");
    grid_medium(grid, 0.9, Rgb::ZERO)
}

pub(crate) fn p07_ray() -> Ray {
    let dir = vec3(0.9634555216934667, 0.2119602147725627, 0.16378743868788936);
    Ray::new(vec3(-1.0, 0.4, 0.1), dir)
}

/// Distances at which a ray crosses a plane between lattice points of the density grid, within the
/// grid's box and the ray, its ends included.
fn breaks(medium: &GridMedium, ray: &Ray) -> Vec<f64> {
    let grid = medium.density();
    let o = grid.from_world().point(ray.origin);
    let d = grid.from_world().vector(ray.dir);
    let (mut enter, mut leave) = (0.0_f64, ray.t_max);
    let mut ts = Vec::new();
    for k in 0..3 {
        let n = grid.size()[k];
        let (a, b) = (-o[k] / d[k], (1.0 - o[k]) / d[k]);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
        let plane = |i: usize| match grid.layout() {
            Layout::VoxelCentred => (i as f64 + 0.5) / n as f64,
            Layout::NodeCentred => i as f64 / (n - 1) as f64,
        };
        ts.extend((0..n).map(|i| (plane(i) - o[k]) / d[k]));
    }
    ts.retain(|&t| t > enter && t < leave);
    if enter < leave {
        ts.extend([enter, leave]);
    }
    ts.sort_by(f64::total_cmp);
    ts
}

/// `∫ sigma_t` along a ray: along a line a trilinear field is a cubic between lattice planes, which
/// two Gauss points integrate exactly.
pub(crate) fn optical_depth(medium: &Medium, ray: &Ray) -> Rgb {
    let MediumKind::Grid(grid) = &medium.kind else { panic!("only for grids") };
    let mut depth = Rgb::ZERO;
    for pair in breaks(grid, ray).windows(2) {
        let (mid, half) = (0.5 * (pair[0] + pair[1]), 0.5 * (pair[1] - pair[0]));
        let g = half / 3.0_f64.sqrt();
        depth += (medium.sigma_t(ray.at(mid - g)) + medium.sigma_t(ray.at(mid + g))) * half;
    }
    depth
}

/// A chromatic grid with empty parts, turned and placed off the origin.
pub(crate) fn cloud(layout: Layout) -> Medium {
    let size = [9, 7, 11];
    let mut values = random_values(3 * size.iter().product::<usize>(), 3);
    for (n, v) in values.iter_mut().enumerate() {
        let voxel = n / 3;
        let strength = [0.3, 1.0, 8.0][n % 3];
        *v *= if voxel % size[0] < 4 { 0.0 } else { strength };
    }
    let turn = Mat3::rotation(vec3(0.6, 0.0, 0.8), 0.7);
    let stretch = turn * Mat3::diagonal(vec3(2.0, 1.0, 1.5));
    let place = Affine { linear: stretch, translation: vec3(-0.3, 0.2, 0.1) };
    let grid = Grid::new(size, 3, values)
        .expect("a valid grid")
        .with_layout(layout)
        .with_placement(place)
        .expect("a proper box");
    grid_medium(grid, 1.7, Rgb::new(0.9, 0.5, 0.2))
}

/// A ray through the middle of a grid medium's box.
pub(crate) fn ray_through(medium: &Medium, dir: Vec3) -> Ray {
    let grid = medium.grid().expect("a grid");
    let middle = grid.density().to_world().point(Vec3::splat(0.5));
    let dir = dir.normalize();
    Ray::new(middle - dir * 2.5, dir)
}
