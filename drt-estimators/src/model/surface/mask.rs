use drt_math::{Rgb, Vec3};

use crate::model::surface::composed::Composed;
use crate::model::surface::property::{Property, Slot, SurfaceError, in_range};
use crate::model::surface::specular::same;
use crate::model::surface::{
    At, Bsdf, BsdfGradient, BsdfParams, Given, SpecularSample, SpecularValue,
};

/// A surface that is there with a probability, its opacity: Mitsuba's `mask`. Else light goes straight through, as through
/// nothing.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Mask {
    /// What scatters where the surface is there.
    pub bsdf: Bsdf,
    /// The opacity; what is below 0 or above 1 counts as that. Default 0.5.
    pub opacity: f64,
}

impl Mask {
    /// The opacity as a probability.
    pub(super) fn opaque(&self) -> f64 {
        self.opacity.clamp(0.0, 1.0)
    }

    /// Sets the derivative by the opacity.
    fn by_opacity(&self, params: &mut BsdfParams, slope: Rgb) {
        if !has_transmittance(&self.bsdf)
            && let Some(entry) = params.get_mut(Property::Opacity)
        {
            *entry = slope;
        }
    }

    /// A number of (0, 1) that chooses the surface, stretched to (0, 1) again.
    fn there(&self, choice: f64) -> Option<f64> {
        let opacity = self.opaque();
        (choice < opacity).then(|| choice / opacity)
    }

    pub(super) fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        match property {
            Property::Opacity => Some(Slot::Scalar(&mut self.opacity)),
            _ => self.bsdf.property(property),
        }
    }

    pub(super) fn validate(&self) -> Result<(), SurfaceError> {
        if self.bsdf.is_null() || self.bsdf.passes_straight() {
            return Err(SurfaceError::CannotHold { outer: "mask", bsdf: self.bsdf.name() });
        }
        in_range(Property::Opacity, self.opacity, true, "a finite number")?;
        self.bsdf.validate()
    }
}

/// True of what has a property whose entry is that of the opacity: around it only that has a derivative.
pub(super) fn has_transmittance(bsdf: &Bsdf) -> bool {
    match bsdf {
        Bsdf::RoughDielectric(_) | Bsdf::Dielectric(_) | Bsdf::ThinDielectric(_) => true,
        Bsdf::Anisotropic(_) | Bsdf::Principled(_) | Bsdf::PrincipledThin(_) | Bsdf::Coated(_) => {
            true
        }
        Bsdf::Textured(b) => has_transmittance(&b.bsdf),
        Bsdf::Perturbed(b) => has_transmittance(&b.bsdf),
        // Of what is in a blend nothing has a derivative, and what is two-sided lets no light through.
        _ => false,
    }
}

impl Composed for Mask {
    fn eval(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Rgb {
        self.bsdf.eval_at(at, wo, wi, n) * self.opaque()
    }

    fn gradient(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> BsdfGradient {
        let (d, opacity) = (self.bsdf.gradient_at(at, wo, wi, n), self.opaque());
        let mut params = BsdfParams::default();
        params.scatter(&d.params, Rgb::splat(opacity));
        self.by_opacity(&mut params, d.value);
        BsdfGradient {
            value: d.value * opacity,
            wo: d.wo * opacity,
            wi: d.wi * opacity,
            n: d.n * opacity,
            params,
        }
    }

    fn sample(&self, at: At<'_>, from: Vec3, n: Vec3, u: [f64; 3], given: Given) -> Option<Vec3> {
        let choice = self.there(u[2])?;
        self.bsdf.direction(at, from, n, [u[0], u[1], choice], given)
    }

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

    fn specular(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Option<SpecularValue> {
        let opacity = self.opaque();
        if let Some(inner) = self.bsdf.specular(at, wo, wi, n) {
            let mut found = inner.scaled(Rgb::splat(opacity), opacity);
            self.by_opacity(&mut found.params, inner.value);
            return Some(found);
        }
        same(-wo, wi).then(|| {
            let mut params = BsdfParams::default();
            self.by_opacity(&mut params, Rgb::splat(-1.0));
            let value = Rgb::splat(1.0 - opacity);
            SpecularValue { value, params, probability: 1.0 - opacity }
        })
    }

    fn pdf(&self, at: At<'_>, from: Vec3, to: Vec3, n: Vec3, given: Given) -> f64 {
        self.bsdf.pdf_at(at, from, to, n, given) * self.opaque()
    }

    fn lobe_width(&self, at: At<'_>) -> f64 {
        self.bsdf.lobe_width(at)
    }
}
