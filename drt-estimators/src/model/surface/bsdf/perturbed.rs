//! Normals by a map.
//!
//! # Derivatives
//!
//! Let n be the normal of the surface, s and t the axes along it of its frame, and m = s c₁ + t c₂ + n c₃ the normal of the map, of unit length. The
//! value is f(wo, wi, m) S(n·wi), with the BSDF f and the shadowing S. By `wo` and `wi` it has the derivatives of both factors. By n it
//! has those of S, and (∂m/∂n)ᵀ ∂f/∂m, where s and t follow n as the frame says: this comes by dual numbers over n. The frame of f
//! follows a direction across m, which depends on n as well; the derivative of f by that direction is [`by_tangent`].
//!
//! What the corners of the triangle change besides n is the direction in which u grows, with which s turns about n. As everything that a value depends
//! on may turn about n together, that derivative follows from the others, as that of any BSDF with a frame does. Heights are also slopes: let a be the length of
//! ∂x/∂u, and b and c the coordinates of ∂x/∂v along s and t. The normal has the direction of (-h_u c, h_u b - h_v a, a c), which
//! changes as the surface is [stretched](Model::stretch). Where a vertex [slides](Model::slide) over the surface, c changes by the gradient of the map.
//! Slopes of heights jump at the borders of texels.
//!
//! # Horizons
//!
//! Seen from behind its back, a normal is mirrored or scatters nothing, and light that only one of both normals sees does not count. Mitsuba's values jump
//! there, where no edge is. So the value goes over from one to the other within the last 0.3° ([`FADE`]) before the horizon of m as seen from `wo`; without shadowing, it
//! fades where light grazes the surface. The shadowing and f itself vanish at both horizons of `wi`.

mod tilt;

use alloc::vec::Vec;

use drt_geom::Mesh;
use drt_geom::edges::Lobes;
use drt_math::{Dual, Frame, Real, Rgb, RgbVec, Vec3, vec3};

use crate::model::surface::bsdf::Composed;
use crate::model::surface::bsdf::perturbed::tilt::{Facet, Tilt};
use crate::model::surface::framed::{by_tangent, of_corners};
use crate::model::surface::model::{COORDINATES, Flags, Model, Numbers, gradient_of, variables};
use crate::model::surface::params::PropertySet;
use crate::model::surface::property::{Property, Slot, SurfaceError};
use crate::model::surface::shading_frame::{by_coordinates, frame_seams, is_front, shading_frame};
use crate::model::surface::textures::Textures;
use crate::model::surface::{
    At, Bsdf, BsdfGradient, BsdfParams, Given, SpecularSample, SpecularValue,
};
use crate::model::texture::{SurfaceLine, Texture, TexturePoint};

#[cfg(doc)]
use crate::model::surface::horizon::FADE;

/// A BSDF with other normals than those of its surface: Mitsuba's `normalmap` and `bumpmap`.
///
/// Light counts only if it is on one and the same side of the surface's normal and of the perturbed one. Where textures
/// are replaced by their means, the normals are the surface's.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Perturbed {
    /// The BSDF that is evaluated with these normals.
    pub bsdf: Bsdf,
    /// Normals or heights.
    pub map: Texture,
    /// Whether the map has normals or heights.
    pub perturbation: Perturbation,
    /// A normal that faces away from the viewer is mirrored at the surface's (Schüssler et al. 2017, "Microfacet-based
    /// Normal Mapping for Robust Monte Carlo Path Tracing").
    pub flip_invalid_normals: bool,
    /// Light fades towards the horizon, as by microfacets (Conty Estevez et al. 2019, "A Microfacet-Based Shadowing
    /// Function to Solve the Bump Terminator Problem").
    pub use_shadowing_function: bool,
}

/// The kind of map that gives the normals.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Perturbation {
    /// Its channels are the normal's coordinates along the directions of u, of v, and of the surface's normal, with
    /// [-1, 1] stored as [0, 1].
    Normals,
    /// Its first channel is the height of the surface, to be multiplied by this.
    Heights(f64),
}

/// A normal that scatters, with the derivatives of its BSDF there.
struct Part<T> {
    facet: Facet<T>,
    /// What the BSDF's value is multiplied by.
    factor: T,
    inner: BsdfGradient,
    /// The derivative of that value by the direction that the BSDF's frame follows.
    by_tangent: RgbVec,
}

impl<const N: usize> Part<Dual<f64, N>> {
    /// The derivative of the value by a variable that turns the normals: by its lane.
    fn lane(&self, k: usize) -> Rgb {
        let [normal, tangent] = [self.facet.normal, self.facet.tangent]
            .map(|v| vec3(v.x.eps[k], v.y.eps[k], v.z.eps[k]));
        let turned = self.inner.n.dot(normal) + self.by_tangent.dot(tangent);
        turned * self.factor.re + self.inner.value * self.factor.eps[k]
    }

    /// The derivative by a vector whose lanes begin at one.
    fn by(&self, first: usize) -> RgbVec {
        gradient_of(|k| self.lane(first + k))
    }
}

impl Perturbed {
    /// The surface's frame. Maps tell normals of the front; behind, they are turned over with the surface's.
    fn frame<T: Real>(at: &TexturePoint<'_>, n: Vec3<T>) -> Frame<T> {
        let front = if is_front(at, n.re()) { n } else { -n };
        Frame { n, ..shading_frame(Some(at), front) }
    }

    /// The normal in the surface's frame, of any length.
    fn normal<T: Real>(&self, at: &TexturePoint<'_>, frame: &Frame<T>) -> Vec3<T> {
        match self.perturbation {
            Perturbation::Normals => mapped(self.map.at_point(at)).lift(),
            Perturbation::Heights(_) => {
                let [by_u, by_v] = by_coordinates(at).map(|by| frame.to_local(by.lift()));
                self.slanted(at, [by_u.x, by_u.y], [by_v.x, by_v.y])
            }
        }
    }

    /// The normal of heights on a plane, where the place changes so with u and v.
    fn slanted<T: Real>(&self, at: &TexturePoint<'_>, by_u: [T; 2], by_v: [T; 2]) -> Vec3<T> {
        let Perturbation::Heights(scale) = self.perturbation else { return Vec3::Z.lift() };
        let [h, k] = self.map.slopes(at.uv()).map(|slope| slope.r * scale);
        let area = by_u[0] * by_v[1] - by_u[1] * by_v[0];
        let normal = vec3(by_u[1] * k - by_v[1] * h, by_v[0] * h - by_u[0] * k, area);
        if area.re() < 0.0 { -normal } else { normal }
    }

    fn tilt<T: Real>(&self, at: &TexturePoint<'_>, n: Vec3<T>) -> Tilt<T> {
        let frame = Self::frame(at, n);
        Tilt::new(frame, self.normal(at, &frame))
    }

    /// The normals that scatter light that leaves to `wo`, each with its share of the value.
    fn seen_from<T: Real>(&self, tilt: &Tilt<T>, wo: Vec3<T>) -> [Option<(Facet<T>, T)>; 2] {
        tilt.seen_from(wo, self.flip_invalid_normals)
    }

    /// The factor of light from `wi`.
    fn passing<T: Real>(&self, facet: &Facet<T>, wi: Vec3<T>) -> T {
        if self.use_shadowing_function { facet.shadowed(wi) } else { facet.fading(wi) }
    }

    /// The normal that scatters light into single directions.
    fn single(&self, at: &TexturePoint<'_>, n: Vec3, w: Vec3) -> Facet<f64> {
        let tilt = self.tilt(at, n);
        if self.flip_invalid_normals && tilt.is_invalid_from(w) {
            tilt.mirrored()
        } else {
            tilt.plain()
        }
    }

    /// The normals with the chances by which they are taken to sample from a direction.
    fn choices(
        &self,
        tilt: &Tilt<f64>,
        from: Vec3,
        given: Given,
    ) -> [Option<(Facet<f64>, f64)>; 2] {
        match (given, self.flip_invalid_normals) {
            (Given::Wo, true) => self.seen_from(tilt, from),
            (Given::Wi, true) => [Some((tilt.plain(), 0.5)), Some((tilt.mirrored(), 0.5))],
            (_, false) => [Some((tilt.plain(), 1.0)), None],
        }
    }

    /// The normals that scatter from `wo` to `wi`, with the derivatives of the BSDF at these.
    fn scattered<T: Real>(
        &self,
        at: &TexturePoint<'_>,
        tilt: &Tilt<T>,
        [wo, wi]: [Vec3<T>; 2],
    ) -> impl Iterator<Item = Part<T>> {
        let parts = self.seen_from(tilt, wo).into_iter().flatten();
        parts.filter(move |(facet, _)| facet.sees(wi.re())).map(move |(facet, share)| {
            let (o, i, m, along) = (wo.re(), wi.re(), facet.normal.re(), facet.tangent.re());
            let inner = facet.with(at, |at| self.bsdf.gradient_at(Some(at), o, i, m));
            let by_tangent = by_tangent(m, along, &[(o, inner.wo), (i, inner.wi)]);
            Part { factor: share * self.passing(&facet, wi), facet, inner, by_tangent }
        })
    }
}

#[cfg(test)]
impl Perturbed {
    /// The unit normal of the map.
    pub(in crate::model::surface) fn plain_normal(&self, at: &TexturePoint<'_>, n: Vec3) -> Vec3 {
        self.tilt(at, n).plain().normal
    }
}

/// The normal that a map has.
fn mapped(Rgb { r, g, b }: Rgb) -> Vec3 {
    vec3(r, g, b) * 2.0 - Vec3::splat(1.0)
}

impl Composed for Perturbed {
    fn parts(&self) -> [Option<&Bsdf>; 2] {
        [Some(&self.bsdf), None]
    }
}

impl Model for Perturbed {
    fn name(&self) -> &'static str {
        match self.perturbation {
            Perturbation::Normals => "normalmap",
            Perturbation::Heights(_) => "bumpmap",
        }
    }

    #[inline(never)]
    fn flags(&self) -> Flags {
        let inner = self.bsdf.flags();
        // What is reflected by a bent mirror moves as no chain of smooth surfaces here tells.
        let differentiable = inner.differentiable && !inner.smooth && !is_perturbed(&self.bsdf);
        Flags { oriented: true, differentiable, ..inner }
    }

    fn differentiated(&self) -> PropertySet {
        self.bsdf.differentiated()
    }

    fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        self.bsdf.property(property)
    }

    fn validate(&self) -> Result<(), SurfaceError> {
        if self.bsdf.is_null() || self.bsdf.passes_straight() {
            return Err(SurfaceError::CannotHold { outer: self.name(), bsdf: self.bsdf.name() });
        }
        if let Perturbation::Heights(scale) = self.perturbation
            && !scale.is_finite()
        {
            return Err(SurfaceError::BadScale(scale));
        }
        self.bsdf.validate()
    }

    #[inline(never)]
    fn value<T: Real>(
        &self,
        numbers: impl Numbers<T>,
        at: At<'_>,
        [wo, wi, n]: [Vec3<T>; 3],
    ) -> Rgb<T> {
        let Some(at) = at else { return self.bsdf.value(numbers, None, [wo, wi, n]) };
        let mut sum = Rgb::splat(T::zero());
        for (facet, share) in self.seen_from(&self.tilt(at, n), wo).into_iter().flatten() {
            if facet.sees(wi.re()) {
                let directions = [wo, wi, facet.normal];
                let value = facet.with(at, |at| self.bsdf.value(numbers, Some(at), directions));
                sum += value * (share * self.passing(&facet, wi));
            }
        }
        sum
    }

    #[inline(never)]
    fn gradient(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> BsdfGradient {
        let Some(at) = at else { return self.bsdf.gradient_at(None, wo, wi, n) };
        let [to, from, normal] = variables::<COORDINATES, 3>([wo, wi, n]);
        let mut sum = BsdfGradient::default();
        for part in self.scattered(at, &self.tilt(at, normal), [to, from]) {
            let scaled = part.inner.scaled(part.factor.re);
            sum.value += scaled.value;
            sum.wo += scaled.wo + part.by(0);
            sum.wi += scaled.wi + part.by(3);
            sum.n += part.by(6);
            sum.params.add_all(&scaled.params);
        }
        sum
    }

    #[inline(never)]
    fn sample(&self, at: At<'_>, from: Vec3, n: Vec3, u: [f64; 3], given: Given) -> Option<Vec3> {
        let Some(at) = at else { return self.bsdf.direction(None, from, n, u, given) };
        let mut choice = u[2];
        for (facet, chance) in self.choices(&self.tilt(at, n), from, given).into_iter().flatten() {
            if choice >= chance {
                choice -= chance;
                continue;
            }
            let u = [u[0], u[1], (choice / chance).max(f64::MIN_POSITIVE)];
            let w =
                facet.with(at, |at| self.bsdf.direction(Some(at), from, facet.normal, u, given))?;
            return facet.sees(w).then_some(w);
        }
        None
    }

    #[inline(never)]
    fn sample_specular(
        &self,
        at: At<'_>,
        from: Vec3,
        n: Vec3,
        choice: f64,
        given: Given,
    ) -> Option<SpecularSample> {
        let Some(at) = at else {
            return self.bsdf.sample_specular_at(None, from, n, choice, given);
        };
        let facet = self.single(at, n, from);
        let s = facet.with(at, |at| {
            self.bsdf.sample_specular_at(Some(at), from, facet.normal, choice, given)
        })?;
        let shadowing = match given {
            _ if !facet.sees(s.w) => 0.0,
            Given::Wo => self.passing(&facet, s.w),
            Given::Wi => self.passing(&facet, from),
        };
        Some(SpecularSample { weight: s.weight * shadowing, ..s })
    }

    fn single_chance(&self, at: At<'_>, from: Vec3, n: Vec3) -> f64 {
        let Some(at) = at else { return self.bsdf.single_chance(None, from, n) };
        let facet = self.single(at, n, from);
        facet.with(at, |at| self.bsdf.single_chance(Some(at), from, facet.normal))
    }

    #[inline(never)]
    fn specular(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Option<SpecularValue> {
        let Some(at) = at else { return self.bsdf.specular(None, wo, wi, n) };
        let facet = self.single(at, n, wo);
        let found = facet.with(at, |at| self.bsdf.specular(Some(at), wo, wi, facet.normal))?;
        let shadowing = if facet.sees(wi) { self.passing(&facet, wi) } else { 0.0 };
        Some(found.scaled(Rgb::splat(shadowing), 1.0))
    }

    #[inline(never)]
    fn pdf(&self, at: At<'_>, from: Vec3, to: Vec3, n: Vec3, given: Given) -> f64 {
        let Some(at) = at else { return self.bsdf.pdf_at(None, from, to, n, given) };
        let choices = self.choices(&self.tilt(at, n), from, given).into_iter().flatten();
        let densities = choices.filter(|(facet, _)| facet.sees(to)).map(|(facet, chance)| {
            let density =
                facet.with(at, |at| self.bsdf.pdf_at(Some(at), from, to, facet.normal, given));
            chance * density
        });
        densities.sum()
    }

    fn lobe_width(&self, at: At<'_>) -> f64 {
        self.bsdf.lobe_width(at)
    }

    /// That of the BSDF about the normal that is seen.
    fn lobes(&self, at: At<'_>, wo: Vec3, n: Vec3) -> Lobes {
        let Some(at) = at else { return self.bsdf.lobes(None, wo, n) };
        let facet = self.single(at, n, wo);
        facet.with(at, |at| self.bsdf.lobes(Some(at), wo, facet.normal))
    }

    fn texture(&self, property: Property) -> Option<&Texture> {
        self.bsdf.texture(property)
    }

    fn undifferentiated(&self, property: Property, _: Textures<'_>) -> Option<&'static str> {
        self.bsdf.undifferentiated(property)
    }

    fn slide(&self, at: At<'_>, [wo, wi, n]: [Vec3; 3], _: &BsdfParams, factor: f64) -> RgbVec {
        let Some(at) = at else { return RgbVec::ZERO };
        let frame = Self::frame(at, n.lift());
        let own = self.perturbation == Perturbation::Normals;
        let normal = match own {
            true => variables::<3, 1>([mapped(self.map.at_point(at))])[0],
            false => self.normal(at, &frame),
        };
        // The map's channels stand for twice their values.
        let gradient = self.map.gradient(at) * 2.0;
        let mut sum = RgbVec::ZERO;
        for part in self.scattered(at, &Tilt::new(frame, normal), [wo.lift(), wi.lift()]) {
            let within = part.factor.re * factor;
            let (m, params) =
                (part.facet.normal.re(), part.inner.params.scaled(Rgb::splat(within)));
            sum +=
                part.facet.with(at, |at| self.bsdf.slide(Some(at), [wo, wi, m], &params, within));
            if own {
                let by = part.by(0);
                sum += [(Vec3::X, gradient.r), (Vec3::Y, gradient.g), (Vec3::Z, gradient.b)]
                    .into_iter()
                    .fold(RgbVec::ZERO, |sum, (axis, slope)| sum + by.dot(axis).outer(slope))
                    * factor;
            }
        }
        sum
    }

    fn stretch(&self, at: At<'_>, [wo, wi, n]: [Vec3; 3], factor: f64) -> [RgbVec; 3] {
        let mut sum = [RgbVec::ZERO; 3];
        let (Some(at), Perturbation::Heights(_)) = (at, self.perturbation) else { return sum };
        let frame = Self::frame(at, n);
        let [u, v] = by_coordinates(at).map(|by| frame.to_local(by));
        if u.x == 0.0 {
            return sum;
        }
        let [Vec3 { x: a, y: b, z: c }] = variables::<3, 1>([vec3(u.x, v.x, v.y)]);
        let normal = self.slanted(at, [a, Dual::from(u.y)], [b, c]);
        let lifted = Frame { s: frame.s.lift(), t: frame.t.lift(), n: n.lift() };
        for part in self.scattered(at, &Tilt::new(lifted, normal), [wo.lift(), wi.lift()]) {
            let [by_a, by_b, by_c] = [0, 1, 2].map(|k| part.lane(k) * factor);
            // The frame turns with u, and so do b and c in it.
            let turned = (by_b * v.y - by_c * v.x) * (1.0 / u.x);
            let by_u = by_a.outer(frame.s) + turned.outer(frame.t);
            let by_v = by_b.outer(frame.s) + by_c.outer(frame.t);
            for (sum, by) in sum.iter_mut().zip(of_corners(at, [by_u, by_v])) {
                *sum += by;
            }
        }
        sum
    }

    fn validate_on(&self, mesh: &Mesh) -> Result<(), SurfaceError> {
        match self.map.bounds_on(mesh) {
            Some(_) => Ok(()),
            None => {
                let name = self.map.attribute().unwrap_or_default().into();
                Err(SurfaceError::NoAttribute { name })
            }
        }
    }

    fn lines_on(&self, mesh: &Mesh) -> Option<Vec<SurfaceLine>> {
        // Of heights the slopes jump at every texel, and change in between.
        if self.perturbation != Perturbation::Normals {
            return None;
        }
        let mut lines = self.map.lines_on(mesh)?;
        lines.extend(frame_seams(mesh));
        Some(lines)
    }
}

/// True of a BSDF in which there is a map of normals or heights.
fn is_perturbed(bsdf: &Bsdf) -> bool {
    matches!(bsdf, Bsdf::Perturbed(_)) || bsdf.parts().any(is_perturbed)
}
