//! Smooth interfaces of two transparent media.

use drt_geom::edges::Lobes;
use drt_math::{Dual, Real, Rgb, Vec3};

use crate::model::surface::fresnel::dielectric_reflected;
use crate::model::surface::microfacet::{mirrored, refracted};
use crate::model::surface::model::{Dependence, Flags, Lanes, Model, Numbers};
use crate::model::surface::params::PropertySet;
use crate::model::surface::property::{Property, Slot, SurfaceError, in_range, nonnegative};
use crate::model::surface::specular::{Bend, same, scatters_into_single_directions};
use crate::model::surface::textures::Textures;
use crate::model::surface::{At, BsdfGradient, Given, SpecularSample, SpecularValue};

/// A smooth interface of two transparent media: Mitsuba's `dielectric`. The normal points to the
/// exterior. Radiance is transported, as by [`RoughDielectric`](super::RoughDielectric).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Dielectric {
    /// Index of the interior over that of the exterior; default glass (BK7) in air.
    pub eta: f64,
    /// Factor of the reflection; default 1.
    pub specular_reflectance: Rgb,
    /// Factor of the refraction; default 1.
    pub specular_transmittance: Rgb,
}

/// Glass (BK7) in air.
pub(super) const GLASS: f64 = 1.5046 / 1.000_277;

impl Default for Dielectric {
    fn default() -> Self {
        let (specular_reflectance, specular_transmittance) = (Rgb::ONE, Rgb::ONE);
        Self { eta: GLASS, specular_reflectance, specular_transmittance }
    }
}

/// Checks the numbers of an interface or a pane.
pub(super) fn check(eta: f64, reflectance: Rgb, transmittance: Rgb) -> Result<(), SurfaceError> {
    in_range(Property::Eta, eta, eta > 0.0, "above 0")?;
    nonnegative(Property::SpecularReflectance, reflectance)?;
    nonnegative(Property::SpecularTransmittance, transmittance)
}

/// Where an interface or a pane keeps a property.
pub(super) fn slot<'a>(
    property: Property,
    eta: &'a mut f64,
    reflectance: &'a mut Rgb,
    transmittance: &'a mut Rgb,
) -> Option<Slot<'a>> {
    match property {
        Property::Eta => Some(Slot::Scalar(eta)),
        Property::SpecularReflectance => Some(Slot::Color(reflectance)),
        Property::SpecularTransmittance => Some(Slot::Color(transmittance)),
        _ => None,
    }
}

impl Model for Dielectric {
    fn name(&self) -> &'static str {
        "dielectric"
    }

    #[inline]
    fn flags(&self) -> Flags {
        Flags { smooth: true, spread: false, ..Flags::INTERFACE }
    }

    scatters_into_single_directions!(SpecularReflectance, SpecularTransmittance);

    fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        let Self { eta, specular_reflectance, specular_transmittance } = self;
        slot(property, eta, specular_reflectance, specular_transmittance)
    }

    fn validate(&self) -> Result<(), SurfaceError> {
        check(self.eta, self.specular_reflectance, self.specular_transmittance)
    }

    fn undifferentiated(&self, property: Property, _: Textures<'_>) -> Option<&'static str> {
        (property == Property::Eta).then_some("it turns light that goes through")
    }

    #[inline(never)]
    fn sample_specular(
        &self,
        _: At<'_>,
        from: Vec3,
        n: Vec3,
        choice: f64,
        given: Given,
    ) -> Option<SpecularSample> {
        let cos = n.dot(from);
        let (n, eta) = if cos > 0.0 { (n, self.eta) } else { (-n, self.eta.recip()) };
        let cos = cos.abs();
        if cos == 0.0 {
            return None;
        }
        let reflected = dielectric_reflected(cos, eta);
        if choice < reflected {
            let weight = self.specular_reflectance;
            return Some(SpecularSample { w: mirrored(from, n), weight, straight: false });
        }
        let (w, _) = refracted(from, n, eta)?;
        // Radiance over squared index is what goes through; importance goes through as it is.
        let scale = match given {
            Given::Wo => 1.0 / (eta * eta),
            Given::Wi => 1.0,
        };
        Some(SpecularSample { w, weight: self.specular_transmittance * scale, straight: false })
    }

    #[inline(never)]
    fn specular(&self, _: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Option<SpecularValue> {
        let cos = n.dot(wo);
        let (n, eta) = if cos > 0.0 { (n, self.eta) } else { (-n, self.eta.recip()) };
        let side = cos.signum();
        let reflected = dielectric_reflected(Dual::variable(cos.abs(), 0), Dual::from(eta));
        let Dual { re: reflected, eps: [by_cosine] } = reflected;
        let properties = self.differentiated();
        let colour = |property, colour| -> Rgb<Dual<f64, 2>> {
            Lanes::<0>::new(properties).colour(property, colour)
        };
        if same(mirrored(wo, n), wi) {
            let value = colour(Property::SpecularReflectance, self.specular_reflectance)
                * Dual::from(reflected);
            let by_cosine = self.specular_reflectance * (by_cosine * side);
            return Some(SpecularValue::by_duals(
                properties,
                value,
                by_cosine,
                reflected,
                Bend::Mirror,
            ));
        }
        refracted(wo, n, eta).filter(|(w, _)| same(*w, wi))?;
        let through = (1.0 - reflected) / (eta * eta);
        let value = colour(Property::SpecularTransmittance, self.specular_transmittance)
            * Dual::from(through);
        let by_cosine = self.specular_transmittance * (-by_cosine * side / (eta * eta));
        let bend = Bend::Refraction(eta);
        Some(SpecularValue::by_duals(properties, value, by_cosine, 1.0 - reflected, bend))
    }
}
