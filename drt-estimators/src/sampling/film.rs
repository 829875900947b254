//! Accumulating images with their variance.
//!
//! Two kinds of film. A [`PixelFilm`] takes values that belong to one pixel: each pixel samples its
//! own filter, so pixels are independent, and their variances add up to those of blocks and of the
//! mean. Its first layer, the image, may be [`splatted`](PixelFilm::splatted) instead: then every sample counts
//! for all the pixels whose filters reach it. A [`SplatFilm`] takes values that land anywhere, in batches: 32 independent ones a pass,
//! whose scatter gives the variance of every pixel, block and mean with all correlations between
//! pixels in it.
//!
//! Rare events spoil such errors: what saw none of them claims to know its mean exactly. So every
//! standard error of a block or of the whole contains one event more of the layer's typical size
//! Σx² / Σ|x| ([`Events`]), which is lost among many and honest among few. How much of Σx² the largest event is tells
//! whether the second moment has settled at all ([`Tail`]).

mod splats;
mod splatting;
mod strata;
mod sums;

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_math::{Real, Rgb};

pub(crate) use crate::sampling::film::splats::Splats;
pub(crate) use crate::sampling::film::splatting::{Raster, Splat, SplatDensity, SplatTile};
pub(crate) use crate::sampling::film::strata::Stratum;

use crate::model::rendering::{BLOCKS, Estimate, Layer, Tail};
use crate::sampling::film::splatting::SplattedImage;
use crate::sampling::film::sums::RunSums;

/// Independent batches that the standard error of a splatted term is estimated from.
pub(crate) const BATCHES: usize = 32;

/// Cell of the block grid that a pixel lies in, along one axis of `n` pixels.
fn cell(i: u32, n: u32) -> usize {
    // The cell k with floor(k n / 8) <= i < floor((k + 1) n / 8).
    (0..BLOCKS).rev().find(|k| (*k as u32 * n) / BLOCKS as u32 <= i).unwrap_or(0)
}

/// The block that a pixel belongs to.
pub(crate) fn block_of(pixel: u32, [w, h]: [u32; 2]) -> usize {
    cell(pixel / w, h) * BLOCKS + cell(pixel % w, w)
}

/// Block of each pixel, and pixels per block.
#[derive(Clone, Debug)]
pub(crate) struct Blocks {
    of: Vec<u8>,
    count: [u32; BLOCKS * BLOCKS],
}

impl Blocks {
    pub(crate) fn new([w, h]: [u32; 2]) -> Self {
        let mut count = [0; BLOCKS * BLOCKS];
        let mut of = Vec::with_capacity((w * h) as usize);
        for y in 0..h {
            for x in 0..w {
                let b = cell(y, h) * BLOCKS + cell(x, w);
                count[b] += 1;
                of.push(b as u8);
            }
        }
        Self { of, count }
    }
}

/// Sums over the blocks of an image, and over all of it.
#[derive(Clone, Debug)]
struct BlockSums([Rgb; BLOCKS * BLOCKS + 1]);

impl BlockSums {
    const ZERO: Self = Self([Rgb::ZERO; BLOCKS * BLOCKS + 1]);

    fn add(&mut self, block: u8, v: Rgb) {
        self.0[block as usize] += v;
        self.0[BLOCKS * BLOCKS] += v;
    }
}

/// Sizes of a layer's contributions.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Events {
    absolute: Rgb,
    squares: Rgb,
    /// The largest square.
    largest: Rgb,
}

impl Events {
    const NONE: Self = Self { absolute: Rgb::ZERO, squares: Rgb::ZERO, largest: Rgb::ZERO };

    fn push(&mut self, v: Rgb) {
        self.absolute += v.abs();
        let square = v * v;
        self.squares += square;
        self.largest = self.largest.max(square);
    }

    fn add(&mut self, o: &Self) {
        self.absolute += o.absolute;
        self.squares += o.squares;
        self.largest = self.largest.max(o.largest);
    }

    /// Widens the errors of blocks and total by one event over the samples that each saw, and notes how much of the second
    /// moment of the total the largest event is.
    fn widen(&self, image: &mut Layer, blocks: &Blocks, per_pixel: f64) {
        let inverse = self.absolute.map(|a| if a > 0.0 { 1.0 / a } else { 0.0 });
        let size = self.squares * inverse;
        let all: u32 = blocks.count.iter().sum();
        let estimates = image.blocks.iter_mut().zip(blocks.count);
        for (e, pixels) in estimates.chain([(&mut image.total, all)]) {
            let one = size * (1.0 / (f64::from(pixels.max(1)) * per_pixel));
            e.stderr = (e.stderr * e.stderr + one * one).map(Real::sqrt);
        }
        let of_mean = 1.0 / (f64::from(all.max(1)) * per_pixel);
        let [second_moment, largest] =
            [self.squares, self.largest].map(|square| square * (of_mean * of_mean));
        image.tail = Tail { second_moment, largest };
    }
}

/// Sums over some neighbouring pixels, before they are merged into the film.
#[derive(Debug)]
pub(crate) struct Tile {
    /// First pixel, row by row.
    start: u32,
    layers: usize,
    sums: Vec<Rgb>,
    events: Vec<Events>,
}

impl Tile {
    pub(crate) fn new(pixels: core::ops::Range<u32>, layers: usize) -> Self {
        Self {
            start: pixels.start,
            layers,
            sums: alloc::vec![Rgb::ZERO; pixels.len() * layers],
            events: alloc::vec![Events::NONE; layers],
        }
    }

    /// Adds one sample of a pixel: a value per layer.
    pub(crate) fn push(&mut self, pixel: u32, values: &[Rgb]) {
        let at = (pixel - self.start) as usize * self.layers;
        for ((sum, event), v) in self.sums[at..].iter_mut().zip(&mut self.events).zip(values) {
            *sum += *v;
            event.push(*v);
        }
    }
}

/// Images whose pixels are sampled one by one.
///
/// Values of pixels are added up in runs ([`RunSums`]). Where the first layer, the image, is
/// [splatted](crate::sampling::film::splatting), pixels have samples in common.
#[derive(Debug, Default)]
pub(crate) struct PixelFilm {
    size: [u32; 2],
    layers: usize,
    /// Layer by layer of each pixel; of the first one nothing where that is splatted.
    sums: RunSums,
    events: Vec<Events>,
    /// Of the stratum that has not ended.
    open_events: Vec<Events>,
    raster: Option<Arc<Raster>>,
    image: Option<SplattedImage>,
    /// Strata that are kept apart, by their number.
    kept: Vec<(u32, Stratum)>,
}

/// What ends with some samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ends {
    Nothing,
    Stratum,
    /// And its last stratum.
    Run,
}

impl PixelFilm {
    pub(crate) fn new(size: [u32; 2], layers: usize) -> Self {
        Self {
            size,
            layers,
            sums: RunSums::new((size[0] * size[1]) as usize * layers),
            events: alloc::vec![Events::NONE; layers],
            open_events: alloc::vec![Events::NONE; layers],
            raster: None,
            image: None,
            kept: Vec::new(),
        }
    }

    /// Of a camera's film, whose first layer is splatted.
    pub(crate) fn splatted(raster: Raster, layers: usize) -> Self {
        let film = Self::of_strata(raster.size(), layers, true);
        Self { raster: Some(Arc::new(raster)), ..film }
    }

    /// For strata that were kept, of films whose first layer was splatted or not.
    pub(crate) fn of_strata(size: [u32; 2], layers: usize, splatted: bool) -> Self {
        let image = splatted.then(|| SplattedImage::new(size));
        Self { image, ..Self::new(size, layers) }
    }

    pub(crate) fn size(&self) -> [u32; 2] {
        self.size
    }

    pub(crate) fn layers(&self) -> usize {
        self.layers
    }

    /// Where splats of the first layer go, if it is made of such.
    pub(crate) fn raster(&self) -> Option<&Arc<Raster>> {
        self.raster.as_ref()
    }

    /// Samples that every pixel has received.
    pub(crate) fn units(&self) -> u32 {
        self.sums.units()
    }

    /// Forgets all samples.
    pub(crate) fn clear(&mut self) {
        self.sums.clear();
        self.kept.clear();
        self.events.fill(Events::NONE);
        self.open_events.fill(Events::NONE);
        if let Some(image) = &mut self.image {
            image.clear();
        }
    }

    /// Begins a pass.
    pub(crate) fn begin(&mut self) {
        self.end_events();
        self.sums.begin();
        if let Some(image) = &mut self.image {
            image.begin();
        }
    }

    /// Takes in what a tile has splatted, which is added with the next samples that are counted; the order is part
    /// of the result's bits.
    pub(crate) fn splat(&mut self, tile: &SplatTile) {
        if let Some(image) = &mut self.image {
            image.add(tile);
        }
    }

    /// Merges a tile; the order of merging is part of the result's bits.
    pub(crate) fn merge(&mut self, tile: &Tile) {
        self.sums.add_from(tile.start as usize * self.layers, &tile.sums);
        for (e, t) in self.open_events.iter_mut().zip(&tile.events) {
            e.add(t);
        }
    }

    /// Counts samples that every pixel has received, and what ends with them.
    pub(crate) fn advance(&mut self, units: u32, ends: Ends) {
        if let Some(image) = &mut self.image {
            image.advance(units, ends);
        }
        self.sums.advance(units, ends);
        if ends != Ends::Nothing {
            self.end_events();
        }
    }

    fn end_events(&mut self) {
        for (e, open) in self.events.iter_mut().zip(&mut self.open_events) {
            e.add(&core::mem::replace(open, Events::NONE));
        }
    }

    /// Instead of counting samples, keeps the stratum that ends with them apart, under a number.
    pub(crate) fn keep(&mut self, number: u32, ends: Ends) {
        let image = self.image.as_mut().map(|image| image.keep(ends));
        if ends == Ends::Nothing {
            return;
        }
        let events =
            core::mem::replace(&mut self.open_events, alloc::vec![Events::NONE; self.layers]);
        let stratum = Stratum { sums: self.sums.take_open(), events, image: image.flatten() };
        self.kept.push((number, stratum));
    }

    /// The strata that were kept.
    pub(crate) fn take_kept(&mut self) -> Vec<(u32, Stratum)> {
        core::mem::take(&mut self.kept)
    }

    /// Adds a stratum that was kept, to the current run.
    pub(crate) fn put_back(&mut self, stratum: &Stratum, units: u32) {
        if let (Some(image), Some(sums)) = (&mut self.image, &stratum.image) {
            image.put_back(sums);
        }
        self.sums.add(&stratum.sums);
        for (e, s) in self.open_events.iter_mut().zip(&stratum.events) {
            e.add(s);
        }
        self.advance(units, Ends::Stratum);
    }

    /// Forgets a run that was not finished.
    pub(crate) fn abandon_run(&mut self) {
        if let Some(image) = &mut self.image {
            image.abandon_run();
        }
        self.sums.abandon_run();
        self.open_events.fill(Events::NONE);
    }

    /// Ends the current run, unless it has no samples.
    pub(crate) fn end_run(&mut self) {
        if let Some(image) = &mut self.image {
            image.end_run();
        }
        self.sums.end_run();
    }

    /// One of a pixel's layers.
    pub(crate) fn estimate(&self, pixel: usize, layer: usize) -> Estimate {
        match &self.image {
            Some(image) if layer == 0 => image.estimate(pixel),
            _ => self.sums.estimate(pixel * self.layers + layer),
        }
    }

    /// The variance of a pixel's mean in one layer, averaged over colours.
    pub(crate) fn variance(&self, pixel: u32, layer: usize) -> f64 {
        let stderr = self.estimate(pixel as usize, layer).stderr;
        (stderr * stderr).mean()
    }

    /// One layer as an image.
    pub(crate) fn layer(&self, l: usize, blocks: &Blocks) -> Layer {
        if let Some(splatted) = self.image.as_ref().filter(|_| l == 0) {
            return splatted.layer(blocks);
        }
        let entries = (l..self.sums.len()).step_by(self.layers);
        let pixels = entries.map(|i| self.sums.estimate(i)).collect();
        let mut image = Layer::from_pixels(self.size, pixels, blocks);
        let mut events = self.events[l];
        events.add(&self.open_events[l]);
        events.widen(&mut image, blocks, f64::from(self.units().max(1)));
        image
    }
}

/// Images whose samples land anywhere.
#[derive(Debug, Default)]
pub(crate) struct SplatFilm {
    size: [u32; 2],
    /// Samples of all finished passes.
    weight: f64,
    layers: Vec<SplatLayer>,
    /// Batches that are kept apart, by their number.
    kept: Vec<(u32, Splats)>,
}

/// Σ N mean and Σ N² variance over passes of N samples; the last entries are blocks and total.
#[derive(Clone, Debug)]
struct SplatLayer {
    sum: Vec<Rgb>,
    variance: Vec<Rgb>,
    events: Events,
}

/// A pass in progress: sums and sums of squares over batches.
#[derive(Debug)]
pub(crate) struct SplatPass {
    batches: u32,
    layers: Vec<(Vec<Rgb>, Vec<Rgb>)>,
    events: Vec<Events>,
}

impl SplatFilm {
    pub(crate) fn new(size: [u32; 2], layers: usize) -> Self {
        let n = (size[0] * size[1]) as usize + BLOCKS * BLOCKS + 1;
        let zero = alloc::vec![Rgb::ZERO; n];
        let layer = SplatLayer { sum: zero.clone(), variance: zero, events: Events::NONE };
        Self { size, weight: 0.0, layers: alloc::vec![layer; layers], kept: Vec::new() }
    }

    /// Forgets all samples.
    pub(crate) fn clear(&mut self) {
        self.weight = 0.0;
        self.kept.clear();
        for layer in &mut self.layers {
            layer.sum.fill(Rgb::ZERO);
            layer.variance.fill(Rgb::ZERO);
            layer.events = Events::NONE;
        }
    }

    /// Keeps a batch apart, under a number.
    pub(crate) fn keep(&mut self, number: u32, batch: Splats) {
        self.kept.push((number, batch));
    }

    /// The batches that were kept.
    pub(crate) fn take_kept(&mut self) -> Vec<(u32, Splats)> {
        core::mem::take(&mut self.kept)
    }

    /// Samples so far.
    pub(crate) fn samples(&self) -> f64 {
        self.weight
    }

    /// The variance of one layer's pixels, averaged over them and over colours.
    pub(crate) fn variance(&self, l: usize) -> f64 {
        let pixels = (self.size[0] * self.size[1]) as usize;
        let sum: f64 = self.layers[l].variance[..pixels].iter().map(|v| v.mean()).sum();
        sum / (pixels as f64 * self.weight * self.weight)
    }

    pub(crate) fn begin(&self) -> SplatPass {
        let zero = alloc::vec![Rgb::ZERO; self.layers.first().map_or(0, |l| l.sum.len())];
        let layers = alloc::vec![(zero.clone(), zero); self.layers.len()];
        SplatPass { batches: 0, events: alloc::vec![Events::NONE; layers.len()], layers }
    }

    /// Ends a pass of `samples` samples in all.
    pub(crate) fn finish(&mut self, pass: &SplatPass, samples: f64) {
        let n = f64::from(pass.batches);
        if n < 2.0 || samples == 0.0 {
            return;
        }
        self.weight += samples;
        for (layer, events) in self.layers.iter_mut().zip(&pass.events) {
            layer.events.add(events);
        }
        for (layer, (sum, squares)) in self.layers.iter_mut().zip(&pass.layers) {
            for i in 0..sum.len() {
                let mean = sum[i] * (1.0 / n);
                // Of the mean over batches.
                let variance = (squares[i] * (1.0 / n) - mean * mean) * (1.0 / (n - 1.0));
                layer.sum[i] += mean * samples;
                layer.variance[i] += variance.map(|v| f64::max(v, 0.0)) * (samples * samples);
            }
        }
    }

    /// One layer as an image.
    pub(crate) fn layer(&self, l: usize, blocks: &Blocks) -> Layer {
        let n = (self.size[0] * self.size[1]) as usize;
        let scale = if self.weight > 0.0 { 1.0 / self.weight } else { 0.0 };
        let estimate = |i: usize| Estimate {
            mean: self.layers[l].sum[i] * scale,
            stderr: (self.layers[l].variance[i] * (scale * scale)).map(Real::sqrt),
        };
        let mut image = Layer {
            size: self.size,
            pixels: (0..n).map(estimate).collect(),
            blocks: (n..n + BLOCKS * BLOCKS).map(estimate).collect(),
            total: estimate(n + BLOCKS * BLOCKS),
            tail: Tail::default(),
        };
        // A sample is one of all that were spread over the film.
        self.layers[l].events.widen(&mut image, blocks, f64::max(self.weight, 1.0));
        image
    }
}

impl SplatPass {
    /// Adds a batch of `samples` samples, each a sum over what it splatted.
    pub(crate) fn add(&mut self, batch: &Splats, samples: f64, blocks: &Blocks) {
        self.batches += 1;
        let scale = 1.0 / samples;
        let all: u32 = blocks.count.iter().sum();
        for (e, b) in self.events.iter_mut().zip(&batch.events) {
            e.add(b);
        }
        for ((sum, squares), image) in self.layers.iter_mut().zip(&batch.layers) {
            let mut sums = BlockSums::ZERO;
            image.for_each(|i, v| {
                let v = v * scale;
                sum[i] += v;
                squares[i] += v * v;
                sums.add(blocks.of[i], v);
            });
            for (k, s) in sums.0.iter().enumerate() {
                let pixels = blocks.count.get(k).copied().unwrap_or(all);
                let v = *s * (1.0 / f64::from(pixels.max(1)));
                sum[blocks.of.len() + k] += v;
                squares[blocks.of.len() + k] += v * v;
            }
        }
    }
}

impl Layer {
    /// An image of independent pixels.
    pub(crate) fn from_pixels(size: [u32; 2], pixels: Vec<Estimate>, blocks: &Blocks) -> Self {
        let mut mean = BlockSums::ZERO;
        let mut variance = BlockSums::ZERO;
        for (p, b) in pixels.iter().zip(&blocks.of) {
            mean.add(*b, p.mean);
            variance.add(*b, p.stderr * p.stderr);
        }
        let estimate = |k: usize, n: u32| {
            let scale = 1.0 / f64::from(n.max(1));
            Estimate { mean: mean.0[k] * scale, stderr: variance.0[k].map(Real::sqrt) * scale }
        };
        let all: u32 = blocks.count.iter().sum();
        Self {
            size,
            blocks: (0..BLOCKS * BLOCKS).map(|k| estimate(k, blocks.count[k])).collect(),
            total: estimate(BLOCKS * BLOCKS, all),
            tail: Tail::default(),
            pixels,
        }
    }

    /// The sum of two independent estimates.
    pub(crate) fn plus(mut self, other: &Self) -> Self {
        let own = self.pixels.iter_mut().chain(&mut self.blocks);
        for (a, b) in own.zip(other.pixels.iter().chain(&other.blocks)) {
            *a = a.plus(b);
        }
        self.total = self.total.plus(&other.total);
        self.tail = self.tail.plus(&other.tail);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block that saw nothing is as uncertain as one event among its samples.
    #[test]
    fn errors_hold_one_event_more() {
        let (size, units) = ([8, 8], 64);
        let blocks = Blocks::new(size);
        let mut film = PixelFilm::new(size, 1);
        film.begin();
        for unit in 0..units {
            let mut tile = Tile::new(0..64, 1);
            for pixel in 0..64 {
                let seen = pixel == 5 && unit == 7;
                tile.push(pixel, &[Rgb::splat(if seen { -3.0 } else { 0.0 })]);
            }
            film.merge(&tile);
            film.advance(1, Ends::Run);
        }
        let image = film.layer(0, &blocks);
        let one = 3.0 / f64::from(units);
        assert!((image.blocks[40].stderr.g - one).abs() < 1e-12);
        assert!(image.blocks[5].stderr.g > 1.3 * one);
        assert!((image.blocks[5].mean.g + one).abs() < 1e-12);
    }
    /// Values of a pixel in passes, as a film sees them and as a plain list.
    fn filled(passes: &[&[&[f64]]]) -> (PixelFilm, f64) {
        let mut film = PixelFilm::new([1, 1], 1);
        let (mut sum, mut count) = (0.0, 0.0);
        for pass in passes {
            film.begin();
            for run in *pass {
                for x in *run {
                    let mut tile = Tile::new(0..1, 1);
                    tile.push(0, &[Rgb::splat(*x)]);
                    film.merge(&tile);
                    let last = core::ptr::eq(x, &run[run.len() - 1]);
                    film.advance(1, if last { Ends::Run } else { Ends::Stratum });
                    (sum, count) = (sum + x, count + 1.0);
                }
            }
        }
        (film, sum / count)
    }

    #[test]
    fn means_are_of_all_samples_and_errors_of_runs() {
        let (film, mean) = filled(&[&[&[1.0, 3.0], &[4.0, 2.0], &[0.0, 8.0]]]);
        let e = film.sums.estimate(0);
        assert_eq!(film.units(), 6);
        assert!((e.mean.g - mean).abs() < 1e-15);
        // Means of runs are 2, 3, 4: their variance is 1, that of their mean 1/3.
        assert!((e.stderr.g - f64::sqrt(1.0 / 3.0)).abs() < 1e-7);

        // A pass of a single run adds to the mean, and is as uncertain as the others.
        let (film, mean) = filled(&[&[&[7.0, 1.0]], &[&[1.0, 3.0], &[4.0, 2.0], &[0.0, 8.0]]]);
        let e = film.sums.estimate(0);
        assert!((e.mean.g - mean).abs() < 1e-15);
        assert!((e.stderr.g - f64::sqrt(1.0 / 3.0 * 6.0 / 8.0)).abs() < 1e-7);

        // Passes of 2 and 4 samples with variances 4 and 1/4 of their means.
        let (film, _) = filled(&[&[&[1.0], &[5.0]], &[&[1.0, 2.0], &[2.0, 3.0]]]);
        let expected = f64::sqrt((4.0 * 4.0 + 16.0 * 0.25) / 36.0);
        assert!((film.sums.estimate(0).stderr.g - expected).abs() < 1e-7);
    }

    #[test]
    fn single_samples_have_no_error_bar() {
        let (film, _) = filled(&[&[&[1.0]], &[&[5.0]]]);
        assert_eq!(film.sums.estimate(0).mean.g, 3.0);
        assert_eq!(film.sums.estimate(0).stderr.g, f64::INFINITY);
    }
}
