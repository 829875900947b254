use drt_math::{Rgb, RgbVec};

/// What a medium does to light at one point, per colour channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Coefficients {
    /// Extinction, in 1 / scene unit.
    pub sigma_t: Rgb,
    /// Scattered part of the extinction.
    pub albedo: Rgb,
    /// Emitted radiance `Le`; the source per length is `sigma_a Le`.
    pub emission: Rgb,
}

impl Coefficients {
    /// Nothing there.
    pub const VACUUM: Self = Self { sigma_t: Rgb::ZERO, albedo: Rgb::ZERO, emission: Rgb::ZERO };

    /// Scattering coefficient, in 1 / scene unit.
    #[inline]
    #[must_use]
    pub fn sigma_s(&self) -> Rgb {
        self.sigma_t * self.albedo
    }
    /// Absorption coefficient, in 1 / scene unit.
    #[inline]
    #[must_use]
    pub fn sigma_a(&self) -> Rgb {
        self.sigma_t - self.sigma_s()
    }
    /// Emitted radiance per length, `sigma_a Le`.
    #[inline]
    #[must_use]
    pub fn source(&self) -> Rgb {
        self.sigma_a() * self.emission
    }
}

/// Spatial gradients of the coefficients of a medium at rest, per scene unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CoefficientGradients {
    /// Of the extinction.
    pub sigma_t: RgbVec,
    /// Of the albedo.
    pub albedo: RgbVec,
    /// Of the emitted radiance.
    pub emission: RgbVec,
}

impl CoefficientGradients {
    /// No dependence on place.
    pub const ZERO: Self =
        Self { sigma_t: RgbVec::ZERO, albedo: RgbVec::ZERO, emission: RgbVec::ZERO };
}

/// Derivatives of the coefficients with respect to a parameter at a fixed point of space, or,
/// transposed, the derivatives of a loss with respect to the coefficients at that point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CoefficientRates {
    /// Of the extinction, albedo held.
    pub sigma_t: Rgb,
    /// Of the albedo, extinction held.
    pub albedo: Rgb,
    /// Of the emitted radiance.
    pub emission: Rgb,
}

impl CoefficientRates {
    /// At rest.
    pub const ZERO: Self = Self { sigma_t: Rgb::ZERO, albedo: Rgb::ZERO, emission: Rgb::ZERO };

    /// The pairing of rates with the adjoint of the same point: the rate of the loss.
    #[inline]
    #[must_use]
    pub fn dot(&self, adjoint: &Self) -> f64 {
        self.sigma_t.dot(adjoint.sigma_t)
            + self.albedo.dot(adjoint.albedo)
            + self.emission.dot(adjoint.emission)
    }
}
