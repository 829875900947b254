use drt_math::{Rgb, ValueChange};

use crate::model::surface::Bsdf;
use crate::model::surface::mask::has_transmittance;
use crate::model::surface::property::{Property, Slot, SurfaceError, names};
use crate::model::texture::Texture;

/// One number per channel for every property of a BSDF that it is differentiated by.
///
/// No BSDF has two properties that share an entry: what is rare stands where others have something else.
///
/// As part of a [`BsdfGradient`](super::BsdfGradient) it holds the derivative of each channel of the
/// value with respect to the same channel of the property, or to the property itself when that is a
/// scalar. Properties a BSDF lacks are zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BsdfParams {
    /// Albedo of the diffuse lobe; `base_color`.
    pub reflectance: Rgb,
    /// Weight of the glossy reflection; `clearcoat` and `diff_trans`.
    pub specular_reflectance: Rgb,
    /// Weight of the glossy refraction; `spec_trans`, the `sigma_a` of a coating, and the `opacity` of a mask around what has
    /// none of these.
    pub specular_transmittance: Rgb,
    /// Roughness: `alpha`, `alpha_u`, `roughness`.
    pub alpha: Rgb,
    /// Relative index of refraction.
    pub eta: Rgb,
    /// Imaginary part of the index; `sheen`.
    pub k: Rgb,
    /// Sharpness of the Phong lobe; the `weight` of a blend, `alpha_v`, `metallic`.
    pub exponent: Rgb,
}

/// A velocity of a BSDF's properties (a scalar's in every channel alike), or the gradient of a
/// number with respect to them (a scalar's is then the sum over its three channels).
pub type BsdfTangent = BsdfParams;

impl BsdfParams {
    /// Rate of change of the value along a velocity of the properties.
    #[inline]
    #[must_use]
    pub fn dot(&self, velocity: &BsdfTangent) -> Rgb {
        self.reflectance * velocity.reflectance
            + self.specular_reflectance * velocity.specular_reflectance
            + self.specular_transmittance * velocity.specular_transmittance
            + self.alpha * velocity.alpha
            + self.eta * velocity.eta
            + self.k * velocity.k
            + self.exponent * velocity.exponent
    }

    /// Adds `weight` times the derivatives `params`: the transpose of [`BsdfParams::dot`], so that
    /// `weight · params.dot(v)` is what a gradient collected from zero gives along `v`.
    #[inline]
    pub fn scatter(&mut self, params: &BsdfParams, weight: Rgb) {
        self.reflectance += params.reflectance * weight;
        self.specular_reflectance += params.specular_reflectance * weight;
        self.specular_transmittance += params.specular_transmittance * weight;
        self.alpha += params.alpha * weight;
        self.eta += params.eta * weight;
        self.k += params.k * weight;
        self.exponent += params.exponent * weight;
    }

    /// How many entries there are.
    pub(super) const ENTRIES: usize = 7;

    /// The entry of a property, by its number.
    pub(super) fn entry(property: Property) -> Option<usize> {
        Some(match property {
            Property::Reflectance | Property::BaseColor => 0,
            Property::SpecularReflectance | Property::Clearcoat | Property::DiffTrans => 1,
            Property::SpecularTransmittance
            | Property::SpecTrans
            | Property::Opacity
            | Property::SigmaA => 2,
            Property::Alpha | Property::AlphaU | Property::Roughness => 3,
            Property::Eta => 4,
            Property::K | Property::Sheen => 5,
            Property::Exponent | Property::Weight | Property::AlphaV | Property::Metallic => 6,
            _ => return None,
        })
    }

    /// Entries in the order of their numbers.
    pub(super) fn from_entries(entries: [Rgb; Self::ENTRIES]) -> Self {
        let [reflectance, specular_reflectance, specular_transmittance, alpha, eta, k, exponent] =
            entries;
        Self { reflectance, specular_reflectance, specular_transmittance, alpha, eta, k, exponent }
    }

    /// The entry of a property; zero of those that nothing is differentiated by.
    #[must_use]
    pub fn get(&self, property: Property) -> Rgb {
        let mut own = *self;
        own.get_mut(property).copied().unwrap_or(Rgb::ZERO)
    }

    /// The entry of a property, to change it; `None` of those that nothing is differentiated by.
    pub fn get_mut(&mut self, property: Property) -> Option<&mut Rgb> {
        let fields = [
            &mut self.reflectance,
            &mut self.specular_reflectance,
            &mut self.specular_transmittance,
            &mut self.alpha,
            &mut self.eta,
            &mut self.k,
            &mut self.exponent,
        ];
        fields.into_iter().nth(Self::entry(property)?)
    }
}

/// A parameter's effect on one property of a BSDF.
///
/// ```
/// use drt_estimators::surface::{Bsdf, BsdfChange, Diffuse, Property};
/// use drt_math::{Rgb, ValueChange};
///
/// let mut wall = Bsdf::Diffuse(Diffuse { reflectance: Rgb::splat(0.4) });
/// let redder = BsdfChange {
///     property: Property::from_name("reflectance")?,
///     op: ValueChange::Add(Rgb::new(1.0, 0.0, 0.0)),
/// };
/// let velocity = wall.tangent(&redder, 0.1)?;
/// wall.apply(&redder, 0.1)?;
/// assert_eq!(velocity.reflectance, Rgb::new(1.0, 0.0, 0.0));
/// assert_eq!(wall, Bsdf::Diffuse(Diffuse { reflectance: Rgb::new(0.5, 0.4, 0.4) }));
/// # Ok::<(), drt_estimators::surface::SurfaceError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfChange {
    /// What changes.
    pub property: Property,
    /// How it depends on theta.
    pub op: ValueChange,
}

impl BsdfChange {
    /// Carries a velocity that an earlier effect gave the BSDF through this later change.
    pub fn carry(&self, velocity: &mut BsdfTangent, theta: f64) {
        if let Some(entry) = velocity.get_mut(self.property) {
            *entry *= self.op.map(theta).factor;
        }
    }
}

impl Bsdf {
    /// Makes a change for the parameter's value `theta`.
    ///
    /// # Errors
    /// When the BSDF has no such property or the new value is not allowed; it is then unchanged.
    pub fn apply(&mut self, change: &BsdfChange, theta: f64) -> Result<(), SurfaceError> {
        let mut changed = self.clone();
        let slot = changed.slot(change)?;
        let value = change.op.at(slot.value(), theta);
        slot.set(value);
        changed.validate()?;
        *self = changed;
        Ok(())
    }

    /// Velocity of the properties, at the parameter's value `theta`, under a change of this (still
    /// unchanged) BSDF. Effects follow one another: after later changes, [`BsdfChange::carry`] it.
    ///
    /// # Errors
    /// When the BSDF has no such property.
    pub fn tangent(&self, change: &BsdfChange, theta: f64) -> Result<BsdfTangent, SurfaceError> {
        let mut base = self.clone();
        let mut velocity = BsdfTangent::default();
        let value = base.slot(change)?.value();
        if let Some(entry) = velocity.get_mut(change.property) {
            *entry = change.op.map_rate(theta).value(value);
        }
        Ok(velocity)
    }

    /// Why there are only finite differences with respect to a property of it, if that is so.
    #[must_use]
    pub fn undifferentiated(&self, property: Property) -> Option<&'static str> {
        let (plain, textures) = match self {
            Self::TwoSided(b) => return b.front.undifferentiated(property),
            Self::Textured(b) => (&b.bsdf, Some(&**b)),
            other => (other, None),
        };
        match plain {
            Self::Principled(_) | Self::PrincipledThin(_) => {}
            Self::Perturbed(b) => return b.bsdf.undifferentiated(property),
            Self::Coated(b) => return b.undifferentiated(property),
            // Which direction either belongs to is nothing that an even surface needs to know.
            Self::Ward(b) if matches!(property, Property::AlphaU | Property::AlphaV) => {
                let even = b.alpha[0] == b.alpha[1] && !self.is_oriented();
                return even.then_some("both roughnesses are equal; give different ones");
            }
            Self::Mask(b) if property != Property::Opacity => {
                return b.bsdf.undifferentiated(property);
            }
            Self::Mask(b) if has_transmittance(&b.bsdf) => {
                return Some("it shares its place with what the surface itself lets through");
            }
            Self::Dielectric(_) if property == Property::Eta => {
                return Some("it turns light that goes through");
            }
            Self::Mask(_) => {}
            _ => return None,
        }
        let plain = &mut plain.clone();
        // The values of a property are between these.
        let mut ends = |p: Property| match textures.and_then(|t| t.texture(p)) {
            Some(texture) => texture.bounds(),
            None => [plain.property(p).map_or(Rgb::ZERO, |slot| slot.value()); 2],
        };
        let mut never = |p: Property| ends(p)[1].max_abs() <= 0.0;
        let no_light_through = never(Property::SpecTrans);
        let tinted =
            !never(Property::SpecTint) || (!never(Property::Sheen) && !never(Property::SheenTint));
        let [least, most] = ends(property);
        let least = least.to_array().into_iter().fold(f64::INFINITY, f64::min);
        let thin = self.name() == "principledthin";
        match property {
            _ if BsdfParams::entry(property).is_none() => Some("no path has its derivative"),
            Property::BaseColor if tinted => Some("a tint mixes its channels"),
            Property::BaseColor if !thin && !no_light_through && least <= 0.0 => {
                Some("light goes through by its root, which has no slope at 0")
            }
            Property::Opacity if least <= 0.0 || most.max_abs() >= 1.0 => {
                Some("at 0 and 1 no path goes where light would")
            }
            Property::SpecTrans | Property::DiffTrans if least <= 0.0 => {
                Some("at 0 no path goes where light would")
            }
            Property::DiffTrans if most.max_abs() >= 2.0 => {
                Some("at 2 no path goes where light would")
            }
            Property::Metallic if !no_light_through && most.max_abs() >= 1.0 => {
                Some("at 1 no path goes where light would")
            }
            _ => None,
        }
    }

    /// Sets a property, to a value that may not be allowed; a scalar's to the first channel.
    ///
    /// # Errors
    /// When the BSDF has no such property.
    pub(super) fn set(&mut self, property: Property, value: Rgb) -> Result<(), SurfaceError> {
        match self.property(property) {
            Some(slot) => slot.set(value),
            None => return Err(self.lacks(property)),
        }
        Ok(())
    }

    pub(super) fn property(&mut self, property: Property) -> Option<Slot<'_>> {
        match self {
            Self::Null | Self::Measured(_) => None,
            Self::Diffuse(b) => b.slot(property),
            Self::Phong(b) => b.slot(property),
            Self::RoughConductor(b) => b.slot(property),
            Self::RoughDielectric(b) => b.slot(property),
            Self::Plastic(b) => b.slot(property),
            Self::Conductor(b) => b.slot(property),
            Self::Dielectric(b) => b.slot(property),
            Self::ThinDielectric(b) => b.slot(property),
            // Inside of another one; by itself it is refused with a message of its own.
            Self::TwoSided(b) if b.back.is_some() => None,
            Self::TwoSided(b) => b.front.property(property),
            Self::Coated(b) => b.slot(property),
            Self::Textured(b) => b.bsdf.property(property),
            Self::Mask(b) => b.slot(property),
            Self::Blend(b) => b.slot(property),
            Self::Perturbed(b) => b.bsdf.property(property),
            Self::Anisotropic(b) => b.slot(property),
            Self::Principled(b) => b.slot(property),
            Self::PrincipledThin(b) => b.slot(property),
            Self::RoughDiffuse(b) => b.slot(property),
            Self::Ward(b) => b.slot(property),
        }
    }

    /// The texture that stands for a property.
    pub(crate) fn texture(&self, property: Property) -> Option<&Texture> {
        match self {
            Self::Textured(b) => b.texture(property),
            Self::TwoSided(b) => b.front.texture(property),
            Self::Mask(b) => b.bsdf.texture(property),
            Self::Coated(b) => b.texture(property),
            Self::Perturbed(b) => b.bsdf.texture(property),
            _ => None,
        }
    }

    /// True for a property that is a single number; `None` where the BSDF lacks it.
    #[must_use]
    pub fn is_number(&self, property: Property) -> Option<bool> {
        self.clone().property(property).map(|slot| matches!(slot, Slot::Scalar(_)))
    }

    fn lacks(&mut self, property: Property) -> SurfaceError {
        let mut available =
            names(Property::ALL.into_iter().filter(|&p| self.property(p).is_some()));
        if available.is_empty() {
            available.push_str("nothing that can change");
        }
        SurfaceError::NoSuchProperty { bsdf: self.name(), property, available }
    }

    fn slot(&mut self, change: &BsdfChange) -> Result<Slot<'_>, SurfaceError> {
        let property = change.property;
        if matches!(self, Self::TwoSided(b) if b.back.is_some()) {
            return Err(SurfaceError::DifferentSides { property });
        }
        if self.texture(property).is_some() {
            return Err(SurfaceError::StoodFor { property });
        }
        let lacks = self.lacks(property);
        let slot = self.property(property).ok_or(lacks)?;
        match (&slot, change.op) {
            (Slot::Scalar(_), ValueChange::Add(a)) if !change.op.is_scalar() => {
                Err(SurfaceError::NotUniform { property, r: a.r, g: a.g, b: a.b })
            }
            _ => Ok(slot),
        }
    }
}
