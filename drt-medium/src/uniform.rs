use alloc::sync::Arc;

use drt_math::{Affine, Mat3, Rgb, RgbVec, Vec3};

use crate::volume::Volume;
use crate::{
    CoefficientGradients, Coefficients, Grid, Homogeneous, MediumError, Property, SpaceMap,
};

/// A medium with the same extinction everywhere, and an albedo and an emitted radiance from volumes: a
/// homogeneous medium that is dyed unevenly.
///
/// Distances and transmittances have the closed forms of [`Homogeneous`]; only where light scatters are the
/// volumes looked up. Like a homogeneous medium it has no boundary of its own, and its volumes go on beyond
/// their boxes by their wrap modes. Changes of a parameter move its grids with everything they hold.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(into = "stored::UniformMedium"))]
#[cfg_attr(feature = "serde", serde(try_from = "stored::UniformMedium"))]
pub struct UniformMedium {
    /// Without albedo and emission.
    pub(crate) extinction: Homogeneous,
    pub(crate) albedo: Volume,
    pub(crate) emission: Volume,
    /// Where the grids were placed before space was deformed.
    map: Option<Arc<dyn SpaceMap>>,
}

impl UniformMedium {
    /// A medium with extinction `sigma_t` (1 / scene unit), and emitted radiance `emission`.
    ///
    /// # Errors
    /// When a coefficient is negative or not finite, or an albedo exceeds one.
    pub fn new(sigma_t: Rgb, albedo: Volume, emission: Volume) -> Result<Self, MediumError> {
        let extinction = Homogeneous::new(sigma_t, Rgb::ZERO, Rgb::ZERO)?;
        albedo.check(Property::Albedo)?;
        emission.check(Property::Emission)?;
        Ok(Self { extinction, albedo, emission, map: None })
    }

    /// The extinction, in 1 / scene unit.
    #[inline]
    #[must_use]
    pub fn sigma_t(&self) -> Rgb {
        self.extinction.coefficients().sigma_t
    }
    /// The albedo, as it was placed before any deformation.
    #[must_use]
    pub fn albedo(&self) -> &Volume {
        &self.albedo
    }
    /// The emitted radiance, as it was placed before any deformation.
    #[must_use]
    pub fn emission(&self) -> &Volume {
        &self.emission
    }

    pub(crate) fn is_scattering(&self) -> bool {
        !self.sigma_t().is_zero() && !self.albedo.is_zero()
    }
    pub(crate) fn is_emissive(&self) -> bool {
        !self.sigma_t().is_zero() && !self.albedo.is_one() && !self.emission.is_zero()
    }

    pub(crate) fn check_property(&self, property: Property) -> Result<(), MediumError> {
        match property {
            Property::SigmaT => crate::homogeneous::check(property, self.sigma_t()),
            Property::Albedo => self.albedo.check(property),
            Property::Emission => self.emission.check(property),
            _ => Ok(()),
        }
    }

    /// The grids of the extinction, the albedo and the emission, as far as they are grids.
    pub(crate) fn volumes(&self) -> [Option<&Grid>; 3] {
        [None, self.albedo.grid(), self.emission.grid()]
    }

    /// The material point at a point of the world, and its derivative by that. What is beyond the deformed
    /// part of space is at rest.
    #[inline]
    pub(crate) fn material(&self, x: Vec3) -> (Vec3, Mat3) {
        let place = self.map.as_ref().and_then(|map| map.material(x));
        place.unwrap_or((x, Mat3::IDENTITY))
    }

    #[inline]
    pub(crate) fn coefficients(&self, x: Vec3) -> Coefficients {
        let (x, _) = self.material(x);
        Coefficients {
            sigma_t: self.sigma_t(),
            albedo: self.albedo.value(x),
            emission: self.emission.value(x),
        }
    }

    pub(crate) fn gradients(&self, x: Vec3) -> CoefficientGradients {
        let (x, slope) = self.material(x);
        let world = |g: RgbVec| g.map(|g| slope.transpose_mul(g));
        CoefficientGradients {
            sigma_t: RgbVec::ZERO,
            albedo: world(self.albedo.gradient(x)),
            emission: world(self.emission.gradient(x)),
        }
    }

    pub(crate) fn is_deformed(&self) -> bool {
        self.map.is_some()
    }

    pub(crate) fn deform(&mut self, map: Arc<dyn SpaceMap>) -> Result<(), MediumError> {
        if self.is_deformed() {
            return Err(MediumError::Deformed);
        }
        self.map = Some(map);
        Ok(())
    }

    pub(crate) fn place(&mut self, map: &Affine) -> Result<(), MediumError> {
        if self.is_deformed() {
            return Err(MediumError::Deformed);
        }
        self.albedo.place(map)?;
        self.emission.place(map)
    }
}

#[cfg(feature = "serde")]
mod stored {
    use drt_math::Rgb;

    use super::{MediumError, Volume};

    /// What a file holds of a medium of uniform extinction. A deformation is not kept.
    #[derive(serde::Serialize, serde::Deserialize)]
    pub(super) struct UniformMedium {
        sigma_t: Rgb,
        albedo: Volume,
        emission: Volume,
    }

    impl From<super::UniformMedium> for UniformMedium {
        fn from(m: super::UniformMedium) -> Self {
            Self { sigma_t: m.sigma_t(), albedo: m.albedo, emission: m.emission }
        }
    }

    impl TryFrom<UniformMedium> for super::UniformMedium {
        type Error = MediumError;
        fn try_from(m: UniformMedium) -> Result<Self, MediumError> {
            Self::new(m.sigma_t, m.albedo, m.emission)
        }
    }
}
