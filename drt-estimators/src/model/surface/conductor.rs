use drt_geom::edges::{Lobe, Lobes};
use drt_math::{Real, Rgb, Vec3, fm};

use crate::model::surface::angles::{Angles, Slopes};
use crate::model::surface::facet::Facet;
use crate::model::surface::fresnel::{conductor_reflected, conductor_slopes};
use crate::model::surface::isotropic::Isotropic;
use crate::model::surface::lobes::reflection;
use crate::model::surface::microfacet::{Distribution, LEAST_ALPHA, mirrored};
use crate::model::surface::model::{Dependence, Flags, Model, Numbers};
use crate::model::surface::params::{BsdfParams, PropertySet};
use crate::model::surface::property::{Property, Slot, SurfaceError, in_range, nonnegative};
use crate::model::surface::{At, BsdfGradient, Given};

/// A rough metal: the single-scattering microfacet reflection of Cook & Torrance in the form of
/// Walter et al. 2007, eq. 20, with separable Smith masking; black from behind.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RoughConductor {
    /// Distribution of the microfacets; default Beckmann.
    pub distribution: Distribution,
    /// Roughness, at least 1e-4 (about the rms slope times sqrt 2); default 0.1.
    pub alpha: f64,
    /// Real part of the index of refraction over the exterior's; default 0.
    pub eta: Rgb,
    /// Imaginary part (absorption) of the same; default 1, which with `eta` 0 reflects everything.
    pub k: Rgb,
    /// Factor of the reflection; default 1.
    pub specular_reflectance: Rgb,
}

impl Default for RoughConductor {
    fn default() -> Self {
        Self {
            distribution: Distribution::Beckmann,
            alpha: 0.1,
            eta: Rgb::ZERO,
            k: Rgb::ONE,
            specular_reflectance: Rgb::ONE,
        }
    }
}

/// `|h|⁴ / 4`
#[inline]
fn reflection_jacobian<T: Real>(h2: T) -> T {
    h2.squared() * 0.25
}

/// Checks the numbers of a metal but for its roughness.
pub(super) fn check_metal(eta: Rgb, k: Rgb, reflectance: Rgb) -> Result<(), SurfaceError> {
    nonnegative(Property::SpecularReflectance, reflectance)?;
    nonnegative(Property::Eta, eta)?;
    nonnegative(Property::K, k)?;
    (eta + k).to_array().into_iter().try_for_each(|sum| {
        in_range(Property::K, sum, sum > 0.0, "above 0 in channels where eta is 0")
    })
}

impl RoughConductor {
    /// The value by [`Distribution::facets`] of any kind.
    #[inline(always)]
    pub(super) fn value_of<T: Real>(
        &self,
        numbers: impl Numbers<T>,
        a: &Angles<T>,
        facets: T,
    ) -> Rgb<T> {
        // Also where |h| = 0, which the rest could not be differentiated at.
        if facets.re() == 0.0 {
            return Rgb::splat(T::zero());
        }
        let cos = a.h2.sqrt() * 0.5;
        let eta = numbers.colour(Property::Eta, self.eta);
        let k = numbers.colour(Property::K, self.k);
        let fresnel = Rgb::new(
            conductor_reflected(cos, eta.r, k.r),
            conductor_reflected(cos, eta.g, k.g),
            conductor_reflected(cos, eta.b, k.b),
        );
        numbers.colour(Property::SpecularReflectance, self.specular_reflectance)
            * fresnel
            * (facets * reflection_jacobian(a.h2))
    }

    /// The density by [`Distribution::visible_density`] of any kind.
    #[inline(always)]
    pub(super) fn pdf_of(a: &Angles, visible: f64) -> f64 {
        reflection_jacobian(a.h2) * visible
    }
}

impl Isotropic for RoughConductor {
    #[inline]
    fn by_angles<T: Real>(&self, numbers: impl Numbers<T>, a: &Angles<T>) -> Rgb<T> {
        if !a.in_front() {
            return Rgb::splat(T::zero());
        }
        let alpha = numbers.number(Property::Alpha, self.alpha);
        self.value_of(numbers, a, self.distribution.facets(a, T::one(), alpha))
    }
}

impl Model for RoughConductor {
    fn name(&self) -> &'static str {
        "roughconductor"
    }

    #[inline]
    fn flags(&self) -> Flags {
        Flags::REFLECTOR
    }

    #[inline]
    fn dependence(&self) -> Dependence {
        Dependence::Normal
    }

    #[inline]
    fn differentiated(&self) -> PropertySet {
        const {
            PropertySet::new(&[
                Property::SpecularReflectance,
                Property::Alpha,
                Property::Eta,
                Property::K,
            ])
        }
    }

    fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        match property {
            Property::Alpha => Some(Slot::Scalar(&mut self.alpha)),
            Property::Eta => Some(Slot::Color(&mut self.eta)),
            Property::K => Some(Slot::Color(&mut self.k)),
            Property::SpecularReflectance => Some(Slot::Color(&mut self.specular_reflectance)),
            _ => None,
        }
    }

    fn validate(&self) -> Result<(), SurfaceError> {
        in_range(Property::Alpha, self.alpha, self.alpha >= LEAST_ALPHA, "at least 1e-4")?;
        check_metal(self.eta, self.k, self.specular_reflectance)
    }

    #[inline]
    fn value<T: Real>(
        &self,
        numbers: impl Numbers<T>,
        _: At<'_>,
        [wo, wi, n]: [Vec3<T>; 3],
    ) -> Rgb<T> {
        self.by_angles(numbers, &Angles::new(wo, wi, n))
    }

    /// This is differentiated by hand, for the reason that the module `model` gives.
    #[inline]
    fn gradient(&self, _: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> BsdfGradient {
        let a = Angles::new(wo, wi, n);
        let mut s = Slopes::default();
        if !a.in_front() {
            return BsdfGradient::default();
        }
        let Some(facets) = self.distribution.facet_slopes(&a, self.alpha) else {
            return BsdfGradient::default();
        };
        let cos = 0.5 * fm::sqrt(a.h2);
        let (mut by_cos, mut by_eta, mut by_k) = (Rgb::ZERO, Rgb::ZERO, Rgb::ZERO);
        let fresnel = Rgb::new(
            conductor_reflected(cos, self.eta.r, self.k.r),
            conductor_reflected(cos, self.eta.g, self.k.g),
            conductor_reflected(cos, self.eta.b, self.k.b),
        );
        [by_cos.r, by_eta.r, by_k.r] = conductor_slopes(cos, self.eta.r, self.k.r);
        [by_cos.g, by_eta.g, by_k.g] = conductor_slopes(cos, self.eta.g, self.k.g);
        [by_cos.b, by_eta.b, by_k.b] = conductor_slopes(cos, self.eta.b, self.k.b);

        let jacobian = reflection_jacobian(a.h2);
        let grey = facets.value * jacobian;
        let scale = self.specular_reflectance * grey;
        let colour = self.specular_reflectance * fresnel;
        s.value = colour * grey;
        s.cos_o = colour * (facets.cos_o * jacobian);
        s.cos_i = colour * (facets.cos_i * jacobian);
        s.h2 = colour * (facets.h2 * jacobian + facets.value * 0.5 * a.h2)
            + scale * by_cos * (0.125 / cos);
        // In the order of the properties that it is differentiated by.
        let params =
            [fresnel * grey, colour * (facets.alpha * jacobian), scale * by_eta, scale * by_k];
        s.params = BsdfParams::from_ranks(self.differentiated(), |k| params[k]);
        s.pull_back(wo, wi, n)
    }

    #[inline]
    fn sample(&self, _: At<'_>, from: Vec3, n: Vec3, u: [f64; 3], _: Given) -> Option<Vec3> {
        if n.dot(from) <= 0.0 {
            return None;
        }
        let m = self.distribution.sample_visible(from, n, self.alpha, [u[0], u[1]]);
        Some(mirrored(from, m))
    }

    #[inline]
    fn pdf(&self, _: At<'_>, from: Vec3, to: Vec3, n: Vec3, _: Given) -> f64 {
        let a = Angles::new(from, to, n);
        if !a.in_front() {
            return 0.0;
        }
        Self::pdf_of(&a, self.distribution.visible_density(&a, 1.0, self.alpha))
    }

    #[inline]
    fn facet(&self, _: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Option<(Facet, f64)> {
        Some((Facet::new((self.distribution, self.alpha), [wo, wi, n], None), 0.0))
    }

    fn lobes(&self, _: At<'_>, wo: Vec3, n: Vec3) -> Lobes {
        let cos = n.dot(wo).clamp(1e-6, 1.0);
        let fresnel = conductor_reflected(cos, self.eta.mean(), self.k.mean());
        let share = self.specular_reflectance.mean() * fresnel;
        Lobes::glossy(0.0, [reflection(wo, n, self.alpha, share), Lobe::default()])
    }

    fn lobe_width(&self, _: At<'_>) -> f64 {
        self.alpha
    }
}
