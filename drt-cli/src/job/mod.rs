//! Jobs: a scene, an estimator and parameters, in one TOML file.

mod cages;
mod document;
mod effects;
mod files;
mod groups;
pub(crate) mod keys;
mod list;
mod motions;
mod optimize;
mod preparation;
mod refusal;
#[cfg(test)]
mod tests;
mod velocities;
mod views;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use drt_estimators::fit::Group;
use drt_estimators::{
    AuxiliarySamples, Depth, EstimatorKind, Scene, Settings, Target, Term, Warp, WarpKernel,
};
use drt_motion::Parameter;
use toml::Spanned;

use crate::error::{Place, Warning};
use crate::files::input_file;
use crate::files::input_file::{read_text, text_of};
use crate::scene_xml::{Read, SceneReader, decode};
use crate::{CliError, Defaults};
use cages::Cages;
use document::Document;
pub use groups::{GroupSteps, ParameterGroup};
pub use optimize::Optimize;

/// What the command line lays over a job or scene.
#[derive(Clone, Debug, Default)]
pub struct Overrides {
    /// Job keys and values, as `--set KEY=VALUE` gives them.
    pub set: Vec<(String, String)>,
    /// Values of the scene's `<default>` names, as `-D NAME=VALUE` gives them.
    pub defaults: Defaults,
    /// The contents of the scene's file, in place of what is stored under the name that the job gives; relative names in the
    /// scene start from the folder of that name.
    pub scene: Option<Vec<u8>>,
}

/// Most values of parameters that a message shows.
const MOST_VALUES: usize = 8;

/// Most bytes in the name of a parameter: with what comes to it, the name of a channel has at most 255.
const LONGEST_NAME: usize = 200;

/// Samples per pixel, where neither job nor scene says how many.
const DEFAULT_SPP: u32 = 64;

/// A scene with what is to be estimated in it.
#[derive(Clone, Debug)]
pub struct Job {
    /// The file it came from: a job, or a scene alone.
    pub path: PathBuf,
    /// The job file's text; `None` for a scene alone.
    pub text: Option<String>,
    /// The scene file.
    pub scene_path: PathBuf,
    /// The scene at the parameters' zero.
    pub scene: Scene,
    /// What is differentiated with respect to, in file order.
    pub parameters: Vec<Parameter<String>>,
    /// How images and derivatives are estimated.
    pub settings: Settings,
    spp: u32,
    /// Boundary samples, per pixel on average, where the job says how many.
    boundary_spp: Option<u32>,
    /// What in the scene is passed over.
    pub warnings: Vec<Warning>,
    /// Where each parameter stands.
    places: Vec<Place>,
    /// How the parameters are fitted, where that is said, or what stands in the way.
    optimize: Result<Option<Optimize>, CliError>,
    /// Parameters that only gradients know, after those of [`parameters`](Self::parameters).
    pub groups: Vec<ParameterGroup>,
    /// What stands in the way of derivative images, but not of a gradient.
    grouped: Option<CliError>,
    /// What it was read from, but for pictures to fit to.
    pub(crate) files: Vec<PathBuf>,
    /// Values given for the scene's `<default>` names.
    pub defaults: Defaults,
}

/// Reads a job file and its scene.
///
/// ```
/// use drt_cli::{Overrides, read_job};
///
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("job.toml");
/// # let scene = r#"<scene version="3.0.0"><emitter type="constant" id="sky"/></scene>"#;
/// # std::fs::write(folder.path().join("scene.xml"), scene)?;
/// std::fs::write(
///     &path,
///     r#"scene = "scene.xml"
///
///        [[parameter]]
///        name = "light"
///        [[parameter.effect]]
///        target = "sky"
///        property = "radiance"
///        multiply = 1.0"#,
/// )?;
/// let set = vec![("estimator.spp".into(), "16".into())];
/// let job = read_job(&path, &Overrides { set, ..Overrides::default() })?;
/// assert_eq!((job.spp(), job.parameters[0].name.as_str()), (16, "light"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Names the file, line and key, or the `--set`, of what is malformed, unknown, missing or not
/// supported.
pub fn read_job(path: &Path, overrides: &Overrides) -> Result<Job, CliError> {
    read_job_by(path, overrides, &mut SceneReader::default())
}

/// As [`read_job`], with a reader that may know the scene.
pub(crate) fn read_job_by(
    path: &Path,
    overrides: &Overrides,
    scenes: &mut SceneReader,
) -> Result<Job, CliError> {
    parse(path, &read_text(path, None)?, overrides, scenes)
}

/// Reads a job from the bytes of its text, as [`read_job`] does from a file. Relative file names start from the folder of
/// `path`, by which messages call the text; such a file need not exist.
///
/// The job's scene is read from the file that its key `scene` names, unless [`Overrides::scene`] has it:
///
/// ```
/// use std::path::Path;
///
/// use drt_cli::{Overrides, decode_job};
///
/// let scene = br#"<scene version="3.0.0"><emitter type="constant" id="sky"/></scene>"#.to_vec();
/// let overrides = Overrides { scene: Some(scene), ..Overrides::default() };
/// let job = decode_job(b"scene = \"sky.xml\"", Path::new("open/job.toml"), &overrides)?;
/// assert_eq!(job.scene.emitters.len(), 1);
///
/// let error = decode_job(b"scene = 1", Path::new("open/job.toml"), &overrides).unwrap_err();
/// assert!(error.to_string().starts_with("open/job.toml:1:9: "));
/// # Ok::<(), drt_cli::CliError>(())
/// ```
///
/// # Errors
/// As [`read_job`].
pub fn decode_job(bytes: &[u8], path: &Path, overrides: &Overrides) -> Result<Job, CliError> {
    parse(path, text_of(bytes, path)?, overrides, &mut SceneReader::default())
}

fn parse(
    path: &Path,
    text: &str,
    overrides: &Overrides,
    scenes: &mut SceneReader,
) -> Result<Job, CliError> {
    let document = Document::new(path, text, &overrides.set);
    let keys: keys::Job = document.parse()?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let scene_path = scene_file(&document, &keys.scene, folder, overrides.scene.is_some())?;
    let (mut scene, warnings, mut read) = match &overrides.scene {
        Some(bytes) => decode(bytes, &scene_path, &overrides.defaults)?,
        None => scenes.read(&scene_path, &overrides.defaults)?,
    };
    if !(keys.parameter.is_empty() && keys.parameter_group.is_empty()) {
        let expanded = scene.expanded().map(std::borrow::Cow::into_owned);
        scene = expanded.map_err(|e| CliError::input(&Place::file(&scene_path), e))?;
    }
    let (parameters, places) = parameters(&document, &keys, folder, &scene)?;
    let settings = settings(&document, &keys, folder, &scene, &parameters)?;
    let [spp, boundary_spp] = sample_counts(&document, &keys.estimator)?;
    let groups = groups::groups(&document, &keys.parameter_group, folder, &scene)?;
    let views = views::views(&document, &keys.view, folder, &scene)?;
    let known = optimize::Known { scene: &scene, parameters: &parameters, groups: &groups };
    let optimize = optimize::optimize(&document, &keys, folder, &known, views);
    let grouped = grouped(&document, &keys);
    read.extend(files::named(&keys, folder));
    read.push(path.into());
    let path = path.into();
    let text = Some(text.into());
    let mut job = Job {
        path,
        text,
        scene_path,
        scene,
        parameters,
        settings,
        spp: DEFAULT_SPP,
        boundary_spp,
        optimize,
        warnings,
        places,
        groups,
        grouped,
        files: read,
        defaults: overrides.defaults.clone(),
    };
    job.set_spp(spp.unwrap_or(DEFAULT_SPP));
    Ok(job)
}

/// The file of the scene that a job names; it need not exist where its contents are given.
fn scene_file(
    document: &Document<'_>,
    key: &Spanned<PathBuf>,
    folder: &Path,
    given: bool,
) -> Result<PathBuf, CliError> {
    let fail = |message: String| document.error_at(key.span().start, format!("`scene`{message}"));
    if key.get_ref().as_os_str().is_empty() {
        return Err(fail(" is empty; expected a file such as \"scene.xml\"".into()));
    }
    let path = folder.join(key.get_ref());
    if !given {
        let unreadable = |e| fail(format!(": cannot read {}: {e}", path.display()));
        input_file::check(&path).map_err(unreadable)?;
    }
    Ok(path)
}

impl Job {
    /// Reads a scene alone, with the number of samples that its sensor asks for.
    ///
    /// # Errors
    /// As [`read_scene`](crate::read_scene).
    pub fn read_scene(path: &Path, defaults: &Defaults) -> Result<Self, CliError> {
        Self::read_scene_by(path, defaults, &mut SceneReader::default())
    }

    /// As [`Job::read_scene`], with a reader that may know the scene.
    pub(crate) fn read_scene_by(
        path: &Path,
        defaults: &Defaults,
        scenes: &mut SceneReader,
    ) -> Result<Self, CliError> {
        Ok(Self::of_scene(path, defaults, scenes.read(path, defaults)?))
    }

    /// Reads a scene alone from the bytes of its text; `path` has the meaning that it has for
    /// [`decode_scene`](crate::decode_scene).
    ///
    /// # Errors
    /// As [`read_scene`](crate::read_scene).
    pub fn decode_scene(bytes: &[u8], path: &Path, defaults: &Defaults) -> Result<Self, CliError> {
        Ok(Self::of_scene(path, defaults, decode(bytes, path, defaults)?))
    }

    fn of_scene(path: &Path, defaults: &Defaults, (scene, warnings, files): Read) -> Self {
        let mut job = Self {
            path: path.into(),
            text: None,
            scene_path: path.into(),
            scene,
            parameters: Vec::new(),
            settings: Settings::default(),
            spp: DEFAULT_SPP,
            boundary_spp: None,
            optimize: Ok(None),
            warnings,
            places: Vec::new(),
            groups: Vec::new(),
            grouped: None,
            files,
            defaults: defaults.clone(),
        };
        job.take_sample_count();
        job
    }

    /// Where no job says how many samples to take, the sensor's sampler does.
    fn take_sample_count(&mut self) {
        let sensor = self.scene.sensors.get(self.settings.sensor);
        if let (None, Some(count)) = (&self.text, sensor.and_then(|s| s.item.sample_count)) {
            self.set_spp(count);
        }
    }

    /// Samples per pixel.
    #[must_use]
    pub fn spp(&self) -> u32 {
        self.spp
    }

    /// Changes the number of samples per pixel. Boundary samples stay as many as the job says; where it does not,
    /// they change in proportion.
    pub fn set_spp(&mut self, spp: u32) {
        self.settings = self.settings_for(spp);
        self.spp = spp;
    }

    /// The settings with another number of samples per pixel.
    pub(crate) fn settings_for(&self, spp: u32) -> Settings {
        let ratio = |boundary: u32| f64::from(boundary) / f64::from(spp.max(1));
        let boundary_ratio = self.boundary_spp.map(ratio);
        Settings { expected_spp: spp, boundary_ratio, ..self.settings.clone() }
    }

    /// Gives a sensor's film another size, in pixels.
    ///
    /// # Errors
    /// When there is no such sensor, or no film of that size.
    pub fn resize(&mut self, sensor: usize, size: [u32; 2]) -> Result<(), CliError> {
        let Some(sensor) = self.scene.sensors.get_mut(sensor) else {
            let message = "the scene has no <sensor>";
            return Err(CliError::input(&Place::file(&self.scene_path), message));
        };
        let resized = sensor.item.sensor.with_film(size);
        sensor.item.sensor = resized.map_err(|e| CliError::argument(format!("--size: {e}")))?;
        Ok(())
    }

    /// Adds a group of each shape's vertices, each medium's voxels and each texture's texels, as far as they have
    /// gradients; they are named as [`Group::all`] does.
    #[must_use]
    pub fn with_all_groups(mut self) -> Self {
        let all = Group::all(&self.scene).into_iter().map(ParameterGroup::from);
        self.groups.extend(all);
        self
    }

    /// What to call it among others: the file's name, or that of its folder where the file's says
    /// nothing.
    #[must_use]
    pub fn name(&self) -> String {
        name_of(&self.path)
    }

    /// Chooses the sensor of an id, or of kind and order such as `sensor[1]`.
    ///
    /// # Errors
    /// When nothing has this name, or it is not a sensor.
    pub fn select_sensor(&mut self, name: &str) -> Result<(), CliError> {
        self.settings.sensor = find_sensor(&self.scene, name)
            .map_err(|e| CliError::argument(format!("--sensor: {e}")))?;
        self.take_sample_count();
        Ok(())
    }

    /// The index of the sensor of an id, or of kind and order such as `sensor[1]`.
    ///
    /// # Errors
    /// When nothing has this name, or it is not a sensor.
    pub fn find_sensor(&self, name: &str) -> Result<usize, CliError> {
        find_sensor(&self.scene, name).map_err(CliError::argument)
    }

    /// Lists all files that were read.
    pub fn inputs(&self) -> impl Iterator<Item = &Path> {
        self.files.iter().map(PathBuf::as_path)
    }

    /// Lists the pictures that a fit reads; other commands may write them.
    pub fn pictures(&self) -> impl Iterator<Item = &Path> {
        let plan = self.optimize.as_ref().ok().and_then(Option::as_ref);
        let pictures = plan
            .into_iter()
            .flat_map(|plan| plan.targets.iter().chain(plan.masks.iter().flatten()));
        pictures.map(PathBuf::as_path)
    }

    /// Refuses parameters whose layers have the names of the terms of others.
    ///
    /// # Errors
    /// Names both.
    pub fn check_terms(&self) -> Result<(), CliError> {
        for (parameter, place) in self.parameters.iter().zip(&self.places) {
            let own = parameter.name.strip_suffix("_stderr").unwrap_or(&parameter.name);
            let taken = Term::ALL.iter().find_map(|term| {
                let other = own.strip_suffix(term.name())?.strip_suffix('.')?;
                self.parameters.iter().find(|p| p.name == other).map(|p| (&p.name, term.name()))
            });
            if let Some((other, term)) = taken {
                let name = &parameter.name;
                let message = format!(
                    "parameter `{name}`: with --terms its layer d_{name} would be one of the term `{term}` of \
                     `{other}`; expected another name"
                );
                return Err(CliError::input(place, message));
            }
        }
        Ok(())
    }

    /// Refuses what has a gradient, but no derivative images.
    ///
    /// # Errors
    /// Names the key.
    pub fn require_derivatives(&self) -> Result<(), CliError> {
        self.grouped.clone().map_or(Ok(()), Err)
    }

    /// How the parameters are fitted to target images, where the job says so.
    ///
    /// # Errors
    /// Names what in `[optimize]` cannot be meant.
    pub fn optimize(&self) -> Result<Option<&Optimize>, CliError> {
        self.optimize.as_ref().map(Option::as_ref).map_err(CliError::clone)
    }

    /// The parameters that are not at zero, where the scene by itself is good.
    fn values_to_blame(&self) -> Option<String> {
        let moved = self.parameters.iter().filter(|p| p.value != 0.0);
        let mut values: Vec<String> = moved.map(|p| format!("{} = {}", p.name, p.value)).collect();
        if values.is_empty() || self.scene.check().is_err() {
            return None;
        }
        if values.len() > MOST_VALUES {
            values.truncate(MOST_VALUES);
            values.push("…".into());
        }
        Some(values.join(", "))
    }

    /// An error of the estimators with the file, and the parameter's line, that it is about.
    #[must_use]
    pub fn blame(&self, error: &drt_estimators::Error) -> CliError {
        let place = match error {
            drt_estimators::Error::Effect { parameter, .. } => {
                let at = self.parameters.iter().position(|p| p.name == *parameter);
                at.and_then(|i| self.places.get(i)).cloned()
            }
            drt_estimators::Error::Element { .. } => {
                if let Some(values) = self.values_to_blame() {
                    let message = format!("at the parameters' values ({values}): {error}");
                    return CliError::input(&Place::file(&self.path), message);
                }
                Some(Place::file(&self.scene_path))
            }
            _ => None,
        };
        CliError::input(&place.unwrap_or_else(|| Place::file(&self.path)), error)
    }
}

/// What to call a file among others, as [`Job::name`] does.
pub(crate) fn name_of(path: &Path) -> String {
    let folder = path.parent().and_then(Path::file_name);
    let name = match (path.file_stem(), folder) {
        (Some(stem), Some(folder)) if stem == "job" || stem == "scene" => folder,
        (Some(stem), _) => stem,
        (None, _) => path.as_os_str(),
    };
    name.to_string_lossy().into_owned()
}

fn find_sensor(scene: &Scene, name: &str) -> Result<usize, String> {
    match scene.find(name).map_err(|e| e.to_string())? {
        Target::Sensor(i) => Ok(i),
        _ => Err(format!("`{name}` is not a sensor")),
    }
}

fn settings(
    document: &Document<'_>,
    keys: &keys::Job,
    folder: &Path,
    scene: &Scene,
    parameters: &[Parameter<String>],
) -> Result<Settings, CliError> {
    let keys::Estimator {
        kind,
        sampling,
        max_depth,
        antithetic,
        guiding,
        every_vertex,
        warp,
        splatting,
        adaptive,
        step,
        ..
    } = &keys.estimator;
    let mut settings = Settings::default();
    if let Some(name) = &keys.sensor {
        settings.sensor = find_sensor(scene, name.get_ref())
            .map_err(|e| document.error_at(name.span().start, format!("`sensor`: {e}")))?;
    }
    settings.estimator = match kind.as_ref().map(Spanned::get_ref) {
        Some(keys::Kind::FiniteDifference) => EstimatorKind::FiniteDifference,
        Some(keys::Kind::Radiative) => EstimatorKind::Radiative,
        Some(keys::Kind::Warped) => EstimatorKind::Warped,
        Some(keys::Kind::PathSpace) => EstimatorKind::PathSpace,
        Some(keys::Kind::Auto) | None => EstimatorKind::Auto,
    };
    if let Some(s) = sampling {
        settings.sampling = (*s).into();
    }
    if let Some(n) = max_depth {
        settings.max_depth =
            depth(*n.get_ref()).map_err(|message| document.error_at(n.span().start, message))?;
    }
    settings.insides = motions::insides(document, &keys.motion, folder, scene, parameters)?;
    settings.antithetic = antithetic.unwrap_or(settings.antithetic);
    settings.guiding = guiding.unwrap_or(settings.guiding);
    settings.every_vertex = every_vertex.unwrap_or(settings.every_vertex);
    if let Some(w) = warp {
        settings.warp = self::warp(w.get_ref())
            .map_err(|message| document.error_at(w.span().start, message))?;
    }
    settings.splatting = splatting.unwrap_or(settings.splatting);
    settings.adaptive = adaptive.unwrap_or(settings.adaptive);
    if let Some(s) = step {
        settings.step = *s.get_ref();
        if !(settings.step > 0.0 && settings.step.is_finite()) {
            let message = format!("`step` is {}; expected a positive number", settings.step);
            return Err(document.error_at(s.span().start, message));
        }
    }
    Ok(settings)
}

/// How vertices move with edges.
fn warp(keys: &keys::Warp) -> Result<Warp, &'static str> {
    let keys::Warp { by, samples, kernel, debiased } = *keys;
    let mut asked = AuxiliarySamples::default();
    asked.count = samples.unwrap_or(asked.count);
    asked.debiased = debiased.unwrap_or(asked.debiased);
    asked.kernel = match kernel {
        None | Some(keys::WarpKernel::Corrected) => WarpKernel::Corrected,
        Some(keys::WarpKernel::Year2023) => WarpKernel::Year2023,
        Some(keys::WarpKernel::Year2020) => WarpKernel::Year2020,
    };
    if asked.count == 0 {
        return Err("`samples` is 0; expected at least 1");
    }
    match by {
        keys::WarpBy::Points => Ok(Warp::Points(asked)),
        keys::WarpBy::Directions => Ok(Warp::Directions(asked)),
        keys::WarpBy::Edges if (samples, kernel, debiased) == (None, None, None) => Ok(Warp::Edges),
        keys::WarpBy::Edges => {
            Err("edges have no auxiliary samples; expected no other key than `by`")
        }
    }
}

/// Samples per pixel, and boundary samples per pixel on average, where they are said.
fn sample_counts(
    document: &Document<'_>,
    keys: &keys::Estimator,
) -> Result<[Option<u32>; 2], CliError> {
    let count = |key: &str, value: &Option<Spanned<i64>>| {
        let Some(value) = value else { return Ok(None) };
        let fits = u32::try_from(*value.get_ref()).ok().filter(|n| *n >= 1);
        let message = format!("`{key}` is {}; expected at least 1", value.get_ref());
        fits.ok_or_else(|| document.error_at(value.span().start, message)).map(Some)
    };
    Ok([count("spp", &keys.spp)?, count("boundary_spp", &keys.boundary_spp)?])
}

/// A path depth, where -1 is unlimited.
pub(crate) fn depth(value: i64) -> Result<Depth, String> {
    match (value, u32::try_from(value)) {
        (-1, _) => Ok(Depth::Unlimited),
        (_, Ok(depth)) => Ok(Depth::AtMost(depth)),
        _ => Err(format!("`max_depth` is {value}; expected -1 (unlimited), 0 or more")),
    }
}

fn parameters(
    document: &Document<'_>,
    keys: &keys::Job,
    folder: &Path,
    scene: &Scene,
) -> Result<(Vec<Parameter<String>>, Vec<Place>), CliError> {
    let mut names = BTreeSet::new();
    let mut parameters = Vec::new();
    let mut places = Vec::new();
    let mut cages = Cages::default();
    for spanned in &keys.parameter {
        let (at, parameter) = (spanned.span().start, spanned.get_ref());
        let name = &parameter.name;
        let fail =
            |message: String| document.error_at(at, format!("parameter `{name}`: {message}"));
        if name.is_empty() || name.contains(|c: char| c.is_control() || c == ',') {
            return Err(fail("the name must not be empty nor contain commas".into()));
        }
        if name.len() > LONGEST_NAME {
            let message =
                format!("the name has {} bytes; expected at most {LONGEST_NAME}", name.len());
            return Err(fail(message));
        }
        if !names.insert(name) {
            return Err(fail("the name is already taken".into()));
        }
        if !parameter.value.is_finite() {
            return Err(fail("`value` is not finite".into()));
        }
        let mut effects = Vec::new();
        for effect in &parameter.effect {
            let (at, keys) = (effect.span().start, effect.get_ref());
            let fail = |message| document.error_at(at, format!("parameter `{name}`: {message}"));
            if keys.amount.is_some() {
                return Err(fail("`amount` belongs to the effects of a [[view]]".into()));
            }
            let effect = effects::effect(keys, folder, &mut cages);
            let effect = effect.map_err(|refusal| refusal.told(fail))?;
            let targets = scene.find_all(&effect.target).map_err(|e| fail(e.to_string()))?;
            if keys.voxels.is_some() {
                effects::check_voxels(scene, &targets, &effect).map_err(fail)?;
            }
            effects.push(effect);
        }
        parameters.push(Parameter { name: name.clone(), value: parameter.value, effects });
        places.push(document.place(at));
    }
    for spanned in &keys.parameter {
        let name = &spanned.get_ref().name;
        if let Some(other) =
            name.strip_suffix("_stderr").filter(|other| names.contains(&(*other).to_owned()))
        {
            let message = format!(
                "parameter `{name}`: its layer d_{name} would be that of the standard error of `{other}`; \
                 expected another name"
            );
            return Err(document.error_at(spanned.span().start, message));
        }
    }
    Ok((parameters, places))
}

/// A key that asks for more parameters than there can be images.
fn grouped(document: &Document<'_>, keys: &keys::Job) -> Option<CliError> {
    let group = keys.parameter_group.first()?;
    let message = "[[parameter_group]] has a gradient (`drt grad --loss` or `--adjoint`), but \
                   no derivative images; `drt optimize` fits it";
    Some(document.error_at(group.span().start, message))
}
