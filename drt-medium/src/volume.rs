//! Quantities that a medium has at every point of space.

use drt_math::{Affine, Rgb, RgbVec, Vec3};

use crate::homogeneous::check;
use crate::{Grid, MediumError, Property};

/// A quantity in space: one constant or a grid.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[expect(clippy::large_enum_variant, reason = "few exist; a box would cost every lookup")]
pub enum Volume {
    /// The same everywhere.
    Constant(Rgb),
    /// Given by voxels.
    Grid(Grid),
}

impl Volume {
    /// The quantity at a point of the world.
    #[inline]
    #[must_use]
    pub fn value(&self, x: Vec3) -> Rgb {
        match self {
            Self::Constant(c) => *c,
            Self::Grid(g) => g.value(x),
        }
    }
    /// Its gradient there, per scene unit.
    #[inline]
    #[must_use]
    pub fn gradient(&self, x: Vec3) -> RgbVec {
        match self {
            Self::Constant(_) => RgbVec::ZERO,
            Self::Grid(g) => g.gradient(x),
        }
    }
    /// The grid, if it is one.
    #[must_use]
    pub fn grid(&self) -> Option<&Grid> {
        match self {
            Self::Constant(_) => None,
            Self::Grid(g) => Some(g),
        }
    }
    pub(crate) fn grid_mut(&mut self) -> Option<&mut Grid> {
        match self {
            Self::Constant(_) => None,
            Self::Grid(g) => Some(g),
        }
    }
    pub(crate) fn is_zero(&self) -> bool {
        match self {
            Self::Constant(c) => c.is_zero(),
            Self::Grid(g) => g.values().iter().all(|&v| v == 0.0),
        }
    }
    pub(crate) fn is_one(&self) -> bool {
        match self {
            Self::Constant(c) => *c == Rgb::ONE,
            Self::Grid(g) => g.values().iter().all(|&v| v == 1.0),
        }
    }
    pub(crate) fn check(&self, property: Property) -> Result<(), MediumError> {
        match self {
            Self::Constant(c) => check(property, *c),
            Self::Grid(g) => check_grid(property, g, 1.0),
        }
    }
    pub(crate) fn place(&mut self, map: &Affine) -> Result<(), MediumError> {
        match self {
            Self::Constant(_) => Ok(()),
            Self::Grid(g) => g.place(map),
        }
    }
}

/// Refuses a grid with values that times `scale` are out of the property's range.
pub(crate) fn check_grid(property: Property, grid: &Grid, scale: f64) -> Result<(), MediumError> {
    grid.values().iter().try_for_each(|&v| check(property, Rgb::splat(v * scale)))
}

/// Refuses a grid of more than one channel, or with a value that `check` refuses.
pub(crate) fn check_scalars(
    property: Property,
    grid: &Grid,
    check: impl Fn(f64) -> Result<(), MediumError>,
) -> Result<(), MediumError> {
    if grid.channels() != 1 {
        return Err(MediumError::NotScalar { property });
    }
    grid.values().iter().try_for_each(|v| check(*v))
}
