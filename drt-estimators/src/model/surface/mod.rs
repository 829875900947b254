//! How surfaces scatter light: values, sampling, densities and derivatives.
//!
//! Conventions: `wo` points towards the camera side, `wi` towards the light side, both away from the
//! surface; `n` is the shading normal; all three have length one. The geometric normal plays no
//! part: telling which side of the true surface a direction is on is the caller's. Values *include*
//! the cosine at the light, `fs(wo, wi) |n·wi|`, and transport radiance: a refraction carries the
//! squared ratio of the indices on the sides of `wo` and `wi`. What smooth surfaces scatter into
//! single directions is not in the value and has no density; [`Bsdf::sample_specular`] draws it.
//! [`Bsdf::Null`] scatters nothing, and light crosses it unchanged.
//!
//! The models, their parameters and their defaults are those of the Mitsuba plugins `diffuse`,
//! `phong`, `plastic`, `roughplastic`, `pplastic`, `conductor`, `roughconductor`, `dielectric`, `thindielectric`,
//! `roughdielectric`, `principled`, `principledthin`, `measured`, `blendbsdf`, `mask`, `normalmap`, `bumpmap`, `twosided`
//! and `null`, and of those of Mitsuba 0.6 `coating`, `roughcoating`, `roughdiffuse` and `ward`.
//!
//! ```
//! use drt_estimators::surface::{Bsdf, Given, RoughConductor};
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
//! let rate: Rgb = g.wi.dot(velocity) + g.params.alpha * -0.01;
//! assert!(rate.is_finite());
//! # Ok::<(), drt_estimators::surface::SurfaceError>(())
//! ```

mod angles;
mod anisotropic;
mod blend;
mod change;
mod coated;
mod coating;
mod composed;
mod conductor;
mod dielectric;
mod diffuse;
mod direction_partner;
mod facet;
mod flags;
mod framed;
mod fresnel;
mod lobes;
mod local;
mod mask;
mod measured;
mod microfacet;
mod perturbed;
mod phong;
mod plastic;
mod principled;
mod principled_thin;
mod property;
mod rough_diffuse;
mod roughness_partner;
mod shading_frame;
mod smooth;
mod specular;
#[cfg(test)]
pub(crate) mod tests;
mod textured;
mod visible_slope;
mod ward;

use alloc::boxed::Box;
use alloc::sync::Arc;

use drt_geom::Mesh;
use drt_math::{Rgb, RgbVec, Vec3, fm};

use crate::model::surface::angles::Angles;
pub use crate::model::surface::anisotropic::Anisotropic;
pub use crate::model::surface::blend::Blend;
pub use crate::model::surface::change::{BsdfChange, BsdfParams, BsdfTangent};
pub use crate::model::surface::coated::Coated;
pub use crate::model::surface::coating::Coating;
use crate::model::surface::composed::Composed;
pub use crate::model::surface::conductor::RoughConductor;
pub use crate::model::surface::dielectric::RoughDielectric;
pub use crate::model::surface::diffuse::Diffuse;
pub(crate) use crate::model::surface::direction_partner::{DirectionPartner, Turn};
use crate::model::surface::facet::Facet;
pub(crate) use crate::model::surface::framed::by_corners;
pub(crate) use crate::model::surface::local::LocalBsdf;
pub use crate::model::surface::mask::Mask;
pub use crate::model::surface::measured::{Measured, MeasuredError, MeasuredTables, Tensor};
pub use crate::model::surface::microfacet::Distribution;
pub use crate::model::surface::perturbed::{Perturbation, Perturbed};
pub use crate::model::surface::phong::Phong;
pub use crate::model::surface::plastic::Plastic;
pub use crate::model::surface::principled::Principled;
pub use crate::model::surface::principled_thin::PrincipledThin;
pub use crate::model::surface::property::{Property, SurfaceError};
pub use crate::model::surface::rough_diffuse::RoughDiffuse;
pub(crate) use crate::model::surface::roughness_partner::RoughnessPartner;
pub use crate::model::surface::smooth::{Conductor, Dielectric, ThinDielectric};
pub(crate) use crate::model::surface::specular::SpecularValue;
pub use crate::model::surface::textured::Textured;
pub use crate::model::surface::ward::{Ward, WardVariant};
use crate::model::texture::TexturePoint;

/// A bidirectional scattering distribution function.
///
/// Fields are plain data: [`Bsdf::validate`] says whether they make sense, and everything else
/// relies on it.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Bsdf {
    /// No surface at all: the border of a medium.
    Null,
    /// A Lambertian reflector.
    Diffuse(Diffuse),
    /// A modified Phong reflector.
    Phong(Phong),
    /// A rough metal.
    RoughConductor(RoughConductor),
    /// A rough interface of two transparent media.
    RoughDielectric(RoughDielectric),
    /// A diffuse base under a coating, smooth or rough.
    Plastic(Plastic),
    /// A smooth metal.
    Conductor(Conductor),
    /// A smooth interface of two transparent media.
    Dielectric(Dielectric),
    /// A thin pane.
    ThinDielectric(ThinDielectric),
    /// A reflector on both sides.
    TwoSided(Box<TwoSided>),
    /// Any but these two with textures.
    Textured(Box<Textured>),
    /// One that is there in part only.
    Mask(Box<Mask>),
    /// Something between two others.
    Blend(Box<Blend>),
    /// One under a clear or tinted layer.
    Coated(Box<Coated>),
    /// One whose normals are not those of the surface.
    Perturbed(Box<Perturbed>),
    /// A rough metal or interface whose lobes are longer than wide.
    Anisotropic(Box<Anisotropic>),
    /// Burley's model of many materials.
    Principled(Box<Principled>),
    /// The same for thin sheets.
    PrincipledThin(Box<PrincipledThin>),
    /// One that was measured.
    Measured(Arc<Measured>),
    /// A diffuse reflector of rough grooves.
    RoughDiffuse(RoughDiffuse),
    /// Ward's reflector.
    Ward(Ward),
}

/// One-sided reflectors used on both sides of a surface: from behind, the normal is turned over.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TwoSided {
    /// The side the normal points to.
    pub front: Bsdf,
    /// The other side; `None` for the same again.
    pub back: Option<Bsdf>,
}

/// Which of the two directions a sample starts from.
///
/// For every model here the same density serves both walks, as all of them treat the two
/// directions alike up to the factors a weight contains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Given {
    /// `wo` is known and `wi` drawn: a walk from the camera.
    Wo,
    /// `wi` is known and `wo` drawn: a walk from a light.
    Wi,
}

/// A direction drawn at random.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionSample {
    /// The direction, away from the surface, of length one.
    pub w: Vec3,
    /// Its density per steradian; positive and finite.
    pub pdf: f64,
}

/// A direction that a smooth surface scatters to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpecularSample {
    /// The direction, away from the surface, of length one.
    pub w: Vec3,
    /// What is scattered there, over the probability of choosing it.
    pub weight: Rgb,
    /// It goes on straight, as if there were no surface.
    pub straight: bool,
}

/// A value `fs(wo, wi) |n·wi|` with its derivatives.
///
/// Derivatives with respect to the three vectors are those of one smooth extension of the value to
/// vectors of any length. Only their contraction with velocities that keep the length, orthogonal
/// to the respective vector, has a meaning of its own.
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

/// Applies an expression to the model of a one-sided BSDF, another to anything else.
macro_rules! match_model {
    ($bsdf:expr, $model:ident => $body:expr, _ => $nothing:expr) => {
        match $bsdf {
            Bsdf::Diffuse($model) => $body,
            Bsdf::Phong($model) => $body,
            Bsdf::RoughConductor($model) => $body,
            Bsdf::RoughDielectric($model) => $body,
            Bsdf::Plastic($model) => $body,
            _ => $nothing,
        }
    };
}

impl Bsdf {
    /// The value `fs(wo, wi) |n·wi|` per channel; zero where the model is black. Like all that does
    /// not say where on a shape it is, this takes textures by their means.
    #[inline]
    #[must_use]
    pub fn eval(&self, wo: Vec3, wi: Vec3, n: Vec3) -> Rgb {
        self.eval_at(None, wo, wi, n)
    }

    #[inline]
    pub(crate) fn eval_at(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Rgb {
        match_model!(
            self,
            b => b.value(&Angles::new(wo, wi, n)),
            _ => self.eval_of_any(at, wo, wi, n)
        )
    }

    /// Of BSDFs that are no plain models.
    #[inline(never)]
    fn eval_of_any(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Rgb {
        if let Some((bsdf, n)) = self.side(wo, n) {
            return bsdf.eval_at(at, wo, wi, n);
        }
        self.composed(|b| b.eval(at, wo, wi, n)).unwrap_or(Rgb::ZERO)
    }

    /// The value and all its derivatives.
    #[inline]
    #[must_use]
    pub fn gradient(&self, wo: Vec3, wi: Vec3, n: Vec3) -> BsdfGradient {
        self.gradient_at(None, wo, wi, n)
    }

    #[inline(always)]
    pub(crate) fn gradient_at(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> BsdfGradient {
        let (bsdf, facing) = self.facing(wo, n);
        let mut gradient = match_model!(
            bsdf,
            b => b.slopes(&Angles::new(wo, wi, facing)).pull_back(wo, wi, facing),
            _ => bsdf.composed(|b| b.gradient(at, wo, wi, facing)).unwrap_or_default()
        );
        if facing != n {
            gradient.n = -gradient.n;
        }
        gradient
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
        let (w, pdf) = match_model!(
            self,
            b => {
                let w = b.sample(from, n, u)?;
                (w, b.pdf(&Angles::new(from, w, n)))
            },
            _ => self.sample_of_any(at, from, n, u, given)?
        );
        (pdf > 0.0 && pdf.is_finite()).then_some(DirectionSample { w, pdf })
    }

    /// Of BSDFs that are no plain models, with the density.
    #[inline(never)]
    fn sample_of_any(
        &self,
        at: At<'_>,
        from: Vec3,
        n: Vec3,
        u: [f64; 3],
        given: Given,
    ) -> Option<(Vec3, f64)> {
        if let Some((bsdf, n)) = self.side(from, n) {
            return bsdf.sample_at(at, from, n, u, given).map(|s| (s.w, s.pdf));
        }
        let w = self.composed(|b| b.sample(at, from, n, u, given)).flatten()?;
        Some((w, self.pdf_of_any(at, from, w, n, given)))
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
        match self {
            Self::Null
            | Self::Diffuse(_)
            | Self::Phong(_)
            | Self::RoughConductor(_)
            | Self::RoughDielectric(_) => None,
            _ => self.specular_of_any(at, from, n, choice, given),
        }
    }

    /// Of BSDFs that may have smooth parts.
    fn specular_of_any(
        &self,
        at: At<'_>,
        from: Vec3,
        n: Vec3,
        choice: f64,
        given: Given,
    ) -> Option<SpecularSample> {
        let (bsdf, n) = self.facing(from, n);
        match bsdf {
            Self::Plastic(b) => b.sample_specular(from, n, choice),
            Self::Conductor(b) => b.sample(from, n),
            Self::Dielectric(b) => b.sample(from, n, choice, given),
            Self::ThinDielectric(b) => b.sample(from, n, choice),
            _ => bsdf.composed(|b| b.sample_specular(at, from, n, choice, given)).flatten(),
        }
    }

    /// The part of the light that goes straight through at a point, as if there was no surface, at a cosine to its normal.
    pub(crate) fn straight(&self, at: At<'_>, cos: f64) -> Rgb {
        match self {
            Self::Mask(b) => Rgb::splat(1.0 - b.opaque()),
            Self::ThinDielectric(b) => b.straight(cos),
            Self::Textured(b) if b.bsdf.passes_straight() => b.at(at).straight(None, cos),
            _ => Rgb::ZERO,
        }
    }

    /// The BSDFs that this one is made of.
    fn inner(&self) -> impl Iterator<Item = &Self> {
        let [a, b] = match self {
            Self::TwoSided(b) => [Some(&b.front), b.back.as_ref()],
            Self::Textured(b) => [Some(&b.bsdf), None],
            Self::Mask(b) => [Some(&b.bsdf), None],
            Self::Blend(b) => b.bsdfs.each_ref().map(Some),
            Self::Perturbed(b) => [Some(&b.bsdf), None],
            Self::Coated(b) => [Some(&b.bsdf), None],
            _ => [None; 2],
        };
        a.into_iter().chain(b)
    }

    /// The gradient of a value by the place of its point, as far as textures change there; `params` are the value's
    /// derivatives by properties, times a `factor`, as the gradient is to be.
    #[cold]
    pub(crate) fn slide(
        &self,
        at: At<'_>,
        [wo, wi, n]: [Vec3; 3],
        params: &BsdfParams,
        factor: f64,
    ) -> RgbVec {
        let (bsdf, n) = self.facing(wo, n);
        match (bsdf, at) {
            (Self::Textured(b), Some(at)) => {
                b.slide(at, params) + b.at(Some(at)).slide(Some(at), [wo, wi, n], params, factor)
            }
            (Self::Blend(b), Some(_)) => b.slide(at, [wo, wi, n], factor),
            (Self::Coated(b), Some(_)) => b.slide(at, [wo, wi, n], factor),
            _ => RgbVec::ZERO,
        }
    }

    /// Density per steradian with which [`Bsdf::sample`] draws `to`.
    #[inline]
    #[must_use]
    pub fn pdf(&self, from: Vec3, to: Vec3, n: Vec3, given: Given) -> f64 {
        self.pdf_at(None, from, to, n, given)
    }

    #[inline]
    pub(crate) fn pdf_at(&self, at: At<'_>, from: Vec3, to: Vec3, n: Vec3, given: Given) -> f64 {
        match_model!(
            self,
            b => b.pdf(&Angles::new(from, to, n)),
            _ => self.pdf_of_any(at, from, to, n, given)
        )
    }

    /// Of BSDFs that are no plain models.
    #[inline(never)]
    fn pdf_of_any(&self, at: At<'_>, from: Vec3, to: Vec3, n: Vec3, given: Given) -> f64 {
        if let Some((bsdf, n)) = self.side(from, n) {
            return bsdf.pdf_at(at, from, to, n, given);
        }
        self.composed(|b| b.pdf(at, from, to, n, given)).unwrap_or(0.0)
    }

    /// What `f` says of a BSDF that is no plain model; `None` of one that is.
    #[cold]
    fn composed<R>(&self, f: impl FnOnce(&dyn Composed) -> R) -> Option<R> {
        Some(f(match self {
            Self::Textured(b) => &**b,
            Self::Mask(b) => &**b,
            Self::Blend(b) => &**b,
            Self::Perturbed(b) => &**b,
            Self::Coated(b) => &**b,
            Self::Anisotropic(b) => &**b,
            Self::Principled(b) => &**b,
            Self::PrincipledThin(b) => &**b,
            Self::Measured(b) => &**b,
            Self::RoughDiffuse(b) => b,
            Self::Ward(b) => b,
            _ => return None,
        }))
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
    fn facet(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Option<(Facet, f64)> {
        let (bsdf, n) = self.facing(wo, n);
        match bsdf {
            Self::RoughConductor(b) => Some((b.facet([wo, wi, n]), 0.0)),
            Self::RoughDielectric(b) => b.facet([wo, wi, n]),
            Self::Textured(b) => b.at(at).facet(None, wo, wi, n),
            _ => None,
        }
    }

    /// About how far the half vector of its sharpest lobe is from the normal, in slopes; at most 1.
    pub(crate) fn lobe_width(&self, at: At<'_>) -> f64 {
        let width = match self {
            Self::Null | Self::Diffuse(_) => 1.0,
            Self::Phong(b) => 1.0 / fm::sqrt(1.0 + 0.5 * b.exponent),
            Self::RoughConductor(b) => b.alpha,
            Self::RoughDielectric(b) => b.alpha,
            Self::Plastic(b) => b.coating.facets().map_or(0.0, |(_, alpha)| alpha),
            Self::Conductor(_) | Self::Dielectric(_) | Self::ThinDielectric(_) => 0.0,
            _ => self.width_of_any(at),
        };
        f64::min(width, 1.0)
    }

    /// Of BSDFs that are no plain models.
    #[cold]
    fn width_of_any(&self, at: At<'_>) -> f64 {
        match self {
            Self::TwoSided(b) => {
                let back = b.back.as_ref().map_or(1.0, |b| b.lobe_width(at));
                f64::min(b.front.lobe_width(at), back)
            }
            _ => self.composed(|b| b.lobe_width(at)).unwrap_or(1.0),
        }
    }

    /// The name of the plugin this BSDF follows.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Null => "null",
            Self::Diffuse(_) => "diffuse",
            Self::Phong(_) => "phong",
            Self::RoughConductor(_) => "roughconductor",
            Self::RoughDielectric(_) => "roughdielectric",
            Self::Plastic(b) if b.is_smooth() => "plastic",
            Self::Plastic(_) => "roughplastic",
            Self::Conductor(_) => "conductor",
            Self::Dielectric(_) => "dielectric",
            Self::ThinDielectric(_) => "thindielectric",
            Self::TwoSided(_) => "twosided",
            Self::Textured(b) => b.bsdf.name(),
            Self::Mask(_) => "mask",
            Self::Blend(_) => "blendbsdf",
            Self::Perturbed(b) => b.name(),
            Self::Coated(b) => b.name(),
            Self::Anisotropic(b) => b.base.name(),
            Self::Principled(_) => "principled",
            Self::PrincipledThin(_) => "principledthin",
            Self::Measured(_) => "measured",
            Self::RoughDiffuse(_) => "roughdiffuse",
            Self::Ward(_) => "ward",
        }
    }

    /// Checks every number.
    ///
    /// # Errors
    /// The first property out of its range, or a two-sided BSDF around anything but a reflector.
    pub fn validate(&self) -> Result<(), SurfaceError> {
        if let Self::TwoSided(b) = self {
            return [Some(&b.front), b.back.as_ref()].into_iter().flatten().try_for_each(|side| {
                let straight = side.passes_straight();
                if side.is_transmissive()
                    || straight
                    || matches!(side, Self::Null | Self::TwoSided(_))
                {
                    Err(SurfaceError::NotReflective { bsdf: side.name() })
                } else {
                    side.validate()
                }
            });
        }
        match self {
            Self::Conductor(b) => b.validate(),
            Self::Dielectric(b) => b.validate(),
            Self::ThinDielectric(b) => b.validate(),
            Self::Textured(b) => b.validate(),
            Self::Mask(b) => b.validate(),
            Self::Blend(b) => b.validate(),
            Self::Perturbed(b) => b.validate(),
            Self::Coated(b) => b.validate(),
            Self::Anisotropic(b) => b.validate(),
            Self::Principled(b) => b.validate(),
            Self::PrincipledThin(b) => b.validate(),
            Self::RoughDiffuse(b) => b.validate(),
            Self::Ward(b) => b.validate(),
            _ => match_model!(self, b => b.validate(), _ => Ok(())),
        }
    }

    /// Checks what textures have from the mesh of a shape.
    pub(crate) fn validate_on(&self, mesh: &Mesh) -> Result<(), SurfaceError> {
        match self {
            Self::Textured(b) if b.textures.iter().any(|t| t.1.attribute().is_some()) => {
                b.validate_on(mesh)?;
            }
            Self::Perturbed(b) if b.map.bounds_on(mesh).is_none() => {
                let name = b.map.attribute().unwrap_or_default().into();
                return Err(SurfaceError::NoAttribute { name });
            }
            _ => {}
        }
        self.inner().try_for_each(|b| b.validate_on(mesh))
    }

    /// The one-sided BSDF that a direction meets, and the normal it goes with.
    #[inline]
    fn facing(&self, from: Vec3, n: Vec3) -> (&Self, Vec3) {
        self.side(from, n).unwrap_or((self, n))
    }

    /// The same of a two-sided one; `None` of others.
    #[inline]
    fn side(&self, from: Vec3, n: Vec3) -> Option<(&Self, Vec3)> {
        let Self::TwoSided(b) = self else { return None };
        let front = n.dot(from) >= 0.0;
        Some(if front { (&b.front, n) } else { (b.back.as_ref().unwrap_or(&b.front), -n) })
    }
}
