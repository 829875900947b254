//! A pilot of few samples: how many of the boundary samples go to edges that the camera sees.
//!
//! Kinds of boundary samples share [`Settings::boundary_ratio`](crate::Settings::boundary_ratio). In equal parts those of the
//! camera's edges often make a hundredth of the noise in a third of the time, as radiance differs beside an edge by about as
//! much as an image does; but where a lamp is in view, and that or the camera moves, they make nearly all of it. So before a run
//! a few samples of all terms tell which it is. With the variance v and cost c of a sample, and those of paths (v₁, c₁) and of the
//! other kinds (v_k, c_k), of which there are one and r₀ to a path, [least work](crate::sampling::budget) for one derivative would be the part
//!
//! ```text
//! p = √(v / c) / max(r₀ √(v₁ / c₁), √(v_k / c_k))
//! ```
//!
//! of an equal one. The camera's edges take a quarter of that, of the derivative that needs them most, but at least 1/4, at most 1,
//! and a power of two from above. The quarter is for what so few samples miss: other terms have rare samples, which make most of
//! their noise. (In rooms and fog 256 edge queries had a sixth to a fortieth of their variance.) No other term takes less for
//! this, and these samples have no part in the images.

use alloc::vec::Vec;

use drt_math::sobol::SobolSampler;
use drt_math::{Real, Rgb};

use crate::derivative::contraction::{Contraction, Motion};
use crate::sampling::budget::{BESIDES, TermStatistics};
use crate::sampling::pixels::Sampler;
use crate::terms::boundary_source::BoundarySource;
use crate::terms::interior::PixelSampler;
use crate::terms::prepared::Prepared;
use crate::terms::splatting::{Checked, ToImages};

/// Samples of pixels, and of each kind that lands anywhere.
const SAMPLES: u32 = 256;

/// Their seed: the same whatever samples a run takes.
const SEED: u64 = 0x7363_6f75_7473;

/// The smallest part that is taken of an equal one.
const LEAST: f64 = 0.25;

/// The part of p that is taken, for what so few samples miss.
const TAKEN: f64 = 0.25;

/// The part that edges seen from the camera take of an `equal` one, which is in samples to a path.
pub(in crate::run::session) fn primary_share(
    prepared: &Prepared,
    motion: &Motion,
    equal: f64,
) -> f64 {
    let Some(camera) = prepared.terms.sources.iter().position(|s| s.is_of_camera()) else {
        return 1.0;
    };
    let [paths, queries] = along_paths(prepared, motion);
    let measured = |source: &BoundarySource| of_source(prepared, motion, *source);
    let mut others: Vec<TermStatistics> = prepared.terms.sources.iter().map(measured).collect();
    let camera = others.swap_remove(camera);
    others.push(queries);
    part(&camera, &paths, &others, equal)
}

/// p, as a power of two.
fn part(
    camera: &TermStatistics,
    paths: &TermStatistics,
    others: &[TermStatistics],
    equal: f64,
) -> f64 {
    let value =
        |term: &TermStatistics, q: usize| Real::sqrt(term.variance[q] / (term.rays + BESIDES));
    let need = |q: usize| {
        let most = others.iter().map(|o| value(o, q)).fold(equal * value(paths, q), f64::max);
        // NaN, which is no need, where nothing is noisy.
        value(camera, q) / most
    };
    let wanted = TAKEN * (0..paths.variance.len()).map(need).fold(0.0, f64::max);
    let mut part = 1.0;
    while part > LEAST && wanted <= 0.5 * part {
        part *= 0.5;
    }
    part
}

/// Of paths, and of edge queries from them.
fn along_paths(prepared: &Prepared, motion: &Motion) -> [TermStatistics; 2] {
    let Prepared { world, terms, .. } = prepared;
    let n = motion.parameters();
    let layers = 1 + n * (1 + terms.along_paths(terms.queries).count());
    let [mut one, mut other] = [0, 1].map(|_| alloc::vec![Rgb::ZERO; layers]);
    let mut squares = alloc::vec![0.0; layers];
    let component = prepared.component(Contraction::new(world, motion));
    let mut sampler = PixelSampler::new(world, [component], SEED, terms.antithetic, true);
    let [w, h] = world.camera.film();
    for i in 0..SAMPLES / 2 {
        // Two in a pixel differ by their noise alone.
        let pixel = u64::from(i) * u64::from(w) * u64::from(h) / u64::from(SAMPLES / 2);
        for (k, values) in (0..).zip([&mut one, &mut other]) {
            sampler.sample(pixel as u32, k, SobolSampler::new(SEED as u32 + i, k), values);
        }
        for (sum, (a, b)) in squares.iter_mut().zip(one.iter().zip(&other)) {
            let d = *a - *b;
            *sum += d.dot(d);
        }
    }
    let account = sampler.account();
    let paths = account.counters.paths as f64;
    let per_path = paths / f64::from(SAMPLES);
    let of = |layers: core::ops::Range<usize>, rays: u64, each: f64| {
        let mut variance = alloc::vec![0.0; n];
        for l in layers {
            variance[(l - 1) % n] += each * per_path * squares[l] / f64::from(SAMPLES);
        }
        TermStatistics { variance, rays: rays as f64 / (each * paths), even: false }
    };
    // Those of queries are the last ones, of two terms.
    let (first, each) = match terms.queries.average() {
        Some(queries) => (layers - 2 * n, queries),
        None => (layers, 1.0),
    };
    let rays = if first < layers { account.query_rays } else { 0 };
    [of(1..first, account.counters.rays - rays, 1.0), of(first..layers, rays, each)]
}

/// Of a source of boundary samples.
fn of_source(prepared: &Prepared, motion: &Motion, source: BoundarySource) -> TermStatistics {
    let world = &prepared.world;
    let splatter = prepared.splatter(world, SEED);
    let mut variance = alloc::vec![0.0; motion.parameters()];
    let mut rays = 0;
    // Each pixel is the mean over the samples of all pixels.
    let [w, h] = world.camera.film();
    let pixels = f64::from(w) * f64::from(h);
    let scale = 1.0 / (pixels * pixels * f64::from(SAMPLES));
    for i in 0..SAMPLES {
        let mut sink = Checked::new(ToImages::new(world, motion));
        rays +=
            splatter.run(source, None, source.stream() + u64::from(i), 1, &mut sink).counters.rays;
        let splats = sink.inner.splats.settled();
        for (p, sum) in variance.iter_mut().enumerate() {
            splats.for_each(p, |_, v| *sum += scale * v.dot(v));
        }
    }
    TermStatistics { variance, rays: rays as f64 / f64::from(SAMPLES), even: source.is_even() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn observed(variance: [f64; 2], cost: f64) -> TermStatistics {
        TermStatistics { variance: variance.to_vec(), rays: cost - BESIDES, even: false }
    }

    #[test]
    fn the_neediest_derivative_decides() {
        let paths = observed([1.0, 1.0], 4.0);
        let others = [observed([4.0, 0.1], 4.0), observed([0.0, 0.2], 4.0)];
        let of = |camera: [f64; 2]| part(&observed(camera, 16.0), &paths, &others, 0.5);
        // By one derivative p is √(v / 16) / √(4 / 4), by the other √(v / 16) / √(1 / 16).
        for (camera, expected) in [
            ([0.01, 0.0], 0.25),
            ([63.0, 0.0], 0.5),
            ([65.0, 0.0], 1.0),
            ([0.01, 0.9], 0.25),
            ([0.01, 3.9], 0.5),
            ([0.01, 4.1], 1.0),
        ] {
            let own = of(camera);
            assert_eq!(own, expected, "{camera:?}");
        }
    }

    #[test]
    fn without_other_noise_all_is_taken() {
        let none = observed([0.0; 2], 4.0);
        let of = |camera: [f64; 2]| {
            part(&observed(camera, 16.0), &none, core::slice::from_ref(&none), 0.5)
        };
        assert_eq!(of([1e-9, 0.0]), 1.0);
        // There is nothing to sample.
        assert_eq!(of([0.0; 2]), LEAST);
    }
}
