use core::f64::consts::FRAC_1_PI;

use drt_geom::edges::Lobes;
use drt_math::{Frame, Real, Rgb, Vec3, warp};

use crate::model::surface::angles::Angles;
use crate::model::surface::isotropic::{Isotropic, scatters_by_angles};
use crate::model::surface::model::{Dependence, Flags, Model, Numbers};
use crate::model::surface::params::PropertySet;
use crate::model::surface::property::{Property, Slot, SurfaceError, nonnegative};
use crate::model::surface::{At, BsdfGradient, Given};

/// A Lambertian reflector: `fs = reflectance / pi` in front, black from behind.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Diffuse {
    /// Part of the incident power that is reflected; default 0.5.
    pub reflectance: Rgb,
}

impl Default for Diffuse {
    fn default() -> Self {
        Self { reflectance: Rgb::splat(0.5) }
    }
}

impl Isotropic for Diffuse {
    #[inline]
    fn by_angles<T: Real>(&self, numbers: impl Numbers<T>, a: &Angles<T>) -> Rgb<T> {
        if !a.in_front() {
            return Rgb::splat(T::zero());
        }
        numbers.colour(Property::Reflectance, self.reflectance) * (a.cos_i * FRAC_1_PI)
    }
}

impl Model for Diffuse {
    fn name(&self) -> &'static str {
        "diffuse"
    }

    #[inline]
    fn flags(&self) -> Flags {
        Flags { black: self.reflectance.is_zero(), ..Flags::REFLECTOR }
    }

    scatters_by_angles!(Reflectance);

    fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        match property {
            Property::Reflectance => Some(Slot::Color(&mut self.reflectance)),
            _ => None,
        }
    }

    fn validate(&self) -> Result<(), SurfaceError> {
        nonnegative(Property::Reflectance, self.reflectance)
    }

    #[inline]
    fn sample(&self, _: At<'_>, from: Vec3, n: Vec3, u: [f64; 3], _: Given) -> Option<Vec3> {
        (n.dot(from) > 0.0)
            .then(|| Frame::from_normal(n).to_world(warp::cosine_hemisphere([u[0], u[1]])))
    }

    #[inline]
    fn pdf(&self, _: At<'_>, from: Vec3, to: Vec3, n: Vec3, _: Given) -> f64 {
        let a = Angles::new(from, to, n);
        if a.in_front() { a.cos_i * FRAC_1_PI } else { 0.0 }
    }

    fn lobes(&self, _: At<'_>, _: Vec3, _: Vec3) -> Lobes {
        Lobes::even(self.reflectance.mean() * FRAC_1_PI)
    }

    fn lobe_width(&self, _: At<'_>) -> f64 {
        1.0
    }
}
