//! Thin panes.

use drt_geom::edges::Lobes;
use drt_math::{Dual, Real, Rgb, Vec3};

use crate::model::surface::fresnel::dielectric_reflected;
use crate::model::surface::microfacet::mirrored;
use crate::model::surface::model::{Dependence, Flags, Lanes, Model, Numbers};
use crate::model::surface::params::PropertySet;
use crate::model::surface::property::{Property, Slot, SurfaceError};
use crate::model::surface::smooth_dielectric::{GLASS, check, slot};
use crate::model::surface::specular::{Bend, same, scatters_into_single_directions};
use crate::model::surface::{At, BsdfGradient, Given, SpecularSample, SpecularValue};

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

impl Default for ThinDielectric {
    fn default() -> Self {
        let (specular_reflectance, specular_transmittance) = (Rgb::ONE, Rgb::ONE);
        Self { eta: GLASS, specular_reflectance, specular_transmittance }
    }
}

/// The part of the light that comes back from a pane, at a cosine above 0.
fn reflected_by_pane<T: Real>(cos: T, eta: T) -> T {
    let once = dielectric_reflected(cos, eta);
    // The sum of the light that leaves after 0, 1, 2 … turns in the pane.
    if once.re() < 1.0 { once * 2.0 / (T::one() + once) } else { T::one() }
}

impl Model for ThinDielectric {
    fn name(&self) -> &'static str {
        "thindielectric"
    }

    #[inline]
    fn flags(&self) -> Flags {
        Flags { smooth: true, straight: true, spread: false, ..Flags::INTERFACE }
    }

    scatters_into_single_directions!(SpecularReflectance, SpecularTransmittance, Eta);

    fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        let Self { eta, specular_reflectance, specular_transmittance } = self;
        slot(property, eta, specular_reflectance, specular_transmittance)
    }

    fn validate(&self) -> Result<(), SurfaceError> {
        check(self.eta, self.specular_reflectance, self.specular_transmittance)
    }

    #[inline(never)]
    fn sample_specular(
        &self,
        _: At<'_>,
        from: Vec3,
        n: Vec3,
        choice: f64,
        _: Given,
    ) -> Option<SpecularSample> {
        let cos = n.dot(from).abs();
        if cos == 0.0 {
            return None;
        }
        let reflected = reflected_by_pane(cos, self.eta);
        Some(if choice < reflected {
            let weight = self.specular_reflectance;
            SpecularSample { w: mirrored(from, n), weight, straight: false }
        } else {
            SpecularSample { w: -from, weight: self.specular_transmittance, straight: true }
        })
    }

    #[inline(never)]
    fn specular(&self, _: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Option<SpecularValue> {
        let side = n.dot(wo).signum();
        let cos = n.dot(wo).abs().min(1.0);
        let properties = self.differentiated();
        let numbers = Lanes::<0>::new(properties);
        let eta: Dual<f64, 3> = numbers.number(Property::Eta, self.eta);
        let reflected = reflected_by_pane(Dual::from(cos), eta);
        let turned = reflected_by_pane(Dual::variable(cos, 0), Dual::from(self.eta));
        let [by_cosine] = turned.eps.map(|slope: f64| slope * side);
        if same(-wo, wi) {
            let through = Dual::one() - reflected;
            let colour =
                numbers.colour(Property::SpecularTransmittance, self.specular_transmittance);
            let by_cosine = self.specular_transmittance * -by_cosine;
            let (value, chance) = (colour * through, through.re);
            return Some(SpecularValue::by_duals(
                properties,
                value,
                by_cosine,
                chance,
                Bend::Straight,
            ));
        }
        same(mirrored(wo, n), wi).then(|| {
            let colour = numbers.colour(Property::SpecularReflectance, self.specular_reflectance);
            let by_cosine = self.specular_reflectance * by_cosine;
            let (value, chance) = (colour * reflected, reflected.re);
            SpecularValue::by_duals(properties, value, by_cosine, chance, Bend::Mirror)
        })
    }

    fn straight(&self, _: At<'_>, cos: f64) -> Rgb {
        let reflected = if cos > 0.0 { reflected_by_pane(cos.min(1.0), self.eta) } else { 1.0 };
        self.specular_transmittance * (1.0 - reflected)
    }
}
