use drt_geom::edges::Lobes;
use drt_math::{Real, Rgb, Vec3, fm};

use crate::model::surface::angles::Angles;
use crate::model::surface::facet::Facet;
use crate::model::surface::fresnel::{dielectric_reflected, dielectric_transmitted};
use crate::model::surface::isotropic::{Isotropic, scatters_by_angles};
use crate::model::surface::lobes::{SeenFacet, reflection};
use crate::model::surface::microfacet::{Distribution, LEAST_ALPHA, mirrored, refracted};
use crate::model::surface::model::{Dependence, Flags, Model, Numbers};
use crate::model::surface::params::PropertySet;
use crate::model::surface::property::{Property, Slot, SurfaceError, in_range, nonnegative};
use crate::model::surface::smooth_dielectric::slot;
use crate::model::surface::{At, BsdfGradient, Given};

/// A rough interface between two transparent media: Walter et al. 2007, eq. 20 (reflection) and
/// eq. 21 (refraction). The normal points to the exterior.
///
/// Radiance is transported: refraction carries the squared ratio of the indices, so that radiance
/// over squared index is what the surface conserves.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RoughDielectric {
    /// Distribution of the microfacets; default Beckmann.
    pub distribution: Distribution,
    /// Roughness, at least 1e-4; default 0.1.
    pub alpha: f64,
    /// Index of the interior over that of the exterior, not one; default glass (BK7) in air.
    pub eta: f64,
    /// Factor of the reflection; default 1.
    pub specular_reflectance: Rgb,
    /// Factor of the refraction; default 1.
    pub specular_transmittance: Rgb,
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
pub(super) struct Passage<T> {
    pub(super) a: Angles<T>,
    eta: T,
}

/// Products of `h = wo + eta wi` with `wo` and `-wi`, once `h` is turned to the side of the normal.
/// They are |h| times the cosines of incidence and refraction.
struct FacetCosines<T> {
    o: T,
    i: T,
}

impl<T: Real> Passage<T> {
    /// None where a direction lies in the surface.
    #[inline]
    pub(super) fn new(a: &Angles<T>, eta: T) -> Option<Self> {
        if a.cos_i.re() == 0.0 || a.cos_o.re() == 0.0 {
            None
        } else if a.cos_o.re() > 0.0 {
            Some(Self { a: *a, eta })
        } else {
            Some(Self { a: a.flipped(), eta: eta.recip() })
        }
    }

    #[inline]
    pub(super) fn reflects(&self) -> bool {
        self.a.cos_i.re() > 0.0
    }

    /// Scale of `wi` in the half vector.
    #[inline]
    pub(super) fn index(&self) -> T {
        if self.reflects() { T::one() } else { self.eta }
    }

    /// None for pairs of directions that no refraction at the front of a microfacet joins.
    #[inline]
    fn refraction_cosines(&self) -> Option<FacetCosines<T>> {
        let n_dot_h = self.a.cos_o.re() + self.eta.re() * self.a.cos_i.re();
        let side = if n_dot_h < 0.0 { -1.0 } else { 1.0 };
        let contrast = T::one() - self.eta;
        let o = (contrast + self.eta * self.a.h2 * 0.5) * side;
        let i = (contrast - self.a.h2 * 0.5) * side;
        (o.re() > 0.0 && i.re() > 0.0).then_some(FacetCosines { o, i })
    }

    /// What the value has besides [`Distribution::facets`]: Fresnel's factor, and `|h|⁴ / 4` in
    /// reflections or `|h·wo| |h·wi|` in refractions. A function of h2 and eta alone.
    #[inline]
    fn facet_share(&self) -> T {
        let h2 = self.a.h2;
        if self.reflects() {
            dielectric_reflected(h2.sqrt() * 0.5, self.eta) * h2.squared() * 0.25
        } else if let Some(cos) = self.refraction_cosines() {
            dielectric_transmitted(cos.o, cos.i, self.eta) * cos.o * cos.i
        } else {
            T::zero()
        }
    }
}

impl RoughDielectric {
    /// The value by [`Distribution::facets`] of any kind.
    #[inline(always)]
    pub(super) fn value_of<T: Real>(
        &self,
        numbers: impl Numbers<T>,
        passage: &Passage<T>,
        facets: T,
    ) -> Rgb<T> {
        // Also where |h| = 0, which the rest could not be differentiated at.
        if facets.re() == 0.0 {
            return Rgb::splat(T::zero());
        }
        let colour = if passage.reflects() {
            numbers.colour(Property::SpecularReflectance, self.specular_reflectance)
        } else {
            numbers.colour(Property::SpecularTransmittance, self.specular_transmittance)
        };
        colour * (facets * passage.facet_share())
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

    /// The density by [`Distribution::visible_density`] of any kind.
    #[inline(always)]
    pub(super) fn pdf_of(&self, passage: &Passage<f64>, visible: impl FnOnce() -> f64) -> f64 {
        let Passage { a, eta } = *passage;
        let (probability, jacobian) = if passage.reflects() {
            let fresnel = dielectric_reflected(0.5 * fm::sqrt(a.h2), eta);
            (self.reflection_choice(fresnel), 0.25 * a.h2 * a.h2)
        } else if let Some(cos) = passage.refraction_cosines() {
            let fresnel = 1.0 - dielectric_transmitted(cos.o, cos.i, eta);
            (1.0 - self.reflection_choice(fresnel), eta * eta * cos.o * cos.i)
        } else {
            return 0.0;
        };
        probability * jacobian * visible()
    }

    /// The direction into which a facet with the normal `m` sends light, by a number that chooses between reflection and
    /// refraction; `n` is on the side of `from`, and `eta` the index beyond over that on that side.
    #[inline(always)]
    pub(super) fn sample_by(
        &self,
        m: Vec3,
        from: Vec3,
        n: Vec3,
        eta: f64,
        choice: f64,
    ) -> Option<Vec3> {
        let cos = m.dot(from);
        if cos <= 0.0 {
            return None;
        }
        let reflects = choice < self.reflection_choice(dielectric_reflected(cos, eta));
        let w = if reflects { mirrored(from, m) } else { refracted(from, m, eta)?.0 };
        // A reflection to the far side, or a refraction to the near one, has left the model.
        (reflects == (n.dot(w) > 0.0)).then_some(w)
    }

    /// The normal on the side of a direction, and the index beyond over the one on that side.
    #[inline]
    pub(super) fn seen_from(&self, from: Vec3, n: Vec3) -> Option<(Vec3, f64)> {
        let side = n.dot(from);
        if side > 0.0 {
            Some((n, self.eta))
        } else if side < 0.0 {
            Some((-n, 1.0 / self.eta))
        } else {
            None
        }
    }
}

impl Isotropic for RoughDielectric {
    #[inline]
    fn by_angles<T: Real>(&self, numbers: impl Numbers<T>, a: &Angles<T>) -> Rgb<T> {
        let eta = numbers.number(Property::Eta, self.eta);
        let Some(passage) = Passage::new(a, eta) else { return Rgb::splat(T::zero()) };
        let alpha = numbers.number(Property::Alpha, self.alpha);
        let facets = self.distribution.facets(&passage.a, passage.index(), alpha);
        self.value_of(numbers, &passage, facets)
    }
}

impl Model for RoughDielectric {
    fn name(&self) -> &'static str {
        "roughdielectric"
    }

    #[inline]
    fn flags(&self) -> Flags {
        Flags::INTERFACE
    }

    scatters_by_angles!(SpecularReflectance, SpecularTransmittance, Alpha, Eta);

    fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        match property {
            Property::Alpha => Some(Slot::Scalar(&mut self.alpha)),
            _ => {
                let Self { eta, specular_reflectance, specular_transmittance, .. } = self;
                slot(property, eta, specular_reflectance, specular_transmittance)
            }
        }
    }

    fn validate(&self) -> Result<(), SurfaceError> {
        in_range(Property::Alpha, self.alpha, self.alpha >= LEAST_ALPHA, "at least 1e-4")?;
        let contrast = (self.eta - 1.0).abs();
        let allowed = self.eta > 0.0 && contrast >= LEAST_CONTRAST;
        in_range(Property::Eta, self.eta, allowed, "positive and not 1 (use a null BSDF there)")?;
        nonnegative(Property::SpecularReflectance, self.specular_reflectance)?;
        nonnegative(Property::SpecularTransmittance, self.specular_transmittance)
    }

    #[inline]
    fn sample(&self, _: At<'_>, from: Vec3, n: Vec3, u: [f64; 3], _: Given) -> Option<Vec3> {
        let (n, eta) = self.seen_from(from, n)?;
        let m = self.distribution.sample_visible(from, n, self.alpha, [u[0], u[1]]);
        self.sample_by(m, from, n, eta, u[2])
    }

    #[inline]
    fn pdf(&self, _: At<'_>, from: Vec3, to: Vec3, n: Vec3, _: Given) -> f64 {
        let Some(passage) = Passage::new(&Angles::new(from, to, n), self.eta) else { return 0.0 };
        let Passage { a, .. } = &passage;
        let index = passage.index();
        self.pdf_of(&passage, || self.distribution.visible_density(a, index, self.alpha))
    }

    #[inline]
    fn facet(&self, _: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Option<(Facet, f64)> {
        let (side, eta) = self.seen_from(wo, n)?;
        let index = (side.dot(wi) < 0.0).then_some(eta);
        let by_eta = match index {
            None => 0.0,
            Some(_) if side == n => 1.0,
            Some(eta) => -eta * eta,
        };
        Some((Facet::new((self.distribution, self.alpha), [wo, wi, side], index), by_eta))
    }

    fn lobes(&self, _: At<'_>, wo: Vec3, n: Vec3) -> Lobes {
        let (n, eta) = if n.dot(wo) >= 0.0 { (n, self.eta) } else { (-n, self.eta.recip()) };
        let facet = SeenFacet::new(wo, n, self.distribution, self.alpha);
        let cosines = [facet.cos, n.dot(wo).clamp(1e-6, 1.0)];
        let fresnel = 0.5 * cosines.map(|cos| dielectric_reflected(cos, eta)).iter().sum::<f64>();
        let reflected = self.specular_reflectance.mean() * fresnel;
        let refracted = self.specular_transmittance.mean() * (1.0 - fresnel) / (eta * eta);
        let lobes =
            [reflection(wo, n, self.alpha, reflected), facet.refraction(wo, eta, refracted)];
        Lobes::glossy(0.0, lobes)
    }

    fn lobe_width(&self, _: At<'_>) -> f64 {
        self.alpha
    }
}
