use drt_geom::edges::Lobes;
use drt_math::{Real, Rgb, RgbVec, Vec3};

use crate::model::surface::bsdf::Composed;
use crate::model::surface::facet::Facet;
use crate::model::surface::model::{Flags, Model, Numbers};
use crate::model::surface::params::{BsdfParams, PropertySet};
use crate::model::surface::property::{Property, Slot, SurfaceError};
use crate::model::surface::textures::Textures;
use crate::model::surface::{At, Bsdf, BsdfGradient, Given, SpecularSample, SpecularValue};
use crate::model::texture::Texture;

/// One-sided reflectors used on both sides of a surface: from behind, the normal is turned over.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TwoSided {
    /// The side the normal points to.
    pub front: Bsdf,
    /// The other side; `None` for the BSDF of the front.
    pub back: Option<Bsdf>,
}

impl TwoSided {
    /// The side that a direction meets, and the normal it goes with.
    #[inline]
    fn side(&self, from: Vec3, n: Vec3) -> (&Bsdf, Vec3) {
        if n.dot(from) >= 0.0 { (&self.front, n) } else { (self.behind(), -n) }
    }

    fn behind(&self) -> &Bsdf {
        self.back.as_ref().unwrap_or(&self.front)
    }
}

impl Composed for TwoSided {
    fn parts(&self) -> [Option<&Bsdf>; 2] {
        [Some(&self.front), self.back.as_ref()]
    }
}

impl Model for TwoSided {
    fn name(&self) -> &'static str {
        "twosided"
    }

    #[inline(never)]
    fn flags(&self) -> Flags {
        let both = self.front.flags().of_both(self.behind().flags());
        Flags { black_from_behind: false, ..both }
    }

    fn differentiated(&self) -> PropertySet {
        self.front.differentiated().union(self.behind().differentiated())
    }

    /// Two different sides have none in common; `Bsdf::apply` refuses a change of one with a message that says so.
    fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        match self.back {
            Some(_) => None,
            None => self.front.property(property),
        }
    }

    fn validate(&self) -> Result<(), SurfaceError> {
        [Some(&self.front), self.back.as_ref()].into_iter().flatten().try_for_each(|side| {
            let through = side.is_transmissive() || side.passes_straight();
            if through || side.is_null() || matches!(side, Bsdf::TwoSided(_)) {
                Err(SurfaceError::NotReflective { bsdf: side.name() })
            } else {
                side.validate()
            }
        })
    }

    #[inline(never)]
    fn value<T: Real>(
        &self,
        numbers: impl Numbers<T>,
        at: At<'_>,
        [wo, wi, n]: [Vec3<T>; 3],
    ) -> Rgb<T> {
        if n.dot(wo).re() >= 0.0 {
            self.front.value(numbers, at, [wo, wi, n])
        } else {
            self.behind().value(numbers, at, [wo, wi, -n])
        }
    }

    #[inline(never)]
    fn gradient(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> BsdfGradient {
        let (bsdf, facing) = self.side(wo, n);
        let mut gradient = bsdf.gradient_at(at, wo, wi, facing);
        if facing != n {
            gradient.n = -gradient.n;
        }
        gradient
    }

    fn sample(&self, at: At<'_>, from: Vec3, n: Vec3, u: [f64; 3], given: Given) -> Option<Vec3> {
        let (bsdf, n) = self.side(from, n);
        bsdf.direction(at, from, n, u, given)
    }

    #[inline(never)]
    fn pdf(&self, at: At<'_>, from: Vec3, to: Vec3, n: Vec3, given: Given) -> f64 {
        let (bsdf, n) = self.side(from, n);
        bsdf.pdf_at(at, from, to, n, given)
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
        let (bsdf, n) = self.side(from, n);
        bsdf.sample_at(at, from, n, u, given).map(|s| (s.w, s.pdf))
    }

    fn single_chance(&self, at: At<'_>, from: Vec3, n: Vec3) -> f64 {
        let (bsdf, n) = self.side(from, n);
        bsdf.single_chance(at, from, n)
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
        let (bsdf, n) = self.side(from, n);
        bsdf.sample_specular_at(at, from, n, choice, given)
    }

    #[inline(never)]
    fn specular(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Option<SpecularValue> {
        let (bsdf, side) = self.side(wo, n);
        let found = bsdf.specular(at, wo, wi, side)?;
        // The cosine is that with the normal of the front.
        Some(SpecularValue { by_cosine: found.by_cosine * side.dot(n).signum(), ..found })
    }

    #[inline(never)]
    fn facet(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Option<(Facet, f64)> {
        let (bsdf, n) = self.side(wo, n);
        bsdf.facet(at, wo, wi, n)
    }

    fn lobes(&self, at: At<'_>, wo: Vec3, n: Vec3) -> Lobes {
        let (bsdf, n) = self.side(wo, n);
        bsdf.lobes(at, wo, n)
    }

    fn lobe_width(&self, at: At<'_>) -> f64 {
        f64::min(self.front.lobe_width(at), self.behind().lobe_width(at))
    }

    fn texture(&self, property: Property) -> Option<&Texture> {
        self.front.texture(property)
    }

    fn undifferentiated(&self, property: Property, _: Textures<'_>) -> Option<&'static str> {
        self.front.undifferentiated(property)
    }

    fn slide(
        &self,
        at: At<'_>,
        [wo, wi, n]: [Vec3; 3],
        params: &BsdfParams,
        factor: f64,
    ) -> RgbVec {
        let (bsdf, n) = self.side(wo, n);
        bsdf.slide(at, [wo, wi, n], params, factor)
    }

    fn stretch(&self, at: At<'_>, [wo, wi, n]: [Vec3; 3], factor: f64) -> [RgbVec; 3] {
        let (bsdf, n) = self.side(wo, n);
        bsdf.stretch(at, [wo, wi, n], factor)
    }
}
