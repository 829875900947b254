//! Guides of functions whose integrals are known.

use drt_math::sobol::SobolSampler;
use drt_math::stats::Moments;
use drt_math::testing::welch_z;
use drt_math::{Real, Rng};

use super::learning::{LEAST_GAIN, Learnt, Observation, learn};
use super::*;

/// A ridge along the second axis, narrow in the first, in a corner of the third; the fourth does not matter. Its integral is
/// 0.75 · 0.04 · 0.5 · 2.
fn ridge([a, b, c, _]: [f64; DIMENSIONS]) -> f64 {
    let inside = (0.4..0.44).contains(&a) && b > 0.25 && c < 0.5;
    if inside { 4.0 * c / 0.5 } else { 0.0 }
}

const RIDGE: f64 = 0.75 * 0.04 * 0.5 * 2.0;

/// Samples of a function and of its cost by a guide.
fn observed(
    guide: &Guide,
    stream: u64,
    count: u32,
    f: impl Fn([f64; DIMENSIONS], &mut Rng) -> f64,
    cost: impl Fn([f64; DIMENSIONS]) -> f64,
) -> Vec<Observation> {
    let one = |i| {
        let mut points = SobolSampler::new(stream as u32, i);
        let drawn = guide.draw(core::array::from_fn(|_| points.next_f64()));
        let value = f(drawn.point, &mut Rng::new(5, stream, i));
        Observation {
            point: drawn.point.map(|u| u as f32),
            weight: drawn.inverse_density as f32,
            cost: cost(drawn.point) as f32,
            square: value * value,
        }
    };
    (0..count).map(one).collect()
}

/// By rounds of samples, each guided by those before.
fn learnt(rounds: u64, f: impl Fn([f64; DIMENSIONS], &mut Rng) -> f64) -> Learnt {
    let mut all = Vec::new();
    let mut learnt = Learnt { guide: None, gain: 1.0, cost: 1.0 };
    for round in 0..rounds {
        let even = Guide::even();
        let guide = learnt.guide.as_ref().unwrap_or(&even);
        let count = u32::max(all.len() as u32, 2048);
        all.extend(observed(guide, round, count, &f, |_| 1.0));
        learnt = learn(&all);
    }
    learnt
}

fn of_ridge() -> Guide {
    learnt(4, |u, _| ridge(u)).guide.expect("a gain")
}

/// The estimate of an integral, with its error.
fn estimate(guide: &Guide, f: impl Fn([f64; DIMENSIONS]) -> f64) -> (f64, f64) {
    let mut rng = Rng::new(11, 0, 0);
    let mut moments = Moments::default();
    for _ in 0..40_000 {
        let drawn = guide.draw(core::array::from_fn(|_| rng.next_f64()));
        moments.push(f(drawn.point) * drawn.inverse_density);
    }
    (moments.mean(), moments.standard_error())
}

#[test]
fn points_have_the_density_that_is_told() {
    let guide = of_ridge();
    let mut rng = Rng::new(3, 0, 0);
    let mut sum = 0.0;
    for _ in 0..20_000 {
        let uniform = core::array::from_fn(|_| rng.next_f64());
        let Drawn { point, inverse_density } = guide.draw(uniform);
        assert!(point.iter().all(|u| *u > 0.0 && *u < 1.0));
        assert!((guide.density(point) * inverse_density - 1.0).abs() < 1e-12);
        assert!(inverse_density * DEFENSIVE <= 1.0 + 1e-12);
        sum += guide.density(uniform);
    }
    assert!((sum / 20_000.0 - 1.0).abs() < 0.1, "{sum}");
    for extreme in [f64::MIN_POSITIVE, BELOW_ONE] {
        let drawn = guide.draw([extreme; DIMENSIONS]);
        assert!(drawn.point.iter().all(|u| *u > 0.0 && *u < 1.0));
    }
    // As many points fall into a box as its density tells.
    let mut rng = Rng::new(5, 0, 0);
    for box_of in [[0.4, 0.44], [0.43, 0.5], [0.25, 0.415], [0.7, 1.0]] {
        let inside = |[a, b, c, _]: [f64; DIMENSIONS]| {
            f64::from(a > box_of[0] && a < box_of[1] && b < 0.6 && c > 0.2)
        };
        let [mut drawn, mut claimed] = [Moments::default(); 2];
        for _ in 0..40_000 {
            drawn.push(inside(guide.draw(core::array::from_fn(|_| rng.next_f64())).point));
            let mut even: [f64; DIMENSIONS] = core::array::from_fn(|_| rng.next_f64());
            even[0] = box_of[0] + (box_of[1] - box_of[0]) * even[0];
            claimed.push((box_of[1] - box_of[0]) * inside(even) * guide.density(even));
        }
        let z = welch_z(&drawn, &claimed);
        assert!(z.abs() < 4.0, "{box_of:?}: {z}");
        // Twice the density is seen.
        assert!((2.0 * claimed.mean() - drawn.mean()).abs() > 8.0 * drawn.standard_error());
    }
}

/// Estimates stay right with less noise; a guide that ignores a cell is found out.
#[test]
fn guided_estimates_are_right() {
    let guide = of_ridge();
    let (mean, error) = estimate(&guide, ridge);
    assert!((mean - RIDGE).abs() < 4.0 * error, "{mean} ± {error}");
    let (_, unguided) = estimate(&Guide::even(), ridge);
    assert!(error < 0.35 * unguided && error < 0.01 * RIDGE, "{error} {unguided}");
    // What is found nowhere in learning is found in time, as some of the samples are even.
    let (mean, error) = estimate(&guide, |u| f64::from(u[0] > 0.7));
    assert!((mean - 0.3).abs() < 4.0 * error, "{mean} ± {error}");
    let mut faulty = guide.clone();
    faulty.ignore_a_cell();
    let (mean, error) = estimate(&faulty, ridge);
    assert!((mean - RIDGE).abs() > 4.0 * error, "{mean} ± {error}");
}

/// Points that are even stay so in every dimension.
#[test]
fn strata_are_kept() {
    let guide = of_ridge();
    let spread = |even: bool| {
        let mut moments = Moments::default();
        for seed in 0..40 {
            let one = |i| {
                let mut rng = Rng::new(8, seed, i);
                let mut points = SobolSampler::new(seed as u32, i);
                let u = core::array::from_fn(|_| match even {
                    true => points.next_f64(),
                    false => rng.next_f64(),
                });
                let drawn = guide.draw(u);
                ridge(drawn.point) * drawn.inverse_density
            };
            moments.push((0..1024).map(one).sum::<f64>() / 1024.0);
        }
        moments.variance()
    };
    let (even, random) = (spread(true), spread(false));
    assert!(even < 0.2 * random, "{even} {random}");
}

/// Where samples cost ten times as much, there are √10 times fewer for the same noise.
#[test]
fn costs_count() {
    let cost = |u: [f64; DIMENSIONS]| if u[1] < 0.5 { 10.0 } else { 1.0 };
    let f = |u: [f64; DIMENSIONS], _: &mut Rng| if u[0] < 0.125 { 1.0 } else { 0.0 };
    let learnt = learn(&observed(&Guide::even(), 1, 8192, f, cost));
    // A fifth costs 5.5; of the rest 1 / (1 + √10) goes where samples cost ten times as much.
    let expected = 0.2 + 0.8 * (1.0 + 9.0 / (1.0 + Real::sqrt(10.0))) / 5.5;
    assert!((learnt.cost / expected - 1.0).abs() < 0.05, "{} {expected}", learnt.cost);
    let guide = learnt.guide.expect("a gain");
    let [dear, cheap] = [0.25, 0.75].map(|b| guide.density([0.06, b, 0.5, 0.5]) - DEFENSIVE);
    assert!((cheap / dear / Real::sqrt(10.0) - 1.0).abs() < 0.1, "{cheap} {dear}");
}

/// Large values that come by chance teach nothing, nor does what is even; few samples do not either.
#[test]
fn nothing_is_learnt_from_noise() {
    for stream in 0..6 {
        let tail = |_: [f64; DIMENSIONS], rng: &mut Rng| Real::powf(rng.next_f64(), -0.8);
        let learnt = learn(&observed(&Guide::even(), stream, 8192, tail, |_| 1.0));
        assert!(learnt.guide.is_none() && learnt.gain < LEAST_GAIN, "{}", learnt.gain);
    }
    let rare = |_: [f64; DIMENSIONS], rng: &mut Rng| f64::from(rng.next_f64() < 0.01);
    let learnt = learn(&observed(&Guide::even(), 9, 8192, rare, |_| 1.0));
    assert!(learnt.guide.is_none(), "{}", learnt.gain);
    let few = observed(&Guide::even(), 9, 16, |u, _| ridge(u), |_| 1.0);
    assert!(learn(&few).guide.is_none() && learn(&[]).guide.is_none());
}

/// Memory is bounded: of the most observations, a leaf has several.
#[test]
fn trees_are_small() {
    let wild = |u: [f64; DIMENSIONS], _: &mut Rng| {
        f64::from((u[0] * 64.0) as u32 * 37 % 64 + (u[1] * 64.0) as u32 * 11 % 64 < 20)
    };
    let guide = learn(&observed(&Guide::even(), 2, 32_768, wild, |_| 1.0)).guide.expect("a gain");
    assert!(guide.cells() > 64 && guide.cells() <= 32_768 / 16, "{}", guide.cells());
}

impl Guide {
    /// A mistake: a cell that has about a quarter of all samples is never drawn.
    pub(crate) fn ignore_a_cell(&mut self) {
        let (mut at, mut mass, mut last) = (0, 1.0, None);
        while let Node::Split { lower, upper, .. } = self.nodes[at] {
            let below = lower >= 0.5;
            (at, mass, last) = match below {
                true => (at + 1, mass * lower, Some((at, 0.0))),
                false => (upper as usize, mass * (1.0 - lower), Some((at, 1.0))),
            };
            if mass < 0.3 {
                break;
            }
        }
        let (node, without) = last.expect("more than one cell");
        if let Node::Split { lower, .. } = &mut self.nodes[node] {
            *lower = without;
        }
    }
}
