//! Derivatives with respect to the values of a grid.

use alloc::borrow::Cow;
use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;

use drt_math::{Rgb, Vec3};

use crate::Grid;

/// The derivative of a loss with respect to the values of a grid, as a sum over points between them.
///
/// Points are kept until they would take more memory than the values. Then they are added up at the values. So a sum over
/// few points takes little time and memory in a grid of any size.
#[derive(Clone, Debug, PartialEq)]
pub struct VoxelGradient {
    grid: Grid,
    /// What values are multiplied with to make the property that the loss depends on.
    scale: f64,
    /// What is kept, by the plane of the grid that it goes to, so that sums over a plane stay in a cache.
    planes: Vec<Parts>,
    /// How many numbers are kept in all planes.
    kept: usize,
    /// What has been added up; empty as long as everything is kept.
    values: Vec<f64>,
}

/// What points add to a plane of the grid: for each its place there, in unit coordinates, and its weighted derivative by each
/// channel. Blocks need not be copied as their number grows.
#[derive(Clone, Debug, Default, PartialEq)]
struct Parts(Vec<Vec<f64>>);

impl Parts {
    /// Numbers in a block.
    const BLOCK: usize = 512;

    #[inline]
    fn push<const N: usize>(&mut self, part: [f64; N]) {
        self.with_room(N).extend_from_slice(&part);
    }

    /// Adds other parts, whose blocks stay as they are unless little is in them.
    fn append(&mut self, o: Self) {
        for block in o.0 {
            if 2 * block.len() > Self::BLOCK {
                self.0.push(block);
            } else {
                self.with_room(block.len()).extend_from_slice(&block);
            }
        }
    }

    /// The last block, which has room for so many more numbers.
    #[inline]
    fn with_room(&mut self, numbers: usize) -> &mut Vec<f64> {
        if self.0.last().is_none_or(|block| block.len() + numbers > Self::BLOCK) {
            self.0.push(Vec::with_capacity(Self::BLOCK));
        }
        let last = self.0.len() - 1;
        &mut self.0[last]
    }
}

impl VoxelGradient {
    /// So many numbers are kept at least before they are added up.
    const FEW: usize = 1 << 15;

    /// No derivative yet by the values of a grid, which a property is `scale` times of.
    #[must_use]
    pub fn zeros(grid: &Grid, scale: f64) -> Self {
        let planes = vec![Parts::default(); grid.size()[2]];
        Self { grid: grid.clone(), scale, planes, kept: 0, values: Vec::new() }
    }

    /// Adds the derivative with respect to the field at a point of the unit cube.
    #[inline]
    pub(crate) fn add_at(&mut self, at: Vec3, adjoint: Rgb) {
        for (z, w) in self.grid.axes()[2].neighbours(at.z) {
            let plane = &mut self.planes[z];
            if self.grid.channels() == 1 {
                plane.push([at.x, at.y, adjoint.sum() * w]);
                self.kept += 3;
            } else {
                let Rgb { r, g, b } = adjoint * w;
                plane.push([at.x, at.y, r, g, b]);
                self.kept += 5;
            }
        }
        self.settle_if_many();
    }

    /// Adds another gradient by the same grid.
    pub fn add(&mut self, o: Self) {
        if self.kept == 0 && self.values.is_empty() {
            *self = o;
            return;
        }
        self.planes.iter_mut().zip(o.planes).for_each(|(own, other)| own.append(other));
        self.kept += o.kept;
        if !o.values.is_empty() {
            self.settle();
            self.values.iter_mut().zip(&o.values).for_each(|(sum, g)| *sum += g);
        }
        self.settle_if_many();
    }

    /// Adds the derivative by each value, times a factor, to numbers in the order and with the channels of the grid; a single
    /// channel stands for all three.
    pub fn add_to(&self, numbers: &mut [f64], factor: f64) {
        let [nx, ny, _] = self.grid.size();
        let row = nx * self.grid.channels();
        // Rounded in the same way whatever the numbers are: the sum first.
        let (mut sums, mut touched) = (vec![0.0; ny * row], vec![false; ny]);
        for (z, numbers) in numbers.chunks_exact_mut(ny * row).enumerate() {
            if let Some(values) = self.values.chunks_exact(ny * row).nth(z) {
                sums.copy_from_slice(values);
                touched.fill(true);
            }
            self.add_up(z, &mut sums, &mut touched);
            let rows = numbers.chunks_exact_mut(row).zip(sums.chunks_exact_mut(row));
            for ((numbers, sums), touched) in rows.zip(&mut touched) {
                if core::mem::take(touched) {
                    numbers
                        .iter_mut()
                        .zip(&*sums)
                        .for_each(|(number, sum)| *number += sum * factor);
                    sums.fill(0.0);
                }
            }
        }
    }

    /// The derivative by each value, in the order and with the channels of the grid; a single channel stands for all three.
    #[must_use]
    pub fn values(&self) -> Cow<'_, [f64]> {
        if self.kept == 0 && !self.values.is_empty() {
            return Cow::Borrowed(&self.values);
        }
        let mut values = vec![0.0; self.grid.values().len()];
        self.add_to(&mut values, 1.0);
        Cow::Owned(values)
    }

    /// The derivative with respect to the logarithm of a factor of all values.
    pub(crate) fn relative(&self) -> f64 {
        let gradient = self.values();
        let products = gradient.iter().zip(self.grid.values()).map(|(g, v)| g * v);
        products.sum::<f64>() * self.scale
    }

    /// The rate of the loss as some voxels change at these rates.
    pub(crate) fn dot(&self, rates: &BTreeMap<[usize; 3], Rgb>) -> f64 {
        let (values, channels) = (self.values(), self.grid.channels());
        let product = |(place, rate): (&[usize; 3], &Rgb)| -> f64 {
            let voxel = values.chunks_exact(channels).nth(self.grid.flatten(*place));
            voxel.unwrap_or_default().iter().zip(rate.to_array()).map(|(g, rate)| g * rate).sum()
        };
        rates.iter().map(product).sum()
    }

    fn settle_if_many(&mut self) {
        if self.kept >= usize::max(self.grid.values().len(), Self::FEW) {
            self.settle();
        }
    }

    fn settle(&mut self) {
        let mut values = core::mem::take(&mut self.values);
        if values.is_empty() {
            values = vec![0.0; self.grid.values().len()];
        }
        let ny = self.grid.size()[1];
        let plane = values.len() / self.planes.len();
        for (z, sums) in values.chunks_exact_mut(plane).enumerate() {
            self.add_up(z, sums, &mut vec![false; ny]);
        }
        self.values = values;
        self.planes.iter_mut().for_each(|plane| plane.0.clear());
        self.kept = 0;
    }

    /// Adds up what is kept of a plane at its values, and says which rows it touches.
    fn add_up(&self, z: usize, sums: &mut [f64], touched: &mut [bool]) {
        let ([x_axis, y_axis, _], channels) = (self.grid.axes(), self.grid.channels());
        let row = self.grid.size()[0] * channels;
        for part in self.planes[z].0.iter().flat_map(|block| block.chunks_exact(2 + channels)) {
            let ([x, y], adjoint) = ([part[0], part[1]], &part[2..]);
            for (y, wy) in y_axis.neighbours(y) {
                touched[y] = true;
                let sums = &mut sums[y * row..][..row];
                for (x, wx) in x_axis.neighbours(x) {
                    let to = &mut sums[x * channels..][..channels];
                    to.iter_mut().zip(adjoint).for_each(|(sum, g)| *sum += g * (wx * wy));
                }
            }
        }
    }
}
