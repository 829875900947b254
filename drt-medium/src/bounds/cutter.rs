//! Cuts of cells in which a field changes much.

use alloc::vec::Vec;

use drt_math::vec3;

use crate::bounds::march::{Cells, Line, March};
use crate::bounds::range::Range;
use crate::grid::unflatten;
use crate::lattice::Cell;
use crate::{Filter, Grid, Piece};

/// Cuts up what of one ray is in cells with loose bounds: into pieces on each of which the field is interpolated between the same
/// values, and halves of these where it changes much.
pub(super) struct Cutter<'a> {
    grid: &'a Grid,
    scale: f64,
    line: Line,
    /// So many more pieces may be halved.
    left: u32,
    /// Intervals between values that are still to come.
    intervals: Option<(Cells, March)>,
    /// What is to be visited before these, the next one last.
    stack: Vec<Part>,
}

/// A part of a ray in an interval between values.
struct Part {
    ends: [f64; 2],
    /// Bounds of what it is a part of.
    around: Range,
    /// How often it may be halved.
    depth: u32,
}

impl<'a> Cutter<'a> {
    /// Pieces of one ray that are halved at most. Estimates end where nothing gets through any more, after some tens of
    /// halvings; a ray that is not stopped, since a channel is empty or values are negative, must end as well.
    const HALVINGS: u32 = 1024;
    /// So often a piece is halved at most: then it is as short as a rounding of where it is. Few halvings lead there,
    /// since the first pieces of a steep rise are visited first, and light that enters it does not reach the others.
    const DEPTH: u32 = 48;

    #[inline(always)]
    pub(super) fn new(grid: &'a Grid, scale: f64, line: Line) -> Self {
        Self { grid, scale, line, left: Self::HALVINGS, intervals: None, stack: Vec::new() }
    }

    #[inline(always)]
    pub(super) fn is_cutting(&self) -> bool {
        self.intervals.is_some()
    }

    /// Begins with a part of the ray.
    #[cold]
    pub(super) fn begin(&mut self, part: [f64; 2]) {
        // Values are at the ends or in the middle of intervals.
        let halves = self.grid.axes().each_ref().map(|axis| 2 * axis.intervals());
        let cells = Cells::new(halves, 1);
        self.intervals = Some((cells, March::new(&self.line.within(part), &cells)));
    }

    /// The next piece; `None` where the part of the ray ends.
    #[cold]
    pub(super) fn next(&mut self) -> Option<Piece> {
        loop {
            let Some(Part { ends, around, depth }) = self.stack.pop() else {
                let (cells, intervals) = self.intervals.as_mut()?;
                let size = cells.size();
                let Some((cell, ends)) = intervals.next() else {
                    self.intervals = None;
                    return None;
                };
                let cell = unflatten(size, cell);
                let middle = [0, 1, 2].map(|k| (cell[k] as f64 + 0.5) / size[k] as f64);
                let seen = Cell::new(self.grid.axes(), middle.into()).voxels();
                let around = Range::of(seen.into_iter().map(|voxel| self.grid.voxel(voxel)));
                self.stack.push(Part { ends, around, depth: Self::DEPTH });
                continue;
            };
            let range = if depth < Self::DEPTH { self.range(ends, &around) } else { around };
            let may = depth > 0 && self.left > 0 && self.grid.filter() != Filter::Nearest;
            if !(may && range.is_loose(self.scale, ends)) {
                return Some(range.piece(self.scale, ends));
            }
            self.left -= 1;
            let [start, end] = ends;
            let middle = 0.5 * (start + end);
            for ends in [[middle, end], [start, middle]] {
                self.stack.push(Part { ends, around: range, depth: depth - 1 });
            }
        }
    }

    /// Bounds of the field on a part of the ray, within those `around` it.
    fn range(&self, ends: [f64; 2], around: &Range) -> Range {
        let Line { origin, dir, .. } = self.line;
        // What is linear along each axis is largest and smallest at the corners of a box.
        let ends = ends.map(|t| origin + dir * t);
        let corners = (0..8_usize).map(|n| {
            let pick = |k: usize| ends[n >> k & 1][k].clamp(0.0, 1.0);
            self.grid.value_at_unit(vec3(pick(0), pick(1), pick(2)))
        });
        Range::of(corners).within(around)
    }
}
