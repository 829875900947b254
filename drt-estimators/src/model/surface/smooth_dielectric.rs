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

/// The lane of the cosine in dual numbers, after those of the properties.
const COSINE: usize = 3;

/// The least probability of refraction into the thinner medium, where light is refracted.
const LEAST_REFRACTION: f64 = 0.25;

/// The probability with which a walk is reflected, where the part `reflected` of the light is; `eta` is the index beyond over the index on the
/// walk's side.
///
/// At an angle x below the critical one the part 1 - F that is refracted grows like √x, and its derivative like 1/√x. If it also was the
/// probability, the second moment of that derivative would be ∫ x^(-3/2) dx. With a probability that stays away from zero it grows no faster than
/// a logarithm.
fn chance_of_reflection(reflected: f64, eta: f64) -> f64 {
    if eta < 1.0 && reflected < 1.0 { reflected.min(1.0 - LEAST_REFRACTION) } else { reflected }
}

impl Model for Dielectric {
    fn name(&self) -> &'static str {
        "dielectric"
    }

    #[inline]
    fn flags(&self) -> Flags {
        Flags { smooth: true, spread: false, bends: true, ..Flags::INTERFACE }
    }

    scatters_into_single_directions!(SpecularReflectance, SpecularTransmittance, Eta);

    fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        let Self { eta, specular_reflectance, specular_transmittance } = self;
        slot(property, eta, specular_reflectance, specular_transmittance)
    }

    fn validate(&self) -> Result<(), SurfaceError> {
        check(self.eta, self.specular_reflectance, self.specular_transmittance)
    }

    fn undifferentiated(&self, property: Property, textures: Textures<'_>) -> Option<&'static str> {
        let varies = property == Property::Eta && textures.of(property).is_some();
        varies.then_some("it turns light that goes through, and varies")
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
        let reflecting = chance_of_reflection(reflected, eta);
        if choice < reflecting {
            let weight = self.specular_reflectance * (reflected / reflecting);
            return Some(SpecularSample { w: mirrored(from, n), weight, straight: false });
        }
        let (w, _) = refracted(from, n, eta)?;
        // Radiance over squared index is what goes through; importance goes through as it is.
        let scale = match given {
            Given::Wo => 1.0 / (eta * eta),
            Given::Wi => 1.0,
        };
        let weight = self.specular_transmittance * (scale * (1.0 - reflected) / (1.0 - reflecting));
        Some(SpecularSample { w, weight, straight: false })
    }

    #[inline(never)]
    fn specular(&self, _: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Option<SpecularValue> {
        let cosine = n.dot(wo);
        let numbers = Lanes::<0>::new(self.differentiated());
        let own: Dual<f64, 4> = numbers.number(Property::Eta, self.eta);
        let (n, eta) = if cosine > 0.0 { (n, own) } else { (-n, own.recip()) };
        let reflected = dielectric_reflected(Dual::variable(cosine.abs(), COSINE), eta);
        let reflecting = chance_of_reflection(reflected.re, eta.re);
        let by_property = if cosine > 0.0 { 1.0 } else { -eta.re * eta.re };
        let found = |value: Rgb<Dual<f64, 4>>, probability, bend| {
            let by_cosine = value.map(|c| c.eps[COSINE] * cosine.signum());
            SpecularValue::by_duals(self.differentiated(), value, by_cosine, probability, bend)
        };
        if same(mirrored(wo, n), wi) {
            let colour = numbers.colour(Property::SpecularReflectance, self.specular_reflectance);
            let bend = Bend::reflection(eta.re, by_property);
            return Some(found(colour * reflected, reflecting, bend));
        }
        refracted(wo, n, eta.re).filter(|(w, _)| same(*w, wi))?;
        let colour = numbers.colour(Property::SpecularTransmittance, self.specular_transmittance);
        let value = colour * ((Dual::from(1.0) - reflected) / eta.squared());
        Some(found(value, 1.0 - reflecting, Bend::refraction(eta.re, by_property)))
    }
}
