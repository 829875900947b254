use alloc::sync::Arc;
use alloc::vec::Vec;
use core::fmt;

use drt_math::{Affine, Rgb, RgbVec, Vec3, vec3};

use crate::MediumError;
use crate::lattice::{Axis, Cell, Filter, Layout, Wrap};

/// A field of numbers or colours given by values on a regular lattice in a placed box.
///
/// Values are stored x fastest, then y, then z, the channels of a voxel side by side, in f64 so
/// that small steps of a parameter are not rounded away. The field is defined everywhere, by
/// [`Wrap`]; who uses it as a density cuts it off at the box.
///
/// ```
/// use drt_math::{Rgb, vec3};
/// use drt_medium::{Grid, Layout};
/// let ramp = Grid::new([2, 1, 1], 1, vec![0.0, 1.0])?.with_layout(Layout::NodeCentred);
/// assert_eq!(ramp.value(vec3(0.25, 0.5, 0.5)), Rgb::splat(0.25));
/// # Ok::<(), drt_medium::MediumError>(())
/// ```
#[derive(Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(into = "stored::Grid", try_from = "stored::Grid"))]
pub struct Grid {
    size: [usize; 3],
    channels: usize,
    /// Scenes are copied, and few copies have other values.
    values: Arc<Vec<f64>>,
    layout: Layout,
    filter: Filter,
    wrap: Wrap,
    to_world: Affine,
    from_world: Affine,
    axes: [Axis; 3],
}

impl Grid {
    /// A voxel-centred, trilinear, clamped grid filling the unit cube.
    ///
    /// # Errors
    /// When the shape has an empty axis or other than 1 or 3 channels, when the number of values
    /// does not fit it, or when a value is not finite.
    pub fn new(size: [usize; 3], channels: usize, values: Vec<f64>) -> Result<Self, MediumError> {
        if size.contains(&0) || !matches!(channels, 1 | 3) {
            return Err(MediumError::GridShape { size, channels });
        }
        let expected = size.iter().try_fold(channels, |n, &s| n.checked_mul(s));
        if expected != Some(values.len()) {
            let expected = expected.unwrap_or(usize::MAX);
            return Err(MediumError::ValueCount { size, channels, expected, found: values.len() });
        }
        if let Some(at) = values.iter().position(|v| !v.is_finite()) {
            let (voxel, channel) = (unflatten(size, at / channels), at % channels);
            return Err(MediumError::NotFinite { voxel, channel, value: values[at] });
        }
        let (layout, filter, wrap) = Default::default();
        Ok(Self {
            size,
            channels,
            values: Arc::new(values),
            layout,
            filter,
            wrap,
            to_world: Affine::IDENTITY,
            from_world: Affine::IDENTITY,
            axes: size.map(|n| Axis::new(n, layout, filter, wrap)),
        })
    }

    /// One value everywhere, in the unit cube.
    ///
    /// # Errors
    /// When the value is not finite.
    pub fn constant(value: Rgb) -> Result<Self, MediumError> {
        Self::new([1; 3], 3, value.to_array().to_vec())
    }

    /// The same values sitting elsewhere in the box.
    #[must_use]
    pub fn with_layout(mut self, layout: Layout) -> Self {
        self.layout = layout;
        self.rebuild_axes()
    }
    /// The same values joined differently.
    #[must_use]
    pub fn with_filter(mut self, filter: Filter) -> Self {
        self.filter = filter;
        self.rebuild_axes()
    }
    /// The same values continued differently.
    #[must_use]
    pub fn with_wrap(mut self, wrap: Wrap) -> Self {
        self.wrap = wrap;
        self.rebuild_axes()
    }
    /// The same values in the image of the unit cube under `to_world`.
    ///
    /// # Errors
    /// When the map cannot be inverted.
    pub fn with_placement(mut self, to_world: Affine) -> Result<Self, MediumError> {
        self.set_placement(to_world)?;
        Ok(self)
    }

    fn set_placement(&mut self, to_world: Affine) -> Result<(), MediumError> {
        let from_world = to_world.inverse();
        if !to_world.is_finite() || !from_world.is_finite() {
            return Err(MediumError::SingularPlacement);
        }
        (self.to_world, self.from_world) = (to_world, from_world);
        Ok(())
    }

    /// Moves the box by a map of the world. On an error nothing has changed.
    ///
    /// # Errors
    /// When the new placement cannot be inverted.
    pub fn place(&mut self, map: &Affine) -> Result<(), MediumError> {
        self.set_placement(map.after(&self.to_world))
    }

    fn rebuild_axes(mut self) -> Self {
        self.axes = self.size.map(|n| Axis::new(n, self.layout, self.filter, self.wrap));
        self
    }

    /// Values along x, y and z.
    #[must_use]
    pub fn size(&self) -> [usize; 3] {
        self.size
    }
    /// Values per voxel: 1 or 3.
    #[must_use]
    pub fn channels(&self) -> usize {
        self.channels
    }
    /// All values: `values[((k ny + j) nx + i) channels + channel]`.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Where the values sit.
    #[must_use]
    pub fn layout(&self) -> Layout {
        self.layout
    }
    /// How they are joined.
    #[must_use]
    pub fn filter(&self) -> Filter {
        self.filter
    }
    /// How they go on outside.
    #[must_use]
    pub fn wrap(&self) -> Wrap {
        self.wrap
    }
    /// The map of the unit cube to the box in the world.
    #[must_use]
    pub fn to_world(&self) -> &Affine {
        &self.to_world
    }
    /// The map of the world to the unit cube.
    #[must_use]
    pub fn from_world(&self) -> &Affine {
        &self.from_world
    }
    /// Smallest corner and largest corner of the box's axis-aligned hull in the world.
    #[must_use]
    pub fn world_bounds(&self) -> [Vec3; 2] {
        let corner = |n: usize| {
            let bit = |k: usize| (n >> k & 1) as f64;
            self.to_world.point(vec3(bit(0), bit(1), bit(2)))
        };
        (1..8).map(corner).fold([corner(0); 2], |[lo, hi], p| [lo.min(p), hi.max(p)])
    }

    /// Edge lengths of that hull.
    #[must_use]
    pub fn world_extent(&self) -> Vec3 {
        let [x, y, z] = self.to_world.linear.cols.map(|c| c.max(-c));
        x + y + z
    }

    /// The least edge of a voxel in the world.
    pub(crate) fn voxel_size(&self) -> f64 {
        let edges = self.to_world.linear.cols;
        let widths = [0, 1, 2].map(|k| edges[k].length() / self.size[k] as f64);
        widths.into_iter().fold(f64::INFINITY, f64::min)
    }

    /// True of a grid that differs from this one in values alone.
    pub(crate) fn is_like(&self, o: &Self) -> bool {
        self.size == o.size
            && self.channels == o.channels
            && (self.layout, self.filter, self.wrap) == (o.layout, o.filter, o.wrap)
            && self.to_world == o.to_world
    }

    /// The values of one voxel; a single channel stands for all three.
    ///
    /// # Panics
    /// When the voxel lies outside the grid.
    #[inline]
    #[must_use]
    pub fn voxel(&self, voxel: [usize; 3]) -> Rgb {
        let at = self.flatten(voxel) * self.channels;
        match self.channels {
            1 => Rgb::splat(self.values[at]),
            _ => Rgb::new(self.values[at], self.values[at + 1], self.values[at + 2]),
        }
    }

    /// The largest value of each channel; a single channel stands for all three.
    #[must_use]
    pub fn largest(&self) -> Rgb {
        let largest = |c: usize| {
            let values = self.values.iter().skip(c).step_by(self.channels);
            values.copied().fold(f64::NEG_INFINITY, f64::max)
        };
        self.per_channel(largest)
    }

    /// A copy of the field with every channel multiplied by a factor of its own.
    #[must_use]
    pub fn scaled(&self, by: Rgb) -> Self {
        let mut grid = self.clone();
        grid.spread_channels();
        for voxel in grid.values_mut().chunks_exact_mut(3) {
            for (value, by) in voxel.iter_mut().zip(by.to_array()) {
                *value *= by;
            }
        }
        grid
    }

    /// The field at a point of the world.
    #[inline]
    #[must_use]
    pub fn value(&self, x: Vec3) -> Rgb {
        self.value_at_unit(self.from_world.point(x))
    }

    /// The field at a point of the unit cube.
    #[inline]
    #[must_use]
    pub fn value_at_unit(&self, u: Vec3) -> Rgb {
        let cell = self.cell(u);
        let at = self.corners(&cell);
        self.per_channel(|c| cell.interpolate(&self.corner_values(&at, c)))
    }

    /// Gradient of the field at a point of the world, per scene unit. On the planes between voxels,
    /// where the slope jumps, the gradient of the side with the larger coordinates.
    #[inline]
    #[must_use]
    pub fn gradient(&self, x: Vec3) -> RgbVec {
        let cell = self.cell(self.from_world.point(x));
        let at = self.corners(&cell);
        let world = |c: usize| self.slope_in_world(cell.slopes(&self.corner_values(&at, c)));
        match self.channels {
            1 => Rgb::ONE.outer(world(0)),
            _ => RgbVec { r: world(0), g: world(1), b: world(2) },
        }
    }

    /// The gradient in the world that belongs to slopes per lattice step.
    #[inline]
    pub(crate) fn slope_in_world(&self, slope: Vec3) -> Vec3 {
        let [x, y, z] = &self.axes;
        let unit = vec3(slope.x * x.scale(), slope.y * y.scale(), slope.z * z.scale());
        self.from_world.linear.transpose_mul(unit)
    }

    #[inline]
    fn per_channel(&self, f: impl Fn(usize) -> f64) -> Rgb {
        match self.channels {
            1 => Rgb::splat(f(0)),
            _ => Rgb::new(f(0), f(1), f(2)),
        }
    }

    /// The lattice cell around a point of the unit cube.
    #[inline]
    pub(crate) fn cell(&self, u: Vec3) -> Cell {
        Cell::new(&self.axes, u)
    }

    /// Voxel numbers in storage order of a cell's corners.
    #[inline]
    pub(crate) fn corners(&self, cell: &Cell) -> [usize; 8] {
        let [nx, ny, _] = self.size;
        cell.sums([1, nx, nx * ny])
    }

    #[inline]
    pub(crate) fn corner_values(&self, at: &[usize; 8], channel: usize) -> [f64; 8] {
        // Written out: mapping the array does not inline.
        let v = |n: usize| self.values[at[n] * self.channels + channel];
        [v(0), v(1), v(2), v(3), v(4), v(5), v(6), v(7)]
    }

    /// Number of a voxel in storage order.
    #[inline]
    pub(crate) fn flatten(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.size[1] + j) * self.size[0] + i
    }

    pub(crate) fn axes(&self) -> &[Axis; 3] {
        &self.axes
    }

    pub(crate) fn values_mut(&mut self) -> &mut [f64] {
        Arc::<Vec<f64>>::make_mut(&mut self.values)
    }

    /// Gives every colour channel its own values.
    pub(crate) fn spread_channels(&mut self) {
        if self.channels == 1 {
            self.values = Arc::new(self.values.iter().flat_map(|&v| [v; 3]).collect());
            self.channels = 3;
        }
    }
}

impl fmt::Debug for Grid {
    /// Without the values, which may be millions.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Grid")
            .field("size", &self.size)
            .field("channels", &self.channels)
            .field("layout", &self.layout)
            .field("filter", &self.filter)
            .field("wrap", &self.wrap)
            .field("to_world", &self.to_world)
            .finish_non_exhaustive()
    }
}

/// The voxel with a number in storage order.
pub(crate) fn unflatten([nx, ny, _]: [usize; 3], n: usize) -> [usize; 3] {
    [n % nx, n / nx % ny, n / (nx * ny)]
}

#[cfg(feature = "serde")]
mod stored {
    use super::{Affine, Arc, Filter, Layout, MediumError, Vec, Wrap};

    /// What a file holds of a grid; everything else follows from it.
    #[derive(serde::Serialize, serde::Deserialize)]
    pub(super) struct Grid {
        size: [usize; 3],
        channels: usize,
        layout: Layout,
        filter: Filter,
        wrap: Wrap,
        to_world: Affine,
        values: Vec<f64>,
    }

    impl From<super::Grid> for Grid {
        fn from(g: super::Grid) -> Self {
            let super::Grid { size, channels, values, layout, filter, wrap, to_world, .. } = g;
            let values = Arc::unwrap_or_clone(values);
            Self { size, channels, layout, filter, wrap, to_world, values }
        }
    }

    impl TryFrom<Grid> for super::Grid {
        type Error = MediumError;
        fn try_from(g: Grid) -> Result<Self, MediumError> {
            Self::new(g.size, g.channels, g.values)?
                .with_layout(g.layout)
                .with_filter(g.filter)
                .with_wrap(g.wrap)
                .with_placement(g.to_world)
        }
    }
}
