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
    /// Path integrals in material form, with interior and boundary terms (2021 paper).
    #[default]
    PathSpace,
    /// The derivative of radiance along rays, with edges seen from vertices (2019 paper): from one vertex of each path,
    /// or from all with [`every_vertex`](Settings::every_vertex).
    Radiative,
    /// Rays that turn with the edges beside them, so that no edge has to be sampled (2023 paper).
    Warped,
    /// Central differences with common random numbers.
    FiniteDifference,
    /// A choice among [`PathSpace`](Self::PathSpace), [`Radiative`](Self::Radiative) and [`Warped`](Self::Warped): where something moves, a
    /// pilot of few samples compares the work that they need for the derivative images of a
    /// [`Session`](crate::Session), at a small part of the cost of the [run](Settings::expected_spp). `PathSpace` is taken unless another one needs less than 0.8 of its work. A
    /// [`Fit`](crate::fit::Fit) chooses once for each view, at the initial values of its parameters. For a
    /// [`gradient`](crate::Session::gradient) the pilot moves the items that it is with respect to by smooth random fields.
    Auto,
}

impl EstimatorKind {
    /// The name that messages and job files have for it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::PathSpace => "path-space",
            Self::Radiative => "radiative",
            Self::Warped => "warped",
            Self::FiniteDifference => "finite-difference",
            Self::Auto => "auto",
        }
    }
}

/// How rays turn, or vertices move, with the edges beside them, in [`EstimatorKind::Warped`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Warp {
    /// Rays turn with the edges themselves, without auxiliary rays and without bias.
    #[default]
    Edges,
    /// Vertices move with what hides auxiliary points around them, as published in 2023. Surfaces only.
    Points(AuxiliarySamples),
    /// Rays turn with what auxiliary rays around them hit, as published in 2020. Surfaces only.
    Directions(AuxiliarySamples),
}

/// Auxiliary samples of a [`Warp`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AuxiliarySamples {
    /// Number of auxiliary samples of each vertex or ray; the bias falls as it grows.
    pub count: u32,
    /// Their weights.
    pub kernel: WarpKernel,
    /// Remove the bias by random truncation of a sum over doubled counts, at about four times the cost.
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
    /// The boundary test is the distance from silhouettes, open edges and sharp edges of triangle meshes, and the sum
    /// of distance function and boundary test is cubed (theory sheet §9.1).
    #[default]
    Corrected,
    /// The distance function of Eq. 16 of the 2023 paper, cubed, and boundary tests as printed there.
    Year2023,
    /// The distance function of Eq. 57 of the 2023 paper, which is that of the 2020 paper.
    Year2020,
}

/// The maximum depth of paths. A depth of 1 shows emitters only, and each scattering adds 1; null interfaces add none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Depth {
    /// The depth of the scene's integrator.
    #[default]
    OfScene,
    /// Unlimited: only Russian roulette ends paths.
    Unlimited,
    /// At most this depth.
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
    /// From the camera and from emitters, connected in every way: for images, and for derivatives by
    /// [`EstimatorKind::PathSpace`] and by [`EstimatorKind::Warped`] with edges.
    Bidirectional,
    /// For images, bidirectional paths if they need less than 0.8 of the work of unidirectional ones in a pilot of few
    /// samples, and otherwise unidirectional ones. Derivatives take unidirectional ones.
    Auto,
}

/// How images and derivatives are estimated. The number of samples is not a setting, but an argument of each call.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Settings {
    /// How derivatives are estimated.
    pub estimator: EstimatorKind,
    /// How paths are found.
    pub sampling: PathSampling,
    /// Index of the sensor.
    pub sensor: usize,
    /// The number of boundary samples of all kinds together for each sample of a pixel, on average; positive. All kinds
    /// get equal parts, except that edges seen from the camera give up to three quarters of theirs to the others where
    /// a pilot finds their noise small enough. `None` is 1; with [`adaptive`](Self::adaptive), `None` chooses for each
    /// kind the number between 1/4 and 4 that makes the noise least for the time.
    pub boundary_ratio: Option<f64>,
    /// Path depth.
    pub max_depth: Depth,
    /// Samples in antithetic pairs: image points mirrored at the pixel's centre (2021 paper, §5.4), and rays
    /// mirrored in narrow lobes that turn. Derivatives with respect to roughness are always estimated by pairs.
    pub antithetic: bool,
    /// Choose samples by the velocities of the scene, and boundary samples by a density that is learnt from a pilot.
    /// The pilot is at most an eighth of the samples, and is not part of the result. Expected values do not change.
    /// Forward and reverse mode learn separately, so they are exact transposes of each other only without guiding.
    pub guiding: bool,
    /// For [`EstimatorKind::Radiative`]: query an edge from every vertex of a path (2019 paper), at a cost
    /// quadratic in the path's length; `boundary_ratio` then counts the camera's edges only. Otherwise one vertex of
    /// each path queries an edge, chosen mostly by its throughput times an estimate of the edges' contribution.
    pub every_vertex: bool,
    /// Give more of the samples to pixels whose derivatives (without parameters, whose image) are noisier; the
    /// mean does not change. A pilot takes an eighth of the samples, and is not part of the result.
    pub adaptive: bool,
    /// Let every path of the image count for all pixels whose filters reach it, where filters reach neighbouring
    /// pixels. Pixels then have less noise, but it is correlated with that of the pixels around. Otherwise each pixel
    /// draws paths from its own filter, for itself alone, as derivatives always do; this is also so for filters with a
    /// radius of more than 8 pixels.
    pub splatting: bool,
    /// For [`EstimatorKind::Warped`]: the way in which rays turn or vertices move.
    pub warp: Warp,
    /// Half step of finite differences, in units of each parameter.
    pub step: f64,
    /// Seed of the random numbers: equal seeds give equal pixel data.
    pub seed: u64,
    /// Number of threads; 0 is one per core. Without the feature `parallel` there is one thread.
    pub threads: usize,
    /// Samples per pixel that a run is expected to take. The pilot of [`EstimatorKind::Auto`] costs at most a tenth of such a run;
    /// where the run is so short that this tells nothing, there is no pilot.
    pub expected_spp: u32,
    /// Also return the terms of each derivative separately.
    pub terms: bool,
    /// Velocity fields inside media that are to replace the plan's choice, each with the medium's index.
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
            expected_spp: 64,
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
