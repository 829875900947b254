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
    #[inline]
    pub(super) fn value(&self, a: &Angles<T>) -> Rgb<T> {
        if !a.in_front() {
            return Rgb::splat(T::zero());
        }
        let facets = self.distribution.facets(a, T::one(), self.alpha);
        // Also where |h| = 0, which the rest could not be differentiated at.
        if facets.re() == 0.0 {
            return Rgb::splat(T::zero());
        }
        let reflected = Rgb::new(
            facet_reflectance(a.h2, self.eta.r, self.k.r),
            facet_reflectance(a.h2, self.eta.g, self.k.g),
            facet_reflectance(a.h2, self.eta.b, self.k.b),
        );
        self.specular_reflectance * reflected * facets
    }
}

/// Fresnel's factor at a microfacet, with the Jacobian `|h|⁴ / 4` of reflection.
#[inline]
fn facet_reflectance<T: Real>(h2: T, eta: T, k: T) -> T {
    conductor_reflected(h2.sqrt() * 0.5, eta, k) * h2.squared() * 0.25
}

impl RoughConductor {
    #[inline]
    pub(super) fn slopes(&self, a: &Angles) -> Slopes {
        let mut s = Slopes::default();
        if !a.in_front() {
            return s;
        }
        let Some(facets) = self.distribution.facet_slopes(a, 1.0, self.alpha) else {
            return s;
        };
        let h2 = Dual::<f64, 3>::variable(a.h2, 0);
        let reflectance =
            |eta, k| facet_reflectance(h2, Dual::variable(eta, 1), Dual::variable(k, 2));
        let reflected = Rgb {
            r: reflectance(self.eta.r, self.k.r),
            g: reflectance(self.eta.g, self.k.g),
            b: reflectance(self.eta.b, self.k.b),
        };
        let by_reflectance = reflected.map(|f| f.re) * facets.value;
        let colour = self.specular_reflectance * reflected.map(|f| f.re);
        let scale = self.specular_reflectance * facets.value;
        s.value = colour * facets.value;
        s.cos_o = colour * facets.cos_o;
        s.cos_i = colour * facets.cos_i;
        s.h2 = colour * facets.h2 + scale * reflected.map(|f| f.eps[0]);
        s.params.alpha = colour * facets.alpha;
        s.params.eta = scale * reflected.map(|f| f.eps[1]);
        s.params.k = scale * reflected.map(|f| f.eps[2]);
        s.params.specular_reflectance = by_reflectance;
        s
    }

    #[inline]
    pub(super) fn pdf(&self, a: &Angles) -> f64 {
        if !a.in_front() {
            return 0.0;
        }
        0.25 * a.h2 * a.h2 * self.distribution.visible_density(a, 1.0, self.alpha)
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
