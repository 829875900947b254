use core::fmt;
use core::ops::ControlFlow;

use alloc::vec::Vec;
use drt_math::{Rgb, Vec3, vec3};

use crate::lattice::Cell;
use crate::tracking::zip;
use crate::{Filter, Grid, Piece, Ray};

/// Bounds of a grid's field over the cells of a coarser grid on the same unit cube.
///
/// A cell's bounds are taken over every value its points can see, neighbours included, so they
/// hold for any interpolation between values.
#[derive(Clone, PartialEq)]
pub(crate) struct Bounds {
    size: [usize; 3],
    cells: Vec<Range>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Range {
    min: Rgb,
    /// Of the magnitudes.
    max: Rgb,
    mean: Rgb,
    /// The largest difference of a channel's bounds.
    spread: f64,
}

impl fmt::Debug for Bounds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Bounds").field("size", &self.size).finish_non_exhaustive()
    }
}

impl Bounds {
    /// Cells per axis as a rule: enough to follow a cloud's outline, few enough for a ray to cross.
    const CELLS: usize = 16;
    /// Voxels per cell and axis as a rule at most: beyond, more cells are better than wider ones.
    const WIDTH: usize = 4;
    /// Expected null collisions on a way through a cell beyond which it is cut up: about what that costs.
    const LOOSE: f64 = 64.0;
    /// Cells per axis at most: the bounds stay small beside the grid.
    const MOST_CELLS: usize = 64;

    pub(crate) fn new(grid: &Grid) -> Self {
        let size = grid.axes().each_ref().map(|axis| {
            let n = axis.intervals();
            let width = usize::min(n.div_ceil(Self::CELLS), Self::WIDTH);
            n.div_ceil(usize::max(width, n.div_ceil(Self::MOST_CELLS)))
        });
        let mut bounds = Self { size, cells: Vec::new() };
        let count = size.iter().product();
        bounds.cells.reserve_exact(count);
        for n in 0..count {
            bounds.cells.push(bounds.range(grid, crate::grid::unflatten(size, n)));
        }
        bounds
    }

    /// Brings the bounds up to date after one voxel has changed.
    pub(crate) fn refresh(&mut self, grid: &Grid, voxel: [usize; 3]) {
        let touched: [Vec<usize>; 3] = core::array::from_fn(|axis| {
            let sees = |&cell: &usize| self.seen(grid, axis, cell).any(|i| i == voxel[axis]);
            (0..self.size[axis]).filter(sees).collect()
        });
        for &z in &touched[2] {
            for &y in &touched[1] {
                for &x in &touched[0] {
                    let n = (z * self.size[1] + y) * self.size[0] + x;
                    self.cells[n] = self.range(grid, [x, y, z]);
                }
            }
        }
    }

    /// Largest magnitude of the grid's values.
    pub(crate) fn largest(&self) -> f64 {
        self.cells.iter().map(|r| r.max.max_channel()).fold(0.0, f64::max)
    }

    fn seen(&self, grid: &Grid, axis: usize, cell: usize) -> impl Iterator<Item = usize> + use<> {
        let n = self.size[axis] as f64;
        grid.axes()[axis].covering(cell as f64 / n, (cell + 1) as f64 / n)
    }

    fn range(&self, grid: &Grid, cell: [usize; 3]) -> Range {
        let along = |axis: usize| self.seen(grid, axis, cell[axis]);
        let voxels = along(2)
            .flat_map(|k| along(1).flat_map(move |j| along(0).map(move |i| grid.voxel([i, j, k]))));
        Range::of(voxels)
    }

    /// Origin and direction of a ray in the grid's unit cube, and the cells that it crosses there.
    #[inline(always)]
    fn march(&self, grid: &Grid, ray: &Ray) -> Option<([Vec3; 2], March)> {
        let part = clip_to_box(grid, ray)?;
        let local = [grid.from_world().point(ray.origin), grid.from_world().vector(ray.dir)];
        Some((local, March::new(local, self.size, part.into())))
    }

    /// The cells a ray crosses, in order, as pieces of the field times `scale`.
    ///
    /// Where a cell's bounds are so far apart that most collisions in it would be null ones, it is cut up where the
    /// interpolation between values changes, so that what is empty beside something very dense costs little.
    #[inline(always)]
    pub(crate) fn walk(
        &self,
        grid: &Grid,
        scale: f64,
        ray: &Ray,
        visit: &mut dyn FnMut(&Piece) -> ControlFlow<()>,
    ) {
        let Some((local, mut cells)) = self.march(grid, ray) else { return };
        let mut cutter = Cutter::new(grid, scale, local);
        // One call of what visits, which is large, so that it becomes part of this loop.
        loop {
            let piece = if cutter.is_cutting() {
                let Some(piece) = cutter.next() else { continue };
                piece
            } else {
                let Some(([x, y, z], part)) = cells.next() else { return };
                let range = &self.cells[(z * self.size[1] + y) * self.size[0] + x];
                if range.is_loose(scale, part) {
                    cutter.begin(part);
                    continue;
                }
                range.piece(scale, part)
            };
            if visit(&piece).is_break() {
                return;
            }
        }
    }

    /// The cells of [`walk`](Self::walk), none of which is cut up: for what needs no bounds, only means.
    pub(crate) fn walk_whole(
        &self,
        grid: &Grid,
        scale: f64,
        ray: &Ray,
        visit: &mut dyn FnMut(&Piece) -> ControlFlow<()>,
    ) {
        let Some((_, mut cells)) = self.march(grid, ray) else { return };
        while let Some(([x, y, z], part)) = cells.next() {
            let range = &self.cells[(z * self.size[1] + y) * self.size[0] + x];
            if visit(&range.piece(scale, part)).is_break() {
                return;
            }
        }
    }
}

impl Range {
    fn of(values: impl Iterator<Item = Rgb>) -> Self {
        let (mut min, mut max) = (Rgb::splat(f64::INFINITY), Rgb::ZERO);
        let (mut sum, mut count) = (Rgb::ZERO, 0.0);
        for v in values {
            min = zip(min, v, f64::min);
            max = zip(max, v.abs(), f64::max);
            sum += v;
            count += 1.0;
        }
        Self { min, max, mean: sum / count, spread: (max - min).max_channel() }
    }

    /// Whether more null collisions than that are expected on a piece of a ray.
    #[inline(always)]
    fn is_loose(&self, scale: f64, [start, end]: [f64; 2]) -> bool {
        self.spread * scale * (end - start) > Bounds::LOOSE
    }

    /// The range widened by what rounding may add to interpolated values, and cut to the range `o` of the voxels that
    /// they lie between.
    fn within(self, o: &Self) -> Self {
        const ROUNDING: f64 = 1e-12;
        let min = zip(self.min * (1.0 - ROUNDING), o.min, f64::max);
        let max = zip(self.max * (1.0 + ROUNDING), o.max, f64::min);
        Self { min, max, mean: self.mean, spread: (max - min).max_channel() }
    }

    /// A negative scale cannot occur: media check it.
    #[inline(always)]
    fn piece(&self, scale: f64, [start, end]: [f64; 2]) -> Piece {
        Piece {
            start,
            end,
            majorant: self.max * scale,
            minorant: self.min * scale,
            mean: self.mean * scale,
        }
    }
}

/// Cuts up what of one ray is in cells with loose bounds: into pieces on each of which the field is interpolated between the same
/// values, and halves of these where it changes much.
struct Cutter<'a> {
    grid: &'a Grid,
    scale: f64,
    /// Origin and direction in the grid's unit cube.
    ray: [Vec3; 2],
    /// So many more pieces may be halved.
    left: u32,
    /// Intervals between values that are still to come.
    intervals: Option<March>,
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
    fn new(grid: &'a Grid, scale: f64, ray: [Vec3; 2]) -> Self {
        Self { grid, scale, ray, left: Self::HALVINGS, intervals: None, stack: Vec::new() }
    }

    #[inline(always)]
    fn is_cutting(&self) -> bool {
        self.intervals.is_some()
    }

    /// Begins with a part of the ray.
    #[cold]
    fn begin(&mut self, part: [f64; 2]) {
        // Values are at the ends or in the middle of intervals.
        let size = self.grid.axes().each_ref().map(|axis| 2 * axis.intervals());
        self.intervals = Some(March::new(self.ray, size, part));
    }

    /// The next piece; `None` where the part of the ray ends.
    #[cold]
    fn next(&mut self) -> Option<Piece> {
        loop {
            let Some(Part { ends, around, depth }) = self.stack.pop() else {
                let intervals = self.intervals.as_mut()?;
                let size = intervals.size;
                let Some((cell, ends)) = intervals.next() else {
                    self.intervals = None;
                    return None;
                };
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
        let [origin, dir] = self.ray;
        // What is linear along each axis is largest and smallest at the corners of a box.
        let ends = ends.map(|t| origin + dir * t);
        let corners = (0..8_usize).map(|n| {
            let pick = |k: usize| ends[n >> k & 1][k].clamp(0.0, 1.0);
            self.grid.value_at_unit(vec3(pick(0), pick(1), pick(2)))
        });
        Range::of(corners).within(around)
    }
}

/// The cells of a grid on the unit cube that part of a ray crosses, in order.
struct March {
    axes: [Stepper; 3],
    size: [usize; 3],
    part: [f64; 2],
    ended: bool,
}

impl March {
    #[inline(always)]
    fn new([origin, dir]: [Vec3; 2], size: [usize; 3], part: [f64; 2]) -> Self {
        let axes = core::array::from_fn(|k| Stepper::new(origin[k], dir[k], size[k], part[0]));
        Self { axes, size, part, ended: false }
    }

    /// The next cell, and the part of the ray that is in it.
    #[inline(always)]
    fn next(&mut self) -> Option<([usize; 3], [f64; 2])> {
        let Self { axes, part: [start, exit], ended, .. } = self;
        while !*ended {
            let next = if axes[0].next <= axes[1].next && axes[0].next <= axes[2].next {
                0
            } else if axes[1].next <= axes[2].next {
                1
            } else {
                2
            };
            let (from, end) = (*start, f64::min(axes[next].next, *exit));
            let cell = axes.each_ref().map(|a| a.cell as usize);
            *ended = end >= *exit || !axes[next].advance();
            if end > from {
                *start = end;
                return Some((cell, [from, end]));
            }
        }
        None
    }
}

/// One axis of the walk through equal cells of the unit interval.
struct Stepper {
    cell: i64,
    step: i64,
    count: i64,
    origin: f64,
    inverse: f64,
    /// Distance at which the ray leaves the cell along this axis.
    next: f64,
}

impl Stepper {
    #[inline]
    fn new(origin: f64, dir: f64, count: usize, t: f64) -> Self {
        let count = count as i64;
        let cell = (((origin + t * dir) * count as f64) as i64).clamp(0, count - 1);
        let step = if dir > 0.0 { 1 } else { -1 };
        let inverse = 1.0 / dir;
        let mut s = Self { cell, step, count, origin, inverse, next: f64::INFINITY };
        if inverse.is_finite() {
            s.next = s.leave();
        }
        s
    }

    /// Computed from the cell's number each time, so that no error accumulates along the ray.
    #[inline]
    fn leave(&self) -> f64 {
        let face = (self.cell + i64::from(self.step > 0)) as f64 / self.count as f64;
        (face - self.origin) * self.inverse
    }

    /// Goes to the next cell; false at the end of the grid.
    #[inline]
    fn advance(&mut self) -> bool {
        self.cell += self.step;
        if self.cell < 0 || self.cell >= self.count {
            return false;
        }
        self.next = self.leave();
        true
    }
}

/// Distances at which a ray enters and leaves the box of a grid, cut to the ray.
#[inline]
pub(crate) fn clip_to_box(grid: &Grid, ray: &Ray) -> Option<(f64, f64)> {
    let origin = grid.from_world().point(ray.origin);
    let dir = grid.from_world().vector(ray.dir);
    let (mut enter, mut leave) = (0.0, ray.t_max);
    for k in 0..3 {
        let inverse = 1.0 / dir[k];
        if !inverse.is_finite() {
            if !(0.0..=1.0).contains(&origin[k]) {
                return None;
            }
            continue;
        }
        let (a, b) = (-origin[k] * inverse, (1.0 - origin[k]) * inverse);
        enter = f64::max(enter, f64::min(a, b));
        leave = f64::min(leave, f64::max(a, b));
    }
    (enter < leave).then_some((enter, leave))
}

/// True for points of the closed unit cube.
#[inline]
pub(crate) fn in_unit_cube(u: Vec3) -> bool {
    let d = u - vec3(0.5, 0.5, 0.5);
    d.max_abs() <= 0.5
}
