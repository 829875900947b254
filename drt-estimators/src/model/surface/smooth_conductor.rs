//! Smooth metals.

use drt_geom::edges::Lobes;
use drt_math::{Dual, Real, Rgb, Vec3};

use crate::model::surface::conductor::check_metal;
use crate::model::surface::fresnel::conductor_reflected;
use crate::model::surface::microfacet::mirrored;
use crate::model::surface::model::{Constants, Dependence, Flags, Lanes, Model, Numbers};
use crate::model::surface::params::PropertySet;
use crate::model::surface::property::{Property, Slot, SurfaceError};
use crate::model::surface::specular::{Bend, same, scatters_into_single_directions};
use crate::model::surface::{At, BsdfGradient, Given, SpecularSample, SpecularValue};

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

impl Default for Conductor {
    fn default() -> Self {
        Self { eta: Rgb::ZERO, k: Rgb::ONE, specular_reflectance: Rgb::ONE }
    }
}

impl Conductor {
    /// What is reflected at a cosine, over any scalar.
    fn reflected<T: Real>(&self, numbers: impl Numbers<T>, cos: T) -> Rgb<T> {
        let eta = numbers.colour(Property::Eta, self.eta);
        let k = numbers.colour(Property::K, self.k);
        let reflected = |eta, k| conductor_reflected(cos, eta, k);
        numbers.colour(Property::SpecularReflectance, self.specular_reflectance)
            * Rgb::new(reflected(eta.r, k.r), reflected(eta.g, k.g), reflected(eta.b, k.b))
    }
}

impl Model for Conductor {
    fn name(&self) -> &'static str {
        "conductor"
    }

    #[inline]
    fn flags(&self) -> Flags {
        Flags { smooth: true, spread: false, ..Flags::REFLECTOR }
    }

    scatters_into_single_directions!(SpecularReflectance, Eta, K);

    fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        match property {
            Property::Eta => Some(Slot::Color(&mut self.eta)),
            Property::K => Some(Slot::Color(&mut self.k)),
            Property::SpecularReflectance => Some(Slot::Color(&mut self.specular_reflectance)),
            _ => None,
        }
    }

    fn validate(&self) -> Result<(), SurfaceError> {
        check_metal(self.eta, self.k, self.specular_reflectance)
    }

    #[inline(never)]
    fn sample_specular(
        &self,
        _: At<'_>,
        from: Vec3,
        n: Vec3,
        _: f64,
        _: Given,
    ) -> Option<SpecularSample> {
        (n.dot(from) > 0.0).then(|| SpecularSample {
            w: mirrored(from, n),
            weight: self.reflected(Constants, n.dot(from)),
            straight: false,
        })
    }

    #[inline(never)]
    fn specular(&self, _: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Option<SpecularValue> {
        let cos = n.dot(wo);
        if cos <= 0.0 || !same(mirrored(wo, n), wi) {
            return None;
        }
        let properties = self.differentiated();
        let lanes = Lanes::<0>::new(properties);
        let value: Rgb<Dual<f64, 3>> = self.reflected(lanes, Dual::from(cos));
        let turned: Rgb<Dual<f64, 1>> = self.reflected(Constants, Dual::variable(cos, 0));
        let by_cosine = turned.map(|c| c.eps[0]);
        Some(SpecularValue::by_duals(properties, value, by_cosine, 1.0, Bend::Mirror))
    }
}
