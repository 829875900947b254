//! A regular lattice in a unit cube along each of its axes, and the values that a point sees.

use drt_math::{Vec3, vec3};

/// Where the values sit in the unit cube.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Layout {
    /// Value i of n at (i + 1/2) / n: the middle of its voxel, as in Mitsuba.
    #[default]
    VoxelCentred,
    /// Value i of n at i / (n - 1): the outermost values lie on the faces of the cube.
    NodeCentred,
}

/// How values are joined between the places where they sit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Filter {
    /// Trilinear interpolation: continuous, with jumps of slope between voxels.
    #[default]
    Trilinear,
    /// The value of the nearest voxel: constant inside, with jumps between voxels. Its gradient is
    /// zero almost everywhere, so derivatives for *motions* of such a grid lack the jumps' part.
    Nearest,
}

/// What lies beyond the outermost values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Wrap {
    /// The outermost value goes on.
    #[default]
    Clamp,
    /// The grid starts again.
    Repeat,
    /// The grid runs back and forth; the outermost value appears twice.
    Mirror,
}

/// Where the values of a grid sit along one axis of its unit cube, and which of them a point sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Axis {
    count: usize,
    /// Lattice coordinate = unit coordinate × scale + shift; values sit at whole numbers.
    scale: f64,
    shift: f64,
    filter: Filter,
    wrap: Wrap,
}

/// The two neighbours of a point along one axis, and the weight of the second.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Between {
    lo: usize,
    hi: usize,
    frac: f64,
}

impl Axis {
    pub(crate) fn new(count: usize, layout: Layout, filter: Filter, wrap: Wrap) -> Self {
        let (scale, shift) = match layout {
            Layout::VoxelCentred => (count as f64, -0.5),
            Layout::NodeCentred => ((count - 1) as f64, 0.0),
        };
        Self { count, scale, shift, filter, wrap }
    }

    /// Values per unit length: what turns a slope along the lattice into one along the unit cube.
    #[inline]
    pub(crate) fn scale(&self) -> f64 {
        self.scale
    }

    /// Steps of the lattice on the unit interval.
    pub(crate) fn intervals(&self) -> usize {
        usize::max(self.scale as usize, 1)
    }

    #[inline(always)]
    fn between(&self, u: f64) -> Between {
        let (base, frac) = self.split(u);
        if self.filter == Filter::Nearest {
            let i = self.wrapped(if frac < 0.5 { base } else { base + 1 });
            return Between { lo: i, hi: i, frac: 0.0 };
        }
        if base >= 0 && base + 1 < self.count as i64 {
            Between { lo: base as usize, hi: base as usize + 1, frac }
        } else {
            Between { lo: self.wrapped(base), hi: self.wrapped(base + 1), frac }
        }
    }

    /// The values on both sides of a unit coordinate, and their weights in the interpolation.
    #[inline]
    pub(crate) fn neighbours(&self, u: f64) -> [(usize, f64); 2] {
        let Between { lo, hi, frac } = self.between(u);
        [(lo, 1.0 - frac), (hi, frac)]
    }

    /// Every value that some point of the closed interval of unit coordinates can see.
    pub(crate) fn covering(&self, from: f64, to: f64) -> impl Iterator<Item = usize> + use<> {
        let axis = *self;
        let (first, (last, beyond)) = (self.split(from).0, self.split(to));
        (first..=last + i64::from(beyond > 0.0)).map(move |i| axis.wrapped(i))
    }

    /// Whole and fractional part of the lattice coordinate.
    #[inline(always)]
    fn split(&self, u: f64) -> (i64, f64) {
        // Beyond 2^52 a lattice coordinate has no fraction left, and i64 could overflow.
        const LIMIT: f64 = 4_503_599_627_370_496.0;
        let q = (u * self.scale + self.shift).clamp(-LIMIT, LIMIT);
        let truncated = q as i64;
        let base = truncated - i64::from(q < truncated as f64);
        (base, q - base as f64)
    }

    #[inline]
    fn wrapped(&self, i: i64) -> usize {
        let n = self.count as i64;
        (match self.wrap {
            Wrap::Clamp => i.clamp(0, n - 1),
            Wrap::Repeat => i.rem_euclid(n),
            Wrap::Mirror => {
                let j = i.rem_euclid(2 * n);
                if j < n { j } else { 2 * n - 1 - j }
            }
        }) as usize
    }
}

/// The eight values around a point. Corner n lies on the upper side along axis k when bit k of n is
/// set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cell([Between; 3]);

impl Cell {
    #[inline]
    pub(crate) fn new(axes: &[Axis; 3], u: Vec3) -> Self {
        Self([axes[0].between(u.x), axes[1].between(u.y), axes[2].between(u.z)])
    }

    /// Per corner, the sum of its coordinates times the strides.
    #[inline]
    pub(crate) fn sums(&self, strides: [usize; 3]) -> [usize; 8] {
        let side = |k: usize| [self.0[k].lo * strides[k], self.0[k].hi * strides[k]];
        let (x, y, z) = (side(0), side(1), side(2));
        core::array::from_fn(|n| x[n & 1] + y[n >> 1 & 1] + z[n >> 2])
    }

    /// Position of each corner in the grid.
    #[inline]
    pub(crate) fn voxels(&self) -> [[usize; 3]; 8] {
        let side = |k: usize, n: usize| if n >> k & 1 == 0 { self.0[k].lo } else { self.0[k].hi };
        core::array::from_fn(|n| [side(0, n), side(1, n), side(2, n)])
    }

    /// Weight of each corner in the interpolation.
    #[inline]
    pub(crate) fn weights(&self) -> [f64; 8] {
        let w = self.0.map(|b| [1.0 - b.frac, b.frac]);
        core::array::from_fn(|n| w[0][n & 1] * w[1][n >> 1 & 1] * w[2][n >> 2])
    }

    /// The trilinear interpolant of values at the corners.
    #[inline]
    pub(crate) fn interpolate(&self, v: &[f64; 8]) -> f64 {
        let [fx, fy, fz] = self.0.map(|b| b.frac);
        let face = |k: usize| lerp(lerp(v[k], v[k + 1], fx), lerp(v[k + 2], v[k + 3], fx), fy);
        lerp(face(0), face(4), fz)
    }

    /// Its slopes along the lattice axes, per lattice step.
    #[inline]
    pub(crate) fn slopes(&self, v: &[f64; 8]) -> Vec3 {
        let [fx, fy, fz] = self.0.map(|b| b.frac);
        // Differences across one axis, interpolated along the steps a and b of the other two.
        let across = |step: usize, (a, fa): (usize, f64), (b, fb): (usize, f64)| {
            let d = |k: usize| v[k + step] - v[k];
            lerp(lerp(d(0), d(a), fa), lerp(d(b), d(a + b), fa), fb)
        };
        let (x, y, z) = ((1, fx), (2, fy), (4, fz));
        vec3(across(1, y, z), across(2, x, z), across(4, x, y))
    }
}

#[inline]
fn lerp(a: f64, b: f64, s: f64) -> f64 {
    a + (b - a) * s
}
