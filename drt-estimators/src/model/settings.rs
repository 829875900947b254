//! What is asked of an estimator.

use alloc::vec::Vec;

use drt_motion::interior::InteriorMotion;

use crate::model::error::{Error, SettingError};
use crate::model::scene::{Scene, Target};

/// How derivatives are estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum EstimatorKind {
    /// Material-form path integrals, interior and boundary (2021 paper).
    #[default]
    PathSpace,
    /// The derivative of radiance along rays, with edges seen from every vertex (2019 paper).
    Radiative,
    /// Rays that turn with the edges beside them, so that no edge has to be sampled (2023 paper).
    Warped,
    /// Central differences with common random numbers.
    FiniteDifference,
    /// Whichever of [`PathSpace`](Self::PathSpace), [`Radiative`](Self::Radiative) and [`Warped`](Self::Warped) finds the derivative
    /// images of a [`Session`](crate::Session) with the least work, by a pilot of few samples of a small picture; a
    /// [`Fit`](crate::fit::Fit) chooses once, at the values that its parameters begin with. A [`gradient`](crate::gradient) takes
    /// `PathSpace`.
    Auto,
}

/// How rays turn, or vertices move, with the edges beside them, by [`EstimatorKind::Warped`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Warp {
    /// By the edges themselves: without auxiliary rays, and without bias.
    #[default]
    Edges,
    /// By auxiliary points around each vertex, as published in 2023. Surfaces only.
    Points(AuxiliarySamples),
    /// By auxiliary directions around each ray, as published in 2020. Surfaces only.
    Directions(AuxiliarySamples),
}

/// Auxiliary samples of a [`Warp`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AuxiliarySamples {
    /// Of each vertex or ray; the more, the less bias.
    pub count: u32,
    /// Their weights.
    pub kernel: WarpKernel,
    /// Without bias, by random truncation of a sum over doubled counts, at some four times the cost.
    pub debiased: bool,
}

impl Default for AuxiliarySamples {
    fn default() -> Self {
        Self { count: 8, kernel: WarpKernel::default(), debiased: false }
    }
}

/// Weights of auxiliary samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum WarpKernel {
    /// Boundary tests by distance from silhouettes, open and sharp edges of triangle meshes, and the cube of distance and
    /// test together (theory sheet §9.1).
    #[default]
    Corrected,
    /// The distance of Eq. 16 of the 2023 paper, cubed, and tests as printed there.
    Year2023,
    /// The distance of Eq. 57 of the 2023 paper, which is that of 2020.
    Year2020,
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

/// How paths are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum PathSampling {
    /// From the camera, with next-event estimation.
    #[default]
    Unidirectional,
    /// From the camera and from emitters, joined in every way. Of images, and of derivatives by [`EstimatorKind::PathSpace`]
    /// and by [`EstimatorKind::Warped`] with edges.
    Bidirectional,
    /// Whichever of the two finds the image with less work, by a pilot of few samples. Derivatives take the first.
    Auto,
}

/// How images and derivatives are estimated, whatever the number of samples: that is told by each call.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Settings {
    /// How derivatives are estimated.
    pub estimator: EstimatorKind,
    /// How paths are found.
    pub sampling: PathSampling,
    /// Index of the sensor.
    pub sensor: usize,
    /// Boundary samples of all kinds together to each sample of a pixel, on average; positive. They share them in equal
    /// parts, of which edges seen from the camera leave up to three quarters where a pilot finds them known well enough.
    /// `None` is 1; with [`adaptive`](Self::adaptive), for each kind what makes the noise least for the time, between
    /// 1/4 and 4.
    pub boundary_ratio: Option<f64>,
    /// Path depth.
    pub max_depth: Depth,
    /// Samples in antithetic pairs: image points mirrored at the pixel's centre (2021 paper, §5.4), and rays
    /// mirrored in narrow lobes that turn. Derivatives by roughness are always estimated by pairs.
    pub antithetic: bool,
    /// Choose samples by how things move, and boundary samples by what a pilot of them has found: at most an eighth of the samples, which
    /// are then forgotten. Expected values do not change. Forward and reverse mode choose apart: they are exact transposes of each
    /// other only without.
    pub guiding: bool,
    /// Of [`EstimatorKind::Radiative`]: query an edge from every vertex of a path (2019 paper), at a cost
    /// quadratic in its length; `boundary_ratio` then counts the camera's edges alone. Else one vertex of each path
    /// queries, chosen by its throughput.
    pub every_vertex: bool,
    /// Give more of the samples to pixels whose derivatives (without parameters, whose image) are noisier; the
    /// mean stays. A pilot takes an eighth of the samples and is then forgotten.
    pub adaptive: bool,
    /// Let every path of the image count for all pixels whose filters reach it, where these reach neighbours: less
    /// noise of pixels, which have it in common with those around. Else each pixel draws its paths from its own filter, for
    /// itself, as derivatives always do; filters of more than 8 pixels' radius are left to that.
    pub splatting: bool,
    /// Of [`EstimatorKind::Warped`].
    pub warp: Warp,
    /// Half step of finite differences, in units of each parameter.
    pub step: f64,
    /// Names the random numbers: same seed, same pixel data.
    pub seed: u64,
    /// Threads; 0 is all cores. Without the feature `parallel`, one.
    pub threads: usize,
    /// Keep each derivative's terms apart as well.
    pub terms: bool,
    /// How the insides of media move, by the medium's index, where not as the plan chooses.
    pub insides: Vec<(usize, InteriorMotion)>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            estimator: EstimatorKind::default(),
            sampling: PathSampling::default(),
            sensor: 0,
            boundary_ratio: None,
            max_depth: Depth::OfScene,
            antithetic: true,
            guiding: true,
            every_vertex: false,
            adaptive: false,
            splatting: true,
            warp: Warp::default(),
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
    pub(crate) fn check(&self, scene: &Scene, derivatives: bool) -> Result<(), Error> {
        let fail = |setting, reason| Err(Error::Setting { setting, reason });
        if !(self.step > 0.0 && self.step.is_finite()) {
            return fail("step", SettingError::NotPositive(self.step));
        }
        // Without boundary samples a term would be missing.
        if let Some(ratio) = self.boundary_ratio.filter(|r| !(*r > 0.0 && r.is_finite())) {
            return fail("boundary_ratio", SettingError::NotPositive(ratio));
        }
        let count = scene.media.len();
        if let Some(&(index, _)) = self.insides.iter().find(|(m, _)| *m >= count) {
            return fail("insides", SettingError::NoMedium { index, count });
        }
        let has_both_ends = match self.estimator {
            EstimatorKind::PathSpace | EstimatorKind::Auto => true,
            EstimatorKind::Warped => self.warp == Warp::Edges,
            _ => false,
        };
        if derivatives && self.sampling == PathSampling::Bidirectional && !has_both_ends {
            return fail("sampling", SettingError::OtherKinds);
        }
        scene.sensor(self.sensor)?;
        if self.sampling == PathSampling::Bidirectional && scene.hides_something() {
            return fail("sampling", SettingError::HiddenEmitters);
        }
        if self.sampling == PathSampling::Bidirectional
            && let Some(i) = scene.first_straight()
        {
            let name = scene.name_of(Target::Shape(i));
            return fail("sampling", SettingError::Straight(name));
        }
        if derivatives
            && self.sampling == PathSampling::Bidirectional
            && let Some(i) = scene.first_smooth()
        {
            let name = scene.name_of(Target::Shape(i));
            return fail("sampling", SettingError::Smooth(name));
        }
        Ok(())
    }
}
