use core::f64::consts::FRAC_1_PI;

use drt_geom::edges::{Lobe, Lobes};
use drt_math::{Dual, Frame, Real, Rgb, Vec3, warp};

use crate::model::surface::angles::Angles;
use crate::model::surface::coating::Coating;
use crate::model::surface::fresnel::dielectric_reflected;
use crate::model::surface::isotropic::{Isotropic, scatters_by_angles};
use crate::model::surface::lobes::reflection;
use crate::model::surface::microfacet::mirrored;
use crate::model::surface::model::{Dependence, Flags, Model, Numbers};
use crate::model::surface::params::{BsdfParams, PropertySet};
use crate::model::surface::property::{Property, Slot, SurfaceError, nonnegative};
use crate::model::surface::specular::{Bend, same};
use crate::model::surface::{At, BsdfGradient, Given, SpecularSample, SpecularValue};

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

    /// Probability of the reflection at the coating, seen at a cosine.
    #[inline]
    fn specular_choice(&self, cos: f64) -> f64 {
        let through = self.coating.let_through(cos);
        let specular = (1.0 - through) * self.specular_reflectance.mean();
        let sum = specular + through * self.reflectance.mean();
        let share = if sum > 0.0 { specular / sum } else { 0.5 };
        share.clamp(LEAST_CHOICE, 1.0 - LEAST_CHOICE)
    }
}

impl Isotropic for Plastic {
    #[inline]
    fn by_angles<T: Real>(&self, numbers: impl Numbers<T>, a: &Angles<T>) -> Rgb<T> {
        if !a.in_front() {
            return Rgb::splat(T::zero());
        }
        let reflectance = numbers.colour(Property::Reflectance, self.reflectance);
        let base = reflectance.map(|c| c / self.inside(c)) * self.base(a);
        match self.coating.reflection(a) {
            Some(grey) if grey.re() != 0.0 => {
                let property = Property::SpecularReflectance;
                base + numbers.colour(property, self.specular_reflectance) * grey
            }
            _ => base,
        }
    }
}

impl Model for Plastic {
    fn name(&self) -> &'static str {
        if self.is_smooth() { "plastic" } else { "roughplastic" }
    }

    #[inline]
    fn flags(&self) -> Flags {
        Flags { smooth: self.is_smooth(), ..Flags::REFLECTOR }
    }

    scatters_by_angles!(Reflectance, SpecularReflectance);

    fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        match property {
            Property::Reflectance => Some(Slot::Color(&mut self.reflectance)),
            Property::SpecularReflectance => Some(Slot::Color(&mut self.specular_reflectance)),
            _ => None,
        }
    }

    fn validate(&self) -> Result<(), SurfaceError> {
        self.coating.validate()?;
        nonnegative(Property::Reflectance, self.reflectance)?;
        nonnegative(Property::SpecularReflectance, self.specular_reflectance)
    }

    #[inline]
    fn sample(
        &self,
        _: At<'_>,
        from: Vec3,
        n: Vec3,
        [u, v, choice]: [f64; 3],
        _: Given,
    ) -> Option<Vec3> {
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

    #[inline]
    fn pdf(&self, _: At<'_>, from: Vec3, to: Vec3, n: Vec3, _: Given) -> f64 {
        let a = Angles::new(from, to, n);
        if !a.in_front() {
            return 0.0;
        }
        let specular = self.specular_choice(a.cos_o);
        let base = (1.0 - specular) * a.cos_i * FRAC_1_PI;
        match self.coating.reflection_density(&a) {
            Some(density) => base + specular * density,
            None => base,
        }
    }

    fn single_chance(&self, _: At<'_>, from: Vec3, n: Vec3) -> f64 {
        let cos = n.dot(from);
        if self.is_smooth() && cos > 0.0 { self.specular_choice(cos) } else { 0.0 }
    }

    #[inline(never)]
    fn sample_specular(
        &self,
        at: At<'_>,
        from: Vec3,
        n: Vec3,
        choice: f64,
        _: Given,
    ) -> Option<SpecularSample> {
        let cos = n.dot(from);
        let probability = self.single_chance(at, from, n);
        (choice < probability).then(|| {
            let fresnel = dielectric_reflected(cos.min(1.0), self.coating.eta());
            let weight = self.specular_reflectance * (fresnel / probability);
            SpecularSample { w: mirrored(from, n), weight, straight: false }
        })
    }

    #[inline(never)]
    fn specular(&self, _: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Option<SpecularValue> {
        let cos = n.dot(wo);
        if !self.is_smooth() || cos <= 0.0 || !same(mirrored(wo, n), wi) {
            return None;
        }
        let eta = Dual::from(self.coating.eta());
        let fresnel = dielectric_reflected(Dual::variable(cos.min(1.0), 0), eta);
        let Dual { re: fresnel, eps: [by_cosine] } = fresnel;
        Some(SpecularValue {
            value: self.specular_reflectance * fresnel,
            params: BsdfParams::of(Property::SpecularReflectance, Rgb::splat(fresnel)),
            probability: self.specular_choice(cos),
            by_cosine: self.specular_reflectance * by_cosine,
            bend: Bend::Mirror,
        })
    }

    fn lobes(&self, _: At<'_>, wo: Vec3, n: Vec3) -> Lobes {
        let through = self.coating.let_through(n.dot(wo).clamp(1e-6, 1.0));
        let even = self.reflectance.mean() * through * FRAC_1_PI;
        match self.coating.facets() {
            Some((_, alpha)) => {
                let share = self.specular_reflectance.mean() * (1.0 - through);
                Lobes::glossy(even, [reflection(wo, n, alpha, share), Lobe::default()])
            }
            None => Lobes::even(even),
        }
    }

    fn lobe_width(&self, _: At<'_>) -> f64 {
        self.coating.facets().map_or(0.0, |(_, alpha)| alpha)
    }
}
