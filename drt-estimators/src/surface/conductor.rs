use drt_math::{Dual, Real, Rgb, Vec3};

use super::angles::{Angles, Slopes};
use super::fresnel::conductor_reflected;
use super::microfacet::{Distribution, LEAST_ALPHA};
use super::property::{Property, Slot, SurfaceError, in_range, nonnegative};

/// A rough metal: the single-scattering microfacet reflection of Cook & Torrance in the form of
/// Walter et al. 2007, eq. 20, with separable Smith masking; black from behind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughConductor<T = f64> {
    /// Distribution of the microfacets; default Beckmann.
    pub distribution: Distribution,
    /// Roughness, at least 1e-4 (about the rms slope times sqrt 2); default 0.1.
    pub alpha: T,
    /// Real part of the index of refraction over the exterior's; default 0.
    pub eta: Rgb<T>,
    /// Imaginary part (absorption) of the same; default 1, which with `eta` 0 reflects everything.
    pub k: Rgb<T>,
    /// Factor of the reflection; default 1.
    pub specular_reflectance: Rgb<T>,
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

impl<T: Real> RoughConductor<T> {
    /// `fs cos` without Fresnel's factor.
    #[inline]
    fn facets(distribution: Distribution, a: &Angles<T>, alpha: T) -> T {
        let density = distribution.density(a.cos_o + a.cos_i, a.h2, alpha) * a.h2.squared();
        let masking = distribution.masking(a.cos_o, alpha) * distribution.masking(a.cos_i, alpha);
        density * masking * a.cos_i * 0.25
    }

    #[inline]
    pub(super) fn value(&self, a: &Angles<T>) -> Rgb<T> {
        if !a.in_front() {
            return Rgb::splat(T::zero());
        }
        let facets = Self::facets(self.distribution, a, self.alpha);
        // Also where |h| = 0, which Fresnel's factor below could not be differentiated at.
        if facets.re() == 0.0 {
            return Rgb::splat(T::zero());
        }
        let cos = a.h2.sqrt() * 0.5;
        let fresnel = Rgb::new(
            conductor_reflected(cos, self.eta.r, self.k.r),
            conductor_reflected(cos, self.eta.g, self.k.g),
            conductor_reflected(cos, self.eta.b, self.k.b),
        );
        self.specular_reflectance * fresnel * facets
    }
}

impl RoughConductor {
    #[inline]
    pub(super) fn slopes(&self, a: &Angles) -> Slopes {
        let mut s = Slopes::default();
        if !a.in_front() {
            return s;
        }
        let facets = RoughConductor::<Dual<f64, 4>>::facets(
            self.distribution,
            &a.seeded(),
            Dual::variable(self.alpha, 3),
        );
        if facets.re == 0.0 {
            return s;
        }
        let cos = (Dual::<f64, 3>::variable(a.h2, 0)).sqrt() * 0.5;
        let reflected =
            |eta, k| conductor_reflected(cos, Dual::variable(eta, 1), Dual::variable(k, 2));
        let fresnel = Rgb {
            r: reflected(self.eta.r, self.k.r),
            g: reflected(self.eta.g, self.k.g),
            b: reflected(self.eta.b, self.k.b),
        };
        let value = |f: Dual<f64, 3>| f.re;
        let colour = self.specular_reflectance * fresnel.map(value);
        let scale = self.specular_reflectance * facets.re;
        s.value = colour * facets.re;
        s.cos_o = colour * facets.eps[0];
        s.cos_i = colour * facets.eps[1];
        s.h2 = colour * facets.eps[2] + scale * fresnel.map(|f| f.eps[0]);
        s.params.alpha = colour * facets.eps[3];
        s.params.eta = scale * fresnel.map(|f| f.eps[1]);
        s.params.k = scale * fresnel.map(|f| f.eps[2]);
        s.params.specular_reflectance = fresnel.map(value) * facets.re;
        s
    }

    #[inline]
    pub(super) fn pdf(&self, a: &Angles) -> f64 {
        if !a.in_front() {
            return 0.0;
        }
        let density = self.distribution.density(a.cos_o + a.cos_i, a.h2, self.alpha);
        density * a.h2 * a.h2 * 0.25 * self.distribution.exact_masking(a.cos_o, self.alpha)
    }

    #[inline]
    pub(super) fn sample(&self, from: Vec3, n: Vec3, u: [f64; 3]) -> Option<Vec3> {
        if n.dot(from) <= 0.0 {
            return None;
        }
        let m = self.distribution.sample_visible(from, n, self.alpha, [u[0], u[1]]);
        Some(m * (2.0 * m.dot(from)) - from)
    }

    pub(super) fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        match property {
            Property::Alpha => Some(Slot::Scalar(&mut self.alpha)),
            Property::Eta => Some(Slot::Color(&mut self.eta)),
            Property::K => Some(Slot::Color(&mut self.k)),
            Property::SpecularReflectance => Some(Slot::Color(&mut self.specular_reflectance)),
            _ => None,
        }
    }

    pub(super) fn validate(&self) -> Result<(), SurfaceError> {
        in_range(Property::Alpha, self.alpha, self.alpha >= LEAST_ALPHA, "at least 1e-4")?;
        nonnegative(Property::SpecularReflectance, self.specular_reflectance)?;
        nonnegative(Property::Eta, self.eta)?;
        nonnegative(Property::K, self.k)?;
        let indices = self.eta + self.k;
        indices.to_array().into_iter().try_for_each(|sum| {
            in_range(Property::K, sum, sum > 0.0, "above 0 in channels where eta is 0")
        })
    }
}
