//! Walks of rays through equal cells.

use drt_math::{Vec3, vec3};

use crate::{Grid, Ray};

/// A part of a ray in a grid's unit cube.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    pub(super) origin: Vec3,
    pub(super) dir: Vec3,
    /// One over the direction's components.
    inverse: Vec3,
    /// Where it starts and ends.
    part: [f64; 2],
}

impl Line {
    /// What of a ray is in a grid's box.
    #[inline(always)]
    pub(super) fn through(grid: &Grid, ray: &Ray) -> Option<Self> {
        let (start, end) = clip_to_box(grid, ray)?;
        let (origin, dir) =
            (grid.from_world().point(ray.origin), grid.from_world().vector(ray.dir));
        let inverse = vec3(1.0 / dir.x, 1.0 / dir.y, 1.0 / dir.z);
        Some(Self { origin, dir, inverse, part: [start, end] })
    }

    /// Another part of the same ray.
    #[inline(always)]
    pub(super) fn within(&self, part: [f64; 2]) -> Self {
        Self { part, ..*self }
    }
}

/// Equal cells of the unit cube, the last ones along an axis possibly cut off by its faces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cells {
    size: [usize; 3],
    per_unit: [f64; 3],
    width: [f64; 3],
}

impl Cells {
    /// Cells that are `group` of `parts` equal parts of the cube along each axis.
    pub(super) fn new(parts: [usize; 3], group: usize) -> Self {
        let [parts_per_unit, group_width] = [parts.map(|n| n as f64), [group as f64; 3]];
        Self {
            size: parts.map(|n| n.div_ceil(group)),
            per_unit: core::array::from_fn(|k| parts_per_unit[k] / group_width[k]),
            width: core::array::from_fn(|k| group_width[k] / parts_per_unit[k]),
        }
    }

    pub(super) fn size(&self) -> [usize; 3] {
        self.size
    }
}

/// The cells that a line crosses, in order.
pub(super) struct March {
    axes: [Stepper; 3],
    /// Number of the present cell, x fastest.
    cell: usize,
    part: [f64; 2],
    ended: bool,
}

/// One axis of the walk.
#[derive(Clone, Copy)]
struct Stepper {
    /// Distance at which the ray leaves the cell along this axis.
    next: f64,
    /// Number of the face through which it does, from the least end of the axis, and what it grows by from cell to cell.
    face: f64,
    step: f64,
    width: f64,
    origin: f64,
    inverse: f64,
    /// Cells after this one on the way.
    left: usize,
    /// What the number of the cell grows by, modulo its range.
    stride: usize,
}

impl March {
    #[inline(always)]
    pub(super) fn new(line: &Line, cells: &Cells) -> Self {
        let Line { origin, dir, inverse, part } = line;
        let mut cell = 0;
        let mut stride = 1;
        let axes = core::array::from_fn(|k| {
            let size = cells.size[k];
            let at = (origin[k] + part[0] * dir[k]) * cells.per_unit[k];
            let place = (at as i64).clamp(0, size as i64 - 1) as usize;
            cell += place * stride;
            let (up, own) = (inverse[k] > 0.0, stride);
            stride *= size;
            let mut axis = Stepper {
                next: f64::INFINITY,
                face: (place + usize::from(up)) as f64,
                step: if up { 1.0 } else { -1.0 },
                width: cells.width[k],
                origin: origin[k],
                inverse: inverse[k],
                left: if up { size - 1 - place } else { place },
                stride: if up { own } else { own.wrapping_neg() },
            };
            if inverse[k].is_finite() {
                axis.next = axis.leave();
            }
            axis
        });
        Self { axes, cell, part: *part, ended: false }
    }

    /// A walk that has come to its end.
    #[inline(always)]
    pub(super) fn ended() -> Self {
        let axis = Stepper {
            next: f64::INFINITY,
            face: 0.0,
            step: 0.0,
            width: 0.0,
            origin: 0.0,
            inverse: 0.0,
            left: 0,
            stride: 0,
        };
        Self { axes: [axis; 3], cell: 0, part: [0.0; 2], ended: true }
    }

    /// The number of the next cell, and the part of the ray that is in it.
    #[inline(always)]
    pub(super) fn next(&mut self) -> Option<(usize, [f64; 2])> {
        let Self { axes, cell, part: [start, exit], ended } = self;
        while !*ended {
            let next = if axes[0].next <= axes[1].next && axes[0].next <= axes[2].next {
                0
            } else if axes[1].next <= axes[2].next {
                1
            } else {
                2
            };
            let axis = &mut axes[next];
            let (from, end, own) = (*start, f64::min(axis.next, *exit), *cell);
            *ended = end >= *exit || axis.left == 0;
            if !*ended {
                *cell = cell.wrapping_add(axis.stride);
                axis.advance();
            }
            if end > from {
                *start = end;
                return Some((own, [from, end]));
            }
        }
        None
    }
}

impl Stepper {
    /// Computed from the face's number each time, so that no error accumulates along the ray.
    #[inline(always)]
    fn leave(&self) -> f64 {
        (self.face * self.width - self.origin) * self.inverse
    }

    #[inline(always)]
    fn advance(&mut self) {
        self.left -= 1;
        self.face += self.step;
        self.next = self.leave();
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
