use core::f64::consts::FRAC_1_PI;

use drt_math::{Dual, Frame, Real, Rgb, Vec3, warp};

use crate::model::surface::angles::{Angles, Slopes};
use crate::model::surface::coating::Coating;
use crate::model::surface::fresnel::dielectric_reflected;
use crate::model::surface::microfacet::mirrored;
use crate::model::surface::property::{Property, Slot, SurfaceError, nonnegative};
use crate::model::surface::specular::same;
use crate::model::surface::{BsdfParams, SpecularSample, SpecularValue};

/// A diffuse base under a dielectric coating: Mitsuba's `plastic` and `roughplastic`; black from
/// behind. Light that goes through the coating is scattered by the base and reflected back to it at the
/// coating any number of times; each time it takes the base's colour.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Plastic {
    /// The coating.
    pub coating: Coating,
    /// Albedo of the base; default 0.5.
    pub reflectance: Rgb,
    /// Factor of the coating's reflection; default 1.
    pub specular_reflectance: Rgb,
    /// Colours change with every scattering inside; without, as if the base were white there.
    pub nonlinear: bool,
}

/// Least probability of choosing either lobe: a lobe of weight zero still has a derivative with
/// respect to that weight.
const LEAST_CHOICE: f64 = 0.1;

impl Plastic {
    /// Plastic of the default colours under a coating.
    #[must_use]
    pub fn new(coating: Coating) -> Self {
        let (reflectance, specular_reflectance) = (Rgb::splat(0.5), Rgb::ONE);
        Self { coating, reflectance, specular_reflectance, nonlinear: false }
    }

    /// True when the coating is a mirror.
    #[inline]
    pub(super) fn is_smooth(&self) -> bool {
        self.coating.facets().is_none()
    }

    /// The value with other colours, over any scalar.
    #[inline]
    pub(super) fn value_with<T: Real>(
        &self,
        a: &Angles<T>,
        reflectance: Rgb<T>,
        specular_reflectance: Rgb<T>,
    ) -> Rgb<T> {
        if !a.in_front() {
            return Rgb::splat(T::zero());
        }
        let base = reflectance.map(|c| c / self.inside(c)) * self.base(a);
        match self.coating.reflection(a) {
            Some(grey) if grey.re() != 0.0 => base + specular_reflectance * grey,
            _ => base,
        }
    }

    #[inline]
    pub(super) fn value(&self, a: &Angles) -> Rgb {
        self.value_with(a, self.reflectance, self.specular_reflectance)
    }

    /// One less what comes back to a base of a colour inside.
    #[inline]
    fn inside<T: Real>(&self, colour: T) -> T {
        let back = T::from(self.coating.internal_reflectance());
        T::one() - if self.nonlinear { colour * back } else { back }
    }

    /// What a white base that is seen once adds.
    #[inline]
    fn base<T: Real>(&self, a: &Angles<T>) -> T {
        let eta = self.coating.eta();
        let through = self.coating.let_through(a.cos_o) * self.coating.let_through(a.cos_i);
        through * a.cos_i * (FRAC_1_PI / (eta * eta))
    }

    #[inline]
    pub(super) fn slopes(&self, a: &Angles) -> Slopes {
        let mut s = Slopes::default();
        if !a.in_front() {
            return s;
        }
        let angles = Angles::<Dual<f64, 3>> {
            cos_o: Dual::variable(a.cos_o, 0),
            cos_i: Dual::variable(a.cos_i, 1),
            h2: Dual::variable(a.h2, 2),
        };
        let base = self.base(&angles);
        let grey = self.coating.reflection(&angles).unwrap_or(Dual::from(0.0));
        let colour = self.reflectance.map(|c| c / self.inside(c));
        let along = |i: usize| colour * base.eps[i] + self.specular_reflectance * grey.eps[i];
        s.value = colour * base.re + self.specular_reflectance * grey.re;
        (s.cos_o, s.cos_i, s.h2) = (along(0), along(1), along(2));
        s.params.specular_reflectance = Rgb::splat(grey.re);
        s.params.reflectance = self.reflectance.map(|c| {
            let inside = self.inside(c);
            if self.nonlinear { base.re / (inside * inside) } else { base.re / inside }
        });
        s
    }

    /// Probability of the reflection at the coating, seen at a cosine.
    #[inline]
    fn specular_choice(&self, cos: f64) -> f64 {
        let through = self.coating.let_through(cos);
        let specular = (1.0 - through) * self.specular_reflectance.mean();
        let sum = specular + through * self.reflectance.mean();
        let share = if sum > 0.0 { specular / sum } else { 0.5 };
        share.clamp(LEAST_CHOICE, 1.0 - LEAST_CHOICE)
    }

    #[inline]
    pub(super) fn pdf(&self, a: &Angles) -> f64 {
        if !a.in_front() {
            return 0.0;
        }
        let specular = self.specular_choice(a.cos_o);
        let base = (1.0 - specular) * a.cos_i * FRAC_1_PI;
        match self.coating.reflection_density(a) {
            Some(density) => base + specular * density,
            None => base,
        }
    }

    #[inline]
    pub(super) fn sample(&self, from: Vec3, n: Vec3, [u, v, choice]: [f64; 3]) -> Option<Vec3> {
        let cos = n.dot(from);
        if cos <= 0.0 {
            return None;
        }
        if choice >= self.specular_choice(cos) {
            return Some(Frame::from_normal(n).to_world(warp::cosine_hemisphere([u, v])));
        }
        let (distribution, alpha) = self.coating.facets()?;
        Some(mirrored(from, distribution.sample_visible(from, n, alpha, [u, v])))
    }

    /// The reflection at a smooth coating, where `choice` chooses it.
    pub(super) fn sample_specular(
        &self,
        from: Vec3,
        n: Vec3,
        choice: f64,
    ) -> Option<SpecularSample> {
        let cos = n.dot(from);
        let probability =
            if self.is_smooth() && cos > 0.0 { self.specular_choice(cos) } else { 0.0 };
        (choice < probability).then(|| {
            let fresnel = dielectric_reflected(cos.min(1.0), self.coating.eta());
            let weight = self.specular_reflectance * (fresnel / probability);
            SpecularSample { w: mirrored(from, n), weight, straight: false }
        })
    }

    pub(super) fn specular(&self, wo: Vec3, wi: Vec3, n: Vec3) -> Option<SpecularValue> {
        let cos = n.dot(wo);
        if !self.is_smooth() || cos <= 0.0 || !same(mirrored(wo, n), wi) {
            return None;
        }
        let fresnel = dielectric_reflected(cos.min(1.0), self.coating.eta());
        let specular_reflectance = Rgb::splat(fresnel);
        let params = BsdfParams { specular_reflectance, ..BsdfParams::default() };
        let value = self.specular_reflectance * fresnel;
        Some(SpecularValue { value, params, probability: self.specular_choice(cos) })
    }

    pub(super) fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        match property {
            Property::Reflectance => Some(Slot::Color(&mut self.reflectance)),
            Property::SpecularReflectance => Some(Slot::Color(&mut self.specular_reflectance)),
            _ => None,
        }
    }

    pub(super) fn validate(&self) -> Result<(), SurfaceError> {
        self.coating.validate()?;
        nonnegative(Property::Reflectance, self.reflectance)?;
        nonnegative(Property::SpecularReflectance, self.specular_reflectance)
    }
}
