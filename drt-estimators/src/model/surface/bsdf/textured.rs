use alloc::boxed::Box;
use alloc::vec::Vec;

use drt_geom::Mesh;
use drt_geom::edges::Lobes;
use drt_math::{Real, Rgb, RgbVec, ValueChange, Vec3};

use crate::model::surface::bsdf::Composed;
use crate::model::surface::facet::Facet;

use crate::model::surface::microfacet::LEAST_ALPHA;
use crate::model::surface::model::{Flags, Model, Numbers};
use crate::model::surface::params::PropertySet;
use crate::model::surface::property::{Property, Slot, SurfaceError};
use crate::model::surface::textures::Textures;
use crate::model::surface::{
    At, Bsdf, BsdfChange, BsdfGradient, BsdfParams, Given, SpecularSample, SpecularValue,
};
use crate::model::texture::{
    Footprint, SurfaceLine, TexelChange, TexelError, TexelTangent, Texture, TexturePoint,
};

/// A one-sided BSDF some of whose properties vary over the surface.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Textured {
    /// The BSDF with the means of its textures.
    pub bsdf: Bsdf,
    /// Textures, each with the property that it replaces. For a scalar property the first channel of the texture
    /// counts, and roughness is clamped to at least the smallest value of microfacets.
    pub textures: Vec<(Property, Texture)>,
}

impl Textured {
    /// A BSDF with textures, which take the place of its own values.
    ///
    /// # Errors
    /// When it is null, two-sided or textured already, lacks a property, or some texture has a value
    /// that it does not take.
    pub fn new(mut bsdf: Bsdf, textures: Vec<(Property, Texture)>) -> Result<Self, SurfaceError> {
        for (property, texture) in &textures {
            bsdf.set(*property, allowed(*property, texture.mean()))?;
        }
        let textured = Self { bsdf, textures };
        textured.validate()?;
        Ok(textured)
    }

    /// The BSDF at a point.
    #[inline]
    pub(in crate::model::surface) fn at(&self, at: At<'_>) -> Bsdf {
        let mut bsdf = self.bsdf.clone();
        if let Some(at) = at {
            for (property, texture) in &self.textures {
                // Only properties that there are can have got a texture.
                let _ = bsdf.set(*property, allowed(*property, texture.at_point(at)));
            }
        }
        bsdf
    }

    /// Makes a change of the texels that stand for a property; their rates. `None` where no texture does.
    fn change(
        &mut self,
        property: Property,
        change: impl FnOnce([u32; 2]) -> Result<TexelChange, TexelError>,
    ) -> Result<Option<(TexelChange, TexelTangent)>, SurfaceError> {
        let found = self.textures.iter_mut().find(|(p, _)| *p == property);
        let Some((_, texture)) = found else { return Ok(None) };
        if texture.size() == [0; 2] {
            return Err(SurfaceError::StoodFor { property });
        }
        let change = change(texture.size())?;
        let rates = texture.change(&change)?;
        let mean = texture.mean();
        self.bsdf.set(property, allowed(property, mean))?;
        let number = self.bsdf.is_number(property) == Some(true);
        Ok(Some((change, if number { rates.of_number() } else { rates })))
    }

    /// Gives the texels that stand for a property other values; false where no texture does.
    fn set_texels(&mut self, property: Property, values: &[Rgb]) -> Result<bool, SurfaceError> {
        let found = self.textures.iter_mut().find(|(p, _)| *p == property);
        let Some((_, texture)) = found else { return Ok(false) };
        texture.set_texels(values)?;
        let mean = texture.mean();
        self.bsdf.set(property, allowed(property, mean))?;
        Ok(true)
    }

    /// Calls `f` with each property whose value is that of texels, and these.
    pub(in crate::model::surface) fn lookups(
        &self,
        at: &TexturePoint<'_>,
        mut f: impl FnMut(Property, &Footprint),
    ) {
        let uv = at.uv();
        for (property, texture) in &self.textures {
            let value = texture.at(uv);
            if let Some(footprint) = texture.footprint(uv)
                && allowed(*property, value) == value
            {
                f(*property, &footprint);
            }
        }
    }

    fn textures(&self) -> Textures<'_> {
        Textures(&self.textures)
    }

    fn check_bounds(&self, bounds: impl Fn(&Texture) -> [Rgb; 2]) -> Result<(), SurfaceError> {
        for (property, texture) in &self.textures {
            for bound in bounds(texture) {
                let fail = |reason| SurfaceError::Texture {
                    property: *property,
                    reason: Box::new(reason),
                };
                let mut bsdf = self.bsdf.clone();
                bsdf.set(*property, allowed(*property, bound))?;
                bsdf.validate().map_err(fail)?;
            }
        }
        Ok(())
    }
}

impl Textured {
    /// The gradient of a value by the place of its point, in the plane of the triangle there: through the properties
    /// that textures stand for, by which the value has the derivatives `params`.
    fn slide_of_textures(&self, at: &TexturePoint<'_>, params: &BsdfParams) -> RgbVec {
        let mut sum = RgbVec::ZERO;
        for (property, texture) in &self.textures {
            let value = texture.at_point(at);
            if allowed(*property, value) == value {
                sum += texture.gradient(at) * params.get(*property);
            }
        }
        sum
    }
}

/// At each point this is the BSDF of the textures' values there.
impl Composed for Textured {
    fn parts(&self) -> [Option<&Bsdf>; 2] {
        [Some(&self.bsdf), None]
    }
}

impl Model for Textured {
    fn name(&self) -> &'static str {
        self.bsdf.name()
    }

    #[inline(never)]
    fn flags(&self) -> Flags {
        let inner = self.bsdf.flags();
        // A texture may stand for how much goes through.
        let through = self.textures().of(Property::SpecTrans).is_some();
        let transmissive = inner.transmissive || through;
        Flags { transmissive, oriented: inner.oriented || self.textures().orients(), ..inner }
    }

    fn differentiated(&self) -> PropertySet {
        self.bsdf.differentiated()
    }

    fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        self.bsdf.property(property)
    }

    fn validate(&self) -> Result<(), SurfaceError> {
        if matches!(self.bsdf, Bsdf::Textured(_) | Bsdf::TwoSided(_)) {
            return Err(SurfaceError::TexturedTwice { bsdf: self.bsdf.name() });
        }
        self.bsdf.validate()?;
        self.check_bounds(Texture::bounds)
    }

    #[inline(never)]
    fn value<T: Real>(
        &self,
        numbers: impl Numbers<T>,
        at: At<'_>,
        directions: [Vec3<T>; 3],
    ) -> Rgb<T> {
        self.at(at).value(numbers, at, directions)
    }

    #[inline(never)]
    fn gradient(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> BsdfGradient {
        self.at(at).gradient_at(at, wo, wi, n)
    }

    fn sample(&self, at: At<'_>, from: Vec3, n: Vec3, u: [f64; 3], given: Given) -> Option<Vec3> {
        self.at(at).direction(at, from, n, u, given)
    }

    #[inline(never)]
    fn pdf(&self, at: At<'_>, from: Vec3, to: Vec3, n: Vec3, given: Given) -> f64 {
        self.at(at).pdf_at(at, from, to, n, given)
    }

    #[inline(never)]
    fn draw(
        &self,
        at: At<'_>,
        from: Vec3,
        n: Vec3,
        u: [f64; 3],
        given: Given,
    ) -> Option<(Vec3, f64)> {
        self.at(at).sample_at(at, from, n, u, given).map(|s| (s.w, s.pdf))
    }

    fn single_chance(&self, at: At<'_>, from: Vec3, n: Vec3) -> f64 {
        self.at(at).single_chance(at, from, n)
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
        self.at(at).sample_specular_at(at, from, n, choice, given)
    }

    #[inline(never)]
    fn specular(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Option<SpecularValue> {
        self.at(at).specular(at, wo, wi, n)
    }

    fn straight(&self, at: At<'_>, cos: f64) -> Rgb {
        if self.bsdf.passes_straight() { self.at(at).straight(None, cos) } else { Rgb::ZERO }
    }

    #[inline(never)]
    fn facet(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Option<(Facet, f64)> {
        self.at(at).facet(None, wo, wi, n)
    }

    fn lobes(&self, at: At<'_>, wo: Vec3, n: Vec3) -> Lobes {
        self.at(at).lobes(None, wo, n)
    }

    fn lobe_width(&self, at: At<'_>) -> f64 {
        self.at(at).lobe_width(at)
    }

    fn texture(&self, property: Property) -> Option<&Texture> {
        self.textures().of(property)
    }

    fn undifferentiated(&self, property: Property, _: Textures<'_>) -> Option<&'static str> {
        self.bsdf.undifferentiated_with(property, self.textures())
    }

    fn slide(&self, at: At<'_>, directions: [Vec3; 3], params: &BsdfParams, factor: f64) -> RgbVec {
        let Some(point) = at else { return RgbVec::ZERO };
        let inner = self.at(at).slide(at, directions, params, factor);
        self.slide_of_textures(point, params) + inner
    }

    fn stretch(&self, at: At<'_>, directions: [Vec3; 3], factor: f64) -> [RgbVec; 3] {
        self.at(at).stretch(at, directions, factor)
    }

    /// Checks what textures have from a mesh.
    fn validate_on(&self, mesh: &Mesh) -> Result<(), SurfaceError> {
        let missing = |t: &&(Property, Texture)| t.1.bounds_on(mesh).is_none();
        if let Some((_, texture)) = self.textures.iter().find(missing) {
            let name = texture.attribute().unwrap_or_default().into();
            return Err(SurfaceError::NoAttribute { name });
        }
        self.check_bounds(|t| t.bounds_on(mesh).unwrap_or_default())
    }

    fn lines_on(&self, mesh: &Mesh) -> Option<Vec<SurfaceLine>> {
        let all: Option<Vec<_>> = self.textures.iter().map(|(_, t)| t.lines_on(mesh)).collect();
        all.map(|lines| lines.concat())
    }
}

impl Bsdf {
    /// Makes a change of one texel, or of all, of the texture that stands for a property; the rates of texels with
    /// `theta`. `None` where there is no texture.
    pub(crate) fn change_texels(
        &mut self,
        change: &BsdfChange,
        texel: Option<[usize; 2]>,
        theta: f64,
    ) -> Result<Option<(TexelChange, TexelTangent)>, SurfaceError> {
        let BsdfChange { property, op } = *change;
        if self.texture(property).is_none() {
            return Ok(None);
        }
        if let (Some(true), ValueChange::Add(a), false) =
            (self.is_number(property), op, op.is_scalar())
        {
            return Err(SurfaceError::NotUniform { property, r: a.r, g: a.g, b: a.b });
        }
        let textured = match &mut *self {
            Self::TwoSided(b) if b.back.is_some() => {
                return Err(SurfaceError::DifferentSides { property });
            }
            Self::TwoSided(b) => &mut b.front,
            other => other,
        };
        let Self::Textured(textured) = textured else { return Ok(None) };
        let found = textured.change(property, |size| TexelChange::new(size, texel, op, theta))?;
        if theta != 0.0 {
            self.validate()?;
        }
        Ok(found)
    }

    /// The texels of the texture that stands for a property, row by row and as they are stored; `None` where none does.
    #[must_use]
    pub fn texel_values(&self, property: Property) -> Option<Vec<Rgb>> {
        self.texels(property)?;
        Some(self.textured_part()?.textures().of(property)?.texels())
    }

    /// This BSDF with other texels of the texture that stands for a property, row by row.
    ///
    /// # Errors
    /// When no texture stands for it, there are more or fewer texels, or a value is out of the property's range.
    pub fn with_texel_values(
        &self,
        property: Property,
        values: &[Rgb],
    ) -> Result<Self, SurfaceError> {
        let mut with = self.clone();
        let textured = match &mut with {
            Self::TwoSided(b) if b.back.is_none() => &mut b.front,
            other => other,
        };
        let found = match textured {
            Self::Textured(textured) => textured.set_texels(property, values)?,
            _ => false,
        };
        if !found {
            return Err(TexelError::NoTexture(property.name().into()).into());
        }
        with.validate()?;
        Ok(with)
    }

    /// Columns and rows of texels of the texture that stands for a property, if one does that can change.
    #[must_use]
    pub fn texels(&self, property: Property) -> Option<[u32; 2]> {
        Some(self.textured_part()?.textures().of(property)?.size()).filter(|size| *size != [0; 2])
    }

    /// Calls `f` with the textures of all its parts, and the properties that they stand for; maps of normals and
    /// heights have the names of their BSDFs.
    pub fn for_each_texture(&self, mut f: impl FnMut(&'static str, &Texture)) {
        let mut parts = alloc::vec![self];
        while let Some(part) = parts.pop() {
            match part {
                Self::Textured(t) => t.textures.iter().for_each(|(p, t)| f(p.name(), t)),
                Self::Perturbed(b) => f(part.name(), &b.map),
                _ => {}
            }
            parts.extend(part.parts());
        }
    }

    /// What has textures; of two sides alike, one of them.
    pub(crate) fn textured_part(&self) -> Option<&Textured> {
        match self {
            Self::Textured(t) => Some(t),
            Self::TwoSided(b) if b.back.is_none() => b.front.textured_part(),
            _ => None,
        }
    }

    /// Calls `f` with each property whose value is that of texels at a point, and these.
    pub(crate) fn lookups(&self, at: &TexturePoint<'_>, f: impl FnMut(Property, &Footprint)) {
        if let Some(textured) = self.textured_part() {
            textured.lookups(at, f);
        }
    }
}

/// What a texture's value makes of a property.
#[inline]
fn allowed(property: Property, value: Rgb) -> Rgb {
    match property {
        // Not `max`, which would take what is no number for allowed.
        Property::Alpha | Property::AlphaU | Property::AlphaV => {
            value.map(|a| if a < LEAST_ALPHA { LEAST_ALPHA } else { a })
        }
        _ => value,
    }
}
