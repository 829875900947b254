//! The keys of a job file, as they stand there.

use std::path::PathBuf;

use serde::Deserialize;
use toml::Spanned;

/// A whole job.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Job {
    pub(super) scene: PathBuf,
    pub(super) sensor: Option<Spanned<String>>,
    #[serde(default)]
    pub(super) estimator: Estimator,
    #[serde(default)]
    pub(super) parameter: Vec<Spanned<Parameter>>,
    #[serde(default)]
    pub(super) parameter_group: Vec<Spanned<ParameterGroup>>,
    #[serde(default)]
    pub(super) motion: Vec<Spanned<Motion>>,
    /// Changes nothing unless fitting is asked for.
    #[serde(rename = "optimize")]
    pub(super) _optimize: Option<Optimize>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Estimator {
    pub(super) kind: Option<Spanned<Kind>>,
    pub(super) sampling: Option<Spanned<Sampling>>,
    pub(super) spp: Option<Spanned<i64>>,
    pub(super) boundary_spp: Option<Spanned<i64>>,
    pub(super) max_depth: Option<Spanned<i64>>,
    pub(super) antithetic: Option<bool>,
    /// Where guiding exists it does not change expected values.
    pub(super) guiding: Option<bool>,
    pub(super) step: Option<Spanned<f64>>,
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Kind {
    Radiative,
    PathSpace,
    Warped,
    FiniteDifference,
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Sampling {
    Unidirectional,
    Bidirectional,
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
    pub(super) translate: Option<[f64; 3]>,
    pub(super) rotate: Option<Rotate>,
    pub(super) scale: Option<Scale>,
    pub(super) matrix: Option<[[f64; 4]; 3]>,
    pub(super) vertex_velocity: Option<PathBuf>,
    pub(super) vertex: Option<Vertex>,
    pub(super) cage: Option<Cage>,
    pub(super) follow: Option<String>,
    pub(super) property: Option<String>,
    pub(super) add: Option<[f64; 3]>,
    pub(super) multiply: Option<f64>,
    pub(super) log: Option<bool>,
    pub(super) voxels: Option<Voxels>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Rotate {
    pub(super) axis: [f64; 3],
    #[serde(default)]
    pub(super) pivot: [f64; 3],
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Scale {
    pub(super) factor: [f64; 3],
    #[serde(default)]
    pub(super) pivot: [f64; 3],
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Vertex {
    pub(super) index: u32,
    pub(super) direction: [f64; 3],
}

/// A control cage: one of its vertices, or, in a group, all of them.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Cage {
    pub(super) mesh: PathBuf,
    pub(super) vertex: Option<u32>,
    pub(super) direction: Option<[f64; 3]>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(untagged, expecting = "expected \"all\" or [i, j, k]")]
pub(super) enum Voxels {
    All(All),
    One([usize; 3]),
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum All {
    All,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "checked for form; groups come with the reverse mode")]
pub(super) struct ParameterGroup {
    target: String,
    name: Option<String>,
    property: Option<String>,
    vertices: Option<All>,
    cage: Option<Cage>,
    voxels: Option<All>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Motion {
    pub(super) medium: String,
    pub(super) kind: MotionKind,
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

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "checked for form; used by the optimisation")]
pub(super) struct Optimize {
    targets: Vec<PathBuf>,
    loss: Option<Loss>,
    optimizer: Option<Optimizer>,
    checkpoint: Option<PathBuf>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[expect(dead_code, reason = "checked for form; used by the optimisation")]
pub(super) enum Loss {
    L2,
    L1,
    Rmse,
    PyramidL2 { levels: u32, weight: f64 },
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "checked for form; used by the optimisation")]
pub(super) struct Optimizer {
    kind: OptimizerKind,
    learning_rate: f64,
    iterations: u32,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum OptimizerKind {
    Adam,
    Sgd,
}
