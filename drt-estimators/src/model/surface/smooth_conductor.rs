//! Smooth metals.

use drt_geom::edges::Lobes;
use drt_math::{Dual, Real, Rgb, Vec3};

use crate::model::surface::fresnel::conductor_reflected;
use crate::model::surface::microfacet::mirrored;
use crate::model::surface::model::{Constants, Dependence, Flags, Lanes, Model, Numbers};
use crate::model::surface::params::PropertySet;
use crate::model::surface::property::{Property, Slot, SurfaceError, in_range, nonnegative};
use crate::model::surface::specular::same;
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
    fn reflected<T: Real>(&self, numbers: impl Numbers<T>, cos: f64) -> Rgb<T> {
        let eta = numbers.colour(Property::Eta, self.eta);
        let k = numbers.colour(Property::K, self.k);
        let reflected = |eta, k| conductor_reflected(T::from(cos), eta, k);
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
        Flags {
            black: false,
            black_from_behind: true,
            transmissive: false,
            smooth: true,
            straight: false,
            oriented: false,
            differentiable: true,
        }
    }

    #[inline]
    fn dependence(&self) -> Dependence {
        Dependence::Normal
    }

    #[inline]
    fn differentiated(&self) -> PropertySet {
        const { PropertySet::new(&[Property::SpecularReflectance, Property::Eta, Property::K]) }
    }

    fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        match property {
            Property::Eta => Some(Slot::Color(&mut self.eta)),
            Property::K => Some(Slot::Color(&mut self.k)),
            Property::SpecularReflectance => Some(Slot::Color(&mut self.specular_reflectance)),
            _ => None,
        }
    }

    fn validate(&self) -> Result<(), SurfaceError> {
        nonnegative(Property::SpecularReflectance, self.specular_reflectance)?;
        nonnegative(Property::Eta, self.eta)?;
        nonnegative(Property::K, self.k)?;
        let indices = self.eta + self.k;
        indices.to_array().into_iter().try_for_each(|sum| {
            in_range(Property::K, sum, sum > 0.0, "above 0 in channels where eta is 0")
        })
    }

    fn value<T: Real>(&self, _: impl Numbers<T>, _: At<'_>, _: [Vec3<T>; 3]) -> Rgb<T> {
        Rgb::splat(T::zero())
    }

    fn gradient(&self, _: At<'_>, _: Vec3, _: Vec3, _: Vec3) -> BsdfGradient {
        BsdfGradient::default()
    }

    fn sample(&self, _: At<'_>, _: Vec3, _: Vec3, _: [f64; 3], _: Given) -> Option<Vec3> {
        None
    }

    fn pdf(&self, _: At<'_>, _: Vec3, _: Vec3, _: Vec3, _: Given) -> f64 {
        0.0
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
        let cos = n.dot(from);
        (cos > 0.0).then(|| SpecularSample {
            w: mirrored(from, n),
            weight: self.reflected(Constants, cos),
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
        let value: Rgb<Dual<f64, 3>> = self.reflected(Lanes::<0>::new(properties), cos);
        Some(SpecularValue::by_duals(properties, value, 1.0))
    }

    /// No sampler asks for it, as nothing that moves is differentiated at such surfaces.
    fn lobes(&self, _: At<'_>, _: Vec3, _: Vec3) -> Lobes {
        Lobes::even(0.0)
    }

    fn lobe_width(&self, _: At<'_>) -> f64 {
        0.0
    }
}
