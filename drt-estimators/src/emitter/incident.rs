use drt_math::{Rgb, Vec3};

use super::{Emission, Emitter, EmitterGradient, EmitterTangent};

/// What a delta emitter sends to a point, visibility and transmittance apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Incident {
    /// Unit vector from the point towards the light; the flow is its opposite.
    pub toward: Vec3,
    /// Distance of the light; infinite for a directional one.
    pub distance: f64,
    /// Emission towards the point, with its gradients.
    pub emission: Emission,
    /// Square of the reciprocal distance, or 1 for directional light: `emission` times this is
    /// the irradiance on a plane across the flow.
    pub inverse_square: f64,
}

impl Emitter {
    /// The light that a delta emitter sends to the point x; `None` for other emitters, and at the
    /// very position of a light.
    #[inline]
    #[must_use]
    pub fn incident(&self, x: Vec3) -> Option<Incident> {
        match *self {
            Self::Point { position, .. } | Self::Spot { position, .. } => {
                let offset = position - x;
                let distance = offset.length();
                let toward = offset / distance;
                let inverse_square = 1.0 / (distance * distance);
                (toward.is_finite() && inverse_square.is_finite()).then(|| Incident {
                    toward,
                    distance,
                    emission: self.emission(-toward),
                    inverse_square,
                })
            }
            Self::Directional { direction, .. } => Some(Incident {
                toward: -direction,
                distance: f64::INFINITY,
                emission: self.emission(direction),
                inverse_square: 1.0,
            }),
            Self::Area { .. } | Self::Constant { .. } => None,
        }
    }
}

impl Incident {
    /// Irradiance on a plane across the flow: I/r², or E.
    #[inline]
    #[must_use]
    pub fn irradiance(&self) -> Rgb {
        self.emission.value * self.inverse_square
    }

    /// Rate of the [`irradiance`](Self::irradiance) while the point and the emitter move.
    #[inline]
    #[must_use]
    pub fn rate(&self, x_rate: Vec3, t: &EmitterTangent) -> Rgb {
        // Reciprocal distance: zero for directional light, which turns no flow by moving.
        let per_r = 1.0 / self.distance;
        let apart = (t.position - x_rate) * per_r;
        let emission_rate = self.emission.rate(-apart.reject(self.toward), t);
        let spread_rate = self.emission.value * (-2.0 * apart.dot(self.toward));
        (emission_rate + spread_rate) * self.inverse_square
    }

    /// Gradient of `adjoint · irradiance`, first with respect to the point, then to the emitter.
    #[inline]
    #[must_use]
    pub fn gradient(&self, adjoint: Rgb) -> (Vec3, EmitterGradient) {
        let per_r = 1.0 / self.distance;
        let (flow, mut emitter) = self.emission.gradient(adjoint * self.inverse_square);
        let spread = 2.0 * self.irradiance().dot(adjoint);
        let point = (flow.reject(self.toward) + self.toward * spread) * per_r;
        emitter.position = -point;
        (point, emitter)
    }
}
