//! An image whose samples count for every pixel that they reach.
//!
//! With N samples of each stratum s (the paths of a pixel), of which sample k puts the light f at the image point q,
//! which has the density p per square pixel among the stratum's samples, or all strata's together, pixel i is
//!
//! ```text
//! I_i = (1/N) Σ_s Σ_k P_i(q) f / p,      P_i the pixel's filter.
//! ```
//!
//! That has the right mean for any N. Its weights add up to 1 on average only: dividing by their sum would take out what
//! noise they have, at the price of a bias of order 1/N and of sums that can't be merged with others. As points
//! are even in each square, that noise is small: for 16 points under a tent its variance is 0.0024 f² / 16, a 180th of that of
//! paths whose standard deviation is f.
//!
//! A [`Splat`] is a point of the image and what arrives there over its density. Whether a pixel's own path
//! puts it there or a connection of a light path to the camera makes no difference: its stratum is that of the random numbers
//! behind it. Splats are added up on a [`SplatTile`], on any thread, and tiles in a fixed order on the film.
//!
//! Errors: the sums of a run are independent of those of another, so that the scatter of runs is an honest error of a
//! pixel, with all that pixels have in common. For blocks and the whole there are few runs, but many strata: these are
//! dealt to [`GROUPS`] groups, independent of each other, whose variances add up.

#[cfg(all(test, feature = "std"))]
mod tests;

use alloc::sync::Arc;
use alloc::vec::Vec;
use core::ops::Range;

use drt_math::{Real, Rgb, fm};

use crate::model::filter::Filter;
use crate::model::rendering::{BLOCKS, Layer};
use crate::sampling::film::sums::RunSums;
use crate::sampling::film::{Blocks, Events, cell};

/// Groups of strata along one axis.
const GROUPS: u32 = 8;

/// Sums of a group: blocks, and the whole.
const SUMS: usize = BLOCKS * BLOCKS + 1;

/// What a sample puts on the image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Splat {
    /// In pixels, from the top left corner.
    pub(crate) point: [f64; 2],
    /// The light that arrives there, over the density of the point per square pixel.
    pub(crate) value: Rgb,
}

/// Which pixels and blocks a point reaches.
#[derive(Clone, Debug)]
pub(crate) struct Raster {
    filter: Filter,
    size: [u32; 2],
    /// Blocks of columns and of rows.
    blocks: [Vec<u8>; 2],
}

impl Raster {
    pub(crate) fn new(filter: Filter, size: [u32; 2]) -> Self {
        let blocks = size.map(|n| (0..n).map(|i| cell(i, n) as u8).collect());
        Self { filter, size, blocks }
    }

    pub(crate) fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The group of the stratum of a pixel: neighbours are in different ones.
    fn group(&self, pixel: u32) -> u32 {
        let [x, y] = [pixel % self.size[0], pixel / self.size[0]];
        x % GROUPS + GROUPS * (y % GROUPS)
    }

    /// Columns and rows that points of some pixels' filters and squares reach.
    fn window(&self, pixels: Range<u32>) -> [Range<u32>; 2] {
        let [w, h] = self.size;
        // From a point within a filter to what that reaches.
        let reach = (fm::ceil(2.0 * self.filter.radius()) as u32).saturating_sub(1);
        let around = |first: u32, last: u32, n: u32| {
            first.saturating_sub(reach)..last.saturating_add(reach + 1).min(n)
        };
        let [first, last] = [pixels.start / w, pixels.end.saturating_sub(1) / w];
        let columns = if first == last {
            around(pixels.start % w, pixels.end.saturating_sub(1) % w, w)
        } else {
            0..w
        };
        [columns, around(first, last, h)]
    }
}

/// Weights of a point along one axis.
#[derive(Debug, Default)]
struct Taps {
    first: u32,
    /// Of pixels from the first one on.
    pixels: Vec<f64>,
    /// Of blocks.
    blocks: Vec<(u8, f64)>,
}

impl Taps {
    fn set(&mut self, raster: &Raster, axis: usize, at: f64) {
        let reached = raster.filter.reached(at, raster.size[axis]);
        self.first = reached.start;
        self.pixels.clear();
        self.blocks.clear();
        for i in reached {
            let weight = raster.filter.axis(at - (f64::from(i) + 0.5));
            self.pixels.push(weight);
            let block = raster.blocks[axis][i as usize];
            match self.blocks.last_mut() {
                Some((last, sum)) if *last == block => *sum += weight,
                _ => self.blocks.push((block, weight)),
            }
        }
    }
}

/// Sums of splats, before they are merged into the film.
#[derive(Debug)]
pub(crate) struct SplatTile {
    raster: Arc<Raster>,
    /// Pixels around those whose paths these are, and their sums.
    window: [Range<u32>; 2],
    sums: Vec<Rgb>,
    /// Splats on other pixels.
    beyond: Vec<(u32, Rgb)>,
    /// The group of the present stratum, and what that has added to which block.
    group: u32,
    present: Vec<(u8, Rgb)>,
    blocks: Vec<(u32, u8, Rgb)>,
    events: Events,
    taps: [Taps; 2],
}

impl SplatTile {
    /// For the paths of some neighbouring pixels, wherever these lead.
    pub(crate) fn new(raster: &Arc<Raster>, pixels: Range<u32>) -> Self {
        let window = raster.window(pixels);
        let [w, h] = window.clone().map(|side| side.len());
        Self {
            raster: Arc::clone(raster),
            window,
            sums: alloc::vec![Rgb::ZERO; w * h],
            beyond: Vec::new(),
            group: 0,
            present: Vec::new(),
            blocks: Vec::new(),
            events: Events::NONE,
            taps: <[Taps; 2]>::default(),
        }
    }

    /// What follows belongs to the stratum of a pixel.
    pub(crate) fn begin(&mut self, pixel: u32) {
        let group = self.group;
        self.blocks.extend(self.present.drain(..).map(|(block, sum)| (group, block, sum)));
        self.group = self.raster.group(pixel);
    }

    /// Adds a splat to all pixels that it reaches.
    pub(crate) fn add(&mut self, splat: &Splat) {
        let [x, y] = &mut self.taps;
        x.set(&self.raster, 0, splat.point[0]);
        y.set(&self.raster, 1, splat.point[1]);
        let [columns, rows] = &self.window;
        let last = x.first + x.pixels.len() as u32;
        for (row, of_row) in (y.first..).zip(&y.pixels) {
            let value = splat.value * *of_row;
            if rows.contains(&row) && columns.start <= x.first && last <= columns.end {
                let start = (row - rows.start) as usize * columns.len();
                let at = start + (x.first - columns.start) as usize;
                for (sum, weight) in self.sums[at..].iter_mut().zip(&x.pixels) {
                    *sum += value * *weight;
                }
            } else {
                let at = row * self.raster.size[0] + x.first;
                self.beyond.extend((at..).zip(&x.pixels).map(|(i, weight)| (i, value * *weight)));
            }
        }
        let mut all = 0.0;
        for (row, of_row) in &y.blocks {
            for (column, of_column) in &x.blocks {
                let block = row * BLOCKS as u8 + column;
                let weight = of_row * of_column;
                let value = splat.value * weight;
                all += weight;
                match self.present.iter_mut().find(|(own, _)| *own == block) {
                    Some((_, sum)) => *sum += value,
                    None => self.present.push((block, value)),
                }
            }
        }
        self.events.push(splat.value * all);
    }
}

/// The sums of a splatted image besides those of its pixels.
#[derive(Debug)]
pub(super) struct SplattedImage {
    raster: Arc<Raster>,
    /// What tiles have added since samples were last counted: to pixels, and to blocks by groups.
    pixels: Vec<Rgb>,
    blocks: Vec<Rgb>,
    events: Events,
    /// Blocks and the whole by groups, over all samples.
    groups: RunSums,
}

impl SplattedImage {
    pub(super) fn new(raster: Raster) -> Self {
        let [w, h] = raster.size;
        let groups = (GROUPS * GROUPS) as usize * SUMS;
        Self {
            raster: Arc::new(raster),
            pixels: alloc::vec![Rgb::ZERO; (w * h) as usize],
            blocks: alloc::vec![Rgb::ZERO; groups],
            events: Events::NONE,
            groups: RunSums::new(groups),
        }
    }

    pub(super) fn raster(&self) -> &Arc<Raster> {
        &self.raster
    }

    pub(super) fn clear(&mut self) {
        self.forget();
        self.groups.clear();
    }

    pub(super) fn begin(&mut self) {
        // What a pass that was cut short has left.
        self.forget();
        self.groups.begin();
    }

    fn forget(&mut self) {
        self.pixels.fill(Rgb::ZERO);
        self.blocks.fill(Rgb::ZERO);
        self.events = Events::NONE;
    }

    pub(super) fn add(&mut self, tile: &SplatTile) {
        let width = self.raster.size[0] as usize;
        let [columns, rows] = &tile.window;
        for (row, sums) in rows.clone().zip(tile.sums.chunks(columns.len().max(1))) {
            let at = row as usize * width + columns.start as usize;
            for (sum, t) in self.pixels[at..].iter_mut().zip(sums) {
                *sum += *t;
            }
        }
        for (pixel, value) in &tile.beyond {
            self.pixels[*pixel as usize] += *value;
        }
        let present = tile.present.iter().map(|(block, sum)| (tile.group, *block, *sum));
        for (group, block, sum) in tile.blocks.iter().copied().chain(present) {
            let of_group = &mut self.blocks[group as usize * SUMS..][..SUMS];
            of_group[block as usize] += sum;
            of_group[SUMS - 1] += sum;
        }
        self.events.add(&tile.events);
    }

    /// Counts samples, with what they have added to pixels.
    pub(super) fn advance(
        &mut self,
        units: u32,
        ends_run: bool,
        events: &mut Events,
        mut to_pixel: impl FnMut(usize, Rgb),
    ) {
        self.pixels.iter().enumerate().for_each(|(i, sum)| to_pixel(i, *sum));
        self.groups.add(0, &self.blocks);
        self.groups.advance(units, ends_run);
        events.add(&self.events);
        self.forget();
    }

    /// The standard errors of blocks and of the whole.
    pub(super) fn set_errors(&self, image: &mut Layer, blocks: &Blocks) {
        let all: u32 = blocks.count.iter().sum();
        let counts = blocks.count.into_iter().chain([all]);
        let estimates = image.blocks.iter_mut().chain([&mut image.total]);
        for ((k, estimate), pixels) in estimates.enumerate().zip(counts) {
            let of_groups = (k..self.groups.len()).step_by(SUMS);
            let variance = of_groups.fold(Rgb::ZERO, |sum, i| {
                let stderr = self.groups.estimate(i).stderr;
                sum + stderr * stderr
            });
            estimate.stderr = variance.map(Real::sqrt) * (1.0 / f64::from(pixels.max(1)));
        }
    }
}
