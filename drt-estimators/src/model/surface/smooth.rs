//! Smooth surfaces: mirrors, glass and thin glass. They scatter into single directions, which have no
//! density; a walk draws them by [`Bsdf::sample_specular`](crate::surface::Bsdf::sample_specular).

use drt_math::{Dual, Real, Rgb, Vec3};

use crate::model::surface::fresnel::{conductor_reflected, conductor_slopes, dielectric_reflected};
use crate::model::surface::microfacet::{mirrored, refracted};
use crate::model::surface::property::{Property, Slot, SurfaceError, in_range, nonnegative};
use crate::model::surface::specular::same;
use crate::model::surface::{BsdfParams, Given, SpecularSample, SpecularValue};

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

    pub(super) fn specular(&self, wo: Vec3, wi: Vec3, n: Vec3) -> Option<SpecularValue> {
        let cos = n.dot(wo);
        if cos <= 0.0 || !same(mirrored(wo, n), wi) {
            return None;
        }
        let SpecularSample { weight: value, .. } = self.sample(wo, n)?;
        let of_index = |channel: usize| {
            let [eta, k] = [self.eta, self.k].map(|index| index.to_array()[channel]);
            let [_, by_eta, by_k] = conductor_slopes(cos, eta, k);
            [conductor_reflected(cos, eta, k), by_eta, by_k]
        };
        let [r, g, b] = [0, 1, 2].map(of_index);
        let [reflected, by_eta, by_k] = [0, 1, 2].map(|i| Rgb::new(r[i], g[i], b[i]));
        let params = BsdfParams {
            specular_reflectance: reflected,
            eta: self.specular_reflectance * by_eta,
            k: self.specular_reflectance * by_k,
            ..BsdfParams::default()
        };
        Some(SpecularValue { value, params, probability: 1.0 })
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

    pub(super) fn specular(&self, wo: Vec3, wi: Vec3, n: Vec3) -> Option<SpecularValue> {
        let cos = n.dot(wo);
        let (n, eta) = if cos > 0.0 { (n, self.eta) } else { (-n, self.eta.recip()) };
        let reflected = dielectric_reflected(cos.abs(), eta);
        let mut params = BsdfParams::default();
        if same(mirrored(wo, n), wi) {
            params.specular_reflectance = Rgb::splat(reflected);
            let value = self.specular_reflectance * reflected;
            return Some(SpecularValue { value, params, probability: reflected });
        }
        refracted(wo, n, eta).filter(|(w, _)| same(*w, wi))?;
        let through = (1.0 - reflected) / (eta * eta);
        params.specular_transmittance = Rgb::splat(through);
        let value = self.specular_transmittance * through;
        Some(SpecularValue { value, params, probability: 1.0 - reflected })
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
        reflected_by_pane(cos, self.eta)
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

    pub(super) fn specular(&self, wo: Vec3, wi: Vec3, n: Vec3) -> Option<SpecularValue> {
        let cos = n.dot(wo).abs().min(1.0);
        let mut params = BsdfParams::default();
        let reflected = reflected_by_pane(Dual::<f64, 1>::from(cos), Dual::variable(self.eta, 0));
        let (part, by_eta) = (reflected.re, reflected.eps[0]);
        if same(-wo, wi) {
            params.specular_transmittance = Rgb::splat(1.0 - part);
            params.eta = self.specular_transmittance * -by_eta;
            let value = self.specular_transmittance * (1.0 - part);
            return Some(SpecularValue { value, params, probability: 1.0 - part });
        }
        same(mirrored(wo, n), wi).then(|| {
            params.specular_reflectance = Rgb::splat(part);
            params.eta = self.specular_reflectance * by_eta;
            let value = self.specular_reflectance * part;
            SpecularValue { value, params, probability: part }
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

/// The part of the light that comes back from a pane, at a cosine above 0.
fn reflected_by_pane<T: Real>(cos: T, eta: T) -> T {
    let once = dielectric_reflected(cos, eta);
    // The sum of the light that leaves after 0, 1, 2 … turns in the pane.
    if once.re() < 1.0 { once * 2.0 / (T::one() + once) } else { T::one() }
}

fn check(eta: f64, reflectance: Rgb, transmittance: Rgb) -> Result<(), SurfaceError> {
    in_range(Property::Eta, eta, eta > 0.0, "above 0")?;
    nonnegative(Property::SpecularReflectance, reflectance)?;
    nonnegative(Property::SpecularTransmittance, transmittance)
}
