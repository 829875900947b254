use core::f64::consts::{FRAC_1_PI, PI};

use drt_math::{Frame, Real, Rgb, Vec3, fm, vec3, warp};

use crate::model::surface::angles::{Angles, Slopes};
use crate::model::surface::property::{Property, Slot, SurfaceError, in_range, nonnegative};

/// The modified Phong reflector of Lafortune & Willems 1994, "Using the modified Phong reflectance
/// model for physically based rendering": in front
/// `fs = reflectance / pi + specular_reflectance (exponent + 2) / (2 pi) max(0, cos a)^exponent`,
/// where `a` is the angle between one direction and the mirror image of the other; black from
/// behind.
///
/// It conserves energy when `reflectance + specular_reflectance <= 1`; this is not enforced.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Phong<T = f64> {
    /// Weight of the diffuse lobe; default 0.5.
    pub reflectance: Rgb<T>,
    /// Weight of the glossy lobe; default 0.2.
    pub specular_reflectance: Rgb<T>,
    /// Sharpness of the glossy lobe, above 0; default 30.
    pub exponent: T,
}

impl Default for Phong {
    fn default() -> Self {
        Self { reflectance: Rgb::splat(0.5), specular_reflectance: Rgb::splat(0.2), exponent: 30.0 }
    }
}

/// Least probability of choosing either lobe: a lobe of weight zero still has a derivative with
/// respect to that weight.
const LEAST_CHOICE: f64 = 0.1;

impl<T: Real> Phong<T> {
    #[inline]
    pub(super) fn value(&self, a: &Angles<T>) -> Rgb<T> {
        if !a.in_front() {
            return Rgb::splat(T::zero());
        }
        let lobe = glossy_lobe(mirror_cosine(a), self.exponent);
        (self.reflectance * T::from(FRAC_1_PI) + self.specular_reflectance * lobe) * a.cos_i
    }
}

/// Cosine between one direction and the mirror image of the other: `2 (n·wo)(n·wi) - wo·wi`.
#[inline]
fn mirror_cosine<T: Real>(a: &Angles<T>) -> T {
    a.cos_o * a.cos_i * 2.0 - a.h2 * 0.5 + 1.0
}

#[inline]
fn glossy_lobe<T: Real>(cos: T, exponent: T) -> T {
    if cos.re() <= 0.0 {
        return T::zero();
    }
    (exponent + 2.0) * (exponent * cos.ln()).exp() * (0.5 * FRAC_1_PI)
}

impl Phong {
    #[inline]
    pub(super) fn slopes(&self, a: &Angles) -> Slopes {
        let mut s = Slopes::default();
        if !a.in_front() {
            return s;
        }
        let cos = mirror_cosine(a);
        let lobe = glossy_lobe(cos, self.exponent);
        let f = self.reflectance * FRAC_1_PI + self.specular_reflectance * lobe;
        s.value = f * a.cos_i;
        s.cos_i = f;
        s.params.reflectance = Rgb::splat(a.cos_i * FRAC_1_PI);
        if lobe > 0.0 {
            let glossy = self.specular_reflectance * (lobe * a.cos_i);
            let along_cos = glossy * (self.exponent / cos);
            s.cos_o = along_cos * (2.0 * a.cos_i);
            s.cos_i += along_cos * (2.0 * a.cos_o);
            s.h2 = along_cos * -0.5;
            s.params.specular_reflectance = Rgb::splat(lobe * a.cos_i);
            s.params.exponent = glossy * ((self.exponent + 2.0).recip() + fm::ln(cos));
        }
        s
    }

    #[inline]
    fn glossy_choice(&self) -> f64 {
        let (diffuse, glossy) = (self.reflectance.mean(), self.specular_reflectance.mean());
        let sum = diffuse + glossy;
        let share = if sum > 0.0 { glossy / sum } else { 0.5 };
        share.clamp(LEAST_CHOICE, 1.0 - LEAST_CHOICE)
    }

    #[inline]
    pub(super) fn pdf(&self, a: &Angles) -> f64 {
        if !a.in_front() {
            return 0.0;
        }
        let glossy = self.glossy_choice();
        let lobe = glossy_lobe(mirror_cosine(a), self.exponent) * (self.exponent + 1.0)
            / (self.exponent + 2.0);
        glossy * lobe + (1.0 - glossy) * a.cos_i * FRAC_1_PI
    }

    #[inline]
    pub(super) fn sample(&self, from: Vec3, n: Vec3, [u, v, choice]: [f64; 3]) -> Option<Vec3> {
        let cos_from = n.dot(from);
        if cos_from <= 0.0 {
            return None;
        }
        if choice >= self.glossy_choice() {
            return Some(Frame::from_normal(n).to_world(warp::cosine_hemisphere([u, v])));
        }
        let cos = fm::powf(u, (self.exponent + 1.0).recip());
        let sin = fm::sqrt((1.0 - cos * cos).max(0.0));
        let (sin_phi, cos_phi) = fm::sin_cos(2.0 * PI * v);
        let mirror = n * (2.0 * cos_from) - from;
        Some(Frame::from_normal(mirror).to_world(vec3(sin * cos_phi, sin * sin_phi, cos)))
    }

    pub(super) fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        match property {
            Property::Reflectance => Some(Slot::Color(&mut self.reflectance)),
            Property::SpecularReflectance => Some(Slot::Color(&mut self.specular_reflectance)),
            Property::Exponent => Some(Slot::Scalar(&mut self.exponent)),
            _ => None,
        }
    }

    pub(super) fn validate(&self) -> Result<(), SurfaceError> {
        nonnegative(Property::Reflectance, self.reflectance)?;
        nonnegative(Property::SpecularReflectance, self.specular_reflectance)?;
        in_range(Property::Exponent, self.exponent, self.exponent > 0.0, "above 0")
    }
}
