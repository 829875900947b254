//! Nanoseconds and lookups per call of walks through media.
//!
//! `cargo bench -p drt-medium --bench tracking`
//!
//! Rays cross a cube, straight or at a slant: of one medium, and of a cloud of voxels whose extinction
//! is mostly far below its largest. The cloud is walked with the bounds of its cells, with their
//! majorants alone (plain ratio tracking), and with one majorant for all; these take turns on the
//! same rays. Then smoke of the same shape in ever more voxels, most of which are empty. A transmittance's noise is the standard deviation of one estimate over the mean, and
//! "work" is variance times time, in units of the cloud's.

use std::cell::RefCell;
use std::hint::black_box;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

use drt_math::{Affine, Moments, Rgb, Rng, Vec3, vec3};
use drt_medium::{
    CoefficientGradients, CoefficientRates, Coefficients, DensityField, Grid, GridMedium,
    Homogeneous, Medium, MediumGradient, MediumKind, MediumTangent, Phase, Piece, Ray,
    TrackingStats, Volume,
};

/// Calls of a turn.
const CALLS: usize = 500;
const TURNS: usize = 60;
/// Voxels along each side.
const SIDE: usize = 64;

fn main() {
    for (name, depth) in [("thin", 0.3), ("dense", 10.0)] {
        let media = media(depth);
        println!("{name}: mean optical depth of the cloud about {depth}");
        println!();
        distances(&media);
        transmittances(&media);
    }
    let smoke = SIDES.map(|(name, side)| (name, smoke(side)));
    println!("smoke: {:.0} % of the voxels are empty", 100.0 * EMPTY);
    println!();
    distances(&smoke);
    transmittances(&smoke);
    gradients(&media(1.0)[1].1);
}

/// Grids of smoke by the number of voxels along each side.
const SIDES: [(&str, usize); 3] = [("smoke, 32", 32), ("smoke, 128", 128), ("smoke, 256", 256)];
/// The share of voxels without any smoke.
const EMPTY: f64 = 0.87;

/// A cloud whose thin parts are gone, and whose inside is in folds.
fn smoke(side: usize) -> Medium {
    let values = (0..side.pow(3)).map(|v| {
        let unit = |i: usize| (i as f64 + 0.5) / side as f64;
        let p = Vec3::from([v % side, v / side % side, v / side / side].map(unit));
        let folds = f64::sin(23.0 * p.x + 9.0 * f64::sin(11.0 * p.y)) * f64::sin(31.0 * p.z);
        let puff =
            |&(centre, r): &([f64; 3], f64)| f64::exp(-((p - centre.into()) / r).length_squared());
        PUFFS.iter().map(puff).sum::<f64>() * (1.0 + 0.5 * folds)
    });
    let values: Vec<f64> = values.collect();
    let mut sorted = values.clone();
    sorted.sort_unstable_by(f64::total_cmp);
    let least = sorted[(EMPTY * sorted.len() as f64) as usize];
    let values: Vec<f64> = values.iter().map(|v| f64::max(v - least, 0.0)).collect();
    let scale = 5.0 * values.len() as f64 / values.iter().sum::<f64>();
    let grid = Grid::new([side; 3], 1, values).expect("a grid");
    let [albedo, emission] = [Rgb::splat(0.9), Rgb::ZERO].map(Volume::Constant);
    let smoke = GridMedium::new(grid, scale, albedo, emission).expect("coefficients");
    Medium::new(smoke, Phase::Isotropic)
}

/// Which bounds of the cloud are shown to a walk.
#[derive(Clone, Copy, Debug)]
enum Shown {
    Majorants,
    OneMajorant,
}

/// A cloud that tells less about itself than it knows.
#[derive(Debug)]
struct Reticent {
    cloud: GridMedium,
    largest: Rgb,
    shown: Shown,
}

impl DensityField for Reticent {
    fn coefficients(&self, x: Vec3) -> Coefficients {
        self.cloud.coefficients(x)
    }
    fn sigma_t(&self, x: Vec3) -> Rgb {
        self.cloud.sigma_t(x)
    }
    fn gradients(&self, x: Vec3) -> CoefficientGradients {
        self.cloud.gradients(x)
    }
    fn pieces(&self, ray: &Ray, visit: &mut dyn FnMut(&Piece) -> ControlFlow<()>) {
        match self.shown {
            Shown::Majorants => {
                self.cloud.pieces(ray, &mut |p| visit(&Piece { minorant: Rgb::ZERO, ..*p }));
            }
            Shown::OneMajorant => {
                // All rays here lie inside the box.
                let _ = visit(&Piece {
                    start: 0.0,
                    end: ray.t_max,
                    majorant: self.largest,
                    minorant: Rgb::ZERO,
                    mean: self.largest,
                });
            }
        }
    }
}

type Named = (&'static str, Medium);

/// The same amount of medium, spread evenly and as a cloud.
fn media(depth: f64) -> [Named; 4] {
    let values = (0..SIDE.pow(3)).map(|v| {
        let unit = |i: usize| (i as f64 + 0.5) / SIDE as f64;
        let p = Vec3::from([v % SIDE, v / SIDE % SIDE, v / SIDE / SIDE].map(unit));
        PUFFS.iter().map(|&(centre, r)| f64::exp(-((p - centre.into()) / r).length_squared())).sum()
    });
    let values: Vec<f64> = values.collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let grid = Grid::new([SIDE; 3], 1, values).expect("a grid");
    let [albedo, emission] = [Rgb::splat(0.9), Rgb::ZERO].map(Volume::Constant);
    let cloud = GridMedium::new(grid, depth / mean, albedo, emission).expect("coefficients");
    let even = Homogeneous::new(Rgb::splat(depth), Rgb::splat(0.9), Rgb::ZERO).expect("valid");
    let medium = |kind: MediumKind| Medium::new(kind, Phase::Isotropic);
    let largest = Rgb::splat(cloud.largest_sigma_t());
    let reticent =
        |shown| MediumKind::Custom(Arc::new(Reticent { cloud: cloud.clone(), largest, shown }));
    [
        ("one medium, closed form", medium(even.into())),
        ("cloud", medium(cloud.clone().into())),
        ("cloud, majorants alone", medium(reticent(Shown::Majorants))),
        ("cloud, one majorant", medium(reticent(Shown::OneMajorant))),
    ]
}

/// Centres and radii.
const PUFFS: [([f64; 3], f64); 4] = [
    ([0.4, 0.4, 0.5], 0.12),
    ([0.6, 0.5, 0.4], 0.10),
    ([0.5, 0.65, 0.6], 0.15),
    ([0.3, 0.6, 0.3], 0.06),
];

/// Through the unit cube, from a point of one face to one of the opposite.
fn rays() -> Vec<Ray> {
    let mut rng = Rng::new(1, 0, 0);
    let ray = |_| {
        let ([a, b], [c, d]) = (rng.next_2d(), rng.next_2d());
        let (from, to) = (vec3(a, b, 0.0), vec3(c, d, 1.0));
        Ray::new(from, (to - from).normalize()).until((to - from).length())
    };
    (0..CALLS).map(ray).collect()
}

/// What one contender's calls cost.
#[derive(Default)]
struct Cost {
    seconds: Vec<f64>,
    stats: TrackingStats,
}

impl Cost {
    fn ns(&self) -> f64 {
        let mut seconds = self.seconds.clone();
        seconds.sort_unstable_by(f64::total_cmp);
        seconds[seconds.len() / 2] / CALLS as f64 * 1e9
    }
    fn per_call(&self) -> [f64; 2] {
        [self.stats.pieces, self.stats.lookups].map(|n| n as f64 / (CALLS * TURNS) as f64)
    }
}

/// Lets all media work on all rays once a turn; `call` is told the numbers of medium and ray.
fn take_turns(
    media: &[Named],
    mut call: impl FnMut([usize; 2], &Medium, &Ray, &mut Rng, &mut TrackingStats),
) -> Vec<Cost> {
    let rays = rays();
    let mut costs: Vec<Cost> = media.iter().map(|_| Cost::default()).collect();
    for turn in 0..TURNS {
        for (m, ((_, medium), cost)) in media.iter().zip(&mut costs).enumerate() {
            let mut rng = Rng::new(2, m as u64, turn as u32);
            let start = Instant::now();
            for (r, ray) in rays.iter().enumerate() {
                call([m, r], medium, ray, &mut rng, &mut cost.stats);
            }
            cost.seconds.push(start.elapsed().as_secs_f64());
        }
    }
    costs
}

fn distances(media: &[Named]) {
    println!("{:24} {:>8} {:>8} {:>8}", "distance", "ns", "cells", "lookups");
    let costs = take_turns(media, |_, medium, ray, rng, stats| {
        let sample = medium.sample_distance(ray, Rgb::ONE, 0.0, rng, stats);
        black_box(sample);
    });
    for ((name, _), cost) in media.iter().zip(&costs) {
        let [pieces, lookups] = cost.per_call();
        println!("{name:24} {:8.1} {pieces:8.1} {lookups:8.1}", cost.ns());
    }
    println!();
}

fn transmittances(media: &[Named]) {
    println!(
        "{:24} {:>8} {:>8} {:>8} {:>8} {:>8}",
        "transmittance", "ns", "cells", "lookups", "noise", "work"
    );
    let mut estimates = vec![[Moments::ZERO; CALLS]; media.len()];
    let costs = take_turns(media, |[m, r], medium, ray, rng, stats| {
        let t = medium.transmittance(ray, rng, stats);
        estimates[m][r].push(t.g);
    });
    let rows: Vec<_> = (media.iter().zip(costs).zip(estimates))
        .map(|(((name, _), cost), estimates)| {
            let mean = |f: fn(&Moments) -> f64| estimates.iter().map(f).sum::<f64>() / CALLS as f64;
            let (variance, mean) = (mean(Moments::variance), mean(Moments::mean));
            (name, cost.ns(), cost.per_call(), variance.sqrt() / mean, variance * cost.ns())
        })
        .collect();
    for (name, ns, [pieces, lookups], noise, work) in &rows {
        let work = work / rows[1].4;
        println!("{name:24} {ns:8.1} {pieces:8.1} {lookups:8.1} {noise:8.3} {work:8.2}");
    }
    println!();
}

/// What derivatives need: at points, and along rays.
fn gradients(cloud: &Medium) {
    let velocity = Affine { translation: Vec3::Z, ..Affine::ZERO };
    let tangent = &MediumTangent { velocity, ..MediumTangent::zero() };
    let gradient = RefCell::new(MediumGradient::zeros(cloud));
    let points = RefCell::new(Vec::new());
    let adjoint = CoefficientRates { sigma_t: Rgb::ONE, ..CoefficientRates::ZERO };
    let middle = |ray: &Ray| ray.at(0.5 * ray.t_max);
    let calls = [
        call("extinction", |ray, _| cloud.sigma_t(middle(ray))),
        call("coefficients", |ray, _| cloud.coefficients(middle(ray))),
        call("their gradients", |ray, _| cloud.gradients(middle(ray))),
        call("their rates", |ray, _| tangent.rates(cloud, middle(ray))),
        call("their scatter to voxels", |ray, _| {
            gradient.borrow_mut().scatter(cloud, middle(ray), &adjoint);
        }),
        call("depth by a parameter", |ray, rng| {
            cloud.optical_depth_rate(ray, tangent, rng, &mut points.borrow_mut())
        }),
        call("depth by the ray's ends", |ray, rng| {
            cloud.optical_depth_gradient(ray, rng, &mut points.borrow_mut())
        }),
    ];
    println!("{:24} {:>8}", "derivatives, cloud", "ns");
    let rays = rays();
    let mut costs = calls.each_ref().map(|_| Cost::default());
    for turn in 0..TURNS {
        for ((_, call), cost) in calls.iter().zip(&mut costs) {
            let mut rng = Rng::new(3, 0, turn as u32);
            let start = Instant::now();
            rays.iter().for_each(|ray| call(ray, &mut rng));
            cost.seconds.push(start.elapsed().as_secs_f64());
        }
    }
    for ((name, _), cost) in calls.iter().zip(&costs) {
        println!("{name:24} {:8.1}", cost.ns());
    }
}

type Call<'a> = (&'static str, Box<dyn Fn(&Ray, &mut Rng) + 'a>);

fn call<'a, T>(name: &'static str, f: impl Fn(&Ray, &mut Rng) -> T + 'a) -> Call<'a> {
    let keep = move |ray: &Ray, rng: &mut Rng| {
        black_box(f(ray, rng));
    };
    (name, Box::new(keep))
}
