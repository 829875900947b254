//! What is asked of an estimator.

use alloc::vec::Vec;

use drt_motion::interior::InteriorMotion;

/// How derivatives are estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum EstimatorKind {
    /// Material-form path integrals, interior and boundary (2021 paper).
    #[default]
    PathSpace,
    /// The derivative of radiance along rays, with edges seen from every vertex (2019 paper).
    Radiative,
    /// Central differences with common random numbers.
    FiniteDifference,
}

/// The longest paths: 1 shows emitters only, each real scattering adds one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Depth {
    /// As the scene's integrator has it.
    #[default]
    OfScene,
    /// Ended by Russian roulette alone.
    Unlimited,
    /// So many at most.
    AtMost(u32),
}

impl Depth {
    /// The depth in a scene whose own is given; `None` is unlimited.
    #[must_use]
    pub fn within(self, scene: Option<u32>) -> Option<u32> {
        match self {
            Self::OfScene => scene,
            Self::Unlimited => None,
            Self::AtMost(depth) => Some(depth),
        }
    }
}

/// Sample budgets and switches of one run.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Settings {
    /// How derivatives are estimated.
    pub estimator: EstimatorKind,
    /// Index of the sensor.
    pub sensor: usize,
    /// Interior (and forward) samples per pixel.
    pub spp: u32,
    /// Boundary samples of all kinds together, per pixel on average; `None` is as many as `spp`, or if
    /// [`adaptive`](Self::adaptive) as many of each kind as pay for their time. The kinds share them in equal
    /// parts, of which edges seen from the camera leave up to three quarters where they are soon known well enough.
    pub boundary_spp: Option<u32>,
    /// Path depth.
    pub max_depth: Depth,
    /// Image points in pairs mirrored at the pixel's centre (theory: 2021 paper, §5.4), and rays in pairs
    /// mirrored in narrow lobes that turn; those that estimate derivatives by roughness are always in pairs.
    pub antithetic: bool,
    /// Choose samples by what is known of how things move; the expected values do not change. Reverse
    /// mode knows nothing of it, so that without guiding forward mode is its exact transpose.
    pub guiding: bool,
    /// Of [`EstimatorKind::Radiative`]: query an edge from every vertex of a path, as the 2019 paper
    /// does, at a cost that grows with the square of its length; `boundary_spp` then tells the camera's
    /// edges alone. Else one of a path's vertices does, chosen by its throughput.
    pub every_vertex: bool,
    /// Pixels whose derivatives are noisier take more of the samples, by a pilot that takes an eighth of them
    /// and is then forgotten; `spp` is the mean. The image, where no derivative is asked for. Where
    /// `boundary_spp` is not given, each boundary term takes as many as make the noise least for the time,
    /// between a quarter of `spp` and four times as many.
    pub adaptive: bool,
    /// Finite-difference half step, in units of each parameter.
    pub step: f64,
    /// Names the random numbers: same seed, same pixel data.
    pub seed: u64,
    /// Threads; 0 takes all cores. Without the feature `parallel`, one.
    pub threads: usize,
    /// Keep each derivative's terms apart as well.
    pub terms: bool,
    /// Insides that do not move as the plan would choose, by the medium's index.
    pub insides: Vec<(usize, InteriorMotion)>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            estimator: EstimatorKind::default(),
            sensor: 0,
            spp: 64,
            boundary_spp: None,
            max_depth: Depth::OfScene,
            antithetic: true,
            guiding: true,
            every_vertex: false,
            adaptive: false,
            step: 1e-3,
            seed: 0,
            threads: 0,
            terms: false,
            insides: Vec::new(),
        }
    }
}

impl Settings {
    /// Checks what cannot be meant.
    ///
    /// # Errors
    /// Names the setting.
    pub(crate) fn check(&self) -> Result<(), crate::model::error::Error> {
        if self.step > 0.0 && self.step.is_finite() {
            return Ok(());
        }
        Err(crate::model::error::Error::Setting {
            setting: "step".into(),
            reason: alloc::format!("is {}; expected a positive number", self.step),
        })
    }
}
