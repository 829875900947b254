use drt_math::{Affine, Rgb};

use crate::volume::{Volume, check_scalars};
use crate::{Grid, MediumError, Phase, Property};

/// Least probability of sampling either part of a blend: one of weight zero still has a derivative by the weight.
const LEAST_CHOICE: f64 = 0.05;

/// Two phase functions in proportion: `(1 - w) p_0 + w p_1`, with a weight that may vary in space.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(into = "(Volume, [Phase; 2])"))]
#[cfg_attr(feature = "serde", serde(try_from = "(Volume, [Phase; 2])"))]
pub struct PhaseBlend {
    pub(crate) weight: Volume,
    parts: [Phase; 2],
}

impl PhaseBlend {
    /// A blend with `weight` of the second part.
    ///
    /// # Errors
    /// When the weight does not lie in [0, 1], or a part is SGGX.
    pub fn new(weight: f64, parts: [Phase; 2]) -> Result<Self, MediumError> {
        Self::with(Volume::Constant(Rgb::splat(weight)), parts)
    }

    /// A blend with a grid of weights of the second part.
    ///
    /// # Errors
    /// When the grid has three channels, or a weight does not lie in [0, 1], or a part is SGGX.
    pub fn varying(weight: Grid, parts: [Phase; 2]) -> Result<Self, MediumError> {
        Self::with(Volume::Grid(weight), parts)
    }

    fn with(weight: Volume, parts: [Phase; 2]) -> Result<Self, MediumError> {
        let blend = Self { weight, parts };
        blend.validate().map(|()| blend)
    }

    pub(super) fn validate(&self) -> Result<(), MediumError> {
        match &self.weight {
            Volume::Constant(w) => check_weight(w.r)?,
            Volume::Grid(grid) => check_scalars(Property::Weight, grid, check_weight)?,
        }
        if self.parts.iter().any(|part| part.sggx().is_some()) {
            return Err(MediumError::SggxInBlend);
        }
        self.parts.iter().try_for_each(Phase::validate)
    }

    /// The part of the second one; all three channels are the same.
    #[must_use]
    pub fn weight(&self) -> &Volume {
        &self.weight
    }

    /// What it is made of.
    #[must_use]
    pub fn parts(&self) -> &[Phase; 2] {
        &self.parts
    }

    pub(super) fn varies(&self) -> bool {
        self.weight.grid().is_some() || self.parts.iter().any(Phase::varies)
    }

    pub(super) fn place(&mut self, map: &Affine) -> Result<(), MediumError> {
        self.weight.place(map)?;
        self.parts.iter_mut().try_for_each(|part| part.place(map))
    }

    /// Probability of sampling the second part.
    #[inline]
    pub(super) fn choice(weight: f64) -> f64 {
        weight.clamp(LEAST_CHOICE, 1.0 - LEAST_CHOICE)
    }

    /// The part that a number in [0, 1) chooses, and the number stretched to [0, 1) again.
    #[inline]
    pub(super) fn choose(&self, weight: f64, u: f64) -> (usize, f64) {
        let choice = Self::choice(weight);
        // Numbers stay below one.
        let rest = |v: f64| f64::min(v, 1.0 - f64::EPSILON);
        if u < choice { (1, rest(u / choice)) } else { (0, rest((u - choice) / (1.0 - choice))) }
    }
}

fn check_weight(value: f64) -> Result<(), MediumError> {
    if (0.0..=1.0).contains(&value) {
        return Ok(());
    }
    let expected = "between 0 and 1";
    Err(MediumError::OutOfRange { property: Property::Weight, value, expected })
}

#[cfg(feature = "serde")]
impl From<PhaseBlend> for (Volume, [Phase; 2]) {
    fn from(blend: PhaseBlend) -> Self {
        (blend.weight, blend.parts)
    }
}

#[cfg(feature = "serde")]
impl TryFrom<(Volume, [Phase; 2])> for PhaseBlend {
    type Error = MediumError;
    fn try_from((weight, parts): (Volume, [Phase; 2])) -> Result<Self, MediumError> {
        Self::with(weight, parts)
    }
}
