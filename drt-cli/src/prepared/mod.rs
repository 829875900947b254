//! A job that is prepared once and sampled again and again, at other values of its unknowns: for programs that minimise
//! losses of their own.

mod field_steps;
pub(crate) mod gradient;
mod sessions;
#[cfg(test)]
mod tests;

use drt_estimators::fit::{Collector, Group, GroupedScene};
use drt_estimators::{
    Control, EstimatorKind, Part, PathSampling, Rendering, Scene, finite_differences,
};
use drt_math::Rgb;
use drt_motion::optimize::Method;

use crate::error::Place;
use crate::job::GroupSteps;
use crate::{CliError, Job};
use gradient::{GroupGradient, by_parameters, collectors};
use sessions::{Purpose, Sessions};

pub use field_steps::FieldSteps;
pub use gradient::independent_seed;

/// How many samples are taken, and by which sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Samples {
    /// Samples per pixel.
    pub spp: u32,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Index of the sensor.
    pub sensor: usize,
}

/// An unknown or a group of unknowns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unknown {
    /// A parameter, which is one number, by its index in the job.
    Parameter(usize),
    /// A group, by its index in the job.
    Group(usize),
}

/// A job with its sessions: images, derivatives and gradients have the bits that the command's `render`, `grad` and
/// `grad --adjoint` have with the same seed, and what one call has prepared is used by the next.
///
/// What is left to a pilot (`kind` or `sampling` = `"auto"`) is decided at the first call, by its seed, and decided anew when
/// the number of samples changes. For derivative images it is also decided anew when values change.
///
/// ```
/// use drt_cli::{Overrides, PreparedJob, Samples, Unknown, read_job};
/// use drt_estimators::Unattended;
/// use drt_math::Rgb;
///
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("job.toml");
/// # let scene = r#"<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm">
/// #   <integer name="width" value="6"/><integer name="height" value="4"/></film></sensor>
/// #   <emitter type="constant" id="sky"/></scene>"#;
/// # std::fs::write(folder.path().join("scene.xml"), scene)?;
/// # let parameter = "name = \"light\"\neffect = [{ target = \"sky\", property = \"radiance\", multiply = 1.0 }]";
/// # std::fs::write(&path, format!("scene = \"scene.xml\"\n[[parameter]]\n{parameter}\n"))?;
/// let mut job = PreparedJob::new(read_job(&path, &Overrides::default())?)?;
/// let light = Unknown::Parameter(0);
/// let samples = Samples { spp: 64, ..job.samples() };
///
/// // The sum of all pixels and channels, and its derivative.
/// job.set(&[(light, &[0.5])])?;
/// let seen = job.render(samples, &Unattended)?.expect("nobody cancels it");
/// let adjoint = vec![Rgb::ONE; seen.image.pixels.len()];
/// let gradient = job.gradient(&[light], &adjoint, samples, &Unattended)?.expect("nobody cancels it");
/// let sum: f64 = seen.image.pixels.iter().map(|pixel| pixel.mean.sum()).sum();
/// // Both are estimates, of which the image divides by the sum of the filter's weights.
/// assert!((gradient[0][0] - sum / 1.5).abs() < 0.05 * sum, "{} {sum}", gradient[0][0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct PreparedJob {
    /// With the present values of the parameters.
    job: Job,
    grouped: GroupedScene,
    /// The scene at all present values, where parameters are not zero.
    moved: Option<Scene>,
    sessions: Sessions,
    /// The indices of the groups that a gradient was with respect to last, and what collects for each.
    collectors: Option<(Vec<usize>, Vec<Collector>)>,
}

impl PreparedJob {
    /// The unknowns have the values that the job and its scene give them.
    ///
    /// # Errors
    /// When a parameter and a group have the same name, or an effect does not fit its target.
    pub fn new(job: Job) -> Result<Self, CliError> {
        let groups: Vec<Group> = job.groups.iter().map(|g| g.group.clone()).collect();
        let same = |p: &&String| groups.iter().any(|group| group.name == **p);
        if let Some(name) = job.parameters.iter().map(|p| &p.name).find(same) {
            let message =
                format!("there are a parameter and a group `{name}`; expected another `name`");
            return Err(CliError::input(&Place::file(&job.path), message));
        }
        let grouped = GroupedScene::new(job.scene.clone(), groups);
        let mut prepared =
            Self { job, grouped, moved: None, sessions: Sessions::default(), collectors: None };
        prepared.apply_parameters()?;
        Ok(prepared)
    }

    /// The job, with the parameters' present values and the scene as it was given.
    #[must_use]
    pub fn job(&self) -> &Job {
        &self.job
    }

    /// The number of samples that the job asks for, by its seed and its sensor.
    #[must_use]
    pub fn samples(&self) -> Samples {
        let settings = &self.job.settings;
        Samples { spp: self.job.spp(), seed: settings.seed, sensor: settings.sensor }
    }

    /// Lists the parameters, and then the groups, by name.
    pub fn unknowns(&self) -> impl Iterator<Item = (&str, Unknown)> {
        let parameters = self.job.parameters.iter().map(|p| p.name.as_str()).enumerate();
        let groups = self.grouped.groups().iter().map(|g| g.name.as_str()).enumerate();
        let parameters = parameters.map(|(i, name)| (name, Unknown::Parameter(i)));
        parameters.chain(groups.map(|(i, name)| (name, Unknown::Group(i))))
    }

    /// The present values of an unknown with the lengths of their axes, which are [those of a group](Group::shape), or
    /// none for a parameter; `None` where there is no such unknown.
    #[must_use]
    pub fn values(&self, unknown: Unknown) -> Option<(Vec<usize>, Vec<f64>)> {
        let values = match unknown {
            Unknown::Parameter(i) => vec![self.job.parameters.get(i)?.value],
            Unknown::Group(i) => self.grouped.values(i)?.into_owned(),
        };
        Some((self.shape(unknown)?, values))
    }

    /// The lengths of the axes of an unknown's values, as [`values`](Self::values) has them.
    #[must_use]
    pub fn shape(&self, unknown: Unknown) -> Option<Vec<usize>> {
        match unknown {
            Unknown::Parameter(i) => self.job.parameters.get(i).map(|_| Vec::new()),
            Unknown::Group(i) => {
                self.grouped.groups().get(i).map(|group| group.shape(self.grouped.given()))
            }
        }
    }

    /// Steps of an unknown by Adam, from its present values. The text is that of a TOML table with keys that say how a
    /// `[[parameter_group]]` is stepped; where it is empty, the job's own keys
    /// count. A learning rate that is nowhere said is `rate`.
    ///
    /// # Errors
    /// When there is no such unknown, or names the key.
    pub fn steps(&self, unknown: Unknown, rate: f64, keys: &str) -> Result<FieldSteps, CliError> {
        let Some((name, values)) =
            self.values(unknown).map(|(_, values)| (self.name(unknown), values))
        else {
            return Err(CliError::argument("there is no such parameter"));
        };
        let fail = |e: &dyn std::fmt::Display| CliError::argument(format!("`{name}`: {e}"));
        let steps = match unknown {
            Unknown::Parameter(_) => {
                let steps = GroupSteps::from_text(keys, None).map_err(|e| fail(&e))?;
                FieldSteps::of_number(&steps, values[0], Method::ADAM, rate)
            }
            Unknown::Group(g) => {
                let mut group = self.job.groups[g].clone();
                let kind = Some(&group.group.kind);
                if !keys.is_empty() {
                    group.steps = GroupSteps::from_text(keys, kind).map_err(|e| fail(&e))?;
                }
                FieldSteps::new(self.grouped.given(), &group, &values, Method::ADAM, rate)
            }
        };
        steps.map_err(|e| fail(&e))
    }

    fn name(&self, of: Unknown) -> &str {
        self.unknowns().find(|(_, unknown)| *unknown == of).map_or("", |(name, _)| name)
    }

    /// Gives some unknowns other values.
    ///
    /// # Errors
    /// When there is no such unknown, the number of values is wrong, one is not finite or out of its range, or two groups
    /// decide the same values; everything then stays as it was.
    pub fn set(&mut self, changes: &[(Unknown, &[f64])]) -> Result<(), CliError> {
        let mut of_groups = Vec::new();
        let before: Vec<f64> = self.job.parameters.iter().map(|p| p.value).collect();
        let mut after = before.clone();
        for (unknown, values) in changes {
            match (unknown, values) {
                (Unknown::Group(g), values) => of_groups.push((*g, *values)),
                (Unknown::Parameter(p), [value]) if *p < after.len() && value.is_finite() => {
                    after[*p] = *value;
                }
                (Unknown::Parameter(p), values) => {
                    let name = self.job.parameters.get(*p).map_or("", |p| p.name.as_str());
                    let message =
                        format!("parameter `{name}`: {values:?}; expected one finite number");
                    return Err(CliError::argument(message));
                }
            }
        }
        let grouped = self.grouped.clone();
        if !of_groups.is_empty() {
            self.grouped.set(&of_groups).map_err(|e| self.job.blame(&e))?;
        }
        self.take_parameters(&after);
        let applied = self.apply_parameters();
        let checked = applied.and_then(|()| self.scene().check().map_err(|e| self.job.blame(&e)));
        if let Err(error) = checked {
            self.grouped = grouped;
            self.take_parameters(&before);
            self.apply_parameters()?;
            return Err(error);
        }
        self.sessions.outdate();
        self.collectors = None;
        Ok(())
    }

    /// Gives a sensor's film another size, in pixels.
    ///
    /// # Errors
    /// When there is no such sensor or size.
    pub fn resize(&mut self, sensor: usize, size: [u32; 2]) -> Result<(), CliError> {
        self.job.resize(sensor, size)?;
        self.grouped.set_sensor(sensor, self.job.scene.sensors[sensor].item.sensor.clone());
        self.sessions = Sessions::default();
        self.collectors = None;
        self.apply_parameters()
    }

    fn take_parameters(&mut self, values: &[f64]) {
        for (parameter, value) in self.job.parameters.iter_mut().zip(values) {
            parameter.value = *value;
        }
    }

    fn apply_parameters(&mut self) -> Result<(), CliError> {
        let scene = self.job.at_values(self.grouped.scene())?;
        self.moved = match scene {
            std::borrow::Cow::Borrowed(_) => None,
            std::borrow::Cow::Owned(scene) => Some(scene),
        };
        Ok(())
    }

    /// The scene at all present values.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        self.moved.as_ref().unwrap_or(self.grouped.scene())
    }

    /// The image at the present values, without derivatives; `None` where `control` cancelled it.
    ///
    /// # Errors
    /// When the scene at these values, or a setting, is unusable.
    pub fn render(
        &mut self,
        samples: Samples,
        control: &dyn Control,
    ) -> Result<Option<Rendering>, CliError> {
        let scene = self.moved.as_ref().unwrap_or(self.grouped.scene());
        let session = self.sessions.get(&self.job, Purpose::Image, samples, scene, &[])?;
        Ok(session.run(samples.spp, control).then(|| session.rendering()))
    }

    /// The image and its derivatives with respect to all parameters, in the job's order; `None` where `control` cancelled it.
    ///
    /// # Errors
    /// As [`render`](Self::render), and when a parameter moves what cannot be differentiated.
    pub fn derivatives(
        &mut self,
        samples: Samples,
        control: &dyn Control,
    ) -> Result<Option<Rendering>, CliError> {
        if self.job.settings.estimator == EstimatorKind::FiniteDifference {
            return self.differences(samples, control);
        }
        let (scene, parameters) = (self.grouped.scene(), &self.job.parameters);
        let purpose = Purpose::Derivatives;
        let session = self.sessions.get(&self.job, purpose, samples, scene, parameters)?;
        Ok(session.run(samples.spp, control).then(|| session.rendering()))
    }

    fn differences(
        &mut self,
        samples: Samples,
        control: &dyn Control,
    ) -> Result<Option<Rendering>, CliError> {
        let Some(mut rendering) = self.render(samples, &Part::new(control, 0.0, 0.3))? else {
            return Ok(None);
        };
        let settings = sessions::settings(&self.job, samples);
        let (scene, parameters) = (self.grouped.scene(), &self.job.parameters);
        let control = &Part::new(control, 0.3, 1.0);
        let step = settings.step;
        let layers = finite_differences(scene, parameters, &settings, rendering.spp, step, control)
            .map_err(|e| self.job.blame(&e))?;
        let complete = layers.len() == parameters.len();
        rendering.derivatives = gradient::named(parameters, layers);
        Ok(complete.then_some(rendering))
    }

    /// The gradient of a loss with respect to some unknowns, in their order, from the derivative of the loss with respect to
    /// every pixel and channel; `None` where `control` cancelled it.
    ///
    /// # Errors
    /// As [`derivatives`](Self::derivatives), and when there is no such unknown or the adjoint has another size than the film.
    pub fn gradient(
        &mut self,
        wanted: &[Unknown],
        adjoint: &[Rgb],
        samples: Samples,
        control: &dyn Control,
    ) -> Result<Option<Vec<Vec<f64>>>, CliError> {
        let of_group = |unknown: &Unknown| match unknown {
            Unknown::Group(g) => Some(*g),
            Unknown::Parameter(_) => None,
        };
        let groups: Vec<usize> = wanted.iter().filter_map(of_group).collect();
        let part = match (groups.is_empty(), groups.len() == wanted.len()) {
            (true, _) => 1.0,
            (_, true) => 0.0,
            _ => 0.6,
        };
        let mut of_parameters = Vec::new();
        if part > 0.0 {
            let control = Part::new(control, 0.0, part);
            let Some(seen) = self.derivatives(samples, &control)? else { return Ok(None) };
            gradient::check_size(&seen, adjoint)?;
            of_parameters = by_parameters(&seen, adjoint);
        }
        let mut of_groups = Vec::new();
        if part < 1.0 {
            let control = Part::new(control, part, 1.0);
            let Some(found) = self.in_reverse(groups, adjoint, samples, &control)? else {
                return Ok(None);
            };
            of_groups = found;
        }
        let mut of_groups = of_groups.into_iter();
        let one = |unknown: &Unknown| match unknown {
            Unknown::Parameter(p) => of_parameters.get(*p).map(|g| vec![*g]),
            Unknown::Group(_) => of_groups.next(),
        };
        let found: Option<Vec<_>> = wanted.iter().map(one).collect();
        found.map(Some).ok_or_else(|| CliError::argument("there is no such parameter"))
    }

    /// The gradient with respect to some groups.
    fn in_reverse(
        &mut self,
        groups: Vec<usize>,
        adjoint: &[Rgb],
        samples: Samples,
        control: &dyn Control,
    ) -> Result<Option<Vec<Vec<f64>>>, CliError> {
        let all = self.grouped.groups();
        if groups.iter().any(|g| *g >= all.len()) {
            return Err(CliError::argument("there is no such group"));
        }
        let chosen = || groups.iter().map(|g| &all[*g]);
        let scene = self.moved.as_ref().unwrap_or(self.grouped.scene());
        let collectors = match self.collectors.take().filter(|(known, _)| *known == groups) {
            Some((_, collectors)) => collectors,
            None => collectors(&self.job, chosen(), scene)?,
        };
        // Without a pilot that chooses how an image's paths are found, an image's session serves for gradients, too.
        let purpose = match self.job.settings.sampling {
            PathSampling::Auto => Purpose::Gradient,
            _ => Purpose::Image,
        };
        let mut sum = GroupGradient::new(chosen(), self.grouped.given());
        let wanted: Vec<_> = chosen().map(Group::wanted).collect();
        let session = self.sessions.get(&self.job, purpose, samples, scene, &[])?;
        let spp = samples.spp;
        let going = session
            .gradient_in_batches(&wanted, spp, adjoint, None, control, &mut |batch| {
                sum.add(&collectors, &batch);
            })
            .map_err(|e| self.job.blame(&e))?;
        self.collectors = Some((groups, collectors));
        Ok(going.then(|| sum.finish()))
    }
}
