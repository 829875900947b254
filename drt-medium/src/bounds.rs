//! Bounds of a grid's field over cells of its unit cube, by which rays walk through it.

mod cutter;
mod level;
mod march;
mod range;

use core::fmt;
use core::ops::ControlFlow;

use alloc::vec::Vec;

use crate::bounds::cutter::Cutter;
use crate::bounds::level::Level;
use crate::bounds::march::{Cells, Line, March};
pub(crate) use crate::bounds::march::{clip_to_box, in_unit_cube};
use crate::bounds::range::Range;
use crate::{Grid, Piece, Ray};

/// Bounds of a grid's field over the cells of one or two coarser grids on the same unit cube.
///
/// A cell's bounds are taken over every value its points can see, neighbours included, so they
/// hold for any interpolation between values.
#[derive(Clone, PartialEq)]
pub(crate) struct Bounds {
    fine: Level,
    /// Cells of several fine ones, where there are many of these: a ray takes one of them in a step where the field is empty,
    /// or even enough.
    coarse: Option<Level>,
}

impl fmt::Debug for Bounds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Bounds").field("size", &self.fine.cells().size()).finish_non_exhaustive()
    }
}

impl Bounds {
    /// Cells per axis as a rule: enough to follow a cloud's outline, few enough for a ray to cross.
    const CELLS: usize = 16;
    /// Voxels per fine cell and axis as a rule at most: beyond, more cells are better than wider ones.
    const WIDTH: usize = 4;
    /// Fine cells per axis at most: the bounds stay small beside the grid.
    const MOST_CELLS: usize = 64;
    /// Fine cells per coarse one and axis.
    const GROUP: usize = 4;

    pub(crate) fn new(grid: &Grid) -> Self {
        let size = grid.axes().each_ref().map(|axis| {
            let n = axis.intervals();
            let width = usize::min(n.div_ceil(Self::CELLS), Self::WIDTH);
            n.div_ceil(usize::max(width, n.div_ceil(Self::MOST_CELLS)))
        });
        let seen: [Vec<Vec<usize>>; 3] = core::array::from_fn(|axis| {
            (0..size[axis]).map(|cell| seen(grid, size, axis, cell).collect()).collect()
        });
        let fine = Level::new(Cells::new(size, 1), grid.channels(), |cell| {
            range(grid, [0, 1, 2].map(|axis| seen[axis][cell[axis]].as_slice()))
        });
        let coarse = size.into_iter().any(|n| n > Self::CELLS).then(|| {
            let cells = Cells::new(size, Self::GROUP);
            Level::new(cells, grid.channels(), |cell| Self::group(&fine, cell))
        });
        Self { fine, coarse }
    }

    /// Brings the bounds up to date after one voxel has changed.
    pub(crate) fn refresh(&mut self, grid: &Grid, voxel: [usize; 3]) {
        let size = self.fine.cells().size();
        let touched: [Vec<usize>; 3] = core::array::from_fn(|axis| {
            let sees = |&cell: &usize| seen(grid, size, axis, cell).any(|i| i == voxel[axis]);
            (0..size[axis]).filter(sees).collect()
        });
        let [xs, ys, zs] = touched.each_ref().map(Vec::as_slice);
        for cell in places([xs, ys, zs].map(|numbers| numbers.iter().copied())) {
            let seen: [Vec<usize>; 3] =
                core::array::from_fn(|axis| seen(grid, size, axis, cell[axis]).collect());
            self.fine.set(cell, &range(grid, seen.each_ref().map(Vec::as_slice)));
            if let Some(coarse) = &mut self.coarse {
                let group = cell.map(|c| c / Self::GROUP);
                coarse.set(group, &Self::group(&self.fine, group));
            }
        }
    }

    /// Bounds over the fine cells of a coarse one.
    fn group(fine: &Level, coarse: [usize; 3]) -> Range {
        let size = fine.cells().size();
        let cells = [0, 1, 2].map(|axis| {
            let first = coarse[axis] * Self::GROUP;
            first..usize::min(first + Self::GROUP, size[axis])
        });
        Range::around(places(cells).map(|cell| fine.range_at(cell)))
    }

    /// Largest magnitude of the grid's values.
    pub(crate) fn largest(&self) -> f64 {
        let level = self.coarse.as_ref().unwrap_or(&self.fine);
        level.ranges().map(|r| r.max.max_channel()).fold(0.0, f64::max)
    }

    /// The cells a ray crosses, in order, as pieces of the field times `scale`: coarse ones where few collisions in them are
    /// null ones, and fine ones elsewhere.
    ///
    /// Where a fine cell's bounds are so far apart that most collisions in it would be null ones, it is cut up where the
    /// interpolation between values changes, so that what is empty beside something very dense costs little.
    #[inline(always)]
    pub(crate) fn walk(
        &self,
        grid: &Grid,
        scale: f64,
        ray: &Ray,
        visit: &mut dyn FnMut(&Piece) -> ControlFlow<()>,
    ) {
        let Some(line) = Line::through(grid, ray) else { return };
        let all = |level: &Level| March::new(&line, level.cells());
        let mut groups = self.coarse.as_ref().map(|level| (level, all(level)));
        let mut fine = if groups.is_some() { March::ended() } else { all(&self.fine) };
        let mut cutter = Cutter::new(grid, scale, line);
        // One call of what visits, which is large, so that it becomes part of this loop.
        loop {
            let piece = if cutter.is_cutting() {
                let Some(piece) = cutter.next() else { continue };
                piece
            } else if let Some((cell, part)) = fine.next() {
                let range = self.fine.range(cell);
                if range.is_loose(scale, part) {
                    cutter.begin(part);
                    continue;
                }
                range.piece(scale, part)
            } else {
                let Some((level, cells)) = &mut groups else { return };
                let Some((cell, part)) = cells.next() else { return };
                let range = level.range(cell);
                if !range.is_tight(scale, part) {
                    fine = March::new(&line.within(part), self.fine.cells());
                    continue;
                }
                range.piece(scale, part)
            };
            if visit(&piece).is_break() {
                return;
            }
        }
    }

    /// The cells that a ray crosses, about as many for grids of any size: for what needs no bounds, only means.
    pub(crate) fn walk_whole(
        &self,
        grid: &Grid,
        scale: f64,
        ray: &Ray,
        visit: &mut dyn FnMut(&Piece) -> ControlFlow<()>,
    ) {
        let Some(line) = Line::through(grid, ray) else { return };
        let many = |level: &&Level| level.cells().size().into_iter().any(|n| n >= Self::CELLS);
        let level = self.coarse.as_ref().filter(many).unwrap_or(&self.fine);
        let mut cells = March::new(&line, level.cells());
        while let Some((cell, part)) = cells.next() {
            if visit(&level.range(cell).piece(scale, part)).is_break() {
                return;
            }
        }
    }
}

/// Every value along an axis that the points of a fine cell can see.
fn seen(
    grid: &Grid,
    size: [usize; 3],
    axis: usize,
    cell: usize,
) -> impl Iterator<Item = usize> + use<> {
    let n = size[axis] as f64;
    grid.axes()[axis].covering(cell as f64 / n, (cell + 1) as f64 / n)
}

/// Bounds of the voxels with these places along each axis.
fn range(grid: &Grid, seen: [&[usize]; 3]) -> Range {
    let (values, channels) = (grid.values(), grid.channels());
    let of = |c: usize| {
        let voxels = places(seen.map(|along| along.iter().copied()));
        Range::of_numbers(voxels.map(|voxel| values[grid.flatten(voxel) * channels + c]))
    };
    Range::by_channel(if channels == 1 { [of(0); 3] } else { [0, 1, 2].map(of) })
}

/// All places with these numbers along each axis.
fn places<I: Iterator<Item = usize> + Clone>(
    [xs, ys, zs]: [I; 3],
) -> impl Iterator<Item = [usize; 3]> {
    let rows = zs.flat_map(move |z| ys.clone().map(move |y| [y, z]));
    rows.flat_map(move |[y, z]| xs.clone().map(move |x| [x, y, z]))
}
