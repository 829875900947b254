//! A BSDF at a point of a surface.
//!
//! With interpolated normals the shading normal decides sides, as in Mitsuba. The contribution then
//! jumps where the camera's direction crosses the shading horizon while the surface is still in view,
//! and where the light's direction sinks under the facet while the shading normal still sees it:
//! jumps that no boundary term knows. So the value fades to zero over the last [`FADE`] of both
//! cosines, and the measurement contribution has no jumps besides visibility, which its derivative
//! relies on.
//!
//! # Smooth surfaces
//!
//! Light that mirrors and glass scatter does not fade: it meets so many horizons inside of glass that it would lose one percent of itself.
//! What happens at a horizon is continuous by other means. Let a surface be seen from one side of the facet and the other side of the
//! shading normal. Where the shading normal is across the ray, all light is reflected, in the ray's own direction. So it is wherever the shading
//! normal points farther away: the ray goes straight on through the facet, with the weight that reflection has at the horizon.
//!
//! A single direction may also lead to the other side of the facet than it does by the shading normal. If the facet decided, a ray that
//! leaves a glass ball at a grazing angle would be trapped under its facets, and creep from one to the next. The shading normal decides,
//! and the ray passes the body's next facet as if that was not there
//! ([`World::cast_bent`](crate::world::World::cast_bent)). On a ball, where a grazing ray is reflected or refracted outwards, this makes
//! light continuous at both horizons. A ray that is reflected on the inside, at an angle smaller than that of the facets, leaves the body instead.

use drt_geom::edges::Lobes;
use drt_math::{Dual, Real, Rgb, RgbVec, Vec3};

use crate::model::surface::framed::by_corners;
use crate::model::surface::horizon::fade;
use crate::model::surface::{
    Bend, Bsdf, BsdfGradient, BsdfParams, DirectionPartner, DirectionSample, Given,
    RoughnessPartner, SpecularSample, SpecularValue,
};
use crate::model::texture::TexturePoint;

/// The cosine of a direction behind the shading horizon with the nearest normal that it is in front of.
const HORIZON: f64 = 1e-12;

/// A BSDF with the unit normals of a point. Directions are unit, away from the surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalBsdf<'a> {
    bsdf: &'a Bsdf,
    at: Option<TexturePoint<'a>>,
    /// Geometric normal.
    ng: Vec3,
    /// Shading normal.
    ns: Vec3,
    /// The shading normal is interpolated, and the value fades at both horizons.
    interpolated: bool,
}

impl Bsdf {
    /// The BSDF at a point with the geometric normal `ng` and the shading normal `ns`.
    #[inline]
    pub(crate) fn at<'a>(
        &'a self,
        at: Option<TexturePoint<'a>>,
        ng: Vec3,
        ns: Vec3,
        interpolated: bool,
    ) -> LocalBsdf<'a> {
        LocalBsdf { bsdf: self, at, ng, ns, interpolated }
    }
}

/// A geometric and a shading normal agree on the side that a direction points to. Normals of which one is the other way round do not count as
/// disagreeing: there the mesh's corners are listed against its normals.
pub(crate) fn agree(ng: Vec3, ns: Vec3, w: Vec3) -> bool {
    ng.dot(w) * ns.dot(w) >= 0.0 || ng.dot(ns) <= 0.0
}

impl LocalBsdf<'_> {
    /// The value times the cosine of `wi` with the shading normal.
    #[inline]
    pub(crate) fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb {
        let value = self.bsdf.eval_at(self.at.as_ref(), wo, wi, self.ns);
        if self.interpolated { value * self.faded(wo, wi) } else { value }
    }

    /// The value with its derivatives, and that by the geometric normal. Of a single direction only the derivatives by the
    /// material, of the weight that [`Self::sample_specular`] gives it.
    #[inline(always)]
    pub(crate) fn gradient(&self, wo: Vec3, wi: Vec3) -> (BsdfGradient, RgbVec) {
        if let Some(SpecularValue { params, .. }) = self.specular(wo, wi) {
            return (BsdfGradient { params, ..BsdfGradient::default() }, RgbVec::ZERO);
        }
        let mut d = self.bsdf.gradient_at(self.at.as_ref(), wo, wi, self.ns);
        let mut by_ng = RgbVec::ZERO;
        if self.interpolated {
            let by_cosine = |cosine| {
                let factor = fade(Dual::<f64, 1>::variable(cosine, 0));
                (factor.re, factor.eps[0])
            };
            let ((a, da), (b, db)) = (by_cosine(self.ns.dot(wo)), by_cosine(self.ng.dot(wi)));
            let (factor, by_wo, by_wi) = (a * b, d.value * (da * b), d.value * (a * db));
            d.wo = d.wo * factor + by_wo.outer(self.ns);
            d.n = d.n * factor + by_wo.outer(wo);
            d.wi = d.wi * factor + by_wi.outer(self.ng);
            by_ng = by_wi.outer(wi);
            d.params = d.params.scaled(Rgb::splat(factor));
            d.value *= factor;
        }
        (d, by_ng)
    }

    /// The normal of the facet and that of the shading agree on the side of a direction.
    fn agrees(&self, w: Vec3) -> bool {
        !self.interpolated || agree(self.ng, self.ns, w)
    }

    /// The normal that light from a direction is reflected and refracted by: if the shading normal points to the other side than the facet's,
    /// the nearest one that does not.
    fn specular_normal(&self, from: Vec3) -> Vec3 {
        if self.agrees(from) {
            return self.ns;
        }
        let side = f64::copysign(HORIZON, self.ng.dot(from));
        self.ns.reject(from).normalize() + from * side
    }

    /// The weight that [`Self::sample_specular`] gives a single direction; `None` of others.
    pub(crate) fn specular(&self, wo: Vec3, wi: Vec3) -> Option<SpecularValue> {
        let normal = self.specular_normal(wo);
        let found = self.bsdf.specular(self.at.as_ref(), wo, wi, normal)?.of_weight()?;
        if self.agrees(wo) {
            return Some(found);
        }
        Some(SpecularValue { by_cosine: Rgb::ZERO, bend: Bend::Straight, ..found })
    }

    /// The probability with which [`Self::sample_specular`] draws any direction.
    pub(crate) fn single_chance(&self, from: Vec3) -> f64 {
        self.bsdf.single_chance(self.at.as_ref(), from, self.specular_normal(from))
    }

    /// Light is scattered into single directions, and other light into all directions of a solid angle.
    pub(crate) fn is_partly_smooth(&self) -> bool {
        self.bsdf.is_partly_smooth()
    }

    /// The shading normal.
    pub(crate) fn normal(&self) -> Vec3 {
        self.ns
    }

    /// The gradient of the value by the place of the point, as far as textures change there; `params` holds its
    /// derivatives by properties.
    pub(crate) fn slide(&self, wo: Vec3, wi: Vec3, params: &BsdfParams) -> RgbVec {
        if !self.bsdf.varies() {
            return RgbVec::ZERO;
        }
        self.bsdf.slide(self.at.as_ref(), [wo, wi, self.ns], params, self.faded(wo, wi))
    }

    /// The gradient of the value by the corners of its triangle, as far as these turn and stretch its texture coordinates. It is given
    /// the gradients by `wo`, by `wi` and by the geometric normal.
    #[cold]
    pub(crate) fn corners(
        &self,
        wo: Vec3,
        wi: Vec3,
        [by_wo, by_wi, by_ng]: [RgbVec; 3],
    ) -> [RgbVec; 3] {
        let Some(at) = &self.at else { return [RgbVec::ZERO; 3] };
        let turned = by_corners(at, self.ns, &[(wo, by_wo), (wi, by_wi), (self.ng, by_ng)]);
        let stretched = self.bsdf.stretch(Some(at), [wo, wi, self.ns], self.faded(wo, wi));
        [0, 1, 2].map(|k| turned[k] + stretched[k])
    }

    /// The factor of the value at interpolated normals.
    fn faded(&self, wo: Vec3, wi: Vec3) -> f64 {
        if self.interpolated { fade(self.ns.dot(wo)) * fade(self.ng.dot(wi)) } else { 1.0 }
    }

    /// Draws the direction that is not given; see [`Bsdf::sample`].
    #[inline]
    pub(crate) fn sample(&self, from: Vec3, u: [f64; 3], given: Given) -> Option<DirectionSample> {
        self.bsdf.sample_at(self.at.as_ref(), from, self.ns, u, given)
    }

    /// Draws one of the single directions of a smooth surface; see [`Bsdf::sample_specular`].
    #[inline]
    pub(crate) fn sample_specular(
        &self,
        from: Vec3,
        choice: f64,
        given: Given,
    ) -> Option<SpecularSample> {
        let normal = self.specular_normal(from);
        self.bsdf.sample_specular_at(self.at.as_ref(), from, normal, choice, given)
    }

    /// Density per steradian with which [`Self::sample`] draws `to`.
    #[inline]
    pub(crate) fn pdf(&self, from: Vec3, to: Vec3, given: Given) -> f64 {
        self.bsdf.pdf_at(self.at.as_ref(), from, to, self.ns, given)
    }

    /// What an importance path multiplies the value by, per solid angle of `wo`: it arrives by
    /// the area measure seen from `wi` and leaves by that seen from `wo` (geometric normals).
    #[inline]
    pub(crate) fn adjoint_correction(&self, wo: Vec3, wi: Vec3) -> f64 {
        let arriving = self.ng.dot(wi).abs();
        if arriving > 0.0 { Real::abs(self.ng.dot(wo)) / arriving } else { 0.0 }
    }

    /// A sketch of [`Self::eval`] by `wi`.
    pub(crate) fn lobes(&self, wo: Vec3) -> Lobes {
        self.bsdf.lobes(self.at.as_ref(), wo, self.ns)
    }

    /// About how wide the narrowest lobe is, in radians; at most 1.
    pub(crate) fn lobe_width(&self) -> f64 {
        self.bsdf.lobe_width(self.at.as_ref())
    }

    /// The [`RoughnessPartner`] of `wi`, if it has one.
    pub(crate) fn roughness_partner(&self, wo: Vec3, wi: Vec3) -> Option<RoughnessPartner> {
        self.bsdf.roughness_partner(self.at.as_ref(), wo, wi, self.ns)
    }

    /// The [`DirectionPartner`] of `wi`, if it has one.
    pub(crate) fn direction_partner(&self, wo: Vec3, wi: Vec3) -> Option<DirectionPartner> {
        self.bsdf.direction_partner(self.at.as_ref(), wo, wi, self.ns)
    }
}
