use drt_geom::edges::Lobes;
use drt_math::{Real, Rgb, Vec3};

use crate::model::surface::model::{Dependence, Flags, Model, Numbers};
use crate::model::surface::params::PropertySet;
use crate::model::surface::property::{Property, Slot, SurfaceError};
use crate::model::surface::{At, BsdfGradient, Given};

/// The model of [`Bsdf::Null`](super::Bsdf::Null), which scatters nothing.
pub(super) struct NoSurface;

impl Model for NoSurface {
    fn name(&self) -> &'static str {
        "null"
    }

    #[inline]
    fn flags(&self) -> Flags {
        // Light crosses it from behind.
        Flags { black: true, black_from_behind: false, ..Flags::REFLECTOR }
    }

    #[inline]
    fn dependence(&self) -> Dependence {
        Dependence::Normal
    }

    #[inline]
    fn differentiated(&self) -> PropertySet {
        PropertySet::NONE
    }

    fn slot(&mut self, _: Property) -> Option<Slot<'_>> {
        None
    }

    fn validate(&self) -> Result<(), SurfaceError> {
        Ok(())
    }

    #[inline]
    fn value<T: Real>(&self, _: impl Numbers<T>, _: At<'_>, _: [Vec3<T>; 3]) -> Rgb<T> {
        Rgb::splat(T::zero())
    }

    #[inline]
    fn gradient(&self, _: At<'_>, _: Vec3, _: Vec3, _: Vec3) -> BsdfGradient {
        BsdfGradient::default()
    }

    #[inline]
    fn sample(&self, _: At<'_>, _: Vec3, _: Vec3, _: [f64; 3], _: Given) -> Option<Vec3> {
        None
    }

    #[inline]
    fn pdf(&self, _: At<'_>, _: Vec3, _: Vec3, _: Vec3, _: Given) -> f64 {
        0.0
    }

    fn lobes(&self, _: At<'_>, _: Vec3, _: Vec3) -> Lobes {
        Lobes::even(0.0)
    }

    fn lobe_width(&self, _: At<'_>) -> f64 {
        1.0
    }
}
