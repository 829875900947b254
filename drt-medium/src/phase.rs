mod blend;
mod flakes;
mod local;
mod sggx;
mod tabulated;

use alloc::boxed::Box;
use core::f64::consts::PI;

use drt_math::{Affine, Real, Vec3, fm};

use crate::volume::{Volume, check_scalars};
use crate::{Grid, MediumError, Property};
pub use blend::PhaseBlend;
pub use flakes::{Flakes, FlakesGradient};
pub use local::{LocalPhase, PhaseGradient};
pub(crate) use sggx::AreaRange;
pub use sggx::Sggx;
pub use tabulated::PhaseTable;

/// Distribution of scattered directions.
///
/// Its numbers may vary in space. [`Phase::at`] and [`Medium::phase_at`](crate::Medium::phase_at) give it at a point, where it can
/// be evaluated and sampled.
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
    /// Henyey and Greenstein's function with a mean cosine that a grid of one channel gives.
    HenyeyGreensteinGrid(Box<Grid>),
    /// Particles much smaller than the wavelength: `3 (1 + c²) / (16 pi)`.
    Rayleigh,
    /// Two others in proportion.
    Blend(Box<PhaseBlend>),
    /// Given by its values.
    Tabulated(Box<PhaseTable>),
    /// That of microflakes (Heitz et al. 2015), which depends on more than the angle. The extinction then depends on the
    /// direction as well: it is the medium's times the [projected area](Flakes::projected_area).
    Sggx(Box<Sggx>),
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

    /// Henyey-Greenstein with a mean cosine from a grid.
    ///
    /// # Errors
    /// When the grid has three channels, or a value does not lie in (-1, 1).
    pub fn henyey_greenstein_grid(g: Grid) -> Result<Self, MediumError> {
        let phase = Self::HenyeyGreensteinGrid(Box::new(g));
        phase.validate().map(|()| phase)
    }

    /// Checks mean cosines and weights.
    ///
    /// # Errors
    /// When a mean cosine does not lie in (-1, 1), or a weight not in [0, 1], or a grid of these has three channels, or a
    /// matrix of SGGX is not positive definite.
    pub fn validate(&self) -> Result<(), MediumError> {
        match self {
            Self::Blend(blend) => blend.validate(),
            Self::HenyeyGreenstein { g } => check_mean_cosine(*g),
            Self::HenyeyGreensteinGrid(g) => check_scalars(Property::G, g, check_mean_cosine),
            Self::Sggx(field) => field.validate(),
            Self::Isotropic | Self::Rayleigh | Self::Tabulated(_) => Ok(()),
        }
    }

    /// The phase function at a point of the space in which its grids are placed.
    #[inline]
    #[must_use]
    pub fn at(&self, x: Vec3) -> LocalPhase<'_> {
        LocalPhase::new(self, x)
    }

    /// True where it is not the same everywhere.
    #[inline]
    #[must_use]
    pub fn varies(&self) -> bool {
        match self {
            Self::HenyeyGreensteinGrid(_) => true,
            Self::Blend(blend) => blend.varies(),
            Self::Sggx(field) => field.varies(),
            Self::Isotropic
            | Self::HenyeyGreenstein { .. }
            | Self::Rayleigh
            | Self::Tabulated(_) => false,
        }
    }

    /// The microflakes of SGGX, by which the extinction depends on the direction.
    #[inline]
    #[must_use]
    pub fn sggx(&self) -> Option<&Sggx> {
        match self {
            Self::Sggx(field) => Some(field),
            _ => None,
        }
    }

    /// The voxels that give one of its properties; `None` where that is the same everywhere.
    #[must_use]
    pub fn voxels(&self, property: Property) -> Option<&Grid> {
        match (self, property) {
            (Self::HenyeyGreensteinGrid(g), Property::G) => Some(g),
            (Self::Blend(blend), Property::Weight) => blend.weight().grid(),
            (Self::Sggx(field), Property::SggxDiagonal) => field.entries()[0].grid(),
            (Self::Sggx(field), Property::SggxOffDiagonal) => field.entries()[1].grid(),
            _ => None,
        }
    }

    pub(crate) fn voxels_mut(&mut self, property: Property) -> Option<&mut Grid> {
        match (self, property) {
            (Self::HenyeyGreensteinGrid(g), Property::G) => Some(g),
            (Self::Blend(blend), Property::Weight) => blend.weight.grid_mut(),
            (Self::Sggx(field), Property::SggxDiagonal) => field.entries[0].grid_mut(),
            (Self::Sggx(field), Property::SggxOffDiagonal) => field.entries[1].grid_mut(),
            _ => None,
        }
    }

    /// Shows all grids in it, those of the parts of a blend too.
    pub(crate) fn grids<'a>(&'a self, visit: &mut dyn FnMut(&'a Grid)) {
        match self {
            Self::HenyeyGreensteinGrid(g) => visit(g),
            Self::Blend(blend) => {
                blend.weight().grid().into_iter().for_each(&mut *visit);
                blend.parts().iter().for_each(|part| part.grids(visit));
            }
            Self::Sggx(field) => field.entries().iter().filter_map(Volume::grid).for_each(visit),
            Self::Isotropic
            | Self::HenyeyGreenstein { .. }
            | Self::Rayleigh
            | Self::Tabulated(_) => {}
        }
    }

    /// Moves its grids by a map of the world.
    ///
    /// # Errors
    /// When the map is singular, or [unfit](Sggx::place) for microflakes.
    pub fn place(&mut self, map: &Affine) -> Result<(), MediumError> {
        match self {
            Self::HenyeyGreensteinGrid(g) => g.place(map),
            Self::Blend(blend) => blend.place(map),
            Self::Sggx(field) => field.place(map),
            Self::Isotropic
            | Self::HenyeyGreenstein { .. }
            | Self::Rayleigh
            | Self::Tabulated(_) => Ok(()),
        }
    }
}

fn check_mean_cosine(g: f64) -> Result<(), MediumError> {
    if g > -1.0 && g < 1.0 {
        return Ok(());
    }
    let expected = "between -1 and 1, both excluded";
    Err(MediumError::OutOfRange { property: Property::G, value: g, expected })
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
