//! Derivatives of what smooth surfaces scatter into single directions.
//!
//! A walk that draws one of the single directions of a surface, with the probability P_i, goes on with the weight V_i / P_i. Its
//! derivative is ∂V_i / P_i: as of any sample, the density counts as a constant. Parts i of a surface that share a direction are
//! told apart by nothing that the walk leaves behind; given the direction, the mean of ∂V_i / P_i over them is Σ ∂V_i / Σ P_i,
//! which is taken: as unbiased, and of no more variance. Where an index of refraction turns the direction, there is more to the
//! derivative, which nothing here has.

use drt_math::{Rgb, Vec3};

use crate::model::surface::{At, Bsdf, BsdfParams};

/// What a surface scatters from one direction into another, single one.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SpecularValue {
    /// The value V.
    pub(crate) value: Rgb,
    /// Its derivatives by the properties.
    pub(crate) params: BsdfParams,
    /// The probability of drawing the direction, given `wo`.
    pub(crate) probability: f64,
}

impl SpecularValue {
    /// So many times the value, drawn so many times as often.
    pub(super) fn scaled(&self, value: Rgb, probability: f64) -> Self {
        let mut params = BsdfParams::default();
        params.scatter(&self.params, value);
        Self { value: self.value * value, params, probability: self.probability * probability }
    }
}

/// True of a direction that was drawn as this one.
pub(super) fn same(drawn: Vec3, w: Vec3) -> bool {
    (drawn - w).max_abs() < 1e-9
}

impl Bsdf {
    /// The derivatives of a walk's weight by the properties, where `wi` is a single direction that `wo` is scattered to.
    #[inline]
    pub(super) fn specular_gradient(
        &self,
        at: At<'_>,
        wo: Vec3,
        wi: Vec3,
        n: Vec3,
    ) -> Option<BsdfParams> {
        match self.facing(wo, n).0 {
            Self::Null
            | Self::Diffuse(_)
            | Self::Phong(_)
            | Self::RoughConductor(_)
            | Self::RoughDielectric(_) => None,
            _ => {
                let found = self.specular(at, wo, wi, n)?;
                let inverse = Rgb::splat(found.probability.recip());
                (found.probability > 0.0).then(|| found.scaled(inverse, 1.0).params)
            }
        }
    }

    /// What is scattered from `wo` into the single direction `wi`; `None` where it is none.
    #[cold]
    pub(crate) fn specular(
        &self,
        at: At<'_>,
        wo: Vec3,
        wi: Vec3,
        n: Vec3,
    ) -> Option<SpecularValue> {
        let (bsdf, n) = self.facing(wo, n);
        match bsdf {
            Self::Plastic(b) => b.specular(wo, wi, n),
            Self::Conductor(b) => b.specular(wo, wi, n),
            Self::Dielectric(b) => b.specular(wo, wi, n),
            Self::ThinDielectric(b) => b.specular(wo, wi, n),
            _ => bsdf.composed(|b| b.specular(at, wo, wi, n)).flatten(),
        }
    }
}
