use drt_geom::edges::{Lobe, Lobes};
use drt_math::{Real, Rgb, RgbVec, Vec3};

use crate::model::surface::bsdf::Composed;
use crate::model::surface::choice::choose;
use crate::model::surface::lobes::two_highest;
use crate::model::surface::model::{Flags, Model, Numbers};
use crate::model::surface::params::PropertySet;
use crate::model::surface::property::{Property, Slot, SurfaceError, in_range};
use crate::model::surface::{
    At, Bsdf, BsdfGradient, BsdfParams, Given, SpecularSample, SpecularValue,
};

/// A linear combination of two BSDFs, `(1 - w) f₀ + w f₁`: Mitsuba's `blendbsdf`.
///
/// It is differentiated with respect to its weight, but not with respect to the properties of its parts.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Blend {
    /// The BSDFs at the weights 0 and 1.
    pub bsdfs: [Bsdf; 2],
    /// The weight w of the second BSDF, clamped to the range from 0 to 1.
    pub weight: f64,
}

/// Least probability of choosing either part: one of weight zero still has a derivative by the weight.
const LEAST_CHOICE: f64 = 0.05;

impl Blend {
    /// The weights of both parts.
    fn weights(&self) -> [f64; 2] {
        let weight = self.weight.clamp(0.0, 1.0);
        [1.0 - weight, weight]
    }

    /// The probabilities of choosing them.
    fn choices(&self) -> [f64; 2] {
        self.weights().map(|w| w.clamp(LEAST_CHOICE, 1.0 - LEAST_CHOICE))
    }

    /// The derivative by the weight, from the values of both parts.
    fn slope(&self, [a, b]: [Rgb; 2]) -> Rgb {
        // Beyond its range the weight changes nothing.
        if (0.0..=1.0).contains(&self.weight) { b - a } else { Rgb::ZERO }
    }

    /// The part that a number of (0, 1) chooses, and the number stretched to (0, 1) again.
    fn choose(&self, choice: f64) -> (usize, f64) {
        let [first, second] = self.choices();
        let (is_second, choice) = choose(choice, [second, first]);
        (usize::from(is_second), choice)
    }
}

impl Composed for Blend {
    fn parts(&self) -> [Option<&Bsdf>; 2] {
        self.bsdfs.each_ref().map(Some)
    }
}

impl Model for Blend {
    fn name(&self) -> &'static str {
        "blendbsdf"
    }

    #[inline(never)]
    fn flags(&self) -> Flags {
        let [a, b] = self.bsdfs.each_ref().map(Bsdf::flags);
        a.of_both(b)
    }

    /// Properties of its parts do not count: both parts may have the same one.
    fn differentiated(&self) -> PropertySet {
        const { PropertySet::new(&[Property::Weight]) }
    }

    fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        (property == Property::Weight).then_some(Slot::Scalar(&mut self.weight))
    }

    fn validate(&self) -> Result<(), SurfaceError> {
        for bsdf in &self.bsdfs {
            if bsdf.is_null() || bsdf.passes_straight() {
                return Err(SurfaceError::CannotHold { outer: "blendbsdf", bsdf: bsdf.name() });
            }
            bsdf.validate()?;
        }
        in_range(Property::Weight, self.weight, true, "a finite number")
    }

    #[inline(never)]
    fn value<T: Real>(
        &self,
        numbers: impl Numbers<T>,
        at: At<'_>,
        directions: [Vec3<T>; 3],
    ) -> Rgb<T> {
        let weight = numbers.number(Property::Weight, self.weight);
        let weight = match weight.re() {
            w if w < 0.0 => T::zero(),
            w if w > 1.0 => T::one(),
            _ => weight,
        };
        let numbers = numbers.without(PropertySet::ALL);
        let [a, b] = self.bsdfs.each_ref().map(|b| b.value(numbers, at, directions));
        a * (T::one() - weight) + b * weight
    }

    #[inline(never)]
    fn gradient(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> BsdfGradient {
        let [a, b] = self.bsdfs.each_ref().map(|b| b.gradient_at(at, wo, wi, n));
        let [u, v] = self.weights();
        let slope = self.slope([a.value, b.value]);
        BsdfGradient {
            value: a.value * u + b.value * v,
            wo: a.wo * u + b.wo * v,
            wi: a.wi * u + b.wi * v,
            n: a.n * u + b.n * v,
            params: BsdfParams::of(Property::Weight, slope),
        }
    }

    #[inline(never)]
    fn sample(&self, at: At<'_>, from: Vec3, n: Vec3, u: [f64; 3], given: Given) -> Option<Vec3> {
        let (part, choice) = self.choose(u[2]);
        self.bsdfs[part].direction(at, from, n, [u[0], u[1], choice], given)
    }

    fn single_chance(&self, at: At<'_>, from: Vec3, n: Vec3) -> f64 {
        let parts = self.bsdfs.iter().zip(self.choices());
        parts.map(|(bsdf, choice)| choice * bsdf.single_chance(at, from, n)).sum()
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
        let (part, choice) = self.choose(choice);
        let sample = self.bsdfs[part].sample_specular_at(at, from, n, choice, given)?;
        let times = self.weights()[part] / self.choices()[part];
        Some(SpecularSample { weight: sample.weight * times, ..sample })
    }

    #[inline(never)]
    fn specular(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Option<SpecularValue> {
        let parts = self.bsdfs.each_ref().map(|b| b.specular(at, wo, wi, n));
        if parts.iter().all(Option::is_none) {
            return None;
        }
        // Parts that share a direction bend alike.
        let bend = parts.iter().flatten().map(|part| part.bend).next().unwrap_or_default();
        let parts = parts.map(Option::unwrap_or_default);
        let mut both = SpecularValue { bend, ..SpecularValue::default() };
        for (part, (weight, choice)) in
            parts.iter().zip(self.weights().into_iter().zip(self.choices()))
        {
            both.value += part.value * weight;
            both.by_cosine += part.by_cosine * weight;
            both.probability += part.probability * choice;
        }
        both.params = BsdfParams::of(Property::Weight, self.slope(parts.map(|p| p.value)));
        Some(both)
    }

    #[inline(never)]
    fn pdf(&self, at: At<'_>, from: Vec3, to: Vec3, n: Vec3, given: Given) -> f64 {
        let parts = self.bsdfs.iter().zip(self.choices());
        parts.map(|(b, choice)| choice * b.pdf_at(at, from, to, n, given)).sum()
    }

    fn lobe_width(&self, at: At<'_>) -> f64 {
        let [a, b] = self.bsdfs.each_ref().map(|b| b.lobe_width(at));
        f64::min(a, b)
    }

    /// Both sketches, of which the two highest lobes stay.
    fn lobes(&self, at: At<'_>, wo: Vec3, n: Vec3) -> Lobes {
        let weights = self.weights();
        let parts = [0, 1].map(|i| self.bsdfs[i].lobes(at, wo, n));
        let mut all = [Lobe::default(); 4];
        for (i, lobe) in all.iter_mut().enumerate() {
            let (part, weight) = (&parts[i / 2].lobes[i % 2], weights[i / 2]);
            *lobe = Lobe { height: part.height * weight, ..*part };
        }
        two_highest(parts[0].even * weights[0] + parts[1].even * weights[1], all)
    }

    fn slide(&self, at: At<'_>, [wo, wi, n]: [Vec3; 3], _: &BsdfParams, factor: f64) -> RgbVec {
        let mut sum = RgbVec::ZERO;
        for (bsdf, weight) in self.bsdfs.iter().zip(self.weights()) {
            let factor = factor * weight;
            let params = bsdf.gradient_at(at, wo, wi, n).params.scaled(Rgb::splat(factor));
            sum += bsdf.slide(at, [wo, wi, n], &params, factor);
        }
        sum
    }

    fn stretch(&self, at: At<'_>, directions: [Vec3; 3], factor: f64) -> [RgbVec; 3] {
        let weights = self.weights();
        let [a, b] = [0, 1].map(|i| self.bsdfs[i].stretch(at, directions, factor * weights[i]));
        [0, 1, 2].map(|k| a[k] + b[k])
    }
}
