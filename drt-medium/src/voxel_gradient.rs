//! Derivatives with respect to the values of a grid.

use alloc::borrow::Cow;
use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;

use drt_math::{Rgb, Vec3};

use crate::Grid;
use crate::lattice::Axis;

/// The derivative of a loss with respect to the values of a grid, as a sum over points between them.
///
/// Points are kept until they would take more memory than the values. Then they are added up at the values. So a sum over
/// few points takes little time and memory in a grid of any size.
#[derive(Clone, Debug, PartialEq)]
pub struct VoxelGradient {
    size: [usize; 3],
    channels: usize,
    axes: [Axis; 3],
    /// What is kept, by the plane of the grid that it goes to, which stays in a cache while it is added up.
    planes: Vec<Vec<Part>>,
    /// How many parts there are in all planes.
    kept: usize,
    /// What has been added up; empty as long as everything is kept.
    values: Vec<f64>,
}

/// What a point adds to a plane of the grid: its place there, in unit coordinates, and its weighted derivative.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Part {
    x: f64,
    y: f64,
    adjoint: Rgb,
}

impl VoxelGradient {
    /// So many values are in a cache, so that points in any order may be added to them one by one.
    const NEAR: usize = 1 << 17;

    /// No derivative yet.
    #[must_use]
    pub fn zeros(grid: &Grid) -> Self {
        let size = grid.size();
        Self {
            size,
            channels: grid.channels(),
            axes: *grid.axes(),
            planes: vec![Vec::new(); size[2]],
            kept: 0,
            values: Vec::new(),
        }
    }

    fn count(&self) -> usize {
        self.plane() * self.size[2]
    }

    /// Values of a plane.
    fn plane(&self) -> usize {
        self.size[0] * self.size[1] * self.channels
    }

    /// Adds the derivative with respect to the field at a point of the unit cube.
    #[inline]
    pub(crate) fn add_at(&mut self, at: Vec3, adjoint: Rgb) {
        for (z, w) in self.axes[2].neighbours(at.z) {
            let part = Part { x: at.x, y: at.y, adjoint: adjoint * w };
            if self.is_near() {
                let (plane, mut values) = (self.plane(), core::mem::take(&mut self.values));
                let on_plane = &mut values[z * plane..][..plane];
                self.spread(&part, |at, g| on_plane[at] += g);
                self.values = values;
            } else {
                self.planes[z].push(part);
                self.kept += 1;
            }
        }
        self.settle_if_large();
    }

    /// True where parts need not be kept.
    fn is_near(&self) -> bool {
        !self.values.is_empty() && self.values.len() <= Self::NEAR
    }

    /// Adds another gradient by the same grid.
    pub fn add(&mut self, o: Self) {
        if self.kept == 0 && self.values.is_empty() {
            *self = o;
            return;
        }
        for (own, mut other) in self.planes.iter_mut().zip(o.planes) {
            own.append(&mut other);
        }
        self.kept += o.kept;
        if !o.values.is_empty() {
            self.settle();
            self.values.iter_mut().zip(&o.values).for_each(|(sum, g)| *sum += g);
        }
        self.settle_if_large();
    }

    /// Adds the derivative by each value, times a factor, to numbers in the order and with the channels of the grid; a single
    /// channel stands for all three.
    pub fn add_to(&self, numbers: &mut [f64], factor: f64) {
        if self.values.is_empty() {
            self.add_kept_to(numbers, factor);
        } else {
            let values = self.values();
            numbers.iter_mut().zip(&*values).for_each(|(number, g)| *number += g * factor);
        }
    }

    /// The derivative by each value, in the order and with the channels of the grid; a single channel stands for all three.
    #[must_use]
    pub fn values(&self) -> Cow<'_, [f64]> {
        if self.kept == 0 && !self.values.is_empty() {
            return Cow::Borrowed(&self.values);
        }
        let mut values =
            if self.values.is_empty() { vec![0.0; self.count()] } else { self.values.clone() };
        self.add_kept_to(&mut values, 1.0);
        Cow::Owned(values)
    }

    /// The rate of the loss as some voxels change at these rates.
    pub(crate) fn dot(&self, rates: &BTreeMap<[usize; 3], Rgb>) -> f64 {
        let [nx, ny, _] = self.size;
        let values = self.values();
        let voxel = |[i, j, k]: [usize; 3]| match &values[((k * ny + j) * nx + i) * self.channels..]
        {
            [r, g, b, ..] if self.channels == 3 => Rgb::new(*r, *g, *b),
            [one, ..] => Rgb::new(*one, 0.0, 0.0),
            [] => Rgb::ZERO,
        };
        rates.iter().map(|(place, rate)| voxel(*place).dot(*rate)).sum()
    }

    fn settle_if_large(&mut self) {
        let bytes = self.kept * size_of::<Part>();
        if bytes > 0 && (self.is_near() || bytes >= self.count() * size_of::<f64>()) {
            self.settle();
        }
    }

    fn settle(&mut self) {
        let mut values = core::mem::take(&mut self.values);
        if values.is_empty() {
            values = vec![0.0; self.count()];
        }
        self.add_kept_to(&mut values, 1.0);
        self.planes.iter_mut().for_each(|plane| *plane = Vec::new());
        (self.kept, self.values) = (0, values);
    }

    /// Adds up what is kept at each value, and adds the sums, times a factor, to numbers.
    fn add_kept_to(&self, numbers: &mut [f64], factor: f64) {
        if self.kept == 0 {
            return;
        }
        let plane = self.plane();
        let (mut sums, mut touched) = (vec![0.0; plane], Vec::new());
        for (parts, numbers) in self.planes.iter().zip(numbers.chunks_exact_mut(plane)) {
            for part in parts {
                self.spread(part, |at, g| {
                    sums[at] += g;
                    touched.push(at);
                });
            }
            for at in touched.drain(..) {
                let sum = core::mem::take(&mut sums[at]);
                if sum != 0.0 {
                    numbers[at] += sum * factor;
                }
            }
        }
    }

    /// Distributes a part among the four values around it, which are numbered within its plane.
    #[inline]
    fn spread(&self, part: &Part, mut to: impl FnMut(usize, f64)) {
        for (y, wy) in self.axes[1].neighbours(part.y) {
            for (x, wx) in self.axes[0].neighbours(part.x) {
                let (at, w) = ((y * self.size[0] + x) * self.channels, wx * wy);
                if self.channels == 1 {
                    to(at, part.adjoint.sum() * w);
                } else {
                    for (c, adjoint) in part.adjoint.to_array().into_iter().enumerate() {
                        to(at + c, adjoint * w);
                    }
                }
            }
        }
    }
}
