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
        let Some((enter, exit)) = clip_to_box(grid, ray) else { return };
        let origin = grid.from_world().point(ray.origin);
        let dir = grid.from_world().vector(ray.dir);
        let mut cutter = Cutter { grid, scale, ray: [origin, dir], left: Cutter::HALVINGS };
        let _ = march([origin, dir], self.size, [enter, exit], |[x, y, z], [start, end]| {
            let r = &self.cells[(z * self.size[1] + y) * self.size[0] + x];
            if r.is_loose(scale, [start, end]) {
                return cutter.cut([start, end], visit);
            }
            visit(&r.piece(scale, [start, end]))
        });
    }

    /// The cells of [`walk`](Self::walk), none of which is cut up: for what needs no bounds, only means.
    pub(crate) fn walk_whole(
        &self,
        grid: &Grid,
        scale: f64,
        ray: &Ray,
        visit: &mut dyn FnMut(&Piece) -> ControlFlow<()>,
    ) {
        let Some(part) = clip_to_box(grid, ray) else { return };
        let origin = grid.from_world().point(ray.origin);
        let dir = grid.from_world().vector(ray.dir);
        let _ = march([origin, dir], self.size, part.into(), |[x, y, z], part| {
            visit(&self.cells[(z * self.size[1] + y) * self.size[0] + x].piece(scale, part))
        });
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
        Self { min, max, mean: sum / count }
    }

    /// Whether more null collisions than that are expected on a piece of a ray.
    #[inline(always)]
    fn is_loose(&self, scale: f64, [start, end]: [f64; 2]) -> bool {
        (self.max - self.min).max_channel() * scale * (end - start) > Bounds::LOOSE
    }

    /// The range widened by what rounding may add to interpolated values, and cut to the range `o` of the voxels that
    /// they lie between.
    fn within(self, o: &Self) -> Self {
        const ROUNDING: f64 = 1e-12;
        Self {
            min: zip(self.min * (1.0 - ROUNDING), o.min, f64::max),
            max: zip(self.max * (1.0 + ROUNDING), o.max, f64::min),
            mean: self.mean,
        }
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

/// Cuts up what of one ray is in cells with loose bounds.
struct Cutter<'a> {
    grid: &'a Grid,
    scale: f64,
    /// Origin and direction in the grid's unit cube.
    ray: [Vec3; 2],
    /// So many more pieces may be halved.
    left: u32,
}

impl Cutter<'_> {
    /// Pieces of one ray that are halved at most. Estimates end where nothing gets through any more, after some tens of
    /// halvings; a ray that is not stopped, since a channel is empty or values are negative, must end as well.
    const HALVINGS: u32 = 1024;
    /// So often a piece is halved at most: then it is as short as a rounding of where it is. Few halvings lead there,
    /// since the first pieces of a steep rise are visited first, and light that enters it does not reach the others.
    const DEPTH: u32 = 48;

    /// Visits part of the ray in pieces on each of which the field is interpolated between the same values, and in parts
    /// of these where it changes much.
    #[cold]
    fn cut(
        &mut self,
        part: [f64; 2],
        visit: &mut dyn FnMut(&Piece) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let axes = self.grid.axes();
        // Values are at the ends or in the middle of intervals.
        let size = axes.each_ref().map(|axis| 2 * axis.intervals());
        march(self.ray, size, part, |cell, part| {
            let middle = [0, 1, 2].map(|k| (cell[k] as f64 + 0.5) / size[k] as f64);
            let seen = Cell::new(axes, middle.into()).voxels();
            let range = Range::of(seen.into_iter().map(|voxel| self.grid.voxel(voxel)));
            self.halve(part, &range, Self::DEPTH, visit)
        })
    }

    /// Visits a piece in halves where its bounds are too far apart.
    fn halve(
        &mut self,
        [start, end]: [f64; 2],
        range: &Range,
        depth: u32,
        visit: &mut dyn FnMut(&Piece) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let may = depth > 0 && self.left > 0 && self.grid.filter() != Filter::Nearest;
        if !(may && range.is_loose(self.scale, [start, end])) {
            return visit(&range.piece(self.scale, [start, end]));
        }
        self.left -= 1;
        let [origin, dir] = self.ray;
        let middle = 0.5 * (start + end);
        for part in [[start, middle], [middle, end]] {
            // What is linear along each axis is largest and smallest at the corners of a box.
            let ends = part.map(|t| origin + dir * t);
            let corners = (0..8_usize).map(|n| {
                let pick = |k: usize| ends[n >> k & 1][k].clamp(0.0, 1.0);
                self.grid.value_at_unit(vec3(pick(0), pick(1), pick(2)))
            });
            let range = Range::of(corners).within(range);
            self.halve(part, &range, depth - 1, visit)?;
        }
        ControlFlow::Continue(())
    }
}

/// Visits the cells of a grid on the unit cube that part of a ray crosses, in order, with the part that is in each.
#[inline(always)]
fn march(
    [origin, dir]: [Vec3; 2],
    size: [usize; 3],
    [mut t, exit]: [f64; 2],
    mut visit: impl FnMut([usize; 3], [f64; 2]) -> ControlFlow<()>,
) -> ControlFlow<()> {
    let mut axes: [Stepper; 3] =
        core::array::from_fn(|k| Stepper::new(origin[k], dir[k], size[k], t));
    loop {
        let next = if axes[0].next <= axes[1].next && axes[0].next <= axes[2].next {
            0
        } else if axes[1].next <= axes[2].next {
            1
        } else {
            2
        };
        let end = f64::min(axes[next].next, exit);
        if end > t {
            visit(axes.each_ref().map(|a| a.cell as usize), [t, end])?;
            t = end;
        }
        if end >= exit || !axes[next].advance() {
            return ControlFlow::Continue(());
        }
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
