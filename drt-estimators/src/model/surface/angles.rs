use drt_math::{Real, Rgb, Vec3};

use crate::model::surface::{BsdfGradient, BsdfParams};

/// The three numbers through which an isotropic BSDF sees its two directions and its normal.
///
/// Every model here is a function of these, so that a derivative with respect to nine coordinates
/// costs three dual lanes. As a function of free vectors this extends the BSDF off the unit spheres
/// in one consistent way: by these dot products as written.
#[derive(Clone, Copy, Debug)]
pub(super) struct Angles<T = f64> {
    /// n·wo.
    pub(super) cos_o: T,
    /// n·wi.
    pub(super) cos_i: T,
    /// |wo + wi|², which is 2 + 2 wo·wi without its cancellation at opposite directions.
    pub(super) h2: T,
}

impl<T: Real> Angles<T> {
    #[inline]
    pub(super) fn new(wo: Vec3<T>, wi: Vec3<T>, n: Vec3<T>) -> Self {
        Self { cos_o: n.dot(wo), cos_i: n.dot(wi), h2: (wo + wi).length_squared() }
    }

    /// The angles of these directions against the opposite normal.
    #[inline]
    pub(super) fn flipped(self) -> Self {
        Self { cos_o: -self.cos_o, cos_i: -self.cos_i, h2: self.h2 }
    }

    /// Both directions on the side the normal points to.
    #[inline]
    pub(super) fn in_front(&self) -> bool {
        self.cos_o.re() > 0.0 && self.cos_i.re() > 0.0
    }
}

/// A value and its derivatives with respect to the [`Angles`] and the material's properties.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Slopes {
    pub(super) value: Rgb,
    pub(super) cos_o: Rgb,
    pub(super) cos_i: Rgb,
    pub(super) h2: Rgb,
    pub(super) params: BsdfParams,
}

impl Slopes {
    /// The chain rule from the angles to the three vectors.
    #[inline]
    pub(super) fn pull_back(self, wo: Vec3, wi: Vec3, n: Vec3) -> BsdfGradient {
        let along_h = self.h2.outer((wo + wi) * 2.0);
        BsdfGradient {
            value: self.value,
            wo: self.cos_o.outer(n) + along_h,
            wi: self.cos_i.outer(n) + along_h,
            n: self.cos_o.outer(wo) + self.cos_i.outer(wi),
            params: self.params,
        }
    }
}
