mod blend;
mod tabulated;

use alloc::boxed::Box;
use core::f64::consts::PI;

use drt_math::{Frame, Real, Vec3, fm, vec3};

use crate::MediumError;
pub use blend::PhaseBlend;
pub use tabulated::PhaseTable;

/// Distribution of scattered directions.
///
/// Every cosine here is `c = w' . w` between the incoming and the outgoing direction of light
/// *flow*: `c = 1` goes straight on. Values are per steradian and integrate to one over the
/// sphere. Swapping or reversing both directions leaves `c` unchanged, so the same numbers serve
/// light paths and camera paths.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Phase {
    /// Uniform over the sphere.
    #[default]
    Isotropic,
    /// Henyey and Greenstein 1941.
    HenyeyGreenstein {
        /// Mean cosine, in (-1, 1); positive scatters forward.
        g: f64,
    },
    /// Particles much smaller than the wavelength: `3 (1 + c²) / (16 pi)`.
    Rayleigh,
    /// Two others in proportion.
    Blend(Box<PhaseBlend>),
    /// Given by its values.
    Tabulated(Box<PhaseTable>),
}

impl Phase {
    /// Henyey-Greenstein with a checked mean cosine.
    ///
    /// # Errors
    /// When `g` does not lie in (-1, 1).
    pub fn henyey_greenstein(g: f64) -> Result<Self, MediumError> {
        let phase = Self::HenyeyGreenstein { g };
        phase.validate().map(|()| phase)
    }

    /// Checks the mean cosine.
    ///
    /// # Errors
    /// When it does not lie in (-1, 1).
    pub fn validate(&self) -> Result<(), MediumError> {
        match *self {
            Self::Blend(ref blend) => blend.parts().iter().try_for_each(Self::validate),
            Self::HenyeyGreenstein { g } if !(g > -1.0 && g < 1.0) => {
                Err(MediumError::OutOfRange {
                    property: crate::Property::G,
                    value: g,
                    expected: "between -1 and 1, both excluded",
                })
            }
            _ => Ok(()),
        }
    }

    /// Density per steradian at a flow cosine.
    #[inline]
    pub fn eval<T: Real>(&self, c: T) -> T {
        match *self {
            Self::Isotropic => T::from(0.25 / PI),
            Self::HenyeyGreenstein { g } => henyey_greenstein(T::from(g), c),
            Self::Rayleigh => rayleigh(c),
            Self::Blend(ref blend) => blend.eval(c),
            Self::Tabulated(ref table) => table.eval(c),
        }
    }

    /// Derivative of [`Phase::eval`] with respect to the cosine.
    #[inline]
    #[must_use]
    pub fn d_cos(&self, c: f64) -> f64 {
        match *self {
            Self::Isotropic => 0.0,
            Self::HenyeyGreenstein { g } => henyey_greenstein(g, c) * 3.0 * g / squared_chord(g, c),
            Self::Rayleigh => 3.0 / (8.0 * PI) * c,
            Self::Blend(ref blend) => blend.d_cos(c),
            Self::Tabulated(ref table) => table.d_cos(c),
        }
    }

    /// Derivative of [`Phase::eval`] with respect to the mean cosine of Henyey-Greenstein. The
    /// isotropic function counts as its member `g = 0`; the others have no such parameter: zero.
    #[inline]
    #[must_use]
    pub fn d_g(&self, c: f64) -> f64 {
        let g = match *self {
            Self::Isotropic => 0.0,
            Self::HenyeyGreenstein { g } => g,
            Self::Rayleigh | Self::Blend(_) | Self::Tabulated(_) => return 0.0,
        };
        let s = squared_chord(g, c);
        let slope = -2.0 * g * s - 3.0 * (1.0 - g) * (1.0 + g) * (g - c);
        slope / (4.0 * PI * s * s * fm::sqrt(s))
    }

    /// The mean cosine `g` where the phase function has that parameter.
    #[inline]
    #[must_use]
    pub fn mean_cosine_parameter(&self) -> Option<f64> {
        match *self {
            Self::Isotropic => Some(0.0),
            Self::HenyeyGreenstein { g } => Some(g),
            Self::Rayleigh | Self::Blend(_) | Self::Tabulated(_) => None,
        }
    }

    /// How far it is from even, from 0 to 1: the largest |mean cosine| of the lobes that it is made of.
    #[must_use]
    pub fn sharpness(&self) -> f64 {
        match self {
            Self::Isotropic | Self::Rayleigh => 0.0,
            Self::HenyeyGreenstein { g } => Real::abs(*g),
            Self::Blend(blend) => blend.parts().iter().map(Self::sharpness).fold(0.0, f64::max),
            Self::Tabulated(table) => Real::abs(table.mean_cosine()),
        }
    }

    /// A flow direction after scattering, with density proportional to the phase function, and
    /// that density per steradian. `flow` is the unit direction before; `u` are two uniform
    /// numbers in [0, 1).
    #[inline]
    #[must_use]
    pub fn sample(&self, flow: Vec3, u: [f64; 2]) -> (Vec3, f64) {
        if let Self::Blend(blend) = self {
            return blend.sample(flow, u);
        }
        // Both 1 - c and 1 + c, so that the sine keeps its digits next to the poles.
        let (below, above) = match *self {
            Self::Isotropic => (2.0 * (1.0 - u[0]), 2.0 * u[0]),
            Self::HenyeyGreenstein { g } => henyey_greenstein_cosine(g, u[0]),
            Self::Rayleigh => {
                let c = rayleigh_cosine(u[0]);
                (1.0 - c, 1.0 + c)
            }
            // Taken care of above.
            Self::Blend(_) => (1.0, 1.0),
            Self::Tabulated(ref table) => {
                let c = table.sample_cosine(u[0]);
                (1.0 - c, 1.0 + c)
            }
        };
        let c = if below < above { 1.0 - below } else { above - 1.0 };
        let s = fm::sqrt(f64::max(0.0, below * above));
        let (sin_phi, cos_phi) = fm::sin_cos(2.0 * PI * u[1]);
        let w = Frame::from_normal(flow).to_world(vec3(s * cos_phi, s * sin_phi, c));
        (w, self.eval(c))
    }
}

/// `1 + g² - 2 g c` as a sum of nonnegative terms: near the peak of a sharp lobe the textbook
/// form loses all digits.
#[inline]
fn squared_chord<T: Real>(g: T, c: T) -> T {
    if g.re() >= 0.0 {
        (T::one() - g).squared() + g * (T::one() - c) * 2.0
    } else {
        (T::one() + g).squared() - g * (T::one() + c) * 2.0
    }
}

/// The Henyey-Greenstein function of mean cosine and cosine, both differentiable.
#[inline]
pub fn henyey_greenstein<T: Real>(g: T, c: T) -> T {
    let s = squared_chord(g, c);
    (T::one() - g) * (T::one() + g) / (s * s.sqrt()) * (0.25 / PI)
}

/// The Rayleigh function of the cosine.
#[inline]
pub fn rayleigh<T: Real>(c: T) -> T {
    (c.squared() + 1.0) * (3.0 / (16.0 * PI))
}

/// `(1 - c, 1 + c)` of the cosine below which the Henyey-Greenstein function holds the fraction `u`.
///
/// The usual inversion `c = (1 + g² - ((1 - g²)/(1 - g + 2 g u))²) / (2 g)` cancels for small and
/// for large `g`; with both differences from the poles factored out no subtraction is left.
#[inline]
fn henyey_greenstein_cosine(g: f64, u: f64) -> (f64, f64) {
    let q = if g >= 0.0 { (1.0 - g) + 2.0 * g * u } else { (1.0 + g) - 2.0 * g * (1.0 - u) };
    let (a, b) = ((1.0 - g) / q, (1.0 + g) / q);
    (2.0 * a * a * (1.0 - u) * (1.0 + g * u), 2.0 * b * b * u * (1.0 - g * (1.0 - u)))
}

/// The root of `c³ + 3 c = 4 (2 u - 1)`, by Cardano's formula.
#[inline]
fn rayleigh_cosine(u: f64) -> f64 {
    let z = 2.0 * (2.0 * u - 1.0);
    // The larger root in magnitude first: its sum does not cancel.
    let r = fm::cbrt(z.abs() + fm::sqrt(z * z + 1.0));
    let c = r - 1.0 / r;
    if z < 0.0 { -c } else { c }
}
