use alloc::sync::Arc;
use core::ops::ControlFlow;

use drt_math::{Affine, Rgb, Vec3};

use crate::bounds::{Bounds, clip_to_box, in_unit_cube};
use crate::homogeneous::check;
use crate::volume::check_grid;
use crate::{
    CoefficientGradients, Coefficients, DensityField, Grid, MediumError, Piece, Property, Ray,
    Volume,
};

/// A medium given by voxels: extinction = scale × density grid, with albedo and emission from
/// grids of their own (each with its own resolution and placement) or constant.
///
/// The medium ends at the box of its *density* grid: outside there is nothing, even where a wrap
/// mode would continue the values. Changes of a parameter may push values outside the physical
/// range; every estimate is then that of the analytic continuation.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(into = "stored::GridMedium", try_from = "stored::GridMedium"))]
pub struct GridMedium {
    pub(crate) density: Grid,
    pub(crate) scale: f64,
    pub(crate) albedo: Volume,
    pub(crate) emission: Volume,
    bounds: Arc<Bounds>,
    floor_depth: f64,
}

impl GridMedium {
    /// Optical depth of the least majorant of defensive sampling along the diagonal of the box.
    pub const DEFAULT_FLOOR_DEPTH: f64 = 1.0;

    /// A medium with extinction `scale × density` (1 / scene unit), and emitted radiance `emission`.
    ///
    /// # Errors
    /// When a coefficient is negative or not finite, or an albedo exceeds one.
    pub fn new(
        density: Grid,
        scale: f64,
        albedo: Volume,
        emission: Volume,
    ) -> Result<Self, MediumError> {
        check(Property::SigmaT, Rgb::splat(scale))?;
        check_grid(Property::SigmaT, &density, 1.0)?;
        albedo.check(Property::Albedo)?;
        emission.check(Property::Emission)?;
        let bounds = Arc::new(Bounds::new(&density));
        let floor_depth = Self::DEFAULT_FLOOR_DEPTH;
        Ok(Self { density, scale, albedo, emission, bounds, floor_depth })
    }

    /// Refuses values outside of a property's physical range.
    pub(crate) fn check_property(&self, property: Property) -> Result<(), MediumError> {
        match property {
            Property::SigmaT => {
                check(property, Rgb::splat(self.scale))?;
                check_grid(property, &self.density, self.scale)
            }
            Property::Albedo => self.albedo.check(property),
            Property::Emission => self.emission.check(property),
            _ => Ok(()),
        }
    }

    /// Another least majorant for defensive sampling, given by its optical depth along the diagonal
    /// of the box: about `defensive × depth` events per diagonal fall into empty voxels.
    #[must_use]
    pub fn with_floor_depth(mut self, depth: f64) -> Self {
        self.floor_depth = f64::max(depth, 0.0);
        self
    }

    /// The density grid.
    #[must_use]
    pub fn density(&self) -> &Grid {
        &self.density
    }
    /// What the density is multiplied with.
    #[must_use]
    pub fn scale(&self) -> f64 {
        self.scale
    }
    /// The albedo.
    #[must_use]
    pub fn albedo(&self) -> &Volume {
        &self.albedo
    }
    /// The emitted radiance.
    #[must_use]
    pub fn emission(&self) -> &Volume {
        &self.emission
    }
    /// Largest extinction in the medium over all channels, in 1 / scene unit.
    #[must_use]
    pub fn largest_sigma_t(&self) -> f64 {
        self.scale * self.bounds.largest()
    }

    /// The share of voxels in which some channel's extinction is below `sigma_t`, in 1 / scene unit.
    #[must_use]
    pub fn share_below(&self, sigma_t: f64) -> f64 {
        let channels = self.density.channels();
        let voxels = self.density.values().chunks(channels);
        let thin = |voxel: &&[f64]| voxel.iter().any(|v| v.abs() * self.scale < sigma_t);
        voxels.filter(thin).count() as f64 * channels as f64 / self.density.values().len() as f64
    }

    pub(crate) fn is_scattering(&self) -> bool {
        self.largest_sigma_t() > 0.0 && !self.albedo.is_zero()
    }
    pub(crate) fn is_emissive(&self) -> bool {
        self.largest_sigma_t() > 0.0 && !self.albedo.is_one() && !self.emission.is_zero()
    }

    /// The grids of the density, the albedo and the emission, as far as they are grids.
    pub(crate) fn volumes(&self) -> [Option<&Grid>; 3] {
        [Some(&self.density), self.albedo.grid(), self.emission.grid()]
    }

    /// True where the medium can be: in the closed box of the density grid.
    #[inline]
    #[must_use]
    pub fn contains(&self, x: Vec3) -> bool {
        in_unit_cube(self.density.from_world().point(x))
    }

    /// Brings the bounds up to date after a change of one voxel of the density, or of all.
    pub(crate) fn update_bounds(&mut self, voxel: Option<[usize; 3]>) {
        match voxel {
            Some(v) => Arc::make_mut(&mut self.bounds).refresh(&self.density, v),
            None => self.bounds = Arc::new(Bounds::new(&self.density)),
        }
    }

    /// Moves all grids by a map of the world.
    ///
    /// # Errors
    /// When the map is singular.
    pub fn place(&mut self, map: &Affine) -> Result<(), MediumError> {
        self.density.place(map)?;
        self.albedo.place(map)?;
        self.emission.place(map)
    }
}

impl DensityField for GridMedium {
    #[inline]
    fn coefficients(&self, x: Vec3) -> Coefficients {
        let u = self.density.from_world().point(x);
        if !in_unit_cube(u) {
            return Coefficients::VACUUM;
        }
        Coefficients {
            sigma_t: self.density.value_at_unit(u) * self.scale,
            albedo: self.albedo.value(x),
            emission: self.emission.value(x),
        }
    }

    #[inline]
    fn sigma_t(&self, x: Vec3) -> Rgb {
        let u = self.density.from_world().point(x);
        if in_unit_cube(u) { self.density.value_at_unit(u) * self.scale } else { Rgb::ZERO }
    }

    fn gradients(&self, x: Vec3) -> CoefficientGradients {
        if !self.contains(x) {
            return CoefficientGradients::ZERO;
        }
        CoefficientGradients {
            sigma_t: self.density.gradient(x) * self.scale,
            albedo: self.albedo.gradient(x),
            emission: self.emission.gradient(x),
        }
    }

    #[inline(always)]
    fn pieces(&self, ray: &Ray, visit: &mut dyn FnMut(&Piece) -> ControlFlow<()>) {
        self.bounds.walk(&self.density, self.scale, ray, visit);
    }

    fn means(&self, ray: &Ray, visit: &mut dyn FnMut(&Piece) -> ControlFlow<()>) {
        self.bounds.walk_whole(&self.density, self.scale, ray, visit);
    }

    fn covered(&self, ray: &Ray) -> Option<(f64, f64)> {
        clip_to_box(&self.density, ray)
    }

    fn majorant_floor(&self) -> f64 {
        self.floor_depth / self.density.world_extent().length()
    }

    fn feature_size(&self) -> f64 {
        self.density.voxel_size()
    }
}

#[cfg(feature = "serde")]
mod stored {
    use super::{Grid, MediumError, Volume};

    /// What a file holds of a grid medium; the bounds follow from it.
    #[derive(serde::Serialize, serde::Deserialize)]
    pub(super) struct GridMedium {
        density: Grid,
        scale: f64,
        albedo: Volume,
        emission: Volume,
        floor_depth: f64,
    }

    impl From<super::GridMedium> for GridMedium {
        fn from(m: super::GridMedium) -> Self {
            let super::GridMedium { density, scale, albedo, emission, floor_depth, .. } = m;
            Self { density, scale, albedo, emission, floor_depth }
        }
    }

    impl TryFrom<GridMedium> for super::GridMedium {
        type Error = MediumError;
        fn try_from(m: GridMedium) -> Result<Self, MediumError> {
            let medium = Self::new(m.density, m.scale, m.albedo, m.emission)?;
            Ok(medium.with_floor_depth(m.floor_depth))
        }
    }
}
