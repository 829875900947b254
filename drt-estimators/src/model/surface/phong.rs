use core::f64::consts::{FRAC_1_PI, PI};

use drt_geom::edges::{Lobe, Lobes};
use drt_math::{Frame, Real, Rgb, Vec3, fm, vec3, warp};

use crate::model::surface::angles::Angles;
use crate::model::surface::isotropic::{Isotropic, scatters_by_angles};
use crate::model::surface::microfacet::mirrored;
use crate::model::surface::model::{Dependence, Flags, Model, Numbers};
use crate::model::surface::params::PropertySet;
use crate::model::surface::property::{Property, Slot, SurfaceError, in_range, nonnegative};
use crate::model::surface::{At, BsdfGradient, Given};

/// The modified Phong reflector of Lafortune & Willems 1994, "Using the modified Phong reflectance
/// model for physically based rendering": in front
/// `fs = reflectance / pi + specular_reflectance (exponent + 2) / (2 pi) max(0, cos a)^exponent`,
/// where `a` is the angle between one direction and the mirror image of the other; black from
/// behind.
///
/// It conserves energy when `reflectance + specular_reflectance <= 1`; this is not enforced.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Phong {
    /// Weight of the diffuse lobe; default 0.5.
    pub reflectance: Rgb,
    /// Weight of the glossy lobe; default 0.2.
    pub specular_reflectance: Rgb,
    /// Sharpness of the glossy lobe, above 0; default 30.
    pub exponent: f64,
}

impl Default for Phong {
    fn default() -> Self {
        Self { reflectance: Rgb::splat(0.5), specular_reflectance: Rgb::splat(0.2), exponent: 30.0 }
    }
}

/// Least probability of choosing either lobe: a lobe of weight zero still has a derivative with
/// respect to that weight.
const LEAST_CHOICE: f64 = 0.1;

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
    fn glossy_choice(&self) -> f64 {
        let (diffuse, glossy) = (self.reflectance.mean(), self.specular_reflectance.mean());
        let sum = diffuse + glossy;
        let share = if sum > 0.0 { glossy / sum } else { 0.5 };
        share.clamp(LEAST_CHOICE, 1.0 - LEAST_CHOICE)
    }
}

impl Isotropic for Phong {
    #[inline]
    fn by_angles<T: Real>(&self, numbers: impl Numbers<T>, a: &Angles<T>) -> Rgb<T> {
        if !a.in_front() {
            return Rgb::splat(T::zero());
        }
        let exponent = numbers.number(Property::Exponent, self.exponent);
        let lobe = glossy_lobe(mirror_cosine(a), exponent);
        let reflectance = numbers.colour(Property::Reflectance, self.reflectance);
        let specular = numbers.colour(Property::SpecularReflectance, self.specular_reflectance);
        (reflectance * T::from(FRAC_1_PI) + specular * lobe) * a.cos_i
    }
}

impl Model for Phong {
    fn name(&self) -> &'static str {
        "phong"
    }

    #[inline]
    fn flags(&self) -> Flags {
        Flags::REFLECTOR
    }

    scatters_by_angles!(Reflectance, SpecularReflectance, Exponent);

    fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        match property {
            Property::Reflectance => Some(Slot::Color(&mut self.reflectance)),
            Property::SpecularReflectance => Some(Slot::Color(&mut self.specular_reflectance)),
            Property::Exponent => Some(Slot::Scalar(&mut self.exponent)),
            _ => None,
        }
    }

    fn validate(&self) -> Result<(), SurfaceError> {
        nonnegative(Property::Reflectance, self.reflectance)?;
        nonnegative(Property::SpecularReflectance, self.specular_reflectance)?;
        in_range(Property::Exponent, self.exponent, self.exponent > 0.0, "above 0")
    }

    #[inline]
    fn sample(&self, _: At<'_>, from: Vec3, n: Vec3, u: [f64; 3], _: Given) -> Option<Vec3> {
        let [u, v, choice] = u;
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

    #[inline]
    fn pdf(&self, _: At<'_>, from: Vec3, to: Vec3, n: Vec3, _: Given) -> f64 {
        let a = Angles::new(from, to, n);
        if !a.in_front() {
            return 0.0;
        }
        let glossy = self.glossy_choice();
        let lobe = glossy_lobe(mirror_cosine(&a), self.exponent) * (self.exponent + 1.0)
            / (self.exponent + 2.0);
        glossy * lobe + (1.0 - glossy) * a.cos_i * FRAC_1_PI
    }

    fn lobes(&self, _: At<'_>, wo: Vec3, n: Vec3) -> Lobes {
        let cos = n.dot(wo).max(0.0);
        // As high in the middle as (exponent + 2) / (2 π).
        let width2 = 2.0 / (self.exponent + 2.0);
        let lobe = Lobe::new(mirrored(wo, n), width2, self.specular_reflectance.mean() * cos);
        Lobes::glossy(self.reflectance.mean() * FRAC_1_PI, [lobe, Lobe::default()])
    }

    fn lobe_width(&self, _: At<'_>) -> f64 {
        1.0 / fm::sqrt(1.0 + 0.5 * self.exponent)
    }
}
