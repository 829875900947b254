use drt_math::{Rgb, ValueChange};

use crate::model::surface::Bsdf;
use crate::model::surface::bsdf::each;
use crate::model::surface::model::Model;
use crate::model::surface::params::{BsdfTangent, PropertySet};
use crate::model::surface::property::{Property, Slot, SurfaceError, names};
use crate::model::surface::textures::Textures;
use crate::model::texture::Texture;

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
/// assert_eq!(velocity.get(Property::Reflectance), Rgb::new(1.0, 0.0, 0.0));
/// assert_eq!(wall, Bsdf::Diffuse(Diffuse { reflectance: Rgb::new(0.5, 0.4, 0.4) }));
/// # Ok::<(), drt_estimators::surface::SurfaceError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfChange {
    /// The property that changes.
    pub property: Property,
    /// How the property depends on the parameter theta.
    pub op: ValueChange,
}

impl BsdfChange {
    /// Carries a velocity that an earlier effect gave the BSDF through this later change.
    pub fn carry(&self, velocity: &mut BsdfTangent, theta: f64) {
        let value = velocity.get(self.property) * self.op.map(theta).factor;
        if velocity.properties().contains(self.property) {
            velocity.set(self.property, value);
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
        let mut velocity = BsdfTangent::zeros(self.differentiated());
        let value = base.slot(change)?.value();
        if velocity.properties().contains(change.property) {
            velocity.set(change.property, change.op.map_rate(theta).value(value));
        }
        Ok(velocity)
    }

    /// The properties that its value is differentiated by.
    #[must_use]
    pub fn differentiated(&self) -> PropertySet {
        each!(self, b => b.differentiated())
    }

    /// Why there are only finite differences with respect to a property of it, if that is so.
    #[must_use]
    pub fn undifferentiated(&self, property: Property) -> Option<&'static str> {
        self.undifferentiated_with(property, Textures::NONE)
    }

    /// Why there are only finite differences, where `textures` stand for some of the values.
    pub(in crate::model::surface) fn undifferentiated_with(
        &self,
        property: Property,
        textures: Textures<'_>,
    ) -> Option<&'static str> {
        each!(self, b => b.undifferentiated(property, textures)).or_else(|| {
            let lost = !self.differentiated().contains(property);
            (lost && self.is_number(property).is_some()).then_some("no path has its derivative")
        })
    }

    /// Sets a property, to a value that may not be allowed; a scalar's to the first channel.
    ///
    /// # Errors
    /// When the BSDF has no such property.
    pub(in crate::model::surface) fn set(
        &mut self,
        property: Property,
        value: Rgb,
    ) -> Result<(), SurfaceError> {
        match self.property(property) {
            Some(slot) => slot.set(value),
            None => return Err(self.lacks(property.name())),
        }
        Ok(())
    }

    /// Where it keeps a property.
    pub(in crate::model::surface) fn property(&mut self, property: Property) -> Option<Slot<'_>> {
        each!(self, b => b.slot(property))
    }

    /// The texture that stands for a property.
    pub(crate) fn texture(&self, property: Property) -> Option<&Texture> {
        each!(self, b => b.texture(property))
    }

    /// True for a property that is a single number; `None` where the BSDF lacks it.
    #[must_use]
    pub fn is_number(&self, property: Property) -> Option<bool> {
        self.clone().property(property).map(|slot| matches!(slot, Slot::Scalar(_)))
    }

    /// The property of a name that a change of this BSDF gives.
    ///
    /// # Errors
    /// [`SurfaceError::NoSuchProperty`] where no BSDF has one of this name, with the names of those that this one has.
    pub fn named_property(&self, name: &str) -> Result<Property, SurfaceError> {
        Property::from_name(name).map_err(|_| self.clone().lacks(name))
    }

    fn lacks(&mut self, property: &str) -> SurfaceError {
        let mut available =
            names(Property::ALL.into_iter().filter(|&p| self.property(p).is_some()));
        if available.is_empty() {
            available.push_str("nothing that can change");
        }
        SurfaceError::NoSuchProperty { bsdf: self.name(), property: property.into(), available }
    }

    fn slot(&mut self, change: &BsdfChange) -> Result<Slot<'_>, SurfaceError> {
        let property = change.property;
        if matches!(self, Self::TwoSided(b) if b.back.is_some()) {
            return Err(SurfaceError::DifferentSides { property });
        }
        if self.texture(property).is_some() {
            return Err(SurfaceError::StoodFor { property });
        }
        let lacks = self.lacks(property.name());
        let slot = self.property(property).ok_or(lacks)?;
        match (&slot, change.op) {
            (Slot::Scalar(_), ValueChange::Add(a)) if !change.op.is_scalar() => {
                Err(SurfaceError::NotUniform { property, r: a.r, g: a.g, b: a.b })
            }
            _ => Ok(slot),
        }
    }
}
