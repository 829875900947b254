use crate::{Filter, Layout, Wrap};

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
pub(crate) struct Between {
    pub(crate) lo: usize,
    pub(crate) hi: usize,
    pub(crate) frac: f64,
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

    #[inline]
    pub(crate) fn between(&self, u: f64) -> Between {
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

    /// Every value that some point of the closed interval of unit coordinates can see.
    pub(crate) fn covering(&self, from: f64, to: f64) -> impl Iterator<Item = usize> + use<> {
        let axis = *self;
        let (first, last) = (self.split(from).0, self.split(to).0 + 1);
        (first..=last).map(move |i| axis.wrapped(i))
    }

    /// Whole and fractional part of the lattice coordinate.
    #[inline]
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
