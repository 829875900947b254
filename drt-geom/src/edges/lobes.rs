//! How a point weighs the directions of what it sees, in a few numbers.
//!
//! A cosine with the point's normal, and a lobe around each of two axes a:
//!
//! ```text
//! f(d) ≈ e |n·d| + Σ s w² / (π (w² + c²)²),    c² = 2 (1 - a·d),
//! ```
//!
//! with the solid angle π w² and the integral s of a lobe. This is the distribution of Trowbridge
//! and Reitz over the directions about a, has integral s for a narrow lobe, and is spread over a cone of
//! the mean squared angle σ² by taking w² + σ² for w²: no exponential, and never zero.

use core::f64::consts::{FRAC_1_PI, PI};
use core::ops::{Add, Div, Mul};

use drt_math::Vec3;

/// The part of a lobe's integral that may be anywhere: the lobe is its middle.
const ANYWHERE: f64 = 0.1;

/// Weights of directions: a cosine and two lobes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobes {
    /// The weight along the normal, apart from lobes; where there is no normal, that of all directions.
    pub even: f64,
    /// Those of no height do not count.
    pub lobes: [Lobe; 2],
}

/// Weight around a direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lobe {
    /// Unit.
    pub axis: Vec3,
    /// w², squared sine-like width: the lobe's solid angle over π.
    pub width2: f64,
    /// s / π: the lobe's integral over π.
    pub height: f64,
}

impl Lobe {
    /// Of the integral `share` around the unit `axis`, with w² = `width2`.
    #[inline]
    #[must_use]
    pub fn new(axis: Vec3, width2: f64, share: f64) -> Self {
        Self { axis, width2: width2.max(f64::MIN_POSITIVE), height: share * FRAC_1_PI }
    }

    /// The weight of a lobe of that height and w² (or w² + σ²) where a direction is off its axis by a
    /// vector of the squared length `off2`.
    #[inline(always)]
    pub fn value<T>(height: T, width2: T, off2: T) -> T
    where
        T: Copy + Add<Output = T> + Mul<Output = T> + Div<Output = T>,
    {
        let off = width2 + off2;
        height * width2 / (off * off)
    }
}

impl Lobes {
    /// The same in all directions, but for the cosine.
    #[inline]
    #[must_use]
    pub fn even(value: f64) -> Self {
        Self { even: value, lobes: [Lobe::default(); 2] }
    }

    /// With lobes, and a part of their integral anywhere.
    #[must_use]
    pub fn glossy(even: f64, lobes: [Lobe; 2]) -> Self {
        let light: f64 = lobes.iter().map(|l| l.height).sum();
        Self { even: even + ANYWHERE * light, lobes }
    }

    /// Of a phase function with the value `across` at a right angle to the given direction, and `peak`
    /// at its maximum, which is along `axis`.
    #[must_use]
    pub fn around(axis: Vec3, across: f64, peak: f64) -> Self {
        let rest = f64::max(1.0 - 4.0 * PI * across, 0.0);
        if peak <= across || rest == 0.0 {
            return Self::even(across);
        }
        // s / (π w²) is the height of the peak.
        let width2 = rest * FRAC_1_PI / (peak - across);
        Self { even: across, lobes: [Lobe::new(axis, width2, rest), Lobe::default()] }
    }
}
