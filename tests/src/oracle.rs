//! The oracle file: scenes with values and derivatives known from closed forms and quadrature.
//!
//! The file's own `conventions` say what its numbers mean. Nothing here knows a number of any
//! particular file: one of the same form, named by the environment variable `DRT_ORACLES`, is read
//! in place of the one next to these tests.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use drt_math::Frame;
use serde::Deserialize;

use crate::Result;
use crate::detector::vector;

/// A point or vector as the file writes it.
pub type Triple = [f64; 3];

/// All oracles.
#[derive(Clone, Debug, Deserialize)]
pub struct OracleFile {
    /// One scene each, measured by one detector.
    pub cases: Vec<Case>,
}

/// A scene, its detector, and what must come out.
#[derive(Clone, Debug, Deserialize)]
pub struct Case {
    /// Unique name.
    pub id: String,
    /// What is tested.
    pub kind: String,
    /// What there is.
    pub scene: SceneText,
    /// What is measured.
    pub detector: Detector,
    /// What changes.
    #[serde(default)]
    pub parameters: Vec<ParameterText>,
    /// The measured value.
    pub value: Option<f64>,
    /// Of a slab: one medium and its numbers per row.
    #[serde(default)]
    pub rows: Vec<SlabRow>,
    /// Of a furnace: the same with paths cut short.
    #[serde(default)]
    pub truncated: Vec<TruncatedFurnace>,
    /// Of a furnace: the same filled with a medium.
    pub medium_variant: Option<FilledFurnace>,
    /// Of layers: the same with the upper medium everywhere.
    pub identical_media_variant: Option<IdenticalLayers>,
}

/// What there is.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct SceneText {
    /// Surfaces that block light.
    pub surfaces: Vec<Surface>,
    /// Participating media; where their boxes touch, they share the face.
    pub media: Vec<MediumText>,
    /// Lights that are not surfaces.
    pub lights: Vec<Light>,
    /// Which paths count; all of them where this is absent.
    pub max_order: Option<String>,
}

/// A surface that blocks light: triangles, or the inside of a box's faces.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct Surface {
    /// What parameters call it.
    pub name: String,
    /// Corners.
    #[serde(default)]
    pub vertices: Vec<Triple>,
    /// Corner indices, counter-clockwise seen from the front.
    #[serde(default)]
    pub triangles: Vec<[u32; 3]>,
    /// `cube faces` in place of triangles.
    pub shape: Option<String>,
    /// Lower corner of the cube.
    pub lo: Option<Triple>,
    /// Upper corner of the cube.
    pub hi: Option<Triple>,
    /// `black` or `diffuse`.
    pub bsdf: String,
    /// Reflectance of a diffuse one.
    pub albedo: Option<f64>,
    /// Radiance emitted in front.
    pub emission: Option<f64>,
    /// Whether a diffuse one reflects behind, too.
    #[serde(default)]
    pub two_sided: bool,
}

/// A medium: coefficients in a region.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct MediumText {
    /// `box`, `all space`, or a slab that a row describes.
    pub region: String,
    /// Lower corner of the box.
    pub lo: Option<Triple>,
    /// Upper corner of the box.
    pub hi: Option<Triple>,
    /// Extinction, or a formula where rows give it.
    pub sigma_t: Option<NumberText>,
    /// Node-centred extinction `[i][j][k]` along x, y, z, before the scale.
    pub sigma_t_grid: Option<Vec<Vec<Vec<f64>>>>,
    /// What the grid is multiplied with.
    pub sigma_t_scale: Option<f64>,
    /// Scattering over extinction.
    #[serde(default)]
    pub albedo: f64,
    /// Radiance of the source term, which is this times the absorption.
    #[serde(default)]
    pub emission_radiance: f64,
    /// `HG`, `isotropic` or `Rayleigh`.
    pub phase: Option<String>,
    /// Mean cosine.
    pub g: Option<f64>,
}

/// A number, or words that say where it comes from.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
pub enum NumberText {
    /// The number.
    Number(f64),
    /// The words.
    Words(String),
}

/// A light that is not a surface.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum Light {
    /// Of the same intensity in all directions.
    Point {
        /// Where it is.
        position: Triple,
        /// Power per steradian.
        intensity: f64,
    },
    /// Parallel light.
    Directional {
        /// Where it flows to.
        direction: Triple,
        /// Power per area perpendicular to the flow.
        irradiance: f64,
    },
    /// A sky of the same radiance everywhere.
    Environment {
        /// The radiance.
        radiance: NumberText,
    },
}

/// What is measured.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum Detector {
    /// Radiance against a direction of view.
    Radiance {
        /// Where.
        origin: Triple,
        /// From where the light comes.
        direction: Triple,
    },
    /// Radiance times cosine over a hemisphere.
    Irradiance {
        /// Where.
        point: Triple,
        /// The hemisphere's axis.
        normal: Triple,
    },
    /// Radiance times a filter on the image plane at distance one.
    PinholePixel {
        /// Its frame.
        camera: Camera,
        /// `tent`.
        filter: String,
        /// Middle of the filter's support.
        center: [f64; 2],
        /// Half its side.
        half_width: f64,
    },
    /// Words; rows say what they mean.
    #[serde(other)]
    Words,
}

/// A camera's frame.
#[derive(Clone, Debug, Deserialize)]
pub struct Camera {
    /// The pinhole.
    pub position: Triple,
    /// First axis of the image plane.
    pub right: Triple,
    /// Second axis of the image plane.
    pub up: Triple,
    /// Into the scene.
    pub forward: Triple,
}

/// What changes, and the derivative of the measured value.
#[derive(Clone, Debug, Deserialize)]
pub struct ParameterText {
    /// Name of the derivative; without velocities, of the scalar that is the parameter.
    pub name: String,
    /// Where the derivative is taken; absent where the name speaks of any motion.
    pub theta0: Option<f64>,
    /// What moves, and how.
    #[serde(default)]
    pub velocity: BTreeMap<String, Velocity>,
    /// The derivative.
    pub derivative: f64,
}

/// One velocity, or one per vertex.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
pub enum Velocity {
    /// Of a whole.
    Uniform(Triple),
    /// Of each vertex.
    PerVertex(Vec<Triple>),
}

/// Numbers of one slab.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct SlabRow {
    /// Optical thickness.
    pub tau: f64,
    /// Scattering over extinction.
    pub albedo: f64,
    /// Mean cosine.
    pub g: f64,
    /// Values.
    #[serde(flatten)]
    pub values: SlabNumbers,
    /// Derivatives by optical thickness.
    pub d_tau: SlabNumbers,
    /// Derivatives by albedo.
    pub d_albedo: SlabNumbers,
    /// Derivatives by mean cosine.
    pub d_g: SlabNumbers,
}

/// One number for each way of lighting and looking at a slab.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct SlabNumbers {
    /// Reflected part of a normally incident beam.
    #[serde(rename = "R_normal")]
    pub r_normal: f64,
    /// Transmitted part of it.
    #[serde(rename = "T_normal_total")]
    pub t_normal: f64,
    /// Reflected part of isotropic light.
    #[serde(rename = "R_diffuse")]
    pub r_diffuse: f64,
    /// Transmitted part of it.
    #[serde(rename = "T_diffuse_total")]
    pub t_diffuse: f64,
}

/// Numbers of a furnace whose paths are cut short.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct TruncatedFurnace {
    /// Reflections that are counted.
    pub max_bounces: u32,
    /// Radiance.
    pub value: f64,
    /// Its derivative by the reflectance.
    pub d_rho: f64,
}

/// A furnace with a medium inside.
#[derive(Clone, Debug, Deserialize)]
pub struct FilledFurnace {
    /// `… sigma_t=…, albedo=…, … g=…`.
    pub medium: String,
    /// Radiance.
    pub value: f64,
    /// Its derivative by the extinction.
    pub d_sigma_t: f64,
    /// Its derivative by the mean cosine.
    pub d_g: f64,
}

/// Layers of the same medium.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct IdenticalLayers {
    /// The measured value.
    pub value: f64,
    /// Its derivative by the place of the interface.
    pub derivative_interface_motion: f64,
}

impl OracleFile {
    /// Reads the file named by `DRT_ORACLES`, else the one of these tests.
    ///
    /// # Errors
    /// When it cannot be read or has another form.
    pub fn read() -> Result<Self> {
        let own = || Path::new(env!("CARGO_MANIFEST_DIR")).join("data/oracles.json");
        let path = std::env::var_os("DRT_ORACLES").map_or_else(own, PathBuf::from);
        let failed = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
        let text = std::fs::read_to_string(&path).map_err(|e| failed(&e))?;
        Ok(serde_json::from_str(&text).map_err(|e| failed(&e))?)
    }
}

impl Detector {
    /// The same with a pixel of some width in place of a ray, where the number itself does not
    /// matter: it costs far fewer samples.
    #[must_use]
    pub fn widened(self, half_width: f64) -> Self {
        let Self::Radiance { origin, direction } = self else { return self };
        let Frame { s, t, n } = Frame::from_normal(vector(direction).normalize());
        let [right, up, forward] = [s, t, n].map(|axis| axis.to_array());
        let camera = Camera { position: origin, right, up, forward };
        Self::PinholePixel { camera, filter: "tent".into(), center: [0.0; 2], half_width }
    }
}

impl NumberText {
    /// The number.
    ///
    /// # Errors
    /// When there are words in its place.
    pub fn number(&self) -> Result<f64> {
        match self {
            Self::Number(x) => Ok(*x),
            Self::Words(w) => Err(format!("`{w}` is not a number").into()),
        }
    }
}
