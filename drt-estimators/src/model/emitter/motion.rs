//! Emitters that move, and whose numbers change.

use alloc::sync::Arc;

use drt_math::{Affine, Rgb, Vec3, vec3};

use crate::model::emitter::{Emitter, EmitterError, EmitterTangent, slide};

/// What a property name stands for.
enum Slot {
    Strength,
    CutoffAngle,
    BeamWidth,
}

impl Emitter {
    /// The emitter moved by a map of space: positions go along, directions are mapped as vectors
    /// and made unit again; an environment of an image turns. An area emitter moves with its shape and a constant environment not at all.
    ///
    /// # Errors
    /// When the map takes a direction to zero or is not finite.
    pub fn moved(&self, map: &Affine) -> Result<Self, EmitterError> {
        let mut moved = self.clone();
        match &mut moved {
            Self::Area { .. } | Self::TexturedArea { .. } | Self::Constant { .. } => {}
            Self::Envmap { map: sky, .. } => {
                *sky = Arc::new(sky.turned(&map.linear).ok_or(EmitterError::OnlyTurns)?);
            }
            Self::Point { position, .. } => *position = map.point(*position),
            Self::Spot { position, direction, .. } => {
                *position = map.point(*position);
                *direction = map.vector(*direction);
            }
            Self::Projector { position, frame, .. } => {
                *position = map.point(*position);
                frame.cols = frame.cols.map(|axis| map.vector(axis));
            }
            Self::Directional { direction, .. } => *direction = map.vector(*direction),
        }
        moved.checked().map_err(|error| match error {
            EmitterError::ZeroDirection(kind) => EmitterError::Flattened(kind),
            other => other,
        })
    }

    /// The rates of an emitter carried by a velocity field: the derivative of
    /// [`moved`](Self::moved) at the identity.
    #[must_use]
    pub fn velocity(&self, field: &Affine) -> EmitterTangent {
        let mut tangent = EmitterTangent::default();
        if let Some(position) = self.position() {
            tangent.position = field.point(position);
        }
        if let Self::Spot { direction, .. } | Self::Directional { direction, .. } = *self {
            tangent.direction = field.vector(direction).reject(direction);
        }
        if let Self::Projector { frame, .. } = self {
            tangent.direction = slide::spin(frame, field);
        }
        if matches!(self, Self::Envmap { .. }) {
            let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|e| field.linear * e);
            tangent.rotation = vec3(y.z - z.y, z.x - x.z, x.y - y.x) * 0.5;
        }
        tangent
    }

    /// A property that a parameter can change. Names and units are the scene file's: `radiance`,
    /// `intensity` or `irradiance`, and of a spot `cutoff_angle` and `beam_width` (degrees, three
    /// equal numbers).
    ///
    /// # Errors
    /// When this kind of emitter has no such property.
    pub fn property(&self, name: &str) -> Result<Rgb, EmitterError> {
        let degrees = |a: f64| Rgb::splat(a.to_degrees());
        Ok(match (self.slot(name)?, self) {
            (Slot::CutoffAngle, Self::Spot { cutoff_angle, .. }) => degrees(*cutoff_angle),
            (Slot::BeamWidth, Self::Spot { beam_width, .. }) => degrees(*beam_width),
            _ => self.strength(),
        })
    }

    /// The emitter with a property changed.
    ///
    /// # Errors
    /// When there is no such property, or the value is unusable.
    pub fn with_property(&self, name: &str, value: Rgb) -> Result<Self, EmitterError> {
        let slot = self.slot(name)?;
        let mut changed = self.clone();
        match (slot, &mut changed) {
            (Slot::CutoffAngle, Self::Spot { cutoff_angle, .. }) => {
                *cutoff_angle = radians("cutoff_angle", value)?;
            }
            (Slot::BeamWidth, Self::Spot { beam_width, .. }) => {
                *beam_width = radians("beam_width", value)?;
            }
            (
                _,
                Self::Area { radiance }
                | Self::TexturedArea { radiance, .. }
                | Self::Constant { radiance }
                | Self::Envmap { radiance, .. },
            ) => *radiance = value,
            (_, Self::Point { intensity, .. } | Self::Spot { intensity, .. }) => *intensity = value,
            (_, Self::Projector { strength, .. }) => *strength = value,
            (_, Self::Directional { irradiance, .. }) => *irradiance = value,
        }
        changed.checked()
    }

    /// The rates of the emitter when a property has the given rate.
    ///
    /// # Errors
    /// When there is no such property, or the rates of a single number differ.
    pub fn property_tangent(&self, name: &str, rate: Rgb) -> Result<EmitterTangent, EmitterError> {
        let mut tangent = EmitterTangent::default();
        match self.slot(name)? {
            Slot::Strength => tangent.strength = rate,
            Slot::CutoffAngle => tangent.cutoff_angle = radians("cutoff_angle", rate)?,
            Slot::BeamWidth => tangent.beam_width = radians("beam_width", rate)?,
        }
        Ok(tangent)
    }

    fn slot(&self, name: &str) -> Result<Slot, EmitterError> {
        let spot = matches!(self, Self::Spot { .. });
        match name {
            _ if name == self.strength_name() => Ok(Slot::Strength),
            "cutoff_angle" if spot => Ok(Slot::CutoffAngle),
            "beam_width" if spot => Ok(Slot::BeamWidth),
            _ => Err(EmitterError::UnknownProperty {
                kind: self.kind(),
                property: name.into(),
                known: if spot {
                    "intensity, cutoff_angle and beam_width"
                } else {
                    self.strength_name()
                },
            }),
        }
    }
}

/// An angle given in degrees, three times.
fn radians(name: &'static str, value: Rgb) -> Result<f64, EmitterError> {
    if value == Rgb::splat(value.r) {
        Ok(value.r.to_radians())
    } else {
        Err(EmitterError::NotScalar(name))
    }
}
