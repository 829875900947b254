//! How surfaces scatter light: values, sampling, densities and derivatives.
//!
//! Conventions: `wo` points towards the camera side, `wi` towards the light side, both away from the
//! surface; `n` is the shading normal; all three have length one. The geometric normal plays no
//! part: the caller has to find out on which side of the true surface a direction is. Values *include*
//! the cosine at the light, `fs(wo, wi) |n·wi|`, and transport radiance: a refraction has as a factor the
//! squared ratio of the refractive indices on the sides of `wo` and `wi`. Delta lobes of smooth surfaces
//! are not in the value and have no density; [`Bsdf::sample_specular`] samples them.
//! [`Bsdf::Null`] scatters nothing, and light crosses it unchanged.
//!
//! The models, their parameters and their defaults are those of the Mitsuba plugins `diffuse`,
//! `phong`, `plastic`, `roughplastic`, `pplastic`, `conductor`, `roughconductor`, `dielectric`, `thindielectric`,
//! `roughdielectric`, `principled`, `principledthin`, `measured`, `blendbsdf`, `mask`, `normalmap`, `bumpmap`,
//! `twosided` and `null`, and of those of Mitsuba 0.6 `coating`, `roughcoating`, `roughdiffuse` and `ward`.
//!
//! ```
//! use drt_estimators::surface::{Bsdf, Given, Property, RoughConductor};
//! use drt_math::{Rgb, Vec3, vec3};
//!
//! let metal = Bsdf::RoughConductor(RoughConductor { alpha: 0.3, ..Default::default() });
//! metal.validate()?;
//! let (n, wo) = (Vec3::Z, vec3(0.6, 0.0, 0.8));
//! let s = metal.sample(wo, n, [0.3, 0.7, 0.5], Given::Wo).expect("not lost below the surface");
//! assert_eq!(s.pdf, metal.pdf(wo, s.w, n, Given::Wo));
//!
//! // How the value answers to a sharper surface, and to a light direction that turns.
//! let g = metal.gradient(wo, s.w, n);
//! assert_eq!(g.value, metal.eval(wo, s.w, n));
//! let velocity = Vec3::Y.reject(s.w);
//! let rate: Rgb = g.wi.dot(velocity) + g.params.get(Property::Alpha) * -0.01;
//! assert!(rate.is_finite());
//! # Ok::<(), drt_estimators::surface::SurfaceError>(())
//! ```

mod angles;
mod bsdf;
mod choice;
mod coating;
mod conductor;
mod dielectric;
mod diffuse;
mod direction_partner;
mod facet;
mod framed;
mod fresnel;
mod horizon;
mod isotropic;
mod lobes;
mod local;
mod measured;
mod microfacet;
mod model;
mod null;
mod params;
mod phong;
mod plastic;
mod principled;
mod principled_thin;
mod property;
mod rough_diffuse;
mod roughness_partner;
mod shading_frame;
mod smooth_conductor;
mod smooth_dielectric;
mod specular;
mod stretched_facets;
#[cfg(test)]
pub(crate) mod tests;
mod textures;
mod thin_dielectric;
mod visible_slope;
mod ward;

use drt_geom::Mesh;
use drt_geom::edges::Lobes;
use drt_math::{Real, Rgb, RgbVec, Vec3};

use crate::model::surface::bsdf::each;
pub use crate::model::surface::bsdf::{
    Anisotropic, Blend, Bsdf, BsdfChange, Coated, Mask, Perturbation, Perturbed, Textured, TwoSided,
};
pub use crate::model::surface::coating::Coating;
pub use crate::model::surface::conductor::RoughConductor;
pub use crate::model::surface::dielectric::RoughDielectric;
pub use crate::model::surface::diffuse::Diffuse;
pub(crate) use crate::model::surface::direction_partner::{DirectionPartner, Turn};
use crate::model::surface::facet::Facet;
pub(crate) use crate::model::surface::local::{LocalBsdf, agree};
pub use crate::model::surface::measured::{Measured, MeasuredError, MeasuredTables, Tensor};
pub use crate::model::surface::microfacet::Distribution;
use crate::model::surface::model::Model;
pub(crate) use crate::model::surface::model::{Constants, Numbers};
pub use crate::model::surface::params::{BsdfParams, BsdfTangent, PropertySet};
pub use crate::model::surface::phong::Phong;
pub use crate::model::surface::plastic::Plastic;
pub use crate::model::surface::principled::Principled;
pub use crate::model::surface::principled_thin::PrincipledThin;
pub use crate::model::surface::property::{Property, SurfaceError};
pub use crate::model::surface::rough_diffuse::RoughDiffuse;
pub(crate) use crate::model::surface::roughness_partner::RoughnessPartner;
pub use crate::model::surface::smooth_conductor::Conductor;
pub use crate::model::surface::smooth_dielectric::Dielectric;
pub(crate) use crate::model::surface::specular::{Bend, SpecularValue};
pub use crate::model::surface::thin_dielectric::ThinDielectric;
pub use crate::model::surface::ward::{Ward, WardVariant};
use crate::model::texture::TexturePoint;

/// Which of the two directions is known when the other is sampled.
///
/// For every model here one density serves paths from the camera and from lights, as all models are symmetric in the
/// two directions up to factors that are part of a sample's weight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Given {
    /// `wo` is known and `wi` drawn: a walk from the camera.
    Wo,
    /// `wi` is known and `wo` drawn: a walk from a light.
    Wi,
}

/// A sampled direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionSample {
    /// The direction, away from the surface, of length one.
    pub w: Vec3,
    /// Its density per steradian; positive and finite.
    pub pdf: f64,
}

/// A direction into which a smooth surface scatters (a delta lobe).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpecularSample {
    /// The direction, away from the surface, of length one.
    pub w: Vec3,
    /// Scattered radiance per incident radiance in this direction, over the probability of choosing it.
    pub weight: Rgb,
    /// Light goes straight on, as if there were no surface.
    pub straight: bool,
}

/// A value `fs(wo, wi) |n·wi|` with its derivatives.
///
/// Derivatives with respect to the three vectors are those of one smooth extension of the value to
/// vectors of any length. Only their dot products with velocities that keep the length, which are orthogonal
/// to the respective vector, have a meaning of their own.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BsdfGradient {
    /// The value, as [`Bsdf::eval`] gives it.
    pub value: Rgb,
    /// Derivative with respect to `wo`.
    pub wo: RgbVec,
    /// Derivative with respect to `wi`.
    pub wi: RgbVec,
    /// Derivative with respect to the shading normal.
    pub n: RgbVec,
    /// Derivative with respect to the material's properties.
    pub params: BsdfParams,
}

/// Where textures are looked up; `None` takes their means.
type At<'a> = Option<&'a TexturePoint<'a>>;

impl BsdfGradient {
    /// The gradient of the value times a constant.
    fn scaled(&self, by: f64) -> Self {
        Self {
            value: self.value * by,
            wo: self.wo * by,
            wi: self.wi * by,
            n: self.n * by,
            params: self.params.scaled(Rgb::splat(by)),
        }
    }
}

impl Bsdf {
    /// The name of the plugin this BSDF follows.
    #[must_use]
    pub fn name(&self) -> &'static str {
        each!(self, b => b.name())
    }

    /// Checks every number.
    ///
    /// # Errors
    /// The first property out of its range, or a two-sided BSDF around anything but a reflector.
    pub fn validate(&self) -> Result<(), SurfaceError> {
        each!(self, b => b.validate())
    }

    /// Checks what textures have from the mesh of a shape.
    pub(crate) fn validate_on(&self, mesh: &Mesh) -> Result<(), SurfaceError> {
        each!(self, b => b.validate_on(mesh))?;
        self.parts().try_for_each(|b| b.validate_on(mesh))
    }

    /// The value `fs(wo, wi) |n·wi|` per channel; zero where the model is black. Like all that does
    /// not say where on a shape it is, this takes textures by their means.
    #[inline]
    #[must_use]
    pub fn eval(&self, wo: Vec3, wi: Vec3, n: Vec3) -> Rgb {
        self.eval_at(None, wo, wi, n)
    }

    #[inline]
    pub(crate) fn eval_at(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Rgb {
        self.value(Constants, at, [wo, wi, n])
    }

    /// The value over any scalar.
    #[inline]
    pub(crate) fn value<T: Real>(
        &self,
        numbers: impl Numbers<T>,
        at: At<'_>,
        directions: [Vec3<T>; 3],
    ) -> Rgb<T> {
        each!(self, b => b.value(numbers, at, directions))
    }

    /// The value and all its derivatives.
    #[inline]
    #[must_use]
    pub fn gradient(&self, wo: Vec3, wi: Vec3, n: Vec3) -> BsdfGradient {
        self.gradient_at(None, wo, wi, n)
    }

    #[inline]
    pub(crate) fn gradient_at(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> BsdfGradient {
        each!(self, b => b.gradient(at, wo, wi, n))
    }

    /// Draws the direction that `from` is scattered to, or `None` for a sample lost below the
    /// surface (or a BSDF that scatters nothing).
    ///
    /// `u` holds independent uniform numbers of (0, 1); the last one chooses between lobes. The
    /// density is positive wherever the value, or its derivative with respect to a property, is not
    /// zero, even where the property itself is.
    #[inline]
    #[must_use]
    pub fn sample(
        &self,
        from: Vec3,
        n: Vec3,
        u: [f64; 3],
        given: Given,
    ) -> Option<DirectionSample> {
        self.sample_at(None, from, n, u, given)
    }

    #[inline]
    pub(crate) fn sample_at(
        &self,
        at: At<'_>,
        from: Vec3,
        n: Vec3,
        u: [f64; 3],
        given: Given,
    ) -> Option<DirectionSample> {
        let (w, pdf) = each!(self, b => b.draw(at, from, n, u, given))?;
        (pdf > 0.0 && pdf.is_finite()).then_some(DirectionSample { w, pdf })
    }

    /// The direction that [`Bsdf::sample`] draws, without its density.
    fn direction(
        &self,
        at: At<'_>,
        from: Vec3,
        n: Vec3,
        u: [f64; 3],
        given: Given,
    ) -> Option<Vec3> {
        self.sample_at(at, from, n, u, given).map(|s| s.w)
    }

    /// Density per steradian with which [`Bsdf::sample`] draws `to`.
    #[inline]
    #[must_use]
    pub fn pdf(&self, from: Vec3, to: Vec3, n: Vec3, given: Given) -> f64 {
        self.pdf_at(None, from, to, n, given)
    }

    #[inline]
    pub(crate) fn pdf_at(&self, at: At<'_>, from: Vec3, to: Vec3, n: Vec3, given: Given) -> f64 {
        each!(self, b => b.pdf(at, from, to, n, given))
    }

    /// Draws one of the single directions that a smooth surface scatters `from` to. `None` where
    /// `choice`, the last of the numbers that [`Bsdf::sample`] takes, chooses what has a density: that
    /// one then draws it, with a density that counts the choice.
    #[inline]
    #[must_use]
    pub fn sample_specular(
        &self,
        from: Vec3,
        n: Vec3,
        choice: f64,
        given: Given,
    ) -> Option<SpecularSample> {
        self.sample_specular_at(None, from, n, choice, given)
    }

    #[inline]
    pub(crate) fn sample_specular_at(
        &self,
        at: At<'_>,
        from: Vec3,
        n: Vec3,
        choice: f64,
        given: Given,
    ) -> Option<SpecularSample> {
        each!(self, b => b.sample_specular(at, from, n, choice, given))
    }

    /// The probability with which [`Bsdf::sample_specular`] draws any direction.
    pub(crate) fn single_chance(&self, at: At<'_>, from: Vec3, n: Vec3) -> f64 {
        each!(self, b => b.single_chance(at, from, n))
    }

    /// What is scattered from `wo` into the single direction `wi`; `None` where it is none.
    #[inline]
    pub(crate) fn specular(
        &self,
        at: At<'_>,
        wo: Vec3,
        wi: Vec3,
        n: Vec3,
    ) -> Option<SpecularValue> {
        each!(self, b => b.specular(at, wo, wi, n))
    }

    /// The part of the light that goes straight through at a point, as if there was no surface, at a cosine to its
    /// normal.
    pub(crate) fn straight(&self, at: At<'_>, cos: f64) -> Rgb {
        each!(self, b => b.straight(at, cos))
    }

    /// The gradient of a value by the place of its point, as far as textures change there; `params` are the value's
    /// derivatives by properties, times a `factor`, as the gradient is to be.
    #[cold]
    pub(crate) fn slide(
        &self,
        at: At<'_>,
        directions: [Vec3; 3],
        params: &BsdfParams,
        factor: f64,
    ) -> RgbVec {
        each!(self, b => b.slide(at, directions, params, factor))
    }

    /// The gradient of the value, times a `factor`, by the corners of its triangle, as far as these stretch the texture coordinates on the
    /// surface.
    #[cold]
    fn stretch(&self, at: At<'_>, directions: [Vec3; 3], factor: f64) -> [RgbVec; 3] {
        each!(self, b => b.stretch(at, directions, factor))
    }

    /// The [`RoughnessPartner`] of `wi` as the surface gets rougher, if it has one.
    #[inline]
    pub(crate) fn roughness_partner(
        &self,
        at: At<'_>,
        wo: Vec3,
        wi: Vec3,
        n: Vec3,
    ) -> Option<RoughnessPartner> {
        RoughnessPartner::new(&self.facet(at, wo, wi, n)?.0)
    }

    /// The [`DirectionPartner`] of `wi` in its lobe, if it has one.
    #[inline]
    pub(crate) fn direction_partner(
        &self,
        at: At<'_>,
        wo: Vec3,
        wi: Vec3,
        n: Vec3,
    ) -> Option<DirectionPartner> {
        let (facet, by_eta) = self.facet(at, wo, wi, n)?;
        DirectionPartner::new(&facet, n, by_eta)
    }

    /// The microfacets that scatter so, and the rate of their index of refraction by that of the material.
    #[inline]
    fn facet(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Option<(Facet, f64)> {
        each!(self, b => b.facet(at, wo, wi, n))
    }

    /// A sketch of the light that leaves to `wo`, by where it comes from.
    pub(crate) fn lobes(&self, at: At<'_>, wo: Vec3, n: Vec3) -> Lobes {
        each!(self, b => b.lobes(at, wo, n))
    }

    /// About how far the half vector of its sharpest lobe is from the normal, in slopes; at most 1.
    pub(crate) fn lobe_width(&self, at: At<'_>) -> f64 {
        f64::min(each!(self, b => b.lobe_width(at)), 1.0)
    }
}
