//! Smooth surfaces: mirrors, glass and thin glass. They scatter into single directions, which have no
//! density; a walk draws them by [`Bsdf::sample_specular`](crate::surface::Bsdf::sample_specular).

use drt_math::{Rgb, Vec3};

use crate::model::surface::fresnel::{conductor_reflected, dielectric_reflected};
use crate::model::surface::microfacet::{mirrored, refracted};
use crate::model::surface::property::{Property, Slot, SurfaceError, in_range, nonnegative};
use crate::model::surface::{Given, SpecularSample};

/// A smooth metal: Mitsuba's `conductor`. Black from behind.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Conductor {
    /// Real part of the index of refraction over the exterior's; default 0.
    pub eta: Rgb,
    /// Imaginary part (absorption) of the same; default 1, which with `eta` 0 reflects everything.
    pub k: Rgb,
    /// Factor of the reflection; default 1.
    pub specular_reflectance: Rgb,
}

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

/// A pane so thin that light goes straight through it, with all reflections inside of it: Mitsuba's
/// `thindielectric`. Both sides are alike.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ThinDielectric {
    /// Index of the pane over that of what is around it; default glass (BK7) in air.
    pub eta: f64,
    /// Factor of the reflection; default 1.
    pub specular_reflectance: Rgb,
    /// Factor of what goes through; default 1.
    pub specular_transmittance: Rgb,
}

impl Default for Conductor {
    fn default() -> Self {
        Self { eta: Rgb::ZERO, k: Rgb::ONE, specular_reflectance: Rgb::ONE }
    }
}

/// Glass (BK7) in air.
const GLASS: f64 = 1.5046 / 1.000_277;

impl Default for Dielectric {
    fn default() -> Self {
        let (specular_reflectance, specular_transmittance) = (Rgb::ONE, Rgb::ONE);
        Self { eta: GLASS, specular_reflectance, specular_transmittance }
    }
}

impl Default for ThinDielectric {
    fn default() -> Self {
        let (specular_reflectance, specular_transmittance) = (Rgb::ONE, Rgb::ONE);
        Self { eta: GLASS, specular_reflectance, specular_transmittance }
    }
}

impl Conductor {
    pub(super) fn sample(&self, from: Vec3, n: Vec3) -> Option<SpecularSample> {
        let cos = n.dot(from);
        let reflected = |eta, k| conductor_reflected(cos, eta, k);
        (cos > 0.0).then(|| SpecularSample {
            w: mirrored(from, n),
            weight: self.specular_reflectance
                * Rgb::new(
                    reflected(self.eta.r, self.k.r),
                    reflected(self.eta.g, self.k.g),
                    reflected(self.eta.b, self.k.b),
                ),
            straight: false,
        })
    }

    pub(super) fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        match property {
            Property::Eta => Some(Slot::Color(&mut self.eta)),
            Property::K => Some(Slot::Color(&mut self.k)),
            Property::SpecularReflectance => Some(Slot::Color(&mut self.specular_reflectance)),
            _ => None,
        }
    }

    pub(super) fn validate(&self) -> Result<(), SurfaceError> {
        nonnegative(Property::SpecularReflectance, self.specular_reflectance)?;
        nonnegative(Property::Eta, self.eta)?;
        nonnegative(Property::K, self.k)?;
        let indices = self.eta + self.k;
        indices.to_array().into_iter().try_for_each(|sum| {
            in_range(Property::K, sum, sum > 0.0, "above 0 in channels where eta is 0")
        })
    }
}

impl Dielectric {
    pub(super) fn sample(
        &self,
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

    pub(super) fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        match property {
            Property::Eta => Some(Slot::Scalar(&mut self.eta)),
            Property::SpecularReflectance => Some(Slot::Color(&mut self.specular_reflectance)),
            Property::SpecularTransmittance => Some(Slot::Color(&mut self.specular_transmittance)),
            _ => None,
        }
    }

    pub(super) fn validate(&self) -> Result<(), SurfaceError> {
        check(self.eta, self.specular_reflectance, self.specular_transmittance)
    }
}

impl ThinDielectric {
    /// The part of the light that comes back, at a cosine above 0.
    fn reflected(&self, cos: f64) -> f64 {
        let once = dielectric_reflected(cos, self.eta);
        // The sum of the light that leaves after 0, 1, 2 … turns in the pane.
        if once < 1.0 { 2.0 * once / (1.0 + once) } else { 1.0 }
    }

    /// What goes through.
    pub(super) fn straight(&self, cos: f64) -> Rgb {
        let reflected = if cos > 0.0 { self.reflected(cos.min(1.0)) } else { 1.0 };
        self.specular_transmittance * (1.0 - reflected)
    }

    pub(super) fn sample(&self, from: Vec3, n: Vec3, choice: f64) -> Option<SpecularSample> {
        let cos = n.dot(from).abs();
        if cos == 0.0 {
            return None;
        }
        let reflected = self.reflected(cos);
        Some(if choice < reflected {
            let weight = self.specular_reflectance;
            SpecularSample { w: mirrored(from, n), weight, straight: false }
        } else {
            SpecularSample { w: -from, weight: self.specular_transmittance, straight: true }
        })
    }

    pub(super) fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        match property {
            Property::Eta => Some(Slot::Scalar(&mut self.eta)),
            Property::SpecularReflectance => Some(Slot::Color(&mut self.specular_reflectance)),
            Property::SpecularTransmittance => Some(Slot::Color(&mut self.specular_transmittance)),
            _ => None,
        }
    }

    pub(super) fn validate(&self) -> Result<(), SurfaceError> {
        check(self.eta, self.specular_reflectance, self.specular_transmittance)
    }
}

fn check(eta: f64, reflectance: Rgb, transmittance: Rgb) -> Result<(), SurfaceError> {
    in_range(Property::Eta, eta, eta > 0.0, "above 0")?;
    nonnegative(Property::SpecularReflectance, reflectance)?;
    nonnegative(Property::SpecularTransmittance, transmittance)
}
