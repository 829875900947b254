//! The keys of a job file, as they stand there.

use std::collections::BTreeMap;
use std::path::PathBuf;

use drt_estimators::PathSampling;
use serde::Deserialize;
use toml::Spanned;

use super::list::List;

/// A whole job.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Job {
    pub(super) scene: Spanned<PathBuf>,
    pub(super) sensor: Option<Spanned<String>>,
    #[serde(default)]
    pub(super) estimator: Estimator,
    #[serde(default)]
    pub(super) parameter: Vec<Spanned<Parameter>>,
    #[serde(default)]
    pub(super) parameter_group: Vec<Spanned<ParameterGroup>>,
    #[serde(default)]
    pub(super) motion: Vec<Spanned<Motion>>,
    #[serde(default)]
    pub(super) view: Vec<Spanned<View>>,
    pub(super) optimize: Option<Spanned<Optimize>>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Estimator {
    pub(super) kind: Option<Spanned<Kind>>,
    pub(super) sampling: Option<Sampling>,
    pub(super) spp: Option<Spanned<i64>>,
    pub(super) boundary_spp: Option<Spanned<i64>>,
    pub(super) max_depth: Option<Spanned<i64>>,
    pub(super) antithetic: Option<bool>,
    /// Where guiding exists it does not change expected values.
    pub(super) guiding: Option<bool>,
    /// Of `radiative`: every vertex of a path looks for an edge, not one of them.
    pub(super) every_vertex: Option<bool>,
    /// Of `warped`: how vertices move with edges.
    pub(super) warp: Option<Spanned<Warp>>,
    /// Paths of the image count for all pixels that they reach.
    pub(super) splatting: Option<bool>,
    /// Noisier pixels take more samples.
    pub(super) adaptive: Option<bool>,
    pub(super) step: Option<Spanned<f64>>,
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Kind {
    Auto,
    Radiative,
    PathSpace,
    Warped,
    FiniteDifference,
}

/// How vertices move with edges; all but `by` are of auxiliary samples.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Warp {
    pub(super) by: WarpBy,
    pub(super) samples: Option<u32>,
    pub(super) kernel: Option<WarpKernel>,
    pub(super) debiased: Option<bool>,
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub(super) enum WarpBy {
    Edges,
    Points,
    Directions,
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
pub(super) enum WarpKernel {
    #[serde(rename = "corrected")]
    Corrected,
    #[serde(rename = "year-2023")]
    Year2023,
    #[serde(rename = "year-2020")]
    Year2020,
}

/// How paths are found, as jobs and commands name it.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Sampling {
    /// From the camera.
    Unidirectional,
    /// From the camera and from emitters.
    Bidirectional,
    /// What a pilot finds to take less work.
    Auto,
}

impl From<Sampling> for PathSampling {
    fn from(sampling: Sampling) -> Self {
        match sampling {
            Sampling::Unidirectional => Self::Unidirectional,
            Sampling::Bidirectional => Self::Bidirectional,
            Sampling::Auto => Self::Auto,
        }
    }
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Parameter {
    pub(super) name: String,
    #[serde(default)]
    pub(super) value: f64,
    #[serde(default)]
    pub(super) effect: Vec<Spanned<Effect>>,
}

/// One effect: a target, one key that says what happens, and what belongs to that key.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Effect {
    pub(super) target: String,
    pub(super) translate: Option<List<f64, 3>>,
    pub(super) rotate: Option<Rotate>,
    pub(super) scale: Option<Scale>,
    pub(super) matrix: Option<List<List<f64, 4>, 3>>,
    pub(super) vertex_velocity: Option<PathBuf>,
    pub(super) vertex_normals: Option<PathBuf>,
    pub(super) vertex: Option<Vertex>,
    pub(super) cage: Option<Cage>,
    pub(super) follow: Option<String>,
    pub(super) property: Option<String>,
    pub(super) add: Option<List<f64, 3>>,
    pub(super) multiply: Option<f64>,
    pub(super) log: Option<bool>,
    pub(super) voxels: Option<Voxels>,
    pub(super) texels: Option<Texels>,
    /// In views: by how much.
    pub(super) amount: Option<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct View {
    pub(super) target: PathBuf,
    pub(super) sensor: Option<String>,
    pub(super) mask: Option<PathBuf>,
    #[serde(default)]
    pub(super) effect: Vec<Spanned<Effect>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Rotate {
    pub(super) axis: List<f64, 3>,
    #[serde(default)]
    pub(super) pivot: List<f64, 3>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Scale {
    pub(super) factor: List<f64, 3>,
    #[serde(default)]
    pub(super) pivot: List<f64, 3>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Vertex {
    pub(super) index: u32,
    pub(super) direction: List<f64, 3>,
}

/// A control cage: one of its vertices, or, in a group, all of them.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Cage {
    pub(super) mesh: PathBuf,
    pub(super) vertex: Option<u32>,
    pub(super) direction: Option<List<f64, 3>>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(untagged, expecting = "expected \"all\" or [i, j, k]")]
pub(super) enum Voxels {
    All(All),
    One(List<usize, 3>),
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(untagged, expecting = "expected \"all\" or [column, row]")]
pub(super) enum Texels {
    All(All),
    One(List<usize, 2>),
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum All {
    All,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ParameterGroup {
    pub(super) target: String,
    pub(super) name: Option<String>,
    pub(super) property: Option<String>,
    pub(super) vertices: Option<All>,
    pub(super) cage: Option<Cage>,
    pub(super) voxels: Option<All>,
    pub(super) texels: Option<All>,
    pub(super) learning_rate: Option<GroupRate>,
    pub(super) laplacian: Option<f64>,
    pub(super) smooth: Option<f64>,
    pub(super) bounds: Option<List<f64, 2>>,
    pub(super) log: Option<bool>,
}

impl ParameterGroup {
    /// The keys that say how the group is stepped.
    pub(super) fn steps(&self) -> Steps {
        let Self { learning_rate, laplacian, smooth, bounds, log, .. } = self;
        let learning_rate = learning_rate.clone();
        Steps { learning_rate, laplacian: *laplacian, smooth: *smooth, bounds: *bounds, log: *log }
    }
}

/// How a fit steps unknowns.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Steps {
    pub(super) learning_rate: Option<GroupRate>,
    pub(super) laplacian: Option<f64>,
    pub(super) smooth: Option<f64>,
    pub(super) bounds: Option<List<f64, 2>>,
    pub(super) log: Option<bool>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(untagged, expecting = "expected a number or stages [[0, 0.02], [100, 0.005]]")]
pub(super) enum GroupRate {
    All(f64),
    Stages(Vec<List<f64, 2>>),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Motion {
    pub(super) medium: String,
    pub(super) kind: MotionKind,
    pub(super) tetrahedralizer: Option<Tetrahedralizer>,
    pub(super) mesh: Option<PathBuf>,
    pub(super) velocities: Option<PathBuf>,
    pub(super) parameter: Option<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum MotionKind {
    Affine,
    Tetrahedral,
    MeanValue,
    Static,
}

/// Who makes the tetrahedra that no file gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Tetrahedralizer {
    Own,
    Tetgen,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Optimize {
    #[serde(default)]
    pub(super) targets: Vec<Spanned<PathBuf>>,
    pub(super) views_per_iteration: Option<Spanned<u32>>,
    pub(super) sensors: Option<Spanned<Vec<String>>>,
    pub(super) masks: Option<Spanned<Vec<Spanned<PathBuf>>>>,
    pub(super) relative: Option<f64>,
    pub(super) loss: Option<Spanned<Loss>>,
    pub(super) optimizer: Option<Spanned<Optimizer>>,
    #[serde(default)]
    pub(super) bounds: BTreeMap<Spanned<String>, List<f64, 2>>,
    #[serde(default)]
    pub(super) log: Vec<Spanned<String>>,
    #[serde(default)]
    pub(super) spp: Vec<Spanned<List<u32, 2>>>,
    #[serde(default)]
    pub(super) reduce: Vec<Spanned<List<u32, 2>>>,
    pub(super) checkpoint: Option<PathBuf>,
    pub(super) checkpoint_every: Option<Spanned<u32>>,
}

#[derive(Debug, Deserialize)]
#[serde(
    untagged,
    expecting = "expected \"l2\", \"l1\", \"rmse\", \"pyramid-l2\" or { pyramid-l2 = { levels = 10, weight = 4 } }"
)]
pub(super) enum Loss {
    Plain(LossKind),
    Pyramid(PyramidLoss),
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum LossKind {
    L2,
    L1,
    Rmse,
    PyramidL2,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct PyramidLoss {
    pub(super) pyramid_l2: Pyramid,
}

#[derive(Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct Pyramid {
    pub(super) levels: u32,
    pub(super) weight: f64,
}

impl Default for Pyramid {
    fn default() -> Self {
        Self { levels: 10, weight: 4.0 }
    }
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct Optimizer {
    pub(super) kind: OptimizerKind,
    pub(super) learning_rate: LearningRate,
    pub(super) iterations: Option<u32>,
    pub(super) betas: Option<List<f64, 2>>,
    pub(super) epsilon: Option<f64>,
    pub(super) momentum: Option<f64>,
    pub(super) memory: Option<f64>,
    pub(super) decay: Decay,
}

#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum OptimizerKind {
    #[default]
    Adam,
    Sgd,
    GaussNewton,
}

#[derive(Debug, Deserialize)]
#[serde(untagged, expecting = "expected a number, or { NAME = number } with every parameter")]
pub(super) enum LearningRate {
    All(f64),
    Each(BTreeMap<String, f64>),
}

impl Default for LearningRate {
    fn default() -> Self {
        Self::All(0.05)
    }
}

#[derive(Debug, Deserialize)]
#[serde(
    untagged,
    expecting = "expected \"constant\", \"exponential\", \"cosine\" or { kind = \"cosine\", end = 0.01 }"
)]
pub(super) enum Decay {
    Plain(DecayKind),
    Table(DecayTable),
}

impl Default for Decay {
    fn default() -> Self {
        Self::Plain(DecayKind::Constant)
    }
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum DecayKind {
    Constant,
    Exponential,
    Cosine,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DecayTable {
    pub(super) kind: DecayKind,
    pub(super) end: f64,
}
