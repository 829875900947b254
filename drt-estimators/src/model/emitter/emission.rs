use drt_math::{Rgb, RgbVec, Vec3, fm};

use crate::model::emitter::Emitter;
use crate::model::gradient::dual_vectors;

/// What an emitter sends in a direction, and how it changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    /// Radiance, intensity times falloff, or irradiance.
    pub value: Rgb,
    /// The same without the falloff.
    strength: Rgb,
    falloff: Falloff,
    picture: Option<Picture>,
}

/// The light of a projector per strength, with its gradient by the flow.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Picture {
    value: Rgb,
    slope: RgbVec,
    flow: Vec3,
}

/// The fall of a spot light off its axis, with its derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Falloff {
    pub(super) value: f64,
    /// Perpendicular to the flow.
    pub(super) flow: Vec3,
    direction: Vec3,
    cutoff_angle: f64,
    beam_width: f64,
}

/// Rates of change of an emitter with a parameter. Of a direction's rate only the part
/// perpendicular to it counts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EmitterTangent {
    /// Rate of the radiance, intensity or irradiance.
    pub strength: Rgb,
    /// Velocity of a point or spot light.
    pub position: Vec3,
    /// Rate of the unit direction of a spot or directional light; of a projector its angular velocity, in radians.
    pub direction: Vec3,
    /// Rate of a spot's cutoff angle, in radians.
    pub cutoff_angle: f64,
    /// Rate of a spot's beam width, in radians.
    pub beam_width: f64,
    /// Angular velocity of surroundings that an image tells, in radians.
    pub rotation: Vec3,
}

/// Derivatives of a number with respect to what an [`EmitterTangent`] holds the rates of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EmitterGradient {
    /// With respect to the radiance, intensity or irradiance.
    pub strength: Rgb,
    /// With respect to the position.
    pub position: Vec3,
    /// With respect to the unit direction, perpendicular to it; of a projector to its turn about each axis of space.
    pub direction: Vec3,
    /// With respect to the cutoff angle.
    pub cutoff_angle: f64,
    /// With respect to the beam width.
    pub beam_width: f64,
    /// With respect to a rotation of surroundings, by its vector in radians.
    pub rotation: Vec3,
}

impl Emitter {
    /// Emission towards a unit direction of flow: radiance of an area or constant emitter,
    /// intensity of a point or spot light, irradiance of a directional one (whose flow is its own
    /// and is not looked at).
    #[inline]
    #[must_use]
    pub fn emission(&self, flow: Vec3) -> Emission {
        let strength = self.strength();
        let falloff = match *self {
            Self::Spot { direction, cutoff_angle, beam_width, .. } => {
                Falloff::new(direction, flow, cutoff_angle, beam_width)
            }
            Self::Projector { frame, ref slide, .. } => {
                let (value, slope) = slide.towards(frame.transpose_mul(flow));
                let picture = Picture { value, slope: slope.map(|s| frame * s), flow };
                let falloff = Falloff::default();
                let value = strength * value;
                return Emission { value, strength, falloff, picture: Some(picture) };
            }
            _ => Falloff { value: 1.0, ..Falloff::default() },
        };
        Emission { value: strength * falloff.value, strength, falloff, picture: None }
    }
}

impl Falloff {
    pub(super) fn new(axis: Vec3, flow: Vec3, cutoff_angle: f64, beam_width: f64) -> Self {
        let theta = angle(axis, flow);
        if theta <= beam_width {
            return Self { value: 1.0, ..Self::default() };
        }
        if theta >= cutoff_angle {
            return Self::default();
        }
        let per_angle = 1.0 / (cutoff_angle - beam_width);
        let value = (cutoff_angle - theta) * per_angle;
        Self {
            value,
            // Towards the axis along the great circle, and the axis towards the flow.
            flow: along_circle(flow, axis) * per_angle,
            direction: along_circle(axis, flow) * per_angle,
            cutoff_angle: (1.0 - value) * per_angle,
            beam_width: value * per_angle,
        }
    }
}

impl Emission {
    /// Rate of [`value`](Self::value) while the flow turns and the emitter changes.
    #[inline]
    #[must_use]
    pub fn rate(&self, flow_rate: Vec3, t: &EmitterTangent) -> Rgb {
        let f = &self.falloff;
        let falloff_rate = f.flow.dot(flow_rate)
            + f.direction.dot(t.direction)
            + f.cutoff_angle * t.cutoff_angle
            + f.beam_width * t.beam_width;
        let rate = t.strength * f.value + self.strength * falloff_rate;
        match &self.picture {
            None => rate,
            Some(p) => {
                let turned = flow_rate - t.direction.cross(p.flow);
                t.strength * p.value + self.strength * p.slope.dot(turned)
            }
        }
    }

    /// Gradient of `adjoint · value`, first with respect to the flow (perpendicular to it), then
    /// to the emitter.
    #[inline]
    #[must_use]
    pub fn gradient(&self, adjoint: Rgb) -> (Vec3, EmitterGradient) {
        let f = &self.falloff;
        let weight = self.strength.dot(adjoint);
        let emitter = EmitterGradient {
            strength: adjoint * f.value,
            position: Vec3::ZERO,
            direction: f.direction * weight,
            cutoff_angle: f.cutoff_angle * weight,
            beam_width: f.beam_width * weight,
            rotation: Vec3::ZERO,
        };
        match &self.picture {
            None => (f.flow * weight, emitter),
            Some(p) => {
                let slope = p.slope.weighted(self.strength * adjoint).reject(p.flow);
                let strength = adjoint * p.value;
                let direction = slope.cross(p.flow);
                (slope, EmitterGradient { strength, direction, ..EmitterGradient::default() })
            }
        }
    }
}

impl EmitterTangent {
    /// True when the emitter's place or direction changes.
    #[must_use]
    pub fn moves(&self) -> bool {
        self.position != Vec3::ZERO || self.direction != Vec3::ZERO
    }
}

dual_vectors!(
    EmitterGradient,
    EmitterTangent { strength, position, direction, cutoff_angle, beam_width, rotation }
);

/// Angle between unit vectors, exact for small angles too.
fn angle(a: Vec3, b: Vec3) -> f64 {
    fm::atan2(a.cross(b).length(), a.dot(b))
}

/// The unit vector at `from`, perpendicular to it, that starts the great circle to `to`; zero
/// where there is none.
fn along_circle(from: Vec3, to: Vec3) -> Vec3 {
    let v = to.reject(from);
    let length = v.length();
    if length > 0.0 { v * length.recip() } else { Vec3::ZERO }
}
