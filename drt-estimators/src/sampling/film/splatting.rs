//! An image whose samples count for every pixel that they reach.
//!
//! With N samples of each stratum s (the paths of a pixel), of which sample k puts the light f at the image point q,
//! which has the density p per square pixel among the stratum's samples, or all strata's together, pixel i is
//!
//! ```text
//! I_i = (1/N) Σ_s Σ_k P_i(q) f / p,      P_i the pixel's filter.
//! ```
//!
//! That has the right mean for any N. Its weights P_i / p add up to 1 on average only. As points are even in each square, the
//! noise of that is small: for runs of 16 points under a tent its variance is 0.0024 f² / N, a 180th of that of paths whose
//! standard deviation is f, but in a plain background nothing else is seen. So it is taken out without bias ([`RunSums`]).
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
use crate::model::rendering::{BLOCKS, Estimate, Layer};
use crate::sampling::film::strata::{GROUPS, OF_GROUP, SplatSums};
use crate::sampling::film::sums::RunSums;
use crate::sampling::film::{Blocks, Ends, Events, cell};

/// What a sample puts on the image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Splat {
    /// In pixels, from the top left corner.
    pub(crate) point: [f64; 2],
    /// The light that arrives there, over the density of the point per square pixel.
    pub(crate) value: Rgb,
    /// One over that density, of points that every pixel's filter sees with the density 1 in the mean over a sample
    /// of each pixel; of others 0.
    pub(crate) weight: f64,
    /// What `value` and `weight` are still to be divided by.
    pub(crate) density: SplatDensity,
}

/// A factor of a point's density that only a film can tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SplatDensity {
    /// None.
    Known,
    /// That of the [samples](Filter::sample) of all pixels together, one of each filter: the balance heuristic for
    /// all pixels (Veach 1997, §9.2.2).
    OfFilters {
        /// Whether these are for derivatives.
        derivative: bool,
    },
}

impl Splat {
    /// One of several that share what they stand for.
    pub(crate) fn scaled(&self, share: f64) -> Self {
        Self { value: self.value * share, weight: self.weight * share, ..*self }
    }
}

/// Sums of values and of weights.
type Sums = (Rgb, f64);

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
    /// What values are divided by.
    density: f64,
}

impl Taps {
    fn set(&mut self, raster: &Raster, axis: usize, splat: &Splat) {
        let at = splat.point[axis];
        let reached = raster.filter.reached(at, raster.size[axis]);
        self.first = reached.start;
        let sampled = match splat.density {
            SplatDensity::Known => None,
            SplatDensity::OfFilters { derivative } => Some(derivative),
        };
        self.density = raster.filter.weights(at, reached, sampled, &mut self.pixels);
        self.blocks.clear();
        let blocks = raster.blocks[axis].get(self.first as usize..).unwrap_or_default();
        for (weight, block) in self.pixels.iter().zip(blocks) {
            match self.blocks.last_mut() {
                Some((last, sum)) if last == block => *sum += weight,
                _ => self.blocks.push((*block, *weight)),
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
    sums: Vec<Sums>,
    /// Splats on other pixels.
    beyond: Vec<(u32, Sums)>,
    /// The group of the present stratum, and what that has added to which block.
    group: u32,
    present: Vec<(u8, Sums)>,
    blocks: Vec<(u32, u8, Sums)>,
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
            sums: alloc::vec![(Rgb::ZERO, 0.0); w * h],
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
        x.set(&self.raster, 0, splat);
        y.set(&self.raster, 1, splat);
        let density = x.density * y.density;
        // At the very end of all filters there is no weight to take out, and no path.
        if density == 0.0 {
            return;
        }
        let splat = &splat.scaled(1.0 / density);
        let [columns, rows] = &self.window;
        let last = x.first + x.pixels.len() as u32;
        for (row, of_row) in (y.first..).zip(&y.pixels) {
            let Splat { value, weight, .. } = splat.scaled(*of_row);
            if rows.contains(&row) && columns.start <= x.first && last <= columns.end {
                let start = (row - rows.start) as usize * columns.len();
                let at = start + (x.first - columns.start) as usize;
                for (sum, tap) in self.sums[at..].iter_mut().zip(&x.pixels) {
                    sum.0 += value * *tap;
                    sum.1 += weight * *tap;
                }
            } else {
                let at = row * self.raster.size[0] + x.first;
                let taps = (at..).zip(&x.pixels);
                self.beyond.extend(taps.map(|(i, tap)| (i, (value * *tap, weight * *tap))));
            }
        }
        let mut all = 0.0;
        for (row, of_row) in &y.blocks {
            for (column, of_column) in &x.blocks {
                let block = row * BLOCKS as u8 + column;
                let tap = of_row * of_column;
                let Splat { value, weight, .. } = splat.scaled(tap);
                all += tap;
                match self.present.iter_mut().find(|(own, _)| *own == block) {
                    Some((_, sum)) => *sum = (sum.0 + value, sum.1 + weight),
                    None => self.present.push((block, (value, weight))),
                }
            }
        }
        self.events.push(splat.value * all);
    }
}

/// An image that is splatted.
#[derive(Debug)]
pub(super) struct SplattedImage {
    size: [u32; 2],
    pixels: RunSums,
    /// Blocks and the whole by groups.
    groups: RunSums,
    events: Events,
    /// Of the stratum that has not ended.
    open_events: Events,
    /// What tiles have added since samples were last counted.
    new: SplatSums,
}

impl SplattedImage {
    pub(super) fn new(size: [u32; 2]) -> Self {
        let pixels = (size[0] * size[1]) as usize;
        let new = SplatSums::new(pixels);
        Self {
            size,
            pixels: RunSums::weighted(pixels),
            groups: RunSums::weighted(new.groups.values.len()),
            events: Events::NONE,
            open_events: Events::NONE,
            new,
        }
    }

    pub(super) fn clear(&mut self) {
        self.new.clear();
        self.pixels.clear();
        self.groups.clear();
        (self.events, self.open_events) = (Events::NONE, Events::NONE);
    }

    pub(super) fn begin(&mut self) {
        // What a pass that was cut short has left.
        self.new.clear();
        self.end_events();
        self.pixels.begin();
        self.groups.begin();
    }

    pub(super) fn add(&mut self, tile: &SplatTile) {
        let width = self.size[0] as usize;
        let [columns, rows] = &tile.window;
        let SplatSums { pixels, groups, events } = &mut self.new;
        for (row, sums) in rows.clone().zip(tile.sums.chunks(columns.len().max(1))) {
            let at = row as usize * width + columns.start as usize;
            for (i, sums) in (at..).zip(sums) {
                pixels.add_to(i, *sums);
            }
        }
        for (pixel, sums) in &tile.beyond {
            pixels.add_to(*pixel as usize, *sums);
        }
        let present = tile.present.iter().map(|(block, sums)| (tile.group, *block, *sums));
        for (group, block, sums) in tile.blocks.iter().copied().chain(present) {
            let of_group = group as usize * OF_GROUP;
            groups.add_to(of_group + block as usize, sums);
            groups.add_to(of_group + OF_GROUP - 1, sums);
        }
        events.add(&tile.events);
    }

    /// Adds to the stratum what tiles have added.
    fn settle(&mut self) {
        self.pixels.take(&mut self.new.pixels);
        self.groups.take(&mut self.new.groups);
        self.open_events.add(&core::mem::replace(&mut self.new.events, Events::NONE));
    }

    /// Counts samples, with what they have added, and what ends with them.
    pub(super) fn advance(&mut self, units: u32, ends: Ends) {
        self.settle();
        self.pixels.advance(units, ends);
        self.groups.advance(units, ends);
        if ends != Ends::Nothing {
            self.end_events();
        }
    }

    fn end_events(&mut self) {
        self.events.add(&core::mem::replace(&mut self.open_events, Events::NONE));
    }

    /// The stratum so far, where that has ended, which is not counted.
    pub(super) fn keep(&mut self, ends: Ends) -> Option<SplatSums> {
        self.settle();
        (ends != Ends::Nothing).then(|| SplatSums {
            pixels: self.pixels.take_open(),
            groups: self.groups.take_open(),
            events: core::mem::replace(&mut self.open_events, Events::NONE),
        })
    }

    /// Adds a stratum that was kept.
    pub(super) fn put_back(&mut self, stratum: &SplatSums) {
        self.pixels.add(&stratum.pixels);
        self.groups.add(&stratum.groups);
        self.open_events.add(&stratum.events);
    }

    pub(super) fn abandon_run(&mut self) {
        self.new.clear();
        self.open_events = Events::NONE;
        self.pixels.abandon_run();
        self.groups.abandon_run();
    }

    pub(super) fn end_run(&mut self) {
        self.pixels.end_run();
        self.groups.end_run();
    }

    pub(super) fn estimate(&self, pixel: usize) -> Estimate {
        self.pixels.estimate(pixel)
    }

    /// The image, with the errors of its blocks and of the whole.
    pub(super) fn layer(&self, blocks: &Blocks) -> Layer {
        let pixels = (0..self.pixels.len()).map(|i| self.estimate(i)).collect();
        let mut image = Layer::from_pixels(self.size, pixels, blocks);
        let all: u32 = blocks.count.iter().sum();
        let counts = blocks.count.into_iter().chain([all]);
        let estimates = image.blocks.iter_mut().chain([&mut image.total]);
        for ((k, estimate), pixels) in estimates.enumerate().zip(counts) {
            let of_groups = (k..self.groups.len()).step_by(OF_GROUP);
            let variance = of_groups.fold(Rgb::ZERO, |sum, i| {
                // As if each pixel of a block had taken its mean from the weights.
                let stderr = self.groups.stderr(i, estimate.mean);
                sum + stderr * stderr
            });
            estimate.stderr = variance.map(Real::sqrt) * (1.0 / f64::from(pixels.max(1)));
        }
        let mut events = self.events;
        events.add(&self.open_events);
        events.widen(&mut image, blocks, f64::from(self.pixels.units().max(1)));
        image
    }
}
