//! Emitters, with Mitsuba's meaning, units and defaults.
//!
//! Directions of emission are directions of light *flow*. Delta emitters (point, spot and
//! directional) keep apart what the path integral keeps apart: the emission towards a direction,
//! and the 1/r² of the geometric term.

mod emission;
mod environment;
mod incident;
mod motion;
mod slide;
#[cfg(test)]
mod tests;

use alloc::sync::Arc;
use alloc::vec::Vec;
use core::f64::consts::PI;

use drt_math::{Frame, Mat3, Rgb, ValueChange, Vec3, fm, vec3, warp};
use thiserror::Error;

pub use crate::model::emitter::emission::{Emission, EmitterGradient, EmitterTangent};
pub use crate::model::emitter::environment::EnvironmentMap;
pub use crate::model::emitter::incident::Incident;
pub use crate::model::emitter::slide::Slide;
use crate::model::texture::{Footprint, TexelChange, TexelError, TexelTangent, Texture};

/// An emitter that cannot be used.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum EmitterError {
    /// A direction that is zero.
    #[error("the {0} emitter's direction is the zero vector; give a direction, of any length")]
    ZeroDirection(&'static str),
    /// A NaN or infinity.
    #[error("the {kind} emitter's {what} is not finite")]
    NotFinite {
        /// Kind of the emitter.
        kind: &'static str,
        /// The offending field.
        what: &'static str,
    },
    /// Emission below zero.
    #[error("the {kind} emitter's {what} has a channel of {value}; it must not be negative")]
    Negative {
        /// Kind of the emitter.
        kind: &'static str,
        /// The offending field.
        what: &'static str,
        /// The channel's value.
        value: f64,
    },
    /// Angles that are not those of a cone.
    #[error(
        "the spot emitter's cutoff_angle is {cutoff_angle} and its beam_width {beam_width} \
         degrees; expected 0 <= beam_width <= cutoff_angle <= 180 and cutoff_angle > 0"
    )]
    Cone {
        /// Cutoff angle in degrees.
        cutoff_angle: f64,
        /// Beam width in degrees.
        beam_width: f64,
    },
    /// A motion that flattens the emitter.
    #[error("the motion takes the {0} emitter's direction to zero; choose a value nearer to zero")]
    Flattened(&'static str),
    /// A motion of an environment that is not a rotation.
    #[error("surroundings are infinitely far away: they can be turned (`rotate`), nothing else")]
    OnlyTurns,
    /// A property that this kind of emitter does not have.
    #[error("a {kind} emitter has no property `{property}`; it has {known}")]
    UnknownProperty {
        /// Kind of the emitter.
        kind: &'static str,
        /// The name asked for.
        property: alloc::string::String,
        /// Names that exist.
        known: &'static str,
    },
    /// Different numbers for the channels of a property that is a single number.
    #[error("`{0}` is a single number; give three equal ones")]
    NotScalar(&'static str),
}

/// An emitter. [`checked`](Self::checked) makes directions unit vectors; all other methods
/// rely on that.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Emitter {
    /// A shape that emits on its front side.
    Area {
        /// Radiance, equal in all directions.
        radiance: Rgb,
    },
    /// A shape that emits on its front side, with a texture of radiance.
    TexturedArea {
        /// Factor of the texture.
        radiance: Rgb,
        /// Radiance by texture coordinates, equal in all directions.
        texture: Texture,
    },
    /// A point that emits equally in all directions.
    Point {
        /// Its position.
        position: Vec3,
        /// Power per steradian.
        intensity: Rgb,
    },
    /// A point that emits into a cone.
    Spot {
        /// Its position.
        position: Vec3,
        /// The cone's axis.
        direction: Vec3,
        /// Power per steradian inside the inner cone.
        intensity: Rgb,
        /// Angle from the axis at which the intensity becomes zero, in radians.
        cutoff_angle: f64,
        /// Angle from the axis up to which the intensity is full (the inner cone), in radians; between the two angles
        /// it falls linearly with the angle.
        beam_width: f64,
    },
    /// A point that projects a picture: Mitsuba's `projector`, and its `spot` with a texture.
    Projector {
        /// Its position.
        position: Vec3,
        /// Its axes, which light leaves along the last of; they may be mirrored.
        frame: Mat3,
        /// Factor of the picture.
        strength: Rgb,
        /// The picture.
        slide: Arc<Slide>,
    },
    /// Parallel light from infinitely far away.
    Directional {
        /// Direction of flow.
        direction: Vec3,
        /// Power per area perpendicular to the flow.
        irradiance: Rgb,
    },
    /// An environment of constant radiance.
    Constant {
        /// The radiance.
        radiance: Rgb,
    },
    /// An environment whose radiance is an image (environment map).
    Envmap {
        /// Factor of the image.
        radiance: Rgb,
        /// The image.
        map: Arc<EnvironmentMap>,
    },
}

/// A direction of flow sampled from a point or spot light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowSample {
    /// Unit vector.
    pub flow: Vec3,
    /// Density per steradian.
    pub pdf: f64,
}

impl Emitter {
    /// Mitsuba's default cutoff angle of a spot, 20 degrees, in radians.
    pub const DEFAULT_CUTOFF_ANGLE: f64 = PI / 9.0;
    /// Mitsuba's default beam width of a spot, as a fraction of the cutoff angle.
    pub const DEFAULT_BEAM_FRACTION: f64 = 0.75;

    /// Checks an emitter of a scene. Changes of a parameter may push its light below zero later: a
    /// central difference around a light that is off does.
    ///
    /// # Errors
    /// As [`checked`](Self::checked), and names light that is negative.
    pub fn validate(&self) -> Result<(), EmitterError> {
        self.checked()?;
        let (kind, what) = (self.kind(), self.strength_name());
        let mut light = self.strength().to_array().to_vec();
        if let Self::TexturedArea { texture, .. } = self {
            light.extend(texture.bounds().iter().flat_map(|c| c.to_array()));
        }
        if let Self::Projector { slide, .. } = self {
            light.extend(slide.darkest().map(Rgb::to_array).into_iter().flatten());
        }
        match light.into_iter().find(|v| *v < 0.0) {
            Some(value) => Err(EmitterError::Negative { kind, what, value }),
            None => Ok(()),
        }
    }

    /// This emitter with unit directions.
    ///
    /// # Errors
    /// Names the field that is not finite, a zero direction, or a cone that is none.
    pub fn checked(&self) -> Result<Self, EmitterError> {
        let kind = self.kind();
        let finite =
            |ok: bool, what| if ok { Ok(()) } else { Err(EmitterError::NotFinite { kind, what }) };
        let unit = |v: Vec3| {
            finite(v.is_finite(), "direction")?;
            let size = v.max_abs();
            // Scaled by the largest coordinate first, so that no length under- or overflows.
            let v = v * (1.0 / size);
            if v.is_finite() { Ok(v.normalize()) } else { Err(EmitterError::ZeroDirection(kind)) }
        };
        finite(self.strength().is_finite(), self.strength_name())?;
        match *self {
            Self::Area { .. }
            | Self::TexturedArea { .. }
            | Self::Constant { .. }
            | Self::Envmap { .. } => Ok(self.clone()),
            Self::Point { position, .. } => {
                finite(position.is_finite(), "position").map(|()| self.clone())
            }
            Self::Spot { position, direction, intensity, cutoff_angle, beam_width } => {
                finite(position.is_finite(), "position")?;
                let direction = unit(direction)?;
                let cone = 0.0 <= beam_width && beam_width <= cutoff_angle;
                if !(cone && 0.0 < cutoff_angle && cutoff_angle <= PI) {
                    let [cutoff_angle, beam_width] =
                        [cutoff_angle, beam_width].map(f64::to_degrees);
                    return Err(EmitterError::Cone { cutoff_angle, beam_width });
                }
                Ok(Self::Spot { position, direction, intensity, cutoff_angle, beam_width })
            }
            Self::Projector { position, frame, strength, ref slide } => {
                finite(position.is_finite(), "position")?;
                finite(frame.cols.iter().all(|c| c.is_finite()), "frame")?;
                let frame = slide::orthonormal(&frame).ok_or(EmitterError::ZeroDirection(kind))?;
                Ok(Self::Projector { position, frame, strength, slide: Arc::clone(slide) })
            }
            Self::Directional { direction, irradiance } => {
                Ok(Self::Directional { direction: unit(direction)?, irradiance })
            }
        }
    }

    /// The plugin's name in scene files.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Area { .. } | Self::TexturedArea { .. } => "area",
            Self::Point { .. } => "point",
            Self::Spot { .. } => "spot",
            Self::Projector { slide, .. } if slide.is_spot() => "spot",
            Self::Projector { .. } => "projector",
            Self::Directional { .. } => "directional",
            Self::Constant { .. } => "constant",
            Self::Envmap { .. } => "envmap",
        }
    }

    /// True for point, spot and directional emitters (delta lights), which no ray can hit.
    #[must_use]
    pub fn is_delta(&self) -> bool {
        !(self.is_area() || self.is_environment())
    }

    /// False for a spot or projector whose light ends with a jump, or jumps inside: its rims need a boundary integral.
    #[must_use]
    pub fn is_continuous(&self) -> bool {
        match self {
            Self::Spot { cutoff_angle, beam_width, .. } => cutoff_angle != beam_width,
            Self::Projector { slide, .. } => slide.is_continuous(),
            _ => true,
        }
    }

    /// The position of an emitter that is a point.
    #[inline]
    #[must_use]
    pub fn position(&self) -> Option<Vec3> {
        match *self {
            Self::Point { position, .. }
            | Self::Spot { position, .. }
            | Self::Projector { position, .. } => Some(position),
            _ => None,
        }
    }

    /// True for a shape that emits.
    #[must_use]
    pub fn is_area(&self) -> bool {
        matches!(self, Self::Area { .. } | Self::TexturedArea { .. })
    }

    /// Columns and rows of the image of its emission, if there is one.
    #[must_use]
    pub fn texels(&self) -> Option<[u32; 2]> {
        match self {
            Self::TexturedArea { texture, .. } => Some(texture.size()).filter(|s| *s != [0; 2]),
            Self::Envmap { map, .. } => Some(map.size()),
            Self::Projector { slide, .. } => slide.texels(),
            _ => None,
        }
    }

    /// The texels of the image that tells its light, row by row and as they are stored; `None` where none does.
    #[must_use]
    pub fn texel_values(&self) -> Option<Vec<Rgb>> {
        self.texels()?;
        match self {
            Self::TexturedArea { texture, .. } => Some(texture.texels()),
            Self::Envmap { map, .. } => Some(map.texels()),
            Self::Projector { slide, .. } => slide.texture().map(Texture::texels),
            _ => None,
        }
    }

    /// This emitter with other texels of the image that tells its light, row by row.
    ///
    /// # Errors
    /// When no image does, there are more or fewer texels, or one is negative or not finite.
    pub fn with_texel_values(&self, values: &[Rgb]) -> Result<Self, TexelError> {
        let mut with = self.clone();
        match &mut with {
            Self::TexturedArea { texture, .. } => texture.set_texels(values)?,
            Self::Envmap { map, .. } => Arc::make_mut(map).set_texels(values)?,
            Self::Projector { slide, .. } => Arc::make_mut(slide).set_texels(values)?,
            _ => return Err(TexelError::NoTexture(self.strength_name().into())),
        }
        with.validate().map_err(|_| TexelError::NotFinite)?;
        Ok(with)
    }

    /// Makes a change of the texels of the image that tells its light.
    pub(crate) fn change_texels(
        &mut self,
        texel: Option<[usize; 2]>,
        op: ValueChange,
        theta: f64,
    ) -> Result<(TexelChange, TexelTangent), TexelError> {
        let Some(size) = self.texels() else {
            return Err(TexelError::NoTexture(self.strength_name().into()));
        };
        let change = TexelChange::new(size, texel, op, theta)?;
        let rates = match self {
            Self::TexturedArea { texture, .. } => texture.change(&change)?,
            Self::Envmap { map, .. } => Arc::make_mut(map).change(&change)?,
            Self::Projector { slide, .. } => Arc::make_mut(slide).change(&change)?,
            _ => TexelTangent::default(),
        };
        Ok((change, rates))
    }

    /// The texels of a spot or projector whose light goes along a unit direction, and the intensity of what they hold.
    pub(crate) fn footprint(&self, flow: Vec3) -> Option<(Footprint, Rgb)> {
        let Self::Projector { ref slide, ref frame, strength, .. } = *self else { return None };
        let (footprint, factor) = slide.footprint(frame.transpose_mul(flow))?;
        Some((footprint, strength * factor))
    }

    /// The radiance of an area emitter, the mean of a texture's.
    #[inline]
    #[must_use]
    pub fn area_radiance(&self) -> Option<Rgb> {
        match *self {
            Self::Area { radiance } => Some(radiance),
            Self::TexturedArea { radiance, ref texture } => Some(radiance * texture.mean()),
            _ => None,
        }
    }

    /// Power sent into a scene inside a sphere of `scene_radius`, mean of the channels (of an image's factor and its
    /// mean apart): what emitters are chosen by. That of an area emitter is per unit of area.
    #[must_use]
    pub fn power(&self, scene_radius: f64) -> f64 {
        let disk = PI * scene_radius * scene_radius;
        let factor = match self {
            Self::Area { .. } => PI,
            Self::TexturedArea { texture, .. } => PI * texture.mean().mean(),
            Self::Point { .. } => 4.0 * PI,
            Self::Spot { cutoff_angle, beam_width, .. } => {
                2.0 * PI * cone_mean(*beam_width, *cutoff_angle)
            }
            Self::Projector { slide, .. } => slide.power(),
            Self::Directional { .. } => disk,
            Self::Constant { .. } => 4.0 * PI * disk,
            Self::Envmap { map, .. } => map.power() * disk,
        };
        self.strength().mean() * factor
    }

    /// Draws a direction of flow from two uniform numbers, uniformly over those that a point or
    /// spot light shines in, or evenly over a projector's picture; `None` for other emitters.
    #[must_use]
    pub fn sample_flow(&self, u: [f64; 2]) -> Option<FlowSample> {
        let flow = match *self {
            Self::Point { .. } => warp::uniform_sphere(u),
            Self::Spot { direction, cutoff_angle, .. } => {
                let local = warp::uniform_cone(u, fm::cos(cutoff_angle));
                Frame::from_normal(direction).to_world(local)
            }
            Self::Projector { frame, ref slide, .. } => frame * slide.sample(u),
            _ => return None,
        };
        Some(FlowSample { flow, pdf: self.flow_pdf(flow) })
    }

    /// Density of [`sample_flow`](Self::sample_flow) per steradian.
    #[must_use]
    pub fn flow_pdf(&self, flow: Vec3) -> f64 {
        match *self {
            Self::Point { .. } => warp::uniform_sphere_pdf(),
            Self::Spot { direction, cutoff_angle, .. } => {
                let height = vec3(0.0, 0.0, direction.dot(flow));
                warp::uniform_cone_pdf(height, fm::cos(cutoff_angle))
            }
            Self::Projector { frame, ref slide, .. } => slide.pdf(frame.transpose_mul(flow)),
            _ => 0.0,
        }
    }

    /// Radiance, intensity or irradiance.
    #[inline]
    #[must_use]
    pub fn strength(&self) -> Rgb {
        match *self {
            Self::Area { radiance }
            | Self::TexturedArea { radiance, .. }
            | Self::Constant { radiance }
            | Self::Envmap { radiance, .. } => radiance,
            Self::Point { intensity, .. } | Self::Spot { intensity, .. } => intensity,
            Self::Projector { strength, .. } => strength,
            Self::Directional { irradiance, .. } => irradiance,
        }
    }

    /// True for surroundings, which are infinitely far away in all directions.
    #[must_use]
    pub fn is_environment(&self) -> bool {
        matches!(self, Self::Constant { .. } | Self::Envmap { .. })
    }

    fn strength_name(&self) -> &'static str {
        match self {
            Self::Area { .. }
            | Self::TexturedArea { .. }
            | Self::Constant { .. }
            | Self::Envmap { .. } => "radiance",
            Self::Point { .. } | Self::Spot { .. } => "intensity",
            Self::Projector { slide, .. } if slide.is_spot() => "intensity",
            Self::Directional { .. } | Self::Projector { .. } => "irradiance",
        }
    }
}

/// Integral over the sphere, over 2 pi, of a spot's falloff from full at the angle b to none at c:
/// 1 - (sin c - sin b)/(c - b), in terms that do not cancel for narrow cones.
fn cone_mean(b: f64, c: f64) -> f64 {
    let half = 0.5 * (c - b);
    let squared = half * half;
    // (sin c - sin b)/(c - b) is cos((b + c)/2) sin(half)/half.
    let lack = if half < 1e-2 {
        squared / 6.0 * (1.0 - squared / 20.0 * (1.0 - squared / 42.0))
    } else {
        1.0 - fm::sin(half) / half
    };
    let h = fm::sin(0.25 * (b + c));
    2.0 * h * h * (1.0 - lack) + lack
}
