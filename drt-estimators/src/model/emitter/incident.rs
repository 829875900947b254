use drt_math::{Rgb, Vec3};

use crate::model::emitter::{Emission, Emitter, EmitterGradient, EmitterTangent};

/// What a delta emitter sends to a point, visibility and transmittance apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Incident {
    /// Unit vector from the point towards the light; the flow is its opposite.
    pub w: Vec3,
    /// Distance of the light; infinite for a directional one.
    pub distance: f64,
    /// Irradiance on a plane across the flow: I(flow)/r², or E.
    pub value: Rgb,
    /// I(flow) or E alone: the factor besides the geometric term's 1/r².
    pub emission: Emission,
    /// 1/r², or 1 for directional light.
    pub inverse_square: f64,
}

impl Emitter {
    /// The light that a delta emitter sends to the point x; `None` for other emitters, and at the
    /// very position of a light.
    #[inline]
    #[must_use]
    pub fn incident(&self, x: Vec3) -> Option<Incident> {
        let (w, distance, inverse_square) = match *self {
            Self::Point { position, .. }
            | Self::Spot { position, .. }
            | Self::Projector { position, .. } => {
                let offset = position - x;
                let distance = offset.length();
                (offset / distance, distance, 1.0 / (distance * distance))
            }
            Self::Directional { direction, .. } => (-direction, f64::INFINITY, 1.0),
            Self::Area { .. }
            | Self::TexturedArea { .. }
            | Self::Constant { .. }
            | Self::Envmap { .. } => return None,
        };
        let emission = self.emission(-w);
        let value = emission.value * inverse_square;
        let usable = w.is_finite() && value.is_finite();
        usable.then_some(Incident { w, distance, value, emission, inverse_square })
    }
}

impl Incident {
    /// Rate of [`value`](Self::value) while the point and the emitter move.
    #[inline]
    #[must_use]
    pub fn rate(&self, x_rate: Vec3, t: &EmitterTangent) -> Rgb {
        // Reciprocal distance: zero for directional light, which turns no flow by moving.
        let per_r = 1.0 / self.distance;
        let apart = (t.position - x_rate) * per_r;
        let emission_rate = self.emission.rate(-apart.reject(self.w), t);
        let spread_rate = self.emission.value * (-2.0 * apart.dot(self.w));
        (emission_rate + spread_rate) * self.inverse_square
    }

    /// Gradient of `adjoint · value`, first with respect to the point, then to the emitter.
    #[inline]
    #[must_use]
    pub fn gradient(&self, adjoint: Rgb) -> (Vec3, EmitterGradient) {
        let per_r = 1.0 / self.distance;
        let (flow, mut emitter) = self.emission.gradient(adjoint * self.inverse_square);
        let spread = 2.0 * self.value.dot(adjoint);
        let point = (flow.reject(self.w) + self.w * spread) * per_r;
        emitter.position = -point;
        (point, emitter)
    }
}
