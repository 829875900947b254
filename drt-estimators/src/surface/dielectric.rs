use drt_math::{Dual, Real, Rgb, Vec3, fm};

use super::angles::{Angles, Slopes};
use super::fresnel::{dielectric_reflected, dielectric_transmitted};
use super::microfacet::{Distribution, LEAST_ALPHA};
use super::property::{Property, Slot, SurfaceError, in_range, nonnegative};

/// A rough interface between two transparent media: Walter et al. 2007, eq. 20 (reflection) and
/// eq. 21 (refraction). The normal points to the exterior.
///
/// Radiance is transported: refraction carries the squared ratio of the indices, so that radiance
/// over squared index is what the surface conserves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughDielectric<T = f64> {
    /// Distribution of the microfacets; default Beckmann.
    pub distribution: Distribution,
    /// Roughness, at least 1e-4; default 0.1.
    pub alpha: T,
    /// Index of the interior over that of the exterior, not one; default glass (BK7) in air.
    pub eta: T,
    /// Factor of the reflection; default 1.
    pub specular_reflectance: Rgb<T>,
    /// Factor of the refraction; default 1.
    pub specular_transmittance: Rgb<T>,
}

impl Default for RoughDielectric {
    fn default() -> Self {
        Self {
            distribution: Distribution::Beckmann,
            alpha: 0.1,
            eta: 1.5046 / 1.000_277,
            specular_reflectance: Rgb::ONE,
            specular_transmittance: Rgb::ONE,
        }
    }
}

/// Nearest an index may come to one, where refraction has no half vector.
const LEAST_CONTRAST: f64 = 1e-6;

/// The angles seen with the first direction in front, and the index beyond the interface over the
/// index on that direction's side.
#[derive(Clone, Copy)]
struct Passage<T> {
    a: Angles<T>,
    eta: T,
}

/// The scaled half vector `wo + eta wi` of a refraction.
struct HalfVector<T> {
    n_dot: T,
    length2: T,
    /// Its products with `wo` and `-wi` after turning it to the side of `n`.
    cos_o: T,
    cos_i: T,
}

impl<T: Real> Passage<T> {
    #[inline]
    fn half_vector(&self) -> HalfVector<T> {
        let Self { a, eta } = *self;
        let contrast = T::one() - eta;
        let n_dot = a.cos_o + eta * a.cos_i;
        let side = if n_dot.re() < 0.0 { -1.0 } else { 1.0 };
        HalfVector {
            n_dot,
            length2: contrast.squared() + eta * a.h2,
            cos_o: (contrast + eta * a.h2 * 0.5) * side,
            cos_i: (contrast - a.h2 * 0.5) * side,
        }
    }

    /// `fs |cos|` of the reflection; both directions in front.
    #[inline]
    fn reflection(&self, distribution: Distribution, alpha: T) -> T {
        let a = &self.a;
        let density = distribution.density(a.cos_o + a.cos_i, a.h2, alpha) * a.h2.squared();
        if density.re() == 0.0 {
            return T::zero();
        }
        let masking = distribution.masking(a.cos_o, alpha) * distribution.masking(a.cos_i, alpha);
        let fresnel = dielectric_reflected(a.h2.sqrt() * 0.5, self.eta);
        density * masking * fresnel * a.cos_i * 0.25
    }

    /// `fs |cos|` of the refraction; the second direction behind.
    #[inline]
    fn refraction(&self, distribution: Distribution, alpha: T) -> T {
        let h = self.half_vector();
        // Microfacets seen from behind, and pairs of directions that no refraction joins.
        if h.cos_o.re() <= 0.0 || h.cos_i.re() <= 0.0 {
            return T::zero();
        }
        let density = distribution.density(h.n_dot, h.length2, alpha);
        if density.re() == 0.0 {
            return T::zero();
        }
        let cos_i = -self.a.cos_i;
        let masking =
            distribution.masking(self.a.cos_o, alpha) * distribution.masking(cos_i, alpha);
        let fresnel = dielectric_transmitted(h.cos_o, h.cos_i, self.eta);
        // The Jacobian's 1 / |h|⁴ is inside the density.
        density * masking * fresnel * h.cos_o * h.cos_i * cos_i
    }
}

impl<T: Real> RoughDielectric<T> {
    /// None where a direction lies in the surface.
    #[inline]
    fn passage(a: &Angles<T>, eta: T) -> Option<Passage<T>> {
        if a.cos_i.re() == 0.0 {
            None
        } else if a.cos_o.re() > 0.0 {
            Some(Passage { a: *a, eta })
        } else if a.cos_o.re() < 0.0 {
            Some(Passage { a: a.flipped(), eta: eta.recip() })
        } else {
            None
        }
    }

    #[inline]
    pub(super) fn value(&self, a: &Angles<T>) -> Rgb<T> {
        match Self::passage(a, self.eta) {
            None => Rgb::splat(T::zero()),
            Some(p) if p.a.in_front() => {
                self.specular_reflectance * p.reflection(self.distribution, self.alpha)
            }
            Some(p) => self.specular_transmittance * p.refraction(self.distribution, self.alpha),
        }
    }
}

impl RoughDielectric {
    #[inline]
    pub(super) fn slopes(&self, a: &Angles) -> Slopes {
        let (alpha, eta) = (Dual::<f64, 5>::variable(self.alpha, 3), Dual::variable(self.eta, 4));
        let Some(passage) = RoughDielectric::passage(&a.seeded(), eta) else {
            return Slopes::default();
        };
        let reflects = passage.a.in_front();
        let (facets, colour) = if reflects {
            (passage.reflection(self.distribution, alpha), self.specular_reflectance)
        } else {
            (passage.refraction(self.distribution, alpha), self.specular_transmittance)
        };
        let along = |lane: usize| colour * facets.eps[lane];
        let mut s = Slopes {
            value: colour * facets.re,
            cos_o: along(0),
            cos_i: along(1),
            h2: along(2),
            ..Slopes::default()
        };
        s.params.alpha = along(3);
        s.params.eta = along(4);
        if reflects {
            s.params.specular_reflectance = Rgb::splat(facets.re);
        } else {
            s.params.specular_transmittance = Rgb::splat(facets.re);
        }
        s
    }

    /// Probability of reflecting at a microfacet that reflects the part `fresnel`: by the lobes'
    /// colours, with a share that ignores them, since a black lobe still has derivatives.
    #[inline]
    fn reflection_choice(&self, fresnel: f64) -> f64 {
        let reflected = fresnel * self.specular_reflectance.mean();
        let sum = reflected + (1.0 - fresnel) * self.specular_transmittance.mean();
        let share = if sum > 0.0 { reflected / sum } else { fresnel };
        0.8 * share + 0.2 * fresnel
    }

    #[inline]
    pub(super) fn pdf(&self, a: &Angles) -> f64 {
        let Some(passage) = RoughDielectric::passage(a, self.eta) else {
            return 0.0;
        };
        let Passage { a, eta } = passage;
        let masking = self.distribution.exact_masking(a.cos_o, self.alpha);
        if a.in_front() {
            let density = self.distribution.density(a.cos_o + a.cos_i, a.h2, self.alpha);
            let fresnel = dielectric_reflected(0.5 * fm::sqrt(a.h2), eta);
            return density * a.h2 * a.h2 * 0.25 * masking * self.reflection_choice(fresnel);
        }
        let h = passage.half_vector();
        if h.cos_o <= 0.0 || h.cos_i <= 0.0 {
            return 0.0;
        }
        let fresnel = 1.0 - dielectric_transmitted(h.cos_o, h.cos_i, eta);
        let jacobian = eta * eta * h.cos_o * h.cos_i;
        let density = self.distribution.density(h.n_dot, h.length2, self.alpha);
        density * jacobian * masking * (1.0 - self.reflection_choice(fresnel))
    }

    #[inline]
    pub(super) fn sample(&self, from: Vec3, n: Vec3, u: [f64; 3]) -> Option<Vec3> {
        let side = n.dot(from);
        let (n, eta) = if side > 0.0 {
            (n, self.eta)
        } else if side < 0.0 {
            (-n, 1.0 / self.eta)
        } else {
            return None;
        };
        let m = self.distribution.sample_visible(from, n, self.alpha, [u[0], u[1]]);
        let cos = m.dot(from);
        if cos <= 0.0 {
            return None;
        }
        let reflects = u[2] < self.reflection_choice(dielectric_reflected(cos, eta));
        let w = if reflects {
            m * (2.0 * cos) - from
        } else {
            let cos_t = fm::sqrt((1.0 - (1.0 - cos * cos) / (eta * eta)).max(0.0));
            m * (cos / eta - cos_t) - from * (1.0 / eta)
        };
        // A reflection to the far side, or a refraction to the near one, has left the model.
        (reflects == (n.dot(w) > 0.0)).then_some(w)
    }

    pub(super) fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        match property {
            Property::Alpha => Some(Slot::Scalar(&mut self.alpha)),
            Property::Eta => Some(Slot::Scalar(&mut self.eta)),
            Property::SpecularReflectance => Some(Slot::Color(&mut self.specular_reflectance)),
            Property::SpecularTransmittance => Some(Slot::Color(&mut self.specular_transmittance)),
            _ => None,
        }
    }

    pub(super) fn validate(&self) -> Result<(), SurfaceError> {
        in_range(Property::Alpha, self.alpha, self.alpha >= LEAST_ALPHA, "at least 1e-4")?;
        let contrast = (self.eta - 1.0).abs();
        let allowed = self.eta > 0.0 && contrast >= LEAST_CONTRAST;
        in_range(Property::Eta, self.eta, allowed, "positive and not 1 (use a null BSDF there)")?;
        nonnegative(Property::SpecularReflectance, self.specular_reflectance)?;
        nonnegative(Property::SpecularTransmittance, self.specular_transmittance)
    }
}
