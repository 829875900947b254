use core::f64::consts::FRAC_1_PI;

use drt_math::{Frame, Real, Rgb, Vec3, warp};

use crate::model::surface::angles::{Angles, Slopes};
use crate::model::surface::property::{Property, Slot, SurfaceError, nonnegative};

/// A Lambertian reflector: `fs = reflectance / pi` in front, black from behind.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Diffuse<T = f64> {
    /// Part of the incident power that is reflected; default 0.5.
    pub reflectance: Rgb<T>,
}

impl Default for Diffuse {
    fn default() -> Self {
        Self { reflectance: Rgb::splat(0.5) }
    }
}

impl<T: Real> Diffuse<T> {
    #[inline]
    pub(super) fn value(&self, a: &Angles<T>) -> Rgb<T> {
        if !a.in_front() {
            return Rgb::splat(T::zero());
        }
        self.reflectance * (a.cos_i * FRAC_1_PI)
    }
}

impl Diffuse {
    #[inline]
    pub(super) fn slopes(&self, a: &Angles) -> Slopes {
        let mut s = Slopes::default();
        if a.in_front() {
            s.value = self.value(a);
            s.cos_i = self.reflectance * FRAC_1_PI;
            s.params.reflectance = Rgb::splat(a.cos_i * FRAC_1_PI);
        }
        s
    }

    #[inline]
    pub(super) fn pdf(&self, a: &Angles) -> f64 {
        if a.in_front() { a.cos_i * FRAC_1_PI } else { 0.0 }
    }

    #[inline]
    pub(super) fn sample(&self, from: Vec3, n: Vec3, u: [f64; 3]) -> Option<Vec3> {
        (n.dot(from) > 0.0)
            .then(|| Frame::from_normal(n).to_world(warp::cosine_hemisphere([u[0], u[1]])))
    }

    pub(super) fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        match property {
            Property::Reflectance => Some(Slot::Color(&mut self.reflectance)),
            _ => None,
        }
    }

    pub(super) fn validate(&self) -> Result<(), SurfaceError> {
        nonnegative(Property::Reflectance, self.reflectance)
    }
}
