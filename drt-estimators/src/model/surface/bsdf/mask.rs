use drt_geom::edges::Lobes;
use drt_math::{Real, Rgb, RgbVec, Vec3};

use crate::model::surface::bsdf::Composed;
use crate::model::surface::model::{Flags, Model, Numbers};
use crate::model::surface::params::PropertySet;
use crate::model::surface::principled::ends_of;
use crate::model::surface::property::{Property, Slot, SurfaceError, in_range};
use crate::model::surface::specular::{Bend, same};
use crate::model::surface::textures::Textures;
use crate::model::surface::{
    At, Bsdf, BsdfGradient, BsdfParams, Given, SpecularSample, SpecularValue,
};
use crate::model::texture::Texture;

/// A surface that scatters with a probability, its opacity, and otherwise lets light go straight
/// through: Mitsuba's `mask`.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Mask {
    /// The BSDF of the part that scatters.
    pub bsdf: Bsdf,
    /// The opacity, clamped to the range from 0 to 1; default 0.5.
    pub opacity: f64,
}

impl Mask {
    /// The opacity as a probability.
    pub(in crate::model::surface) fn opaque(&self) -> f64 {
        self.opacity.clamp(0.0, 1.0)
    }

    /// The derivative by the opacity of what it is a factor of: beyond its range it changes nothing.
    fn slope(&self, value: Rgb) -> Rgb {
        if (0.0..=1.0).contains(&self.opacity) { value } else { Rgb::ZERO }
    }

    /// A number of (0, 1) that chooses the surface, stretched to (0, 1) again.
    fn there(&self, choice: f64) -> Option<f64> {
        let opacity = self.opaque();
        (choice < opacity).then(|| choice / opacity)
    }
}

impl Composed for Mask {
    fn parts(&self) -> [Option<&Bsdf>; 2] {
        [Some(&self.bsdf), None]
    }
}

impl Model for Mask {
    fn name(&self) -> &'static str {
        "mask"
    }

    #[inline(never)]
    fn flags(&self) -> Flags {
        Flags { black: false, straight: true, smooth: true, ..self.bsdf.flags() }
    }

    fn differentiated(&self) -> PropertySet {
        self.bsdf.differentiated().union(const { PropertySet::new(&[Property::Opacity]) })
    }

    fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        match property {
            Property::Opacity => Some(Slot::Scalar(&mut self.opacity)),
            _ => self.bsdf.property(property),
        }
    }

    fn validate(&self) -> Result<(), SurfaceError> {
        if self.bsdf.is_null() || self.bsdf.passes_straight() {
            return Err(SurfaceError::CannotHold { outer: "mask", bsdf: self.bsdf.name() });
        }
        in_range(Property::Opacity, self.opacity, true, "a finite number")?;
        self.bsdf.validate()
    }

    #[inline(never)]
    fn value<T: Real>(
        &self,
        numbers: impl Numbers<T>,
        at: At<'_>,
        directions: [Vec3<T>; 3],
    ) -> Rgb<T> {
        let opacity = match self.opaque() {
            opacity if opacity == self.opacity => numbers.number(Property::Opacity, opacity),
            beyond => T::from(beyond),
        };
        self.bsdf.value(numbers, at, directions) * opacity
    }

    #[inline(never)]
    fn gradient(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> BsdfGradient {
        let (d, opacity) = (self.bsdf.gradient_at(at, wo, wi, n), self.opaque());
        let mut scaled = d.scaled(opacity);
        scaled.params.set(Property::Opacity, self.slope(d.value));
        scaled
    }

    #[inline(never)]
    fn sample(&self, at: At<'_>, from: Vec3, n: Vec3, u: [f64; 3], given: Given) -> Option<Vec3> {
        let choice = self.there(u[2])?;
        self.bsdf.direction(at, from, n, [u[0], u[1], choice], given)
    }

    fn single_chance(&self, at: At<'_>, from: Vec3, n: Vec3) -> f64 {
        1.0 - self.opaque() * (1.0 - self.bsdf.single_chance(at, from, n))
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
        match self.there(choice) {
            Some(choice) => self.bsdf.sample_specular_at(at, from, n, choice, given),
            None => Some(SpecularSample { w: -from, weight: Rgb::ONE, straight: true }),
        }
    }

    #[inline(never)]
    fn pdf(&self, at: At<'_>, from: Vec3, to: Vec3, n: Vec3, given: Given) -> f64 {
        self.bsdf.pdf_at(at, from, to, n, given) * self.opaque()
    }

    fn lobe_width(&self, at: At<'_>) -> f64 {
        self.bsdf.lobe_width(at)
    }

    #[inline(never)]
    fn specular(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Option<SpecularValue> {
        let opacity = self.opaque();
        if let Some(inner) = self.bsdf.specular(at, wo, wi, n) {
            let mut found = inner.scaled(Rgb::splat(opacity), opacity);
            found.params.set(Property::Opacity, self.slope(inner.value));
            return Some(found);
        }
        same(-wo, wi).then(|| SpecularValue {
            value: Rgb::splat(1.0 - opacity),
            params: BsdfParams::of(Property::Opacity, self.slope(Rgb::splat(-1.0))),
            probability: 1.0 - opacity,
            by_cosine: Rgb::ZERO,
            bend: Bend::Straight,
        })
    }

    fn straight(&self, _: At<'_>, _: f64) -> Rgb {
        Rgb::splat(1.0 - self.opaque())
    }

    /// No sampler asks for it, as no edge is sampled beside surfaces that let light straight through.
    fn lobes(&self, _: At<'_>, _: Vec3, _: Vec3) -> Lobes {
        Lobes::even(0.0)
    }

    fn texture(&self, property: Property) -> Option<&Texture> {
        self.bsdf.texture(property)
    }

    fn undifferentiated(&self, property: Property, textures: Textures<'_>) -> Option<&'static str> {
        if property != Property::Opacity {
            return self.bsdf.undifferentiated_with(property, textures);
        }
        let [least, most] = ends_of(self.opacity, property, textures);
        (least <= 0.0 || most >= 1.0).then_some("at 0 and 1 no path goes where light would")
    }

    fn slide(&self, at: At<'_>, directions: [Vec3; 3], params: &BsdfParams, factor: f64) -> RgbVec {
        self.bsdf.slide(at, directions, params, factor * self.opaque())
    }

    fn stretch(&self, at: At<'_>, directions: [Vec3; 3], factor: f64) -> [RgbVec; 3] {
        self.bsdf.stretch(at, directions, factor * self.opaque())
    }
}
