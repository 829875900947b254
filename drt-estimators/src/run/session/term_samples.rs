//! Variance and cost of the terms of a derivative, from a few samples of each.
//!
//! The samples are those that the run itself would take: of its film, its edges and its media. Paths come in pairs within
//! a pixel, which differ by their noise alone. Samples come in batches of fixed size with random numbers of their own, so that
//! batches may be taken on any thread, and their scatter tells how far what they say can be trusted. They have no part in images.

use alloc::vec::Vec;
use core::ops::Range;

use drt_math::Rgb;
use drt_math::sobol::SobolSampler;

use crate::derivative::contraction::{Contraction, Motion};
use crate::model::rendering::Counters;
use crate::run::component::Component;
use crate::sampling::budget::{BESIDES, LOOKUP, TermStatistics};
use crate::sampling::film::block_of;
use crate::sampling::parallel::Pool;
use crate::sampling::pixels::Sampler;
use crate::sampling::streams::sequence_name;
use crate::terms::boundary_source::BoundarySource;
use crate::terms::interior::PixelSampler;
use crate::terms::prepared::Prepared;
use crate::terms::splatting::{Checked, ToImages};

/// Paths of a batch, and samples of each kind that lands anywhere in the first [`FULL`] batches.
pub(super) const BATCH: u32 = 32;

/// Batches with as many boundary samples of each kind as paths. Later ones have a [part](PART) of them, as runs do.
pub(super) const FULL: u32 = 8;
const PART: u32 = 2;

/// The seed of all batches: the same whatever samples a run takes.
const SEED: u64 = 0x7363_6f75_7473;

/// The costs in rays, as measured on the scenes of the examples, of an edge that turns a ray, of a point of the flux, of
/// differentiating at a vertex of a path, and of choosing an edge that a vertex sees.
const TURNING_EDGE: f64 = 1.0;
const FLUX_SAMPLE: f64 = 12.0;
const VERTEX: f64 = 0.25;
const QUERY: f64 = 4.0;

/// What a sample of a term of one component brings and costs.
#[derive(Clone, Debug)]
pub(super) struct TermSamples {
    pub(super) pixels: TermStatistics,
    /// The variance of one sample per derivative, where the pixels of a block are added up.
    pub(super) blocks: Vec<f64>,
    /// The cost of one sample, in rays, and of all of them.
    pub(super) cost: f64,
    pub(super) spent: f64,
}

/// A batch of samples of the terms of a component: its paths, its edge queries, and its sources of boundary samples in
/// their order.
pub(super) type Batch = Vec<TermSamples>;

/// Takes some batches.
pub(super) fn batches(component: &Component<Motion>, which: Range<u32>, pool: &Pool) -> Vec<Batch> {
    let Component { prepared, unknowns: motion, .. } = component;
    let mut taken = Vec::new();
    let work = |b| {
        let sources = prepared.terms.sources.iter().map(|s| of_source(prepared, motion, *s, b));
        along_paths(prepared, motion, b).into_iter().chain(sources).collect::<Batch>()
    };
    pool.ordered(which, 4, work, |_, batch| {
        taken.push(batch);
        true
    });
    taken
}

/// Samples that a run takes of each of these terms to a path.
pub(super) fn ratios(prepared: &Prepared) -> impl Iterator<Item = f64> {
    let queries = prepared.terms.queries.average().unwrap_or(1.0);
    let sources = (0..prepared.terms.sources.len()).map(|i| prepared.source_ratio(i));
    [1.0, queries].into_iter().chain(sources)
}

/// What was done, in rays.
pub(super) fn cost(counters: &Counters) -> f64 {
    let boundary = counters.boundary_samples + counters.border_samples;
    counters.rays as f64
        + LOOKUP * counters.tracking_steps as f64
        + TURNING_EDGE * counters.turning_edges as f64
        + FLUX_SAMPLE * counters.flux_samples as f64
        + VERTEX * counters.recorded_vertices as f64
        + BESIDES * boundary as f64
}

/// Samples paths, and edge queries from them.
fn along_paths(prepared: &Prepared, motion: &Motion, batch: u32) -> [TermSamples; 2] {
    let Prepared { world, terms, .. } = prepared;
    let n = motion.parameters();
    let layers = 1 + n * (1 + terms.along_paths(terms.queries).count());
    // Those of queries are the last ones, of two terms.
    let (first_query, each) = match terms.queries.average() {
        Some(queries) => (layers - 2 * n, queries),
        None => (layers, 1.0),
    };
    let [mut one, mut other] = [0, 1].map(|_| alloc::vec![Rgb::ZERO; layers]);
    let [mut paths, mut queries] = [0, 1].map(|_| alloc::vec![0.0; n]);
    let component = prepared.component(Contraction::new(world, motion));
    let mut sampler = PixelSampler::new(world, [component], SEED, terms.antithetic, true)
        .with_light_paths(terms.emission.as_ref());
    for pair in batch * BATCH / 2..(batch + 1) * BATCH / 2 {
        let pixel = pixel(pair, world.camera.film());
        for (k, values) in (2 * pair..).zip([&mut one, &mut other]) {
            let points = SobolSampler::new(sequence_name(SEED, pixel, k), 0);
            sampler.sample(pixel, k, points, values);
        }
        let add = |squares: &mut [f64], layers: Range<usize>| {
            for (p, square) in squares.iter_mut().enumerate() {
                let layers = layers.clone().skip(p).step_by(n);
                let d = layers.fold(Rgb::ZERO, |d, l| d + one[l] - other[l]);
                *square += d.dot(d);
            }
        };
        add(&mut paths, 1..first_query);
        add(&mut queries, first_query..layers);
    }
    let account = sampler.account();
    let samples = account.counters.paths as f64;
    let of = |squares: Vec<f64>, rays: u64, work: f64, each: f64| {
        // Half the square of a difference is a variance, and there are half as many of them as samples.
        let scale = each * samples / f64::from(BATCH * BATCH);
        let variance: Vec<f64> = squares.iter().map(|s| s * scale).collect();
        TermSamples {
            blocks: variance.clone(),
            pixels: TermStatistics { variance, rays: rays as f64 / (each * samples), even: false },
            cost: work / (each * samples),
            spent: work,
        }
    };
    let all = cost(&account.counters);
    if first_query == layers {
        return [of(paths, account.counters.rays, all, 1.0), of(queries, 0, 0.0, each)];
    }
    let rays = account.query_rays;
    let of_queries = rays as f64 + QUERY * each * samples;
    [
        of(paths, account.counters.rays - rays, all - rays as f64, 1.0),
        of(queries, rays, of_queries, each),
    ]
}

/// Samples a source of boundary samples.
fn of_source(
    prepared: &Prepared,
    motion: &Motion,
    source: BoundarySource,
    batch: u32,
) -> TermSamples {
    let world = &prepared.world;
    let splatter = prepared.splatter(world, SEED);
    let [mut pixels, mut blocks] = [0, 1].map(|_| alloc::vec![0.0; motion.parameters()]);
    let (mut rays, mut work) = (0, 0.0);
    let film = world.camera.film();
    let samples = if batch < FULL { BATCH } else { BATCH / PART };
    for k in batch * BATCH..batch * BATCH + samples {
        let mut sink = Checked::new(ToImages::new(world, motion));
        let account = splatter.run(source, None, source.stream() + u64::from(k), 1, &mut sink);
        rays += account.counters.rays;
        work += cost(&account.counters);
        let splats = sink.inner.splats.settled();
        for (p, (pixels, blocks)) in pixels.iter_mut().zip(&mut blocks).enumerate() {
            let mut of_blocks: Vec<(usize, Rgb)> = Vec::new();
            splats.for_each(p, |pixel, v| {
                *pixels += v.dot(v);
                let block = block_of(pixel as u32, film);
                match of_blocks.iter_mut().find(|(b, _)| *b == block) {
                    Some((_, sum)) => *sum += v,
                    None => of_blocks.push((block, v)),
                }
            });
            *blocks += of_blocks.iter().map(|(_, v)| v.dot(*v)).sum::<f64>();
        }
    }
    // Each pixel is the mean over the samples of all pixels.
    let count = f64::from(film[0]) * f64::from(film[1]);
    let samples = f64::from(samples);
    let mean = |squares: Vec<f64>| -> Vec<f64> {
        squares.iter().map(|s| s / (count * count * samples)).collect()
    };
    let (variance, blocks) = (mean(pixels), mean(blocks));
    let pixels = TermStatistics { variance, rays: rays as f64 / samples, even: source.is_even() };
    TermSamples { pixels, blocks, cost: work / samples, spent: work }
}

/// A pixel of a sequence that covers the film evenly however many are taken.
fn pixel(index: u32, [w, h]: [u32; 2]) -> u32 {
    // The golden ratio, as a part of 2^64.
    let part = u64::from(index).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
    ((part * u64::from(w) * u64::from(h)) >> 32) as u32
}
