use core::fmt;
use core::ops::ControlFlow;

use alloc::vec::Vec;
use drt_math::{Rgb, Vec3, vec3};

use crate::tracking::zip;
use crate::{Grid, Piece, Ray};

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
        let (mut min, mut max) = (Rgb::splat(f64::INFINITY), Rgb::ZERO);
        let (mut sum, mut count) = (Rgb::ZERO, 0.0);
        for k in self.seen(grid, 2, cell[2]) {
            for j in self.seen(grid, 1, cell[1]) {
                for i in self.seen(grid, 0, cell[0]) {
                    let v = grid.voxel([i, j, k]);
                    min = zip(min, v, f64::min);
                    max = zip(max, v.abs(), f64::max);
                    sum += v;
                    count += 1.0;
                }
            }
        }
        Range { min, max, mean: sum / count }
    }

    /// The cells a ray crosses, in order, as pieces of the field times `scale`.
    #[inline(always)]
    pub(crate) fn walk(
        &self,
        grid: &Grid,
        scale: f64,
        ray: &Ray,
        visit: &mut dyn FnMut(&Piece) -> ControlFlow<()>,
    ) {
        let Some((mut t, exit)) = clip_to_box(grid, ray) else { return };
        let origin = grid.from_world().point(ray.origin);
        let dir = grid.from_world().vector(ray.dir);
        let mut axes: [Stepper; 3] =
            core::array::from_fn(|k| Stepper::new(origin[k], dir[k], self.size[k], t));
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
                let [x, y, z] = axes.each_ref().map(|a| a.cell as usize);
                let r = &self.cells[(z * self.size[1] + y) * self.size[0] + x];
                // A negative scale cannot occur: media check it.
                let piece = Piece {
                    start: t,
                    end,
                    majorant: r.max * scale,
                    minorant: r.min * scale,
                    mean: r.mean * scale,
                };
                if visit(&piece).is_break() {
                    return;
                }
                t = end;
            }
            if end >= exit || !axes[next].advance() {
                return;
            }
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
