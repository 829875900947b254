//! A dielectric layer over any reflector.
//!
//! After Weidlich & Wilkie 2007, "Arbitrarily Layered Micro-Facet Surfaces", as Mitsuba 0.6's `coating` and
//! `roughcoating` have it: light is refracted into the layer, scattered once by what is below, and refracted out again;
//! light that the layer reflects back down is lost. With η the index of the layer over that of the outside, a direction
//! w at the cosine c = n·w to the normal belongs to the direction w' in the layer,
//!
//! ```text
//! w' = w / η + n g(c),     g(c) = c' - c / η,     c' = sign(c) √(1 - (1 - c²) / η²),
//! ```
//!
//! which has the cosine c' and the tangent part of Snell's law. Both directions point away from the surface. What
//! leaves along wo by light from wi is the integral of L'(wi') f'(wo', wi') |c'| over solid angles in the layer. The
//! radiance that arrives there is L' = T(wi) η² L, for it is compressed, and what leaves is T(wo) / η² of what goes up
//! in the layer. The sine shrinks by η, so that solid angles are
//!
//! ```text
//! c' dw' = c dw / η².
//! ```
//!
//! With the transmittances T of the interface and absorption σ over the layer's thickness d, along both slanted ways,
//!
//! ```text
//! f |n·wi| = T(wo) T(wi) exp(-σ d (1 / |n·wo'| + 1 / |n·wi'|)) f'(wo', wi') |n·wi'| · |n·wi| / (η² |n·wi'|),
//! ```
//!
//! whose last factor is dwi'/dwi: a density of directions below the layer, times it, is one above. f is as symmetric as
//! f'. On top is the reflection of the interface, on both sides of the surface: a mirror's, or one by microfacets. For
//! single directions that something smooth below scatters to, there is no last factor.
//!
//! Rough layers let through what [`Coating`] has tabulated, but bend light as a smooth one does.
//!
//! Derivatives by directions and the normal go through w': with dc'/dc = c / (η² c'),
//!
//! ```text
//! dw' = dw / η + n g'(c) dc + g(c) dn,     dc = n·dw + w·dn.
//! ```

use drt_geom::edges::{Lobe, Lobes};
use drt_math::{Dual, Real, Rgb, RgbVec, Vec3, fm};

use crate::model::surface::angles::{Angles, Slopes};
use crate::model::surface::bsdf::Composed;
use crate::model::surface::choice::choose;
use crate::model::surface::coating::Coating;
use crate::model::surface::fresnel::dielectric_reflected;
use crate::model::surface::lobes::{reflection, two_highest};
use crate::model::surface::microfacet::mirrored;
use crate::model::surface::model::{Flags, Model, Numbers};
use crate::model::surface::params::{BsdfParams, PropertySet};
use crate::model::surface::property::{Property, Slot, SurfaceError, in_range, nonnegative};
use crate::model::surface::specular::{Bend, same};
use crate::model::surface::textures::Textures;
use crate::model::surface::{At, Bsdf, BsdfGradient, Given, SpecularSample, SpecularValue};
use crate::model::texture::Texture;

/// A reflector under a dielectric layer, which may absorb: Mitsuba 0.6's `coating` and `roughcoating`.
///
/// The BSDF below keeps its properties, except `specular_reflectance`, which is that of the layer.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Coated {
    /// The BSDF below the layer; it must not transmit light.
    pub bsdf: Bsdf,
    /// The upper interface of the layer.
    pub coating: Coating,
    /// Factor of the reflection at the interface.
    pub specular_reflectance: Rgb,
    /// Absorption coefficient of the layer, per unit of its thickness.
    pub sigma_a: Rgb,
    /// Thickness of the layer.
    pub thickness: f64,
}

/// Least probability of choosing either the reflection at the interface or what is below: each may be black and have a
/// derivative.
const LEAST_CHOICE: f64 = 0.1;

/// A direction in the layer.
struct Below {
    w: Vec3,
    /// g and g' of the module's formulas.
    shift: f64,
    by_cos: f64,
}

impl Below {
    /// Adds to the gradients by the direction above and by the normal what follows from one by that below.
    fn pull_back(&self, by: RgbVec, [w, n]: [Vec3; 2], eta: f64, by_n: &mut RgbVec) -> RgbVec {
        let by_cos = by.dot(n) * self.by_cos;
        *by_n += by * self.shift + by_cos.outer(w);
        by * eta.recip() + by_cos.outer(n)
    }
}

impl Coated {
    /// A clear layer of thickness 1 over a reflector.
    #[must_use]
    pub fn new(bsdf: Bsdf, coating: Coating) -> Self {
        Self { bsdf, coating, specular_reflectance: Rgb::ONE, sigma_a: Rgb::ZERO, thickness: 1.0 }
    }

    /// True when the interface is a mirror.
    fn is_smooth(&self) -> bool {
        self.coating.facets().is_none()
    }

    /// The cosine in the layer, of one that is not negative.
    fn refracted<T: Real>(&self, cos: T) -> T {
        let eta = self.coating.eta();
        (T::one() - (T::one() - cos.squared()) * (eta * eta).recip()).sqrt()
    }

    fn below(&self, w: Vec3, n: Vec3) -> Below {
        let (cos, eta) = (n.dot(w), self.coating.eta());
        let inside = self.refracted(Real::abs(cos)).copysign(cos);
        let shift = inside - cos / eta;
        let by_cos = cos / (eta * eta * inside) - eta.recip();
        Below { w: w * eta.recip() + n * shift, shift, by_cos }
    }

    /// Where light of a direction in the layer leaves it; `None` where it is reflected.
    fn above(&self, w: Vec3, n: Vec3) -> Option<Vec3> {
        let (cos, eta) = (n.dot(w), self.coating.eta());
        let cos2 = 1.0 - (1.0 - cos * cos) * (eta * eta);
        let outside = fm::sqrt(cos2.max(0.0)).copysign(cos);
        (cos2 > 0.0).then(|| w * eta + n * (outside - cos * eta))
    }

    /// The length of both ways through the layer, from the cosines outside.
    fn path<T: Real>(&self, cosines: [T; 2]) -> T {
        let [a, b] = cosines.map(|c| self.refracted(c.abs()).recip());
        (a + b) * self.thickness
    }

    /// The part of the light that gets through the interface and the layer, and back.
    fn through<T: Real>(&self, sigma_a: Rgb<T>, cosines: [T; 2]) -> Rgb<T> {
        let [a, b] = cosines.map(|c| self.coating.let_through(c.abs()));
        let (both, path) = (a * b, self.path(cosines));
        sigma_a.map(|s| (path * -s).exp() * both)
    }

    /// The solid angle in the layer by that outside.
    fn compression<T: Real>(&self, cos: T) -> T {
        let (cos, eta) = (cos.abs(), self.coating.eta());
        cos / (self.refracted(cos) * (eta * eta))
    }

    /// What the value below is multiplied by.
    fn factor<T: Real>(&self, sigma_a: Rgb<T>, [cos_o, cos_i]: [T; 2]) -> Rgb<T> {
        self.through(sigma_a, [cos_o, cos_i]) * self.compression(cos_i)
    }

    /// The white reflection by microfacets, on the side of both directions; `None` of a smooth layer.
    fn facets<T: Real>(&self, a: Angles<T>) -> Option<T> {
        let a = if a.cos_o.re() < 0.0 { a.flipped() } else { a };
        if a.in_front() { self.coating.reflection(&a) } else { None }
    }

    /// Probabilities of the reflection at the interface, seen at a cosine, and of what is below.
    fn choices(&self, cos: f64) -> [f64; 2] {
        let cos = Real::abs(cos);
        let reflected = (1.0 - self.coating.let_through(cos)) * self.specular_reflectance.mean();
        let rest = self.through(self.sigma_a, [cos; 2]).mean();
        let sum = reflected + rest;
        let share = if sum > 0.0 { reflected / sum } else { 0.5 };
        let share = share.clamp(LEAST_CHOICE, 1.0 - LEAST_CHOICE);
        [share, 1.0 - share]
    }
}

impl Composed for Coated {
    fn parts(&self) -> [Option<&Bsdf>; 2] {
        [Some(&self.bsdf), None]
    }
}

impl Model for Coated {
    fn name(&self) -> &'static str {
        if self.is_smooth() { "coating" } else { "roughcoating" }
    }

    #[inline(never)]
    fn flags(&self) -> Flags {
        let inner = self.bsdf.flags();
        let smooth = self.is_smooth() || inner.smooth;
        let spread = !self.is_smooth() || inner.spread;
        Flags { black: false, black_from_behind: false, smooth, spread, ..inner }
    }

    fn differentiated(&self) -> PropertySet {
        let own = const { PropertySet::new(&[Property::SpecularReflectance, Property::SigmaA]) };
        self.bsdf.differentiated().union(own)
    }

    fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        match property {
            Property::SpecularReflectance => Some(Slot::Color(&mut self.specular_reflectance)),
            Property::SigmaA => Some(Slot::Color(&mut self.sigma_a)),
            Property::Thickness => Some(Slot::Scalar(&mut self.thickness)),
            _ => self.bsdf.property(property),
        }
    }

    fn validate(&self) -> Result<(), SurfaceError> {
        let inner = &self.bsdf;
        if inner.is_null() || inner.passes_straight() || inner.is_transmissive() {
            return Err(SurfaceError::CannotHold { outer: self.name(), bsdf: inner.name() });
        }
        self.coating.validate()?;
        nonnegative(Property::SpecularReflectance, self.specular_reflectance)?;
        nonnegative(Property::SigmaA, self.sigma_a)?;
        in_range(Property::Thickness, self.thickness, self.thickness >= 0.0, "0 or more")?;
        inner.validate()
    }

    #[inline(never)]
    fn value<T: Real>(
        &self,
        numbers: impl Numbers<T>,
        at: At<'_>,
        [wo, wi, n]: [Vec3<T>; 3],
    ) -> Rgb<T> {
        let eta = self.coating.eta();
        let below = |w: Vec3<T>| {
            let cos = n.dot(w);
            let inside = self.refracted(cos.abs());
            let inside = if cos.re() < 0.0 { -inside } else { inside };
            w * T::from(eta.recip()) + n * (inside - cos / eta)
        };
        let hidden = const { PropertySet::new(&[Property::SpecularReflectance]) };
        let value = self.bsdf.value(numbers.without(hidden), at, [below(wo), below(wi), n]);
        let sigma_a = numbers.colour(Property::SigmaA, self.sigma_a);
        let value = value * self.factor(sigma_a, [n.dot(wo), n.dot(wi)]);
        match self.facets(Angles::new(wo, wi, n)) {
            Some(grey) => {
                let property = Property::SpecularReflectance;
                value + numbers.colour(property, self.specular_reflectance) * grey
            }
            None => value,
        }
    }

    #[inline(never)]
    fn gradient(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> BsdfGradient {
        let angles = Angles::new(wo, wi, n);
        let below = [self.below(wo, n), self.below(wi, n)];
        let d = self.bsdf.gradient_at(at, below[0].w, below[1].w, n);
        let cosines = [Dual::<f64, 2>::variable(angles.cos_o, 0), Dual::variable(angles.cos_i, 1)];
        let factor = self.factor(self.sigma_a.map(Dual::from), cosines);
        let by = |i: usize| factor.map(|f| f.eps[i]);
        let (by_cos_o, by_cos_i) = (d.value * by(0), d.value * by(1));
        let factor = factor.map(|f| f.re);
        let base = d.value * factor;

        let top = Angles::<Dual<f64, 3>> {
            cos_o: Dual::variable(angles.cos_o, 0),
            cos_i: Dual::variable(angles.cos_i, 1),
            h2: Dual::variable(angles.h2, 2),
        };
        let grey = self.facets(top);
        let along = |i: usize| self.specular_reflectance * grey.map_or(0.0, |g| g.eps[i]);
        let mut slopes = Slopes {
            value: grey.map_or(base, |g| base + self.specular_reflectance * g.re),
            cos_o: by_cos_o + along(0),
            cos_i: by_cos_i + along(1),
            h2: along(2),
            ..Slopes::default()
        };
        slopes.params = d.params.scaled(factor);
        let top = Rgb::splat(grey.map_or(0.0, |g| g.re));
        slopes.params.set(Property::SpecularReflectance, top);
        let path = self.path([angles.cos_o, angles.cos_i]);
        slopes.params.set(Property::SigmaA, base * -path);

        let mut gradient = slopes.pull_back(wo, wi, n);
        let eta = self.coating.eta();
        gradient.n += d.n * factor;
        gradient.wo += below[0].pull_back(d.wo * factor, [wo, n], eta, &mut gradient.n);
        gradient.wi += below[1].pull_back(d.wi * factor, [wi, n], eta, &mut gradient.n);
        gradient
    }

    #[inline(never)]
    fn sample(&self, at: At<'_>, from: Vec3, n: Vec3, u: [f64; 3], given: Given) -> Option<Vec3> {
        let cos = n.dot(from);
        let (reflects, choice) = choose(u[2], self.choices(cos));
        if !reflects {
            let u = [u[0], u[1], choice];
            let w = self.bsdf.direction(at, self.below(from, n).w, n, u, given)?;
            return self.above(w, n);
        }
        let side = if cos < 0.0 { -n } else { n };
        let (distribution, alpha) = self.coating.facets().filter(|_| cos != 0.0)?;
        Some(mirrored(from, distribution.sample_visible(from, side, alpha, [u[0], u[1]])))
    }

    fn single_chance(&self, at: At<'_>, from: Vec3, n: Vec3) -> f64 {
        let cos = n.dot(from);
        let [reflects, rest] = self.choices(cos);
        let top = if self.is_smooth() && cos != 0.0 { reflects } else { 0.0 };
        top + rest * self.bsdf.single_chance(at, self.below(from, n).w, n)
    }

    #[inline(never)]
    fn sample_specular(
        &self,
        at: At<'_>,
        from: Vec3,
        n: Vec3,
        choice: f64,
        given: Given,
    ) -> Option<SpecularSample> {
        let cos = n.dot(from);
        let choices = self.choices(cos);
        let (reflects, choice) = choose(choice, choices);
        if !reflects {
            let below = self.below(from, n).w;
            let s = self.bsdf.sample_specular_at(at, below, n, choice, given)?;
            let w = self.above(s.w, n)?;
            let weight =
                s.weight * self.through(self.sigma_a, [cos, n.dot(w)]) * choices[1].recip();
            return Some(SpecularSample { w, weight, straight: false });
        }
        (self.is_smooth() && cos != 0.0).then(|| {
            let fresnel = dielectric_reflected(Real::abs(cos).min(1.0), self.coating.eta());
            let weight = self.specular_reflectance * (fresnel / choices[0]);
            SpecularSample { w: mirrored(from, n), weight, straight: false }
        })
    }

    /// A mirror below reflects to where the interface does.
    #[inline(never)]
    fn specular(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Option<SpecularValue> {
        let cos = n.dot(wo);
        let choices = self.choices(cos);
        let cosines = [cos, n.dot(wi)];
        let nested = self.bsdf.specular(at, self.below(wo, n).w, self.below(wi, n).w, n);
        let nested = nested.map(|found| {
            let outside = Dual::<f64, 1>::variable(cos, 0);
            let sigma_a = self.sigma_a.map(Dual::from);
            let through = self.through(sigma_a, [outside; 2]);
            let by_through = through.map(|c| c.eps[0]);
            let [inside] = self.refracted(outside.abs()).eps;
            let by_cosine = found.by_cosine * (inside * cos.signum());
            let mut scaled = found.scaled(through.map(|c| c.re), choices[1]);
            scaled.by_cosine = by_cosine * through.map(|c| c.re) + found.value * by_through;
            scaled
        });
        let top = self.is_smooth() && cos != 0.0 && same(mirrored(wo, n), wi);
        if nested.is_none() && !top {
            return None;
        }
        let mut found = nested.unwrap_or_default();
        found.params.set(Property::SigmaA, found.value * -self.path(cosines));
        found.params.set(Property::SpecularReflectance, Rgb::ZERO);
        if top {
            let turned = Dual::variable(Real::abs(cos).min(1.0), 0);
            let fresnel = dielectric_reflected(turned, Dual::from(self.coating.eta()));
            let Dual { re: fresnel, eps: [by_cosine] } = fresnel;
            found.params.set(Property::SpecularReflectance, Rgb::splat(fresnel));
            found.value += self.specular_reflectance * fresnel;
            found.by_cosine += self.specular_reflectance * (by_cosine * cos.signum());
            found.probability += choices[0];
            found.bend = Bend::Mirror;
        }
        Some(found)
    }

    #[inline(never)]
    fn pdf(&self, at: At<'_>, from: Vec3, to: Vec3, n: Vec3, given: Given) -> f64 {
        let a = Angles::new(from, to, n);
        let [reflects, rest] = self.choices(a.cos_o);
        let below = self.bsdf.pdf_at(at, self.below(from, n).w, self.below(to, n).w, n, given);
        let below = rest * below * self.compression(a.cos_i);
        let a = if a.cos_o < 0.0 { a.flipped() } else { a };
        let top = if a.in_front() { self.coating.reflection_density(&a) } else { None };
        below + reflects * top.unwrap_or(0.0)
    }

    fn lobe_width(&self, at: At<'_>) -> f64 {
        let top = self.coating.facets().map_or(0.0, |(_, alpha)| alpha);
        f64::min(top, self.bsdf.lobe_width(at))
    }

    /// The sketch of what is below, bent and dimmed, with the reflection by microfacets.
    fn lobes(&self, at: At<'_>, wo: Vec3, n: Vec3) -> Lobes {
        let (side, eta2) = (if n.dot(wo) < 0.0 { -n } else { n }, self.coating.eta().powi(2));
        let cos = side.dot(wo).clamp(1e-6, 1.0);
        let dimmed = self.through(self.sigma_a, [cos; 2]).mean() / eta2;
        let below = self.bsdf.lobes(at, self.below(wo, n).w, n);
        let [a, b] = below.lobes.map(|lobe| {
            let along = lobe.axis.reject(n);
            let flat = if along.max_abs() > 0.0 { along.normalize() } else { lobe.axis };
            let axis = self.above(lobe.axis, n).unwrap_or(flat);
            Lobe { axis, width2: lobe.width2 * eta2, height: lobe.height * dimmed * eta2 }
        });
        let top = self.coating.facets().map(|(_, alpha)| {
            let reflected = 1.0 - self.coating.let_through(cos);
            reflection(wo, side, alpha, self.specular_reflectance.mean() * reflected)
        });
        two_highest(below.even * dimmed, [a, b, top.unwrap_or_default(), Lobe::default()])
    }

    /// The texture below the layer that stands for a property.
    fn texture(&self, property: Property) -> Option<&Texture> {
        match property {
            Property::SpecularReflectance | Property::SigmaA | Property::Thickness => None,
            _ => self.bsdf.texture(property),
        }
    }

    fn undifferentiated(&self, property: Property, _: Textures<'_>) -> Option<&'static str> {
        match property {
            Property::SpecularReflectance | Property::SigmaA => None,
            Property::Thickness => Some("change `sigma_a`, which it is a factor of"),
            _ => self.bsdf.undifferentiated(property),
        }
    }

    fn slide(&self, at: At<'_>, [wo, wi, n]: [Vec3; 3], _: &BsdfParams, factor: f64) -> RgbVec {
        let inside = [self.below(wo, n).w, self.below(wi, n).w, n];
        let params = self.bsdf.gradient_at(at, inside[0], inside[1], n).params;
        self.bsdf.slide(at, inside, &params, 1.0)
            * (self.factor(self.sigma_a, [n.dot(wo), n.dot(wi)]) * factor)
    }

    fn stretch(&self, at: At<'_>, [wo, wi, n]: [Vec3; 3], factor: f64) -> [RgbVec; 3] {
        let inside = [self.below(wo, n).w, self.below(wi, n).w, n];
        let through = self.factor(self.sigma_a, [n.dot(wo), n.dot(wi)]) * factor;
        self.bsdf.stretch(at, inside, 1.0).map(|by| by * through)
    }
}
