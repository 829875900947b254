//! Accumulating images with their variance.
//!
//! Two kinds of film. A [`PixelFilm`] takes values that belong to one pixel (each pixel samples its
//! own filter, so pixels are independent). A [`SplatFilm`] takes values that land anywhere, in
//! batches: 32 independent ones a pass, whose scatter gives the variance of every pixel, block and
//! mean with all correlations between pixels in it.
//!
//! Rare events spoil such errors: what saw none of them claims to know its mean exactly. So every
//! standard error of a block or of the whole contains one event more of the layer's typical size
//! Σx² / Σ|x| ([`Events`]), which is lost among many and honest among few.

use alloc::vec::Vec;

use drt_math::{Real, Rgb, RgbMoments};

use crate::rendering::{BLOCKS, Estimate, Layer};

/// Independent batches that a standard error is estimated from.
pub(crate) const BATCHES: usize = 32;

/// Cell of the block grid that a pixel lies in, along one axis of `n` pixels.
fn cell(i: u32, n: u32) -> usize {
    // The cell k with floor(k n / 8) <= i < floor((k + 1) n / 8).
    (0..BLOCKS).rev().find(|k| (*k as u32 * n) / BLOCKS as u32 <= i).unwrap_or(0)
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
#[derive(Clone, Copy, Debug)]
struct Events {
    absolute: Rgb,
    squares: Rgb,
}

impl Events {
    const NONE: Self = Self { absolute: Rgb::ZERO, squares: Rgb::ZERO };

    fn push(&mut self, v: Rgb) {
        self.absolute += v.abs();
        self.squares += v * v;
    }

    fn add(&mut self, o: &Self) {
        self.absolute += o.absolute;
        self.squares += o.squares;
    }

    /// Widens the errors of blocks and total by one event over the samples that each saw.
    fn widen(&self, image: &mut Layer, blocks: &Blocks, per_pixel: f64) {
        let inverse = self.absolute.map(|a| if a > 0.0 { 1.0 / a } else { 0.0 });
        let size = self.squares * inverse;
        let all: u32 = blocks.count.iter().sum();
        let estimates = image.blocks.iter_mut().zip(blocks.count);
        for (e, pixels) in estimates.chain([(&mut image.total, all)]) {
            let one = size * (1.0 / (f64::from(pixels.max(1)) * per_pixel));
            e.stderr = (e.stderr * e.stderr + one * one).map(Real::sqrt);
        }
    }
}

/// Values of some neighbouring pixels, before they are merged into the film.
#[derive(Debug)]
pub(crate) struct Tile {
    /// First pixel (row by row) and one past the last.
    pub(crate) pixels: core::ops::Range<u32>,
    layers: usize,
    moments: Vec<RgbMoments>,
    batches: Vec<BlockSums>,
    events: Vec<Events>,
}

impl Tile {
    pub(crate) fn new(pixels: core::ops::Range<u32>, layers: usize) -> Self {
        let n = pixels.len() * layers;
        Self {
            pixels,
            layers,
            moments: alloc::vec![RgbMoments::default(); n],
            batches: alloc::vec![BlockSums::ZERO; BATCHES * layers],
            events: alloc::vec![Events::NONE; layers],
        }
    }

    /// Adds one sample of a pixel: a value per layer. `unit` counts the pixel's samples.
    pub(crate) fn push(&mut self, blocks: &Blocks, pixel: u32, unit: u32, values: &[Rgb]) {
        let block = blocks.of[pixel as usize];
        let batch = unit as usize % BATCHES;
        let at = (pixel - self.pixels.start) as usize * self.layers;
        for (l, v) in values.iter().enumerate() {
            self.moments[at + l].push(*v);
            self.batches[batch * self.layers + l].add(block, *v);
            self.events[l].push(*v);
        }
    }
}

/// Images whose pixels are sampled one by one.
#[derive(Debug)]
pub(crate) struct PixelFilm {
    size: [u32; 2],
    layers: usize,
    moments: Vec<RgbMoments>,
    batches: Vec<BlockSums>,
    events: Vec<Events>,
    units: u32,
}

impl PixelFilm {
    pub(crate) fn new(size: [u32; 2], layers: usize) -> Self {
        let n = (size[0] * size[1]) as usize * layers;
        Self {
            size,
            layers,
            moments: alloc::vec![RgbMoments::default(); n],
            batches: alloc::vec![BlockSums::ZERO; BATCHES * layers],
            events: alloc::vec![Events::NONE; layers],
            units: 0,
        }
    }

    /// Merges a tile; the order of merging is part of the result's bits.
    pub(crate) fn merge(&mut self, tile: &Tile) {
        let at = tile.pixels.start as usize * self.layers;
        for (m, t) in self.moments[at..].iter_mut().zip(&tile.moments) {
            m.merge(t);
        }
        for (b, t) in self.batches.iter_mut().zip(&tile.batches) {
            for (s, v) in b.0.iter_mut().zip(&t.0) {
                *s += *v;
            }
        }
        for (e, t) in self.events.iter_mut().zip(&tile.events) {
            e.add(t);
        }
    }

    /// Counts samples that every pixel has received.
    pub(crate) fn advance(&mut self, units: u32) {
        self.units += units;
    }

    pub(crate) fn units(&self) -> u32 {
        self.units
    }

    /// The first layer of some pixels.
    pub(crate) fn estimates(&self, pixels: core::ops::Range<u32>) -> Vec<Estimate> {
        let of = |i: u32| {
            let m = &self.moments[i as usize * self.layers];
            Estimate { mean: m.mean(), stderr: m.standard_error() }
        };
        pixels.map(of).collect()
    }

    /// One layer as an image.
    pub(crate) fn layer(&self, l: usize, blocks: &Blocks) -> Layer {
        let pixels: Vec<Estimate> = self
            .moments
            .iter()
            .skip(l)
            .step_by(self.layers)
            .map(|m| Estimate { mean: m.mean(), stderr: m.standard_error() })
            .collect();
        let mut image = Layer::from_pixels(self.size, pixels, blocks);
        if self.units as usize >= BATCHES {
            self.batch_errors(l, blocks, &mut image);
        }
        self.events[l].widen(&mut image, blocks, f64::from(self.units.max(1)));
        image
    }

    /// Replaces the block errors from independent pixels by those from batches.
    fn batch_errors(&self, l: usize, blocks: &Blocks, image: &mut Layer) {
        let full = self.units / BATCHES as u32;
        let rest = self.units as usize % BATCHES;
        let all: u32 = blocks.count.iter().sum();
        for k in 0..=BLOCKS * BLOCKS {
            let pixels = blocks.count.get(k).copied().unwrap_or(all);
            if pixels == 0 {
                continue;
            }
            let mut m = RgbMoments::default();
            for b in 0..BATCHES {
                let units = full + u32::from(b < rest);
                let n = f64::from(pixels) * f64::from(units);
                m.push(self.batches[b * self.layers + l].0[k] * (1.0 / n));
            }
            let e = if k < BLOCKS * BLOCKS { &mut image.blocks[k] } else { &mut image.total };
            e.stderr = m.standard_error();
        }
    }
}

/// One batch of a splatted term: a sum per pixel and layer.
#[derive(Debug)]
pub(crate) struct Splats {
    layers: Vec<Vec<Rgb>>,
    events: Vec<Events>,
}

impl Splats {
    pub(crate) fn new(size: [u32; 2], layers: usize) -> Self {
        let n = (size[0] * size[1]) as usize;
        Self {
            layers: alloc::vec![alloc::vec![Rgb::ZERO; n]; layers],
            events: alloc::vec![Events::NONE; layers],
        }
    }

    pub(crate) fn add(&mut self, layer: usize, pixel: u32, v: Rgb) {
        self.layers[layer][pixel as usize] += v;
        self.events[layer].push(v);
    }
}

/// Images whose samples land anywhere.
#[derive(Debug)]
pub(crate) struct SplatFilm {
    size: [u32; 2],
    /// Samples of all finished passes.
    weight: f64,
    layers: Vec<SplatLayer>,
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
        Self { size, weight: 0.0, layers: alloc::vec![layer; layers] }
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
            for (i, v) in image.iter().enumerate() {
                let v = *v * scale;
                sum[i] += v;
                squares[i] += v * v;
                sums.add(blocks.of[i], v);
            }
            for (k, s) in sums.0.iter().enumerate() {
                let pixels = blocks.count.get(k).copied().unwrap_or(all);
                let v = *s * (1.0 / f64::from(pixels.max(1)));
                sum[image.len() + k] += v;
                squares[image.len() + k] += v * v;
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
            pixels,
        }
    }

    /// The sum of two independent estimates.
    pub(crate) fn plus(mut self, other: &Self) -> Self {
        let add = |a: &mut Estimate, b: &Estimate| {
            a.mean += b.mean;
            a.stderr = (a.stderr * a.stderr + b.stderr * b.stderr).map(Real::sqrt);
        };
        for (a, b) in self.pixels.iter_mut().zip(&other.pixels) {
            add(a, b);
        }
        for (a, b) in self.blocks.iter_mut().zip(&other.blocks) {
            add(a, b);
        }
        add(&mut self.total, &other.total);
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
        let mut tile = Tile::new(0..64, 1);
        for unit in 0..units {
            for pixel in 0..64 {
                let seen = pixel == 5 && unit == 7;
                let value = if seen { -3.0 } else { 0.0 };
                tile.push(&blocks, pixel, unit, &[Rgb::splat(value)]);
            }
        }
        film.merge(&tile);
        film.advance(units);
        let image = film.layer(0, &blocks);
        let one = 3.0 / f64::from(units);
        assert!((image.blocks[40].stderr.g - one).abs() < 1e-12);
        assert!(image.blocks[5].stderr.g > 1.3 * one);
        assert!((image.blocks[5].mean.g + one).abs() < 1e-12);
    }
}
