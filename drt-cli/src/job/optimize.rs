//! From `[optimize]` to what a fit does.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use drt_estimators::Scene;
use drt_estimators::loss::Loss;
use drt_motion::Parameter;
use drt_motion::optimize::{Decay, Method, Optimizer, Stages, Variable};
use toml::Spanned;

use super::document::Document;
use super::list::List;
use super::views::JobView;
use super::{ParameterGroup, find_sensor, keys};
use crate::CliError;
use crate::files::input_file;

/// Iterations where a job does not say how many.
const ITERATIONS: u32 = 100;
/// Iterations between checkpoints where a job does not say how many.
const CHECKPOINT_EVERY: u32 = 10;
/// Where a decay ends when the job does not say.
const DECAYED: f64 = 0.01;

/// How a job's parameters are fitted.
#[derive(Clone, Debug)]
pub struct Optimize {
    /// Image files, one per sensor.
    pub targets: Vec<PathBuf>,
    /// The sensor of each target; `None` is the job's own for a single target, else all sensors in the
    /// scene's order.
    pub sensors: Option<Vec<usize>>,
    /// Image files of the targets' masks, one per target where there are any.
    pub masks: Vec<Option<PathBuf>>,
    /// What is known to be otherwise in each target, where there are poses.
    pub poses: Vec<Vec<Parameter>>,
    /// How many of the targets an iteration looks at.
    pub views_per_iteration: Option<u32>,
    /// Divides differences by what a target shows, and this part of its mean more.
    pub relative: Option<f64>,
    /// What is minimised.
    pub loss: Loss,
    /// How steps follow from gradients.
    pub method: Method,
    /// Learning rate and bounds of each parameter.
    pub variables: Vec<Variable>,
    /// Learning rate of each group of unknowns that has none of its own.
    pub group_rates: Vec<f64>,
    /// How learning rates change.
    pub decay: Decay,
    /// Steps to take.
    pub iterations: u32,
    /// Samples per pixel from some iterations on, instead of the estimator's.
    pub spp: Vec<(u32, u32)>,
    /// The images' sides are divided by this much.
    pub reduce: Stages<u32>,
    /// The folder that a stopped run goes on from.
    pub checkpoint: Option<PathBuf>,
    /// Iterations between two checkpoints.
    pub checkpoint_every: u32,
    /// What to say of a target or mask that cannot be read.
    unreadable: BTreeMap<PathBuf, CliError>,
}

impl Optimize {
    /// Refuses a target or mask that is not there, by the place that names it.
    ///
    /// # Errors
    /// Names the file and the key.
    pub fn check_file(&self, path: &Path) -> Result<(), CliError> {
        match (input_file::check(path), self.unreadable.get(path)) {
            (Err(_), Some(error)) => Err(error.clone()),
            (Err(e), None) => Err(input_file::unreadable(path, None, &e)),
            (Ok(()), _) => Ok(()),
        }
    }
}

pub(super) fn optimize(
    document: &Document<'_>,
    keys: &keys::Job,
    folder: &Path,
    known: &Known<'_>,
    views: Vec<JobView>,
) -> Result<Option<Optimize>, CliError> {
    let Some(table) = &keys.optimize else {
        let Some(view) = keys.view.first() else { return Ok(None) };
        let message = "[[view]] goes with an [optimize]";
        return Err(document.error_at(view.span().start, message));
    };
    let Known { scene, parameters, groups } = *known;
    let reader = Reader { document, table, parameters, groups };
    let (job, keys) = (keys, table.get_ref());
    let (loss, method, decay) = (reader.loss()?, reader.method(), reader.decay()?);
    if matches!(method, Method::GaussNewton { .. }) && !loss.is_curved() {
        return Err(reader.error(
            "`optimizer` \"gauss-newton\" needs a loss with second derivatives, which \"l1\" lacks; \
             expected \"l2\", \"pyramid-l2\" or \"rmse\"",
        ));
    }
    let own_sensor = match &job.sensor {
        Some(name) => find_sensor(scene, name.get_ref()).unwrap_or(0),
        None => 0,
    };
    let variables = reader.variables()?;
    let group_rates = reader.group_rates()?;
    let start: Vec<f64> = parameters.iter().map(|p| p.value).collect();
    // Refuses what no run could begin with, parameters by their names.
    Optimizer::new(method, variables.clone(), &start).map_err(|e| reader.refuse(&e.to_string()))?;
    let sensors = keys.sensors.as_ref().map(|names| {
        let fail = |e: String| document.error_at(names.span().start, format!("`sensors`: {e}"));
        let found = names.get_ref().iter().map(|n| find_sensor(scene, n).map_err(fail));
        let found = found.collect::<Result<Vec<_>, _>>()?;
        reader.one_per_target("sensors", names.span().start, found.len())?;
        Ok(found)
    });
    let masks = keys.masks.as_ref().map_or(Ok(Vec::new()), |masks| {
        reader.one_per_target("masks", masks.span().start, masks.get_ref().len())?;
        Ok(masks.get_ref().iter().map(|m| Some(folder.join(m.get_ref()))).collect())
    })?;
    let masked = keys.masks.iter().flat_map(|masks| masks.get_ref().iter());
    let named = keys.targets.iter().map(|t| ("targets", t)).chain(masked.map(|m| ("masks", m)));
    let unreadable = |(key, file): (&str, &Spanned<PathBuf>)| {
        let path = folder.join(file.get_ref());
        let message = format!("`{key}`: cannot read {}; expected an image file", path.display());
        (path, document.error_at(file.span().start, message))
    };
    let mut unreadable: BTreeMap<PathBuf, CliError> = named.map(unreadable).collect();
    let plain = keys.sensors.is_some() || keys.masks.is_some() || !keys.targets.is_empty();
    if plain && !views.is_empty() {
        let message = "[[view]] takes the place of `targets`, `sensors` and `masks`; expected one or the other";
        return Err(reader.error(message));
    }
    if keys.targets.is_empty() && views.is_empty() {
        return Err(
            reader.error("`targets` is empty; expected an image file per sensor, or [[view]]")
        );
    }
    unreadable.extend(views.iter().flat_map(|view| view.unreadable.iter().cloned()));
    let targets: Vec<PathBuf> = match &views[..] {
        [] => keys.targets.iter().map(|t| folder.join(t.get_ref())).collect(),
        views => views.iter().map(|view| view.target.clone()).collect(),
    };
    let views_per_iteration = match &keys.views_per_iteration {
        Some(n) if *n.get_ref() == 0 || *n.get_ref() as usize > targets.len() => {
            let message = format!(
                "`views_per_iteration` is {}; expected 1 to {}, the number of views",
                n.get_ref(),
                targets.len()
            );
            return Err(document.error_at(n.span().start, message));
        }
        n => n.as_ref().map(|n| *n.get_ref()),
    };
    let optimizer = keys.optimizer.as_ref().map(Spanned::get_ref);
    let checkpoint_every = match &keys.checkpoint_every {
        Some(n) if *n.get_ref() == 0 => {
            let message = "`checkpoint_every` is 0; expected at least 1";
            return Err(document.error_at(n.span().start, message));
        }
        Some(n) => *n.get_ref(),
        None => CHECKPOINT_EVERY,
    };
    Ok(Some(Optimize {
        sensors: match &views[..] {
            [] => sensors.transpose()?,
            views => Some(views.iter().map(|view| view.sensor.unwrap_or(own_sensor)).collect()),
        },
        masks: match &views[..] {
            [] => masks,
            views => views.iter().map(|view| view.mask.clone()).collect(),
        },
        poses: views.iter().map(|view| view.pose.clone()).collect(),
        views_per_iteration,
        targets,
        relative: keys.relative,
        loss,
        method,
        variables,
        group_rates,
        decay,
        iterations: optimizer.and_then(|o| o.iterations).unwrap_or(ITERATIONS),
        spp: reader.stages("spp", &keys.spp)?,
        reduce: Stages::new(1, reader.stages("reduce", &keys.reduce)?),
        checkpoint: keys.checkpoint.as_ref().map(|c| folder.join(c)),
        checkpoint_every,
        unreadable,
    }))
}

/// What a job has read before its fit.
pub(super) struct Known<'a> {
    pub(super) scene: &'a Scene,
    pub(super) parameters: &'a [Parameter<String>],
    pub(super) groups: &'a [ParameterGroup],
}

struct Reader<'a> {
    document: &'a Document<'a>,
    table: &'a Spanned<keys::Optimize>,
    parameters: &'a [Parameter<String>],
    groups: &'a [ParameterGroup],
}

impl Reader<'_> {
    fn error(&self, message: impl std::fmt::Display) -> CliError {
        self.document.error_at(self.table.span().start, format!("[optimize]: {message}"))
    }

    /// An error of the optimiser, which knows parameters by number.
    fn refuse(&self, message: &str) -> CliError {
        let named = self.parameters.iter().enumerate().find_map(|(i, p)| {
            let rest = message.strip_prefix(&format!("variable {i}"))?;
            let ends = !rest.starts_with(|c: char| c.is_ascii_digit());
            ends.then(|| format!("parameter `{}`{rest}", p.name))
        });
        self.error(named.as_deref().unwrap_or(message))
    }

    fn one_per_target(&self, key: &str, at: usize, found: usize) -> Result<(), CliError> {
        let expected = self.table.get_ref().targets.len();
        if found == expected {
            return Ok(());
        }
        let message = format!("`{key}` has {found} entries; expected {expected}, one per target");
        Err(self.document.error_at(at, message))
    }

    fn loss(&self) -> Result<Loss, CliError> {
        let Some(loss) = &self.table.get_ref().loss else { return Ok(Loss::L2) };
        let pyramid = |p: &keys::Pyramid| Loss::PyramidL2 { levels: p.levels, weight: p.weight };
        let read = match loss.get_ref() {
            keys::Loss::Plain(keys::LossKind::L2) => Loss::L2,
            keys::Loss::Plain(keys::LossKind::L1) => Loss::L1,
            keys::Loss::Plain(keys::LossKind::Rmse) => Loss::Rmse,
            keys::Loss::Plain(keys::LossKind::PyramidL2) => pyramid(&keys::Pyramid::default()),
            keys::Loss::Pyramid(p) => pyramid(&p.pyramid_l2),
        };
        read.check().map_err(|e| self.document.error_at(loss.span().start, e))?;
        Ok(read)
    }

    fn method(&self) -> Method {
        let keys = self.table.get_ref().optimizer.as_ref().map(Spanned::get_ref);
        let Some(keys) = keys else { return Method::ADAM };
        match (keys.kind, Method::ADAM) {
            (keys::OptimizerKind::Adam, Method::Adam { beta1, beta2, epsilon }) => {
                let [beta1, beta2] = keys.betas.map_or([beta1, beta2], |betas| betas.0);
                Method::Adam { beta1, beta2, epsilon: keys.epsilon.unwrap_or(epsilon) }
            }
            (keys::OptimizerKind::GaussNewton, _) => match (keys.memory, Method::GAUSS_NEWTON) {
                (Some(memory), _) => Method::GaussNewton { memory },
                (None, method) => method,
            },
            _ => Method::Momentum { momentum: keys.momentum.unwrap_or(0.0) },
        }
    }

    fn decay(&self) -> Result<Decay, CliError> {
        let Some(optimizer) = &self.table.get_ref().optimizer else { return Ok(Decay::Constant) };
        let keys = optimizer.get_ref();
        for (key, given, fits) in [
            ("betas", keys.betas.is_some(), matches!(keys.kind, keys::OptimizerKind::Adam)),
            ("epsilon", keys.epsilon.is_some(), matches!(keys.kind, keys::OptimizerKind::Adam)),
            ("momentum", keys.momentum.is_some(), matches!(keys.kind, keys::OptimizerKind::Sgd)),
            (
                "memory",
                keys.memory.is_some(),
                matches!(keys.kind, keys::OptimizerKind::GaussNewton),
            ),
        ] {
            if given && !fits {
                let message = format!("`optimizer`: `{key}` does not belong to this kind");
                return Err(self.document.error_at(optimizer.span().start, message));
            }
        }
        let (kind, end) = match &keys.decay {
            keys::Decay::Plain(kind) => (*kind, DECAYED),
            keys::Decay::Table(table) => (table.kind, table.end),
        };
        if !(end > 0.0 && end <= 1.0) {
            let message = format!("`decay`: `end` is {end}; expected more than 0 and at most 1");
            return Err(self.document.error_at(optimizer.span().start, message));
        }
        Ok(match kind {
            keys::DecayKind::Constant => Decay::Constant,
            keys::DecayKind::Exponential => Decay::Exponential { end },
            keys::DecayKind::Cosine => Decay::Cosine { end },
        })
    }

    fn index(&self, key: &str, name: &str) -> Result<usize, String> {
        let found = self.parameters.iter().position(|p| p.name == name);
        found.ok_or_else(|| format!("`{key}`: there is no parameter `{name}`"))
    }

    fn variables(&self) -> Result<Vec<Variable>, CliError> {
        let keys = self.table.get_ref();
        let default = keys::LearningRate::default();
        let rates = keys.optimizer.as_ref().map_or(&default, |o| &o.get_ref().learning_rate);
        let at = keys.optimizer.as_ref().map_or(self.table.span().start, |o| o.span().start);
        let fail = |message: String| self.document.error_at(at, message);
        let mut variables = Vec::new();
        for p in self.parameters {
            let learning_rate = match rates {
                keys::LearningRate::All(rate) => *rate,
                keys::LearningRate::Each(rates) => *rates.get(&p.name).ok_or_else(|| {
                    fail(format!("`learning_rate` has no entry for parameter `{}`", p.name))
                })?,
            };
            variables.push(Variable { learning_rate, ..Variable::default() });
        }
        if let keys::LearningRate::Each(rates) = rates {
            let of_group = |name: &String| self.groups.iter().any(|g| g.group.name == *name);
            for name in rates.keys().filter(|name| !of_group(name)) {
                self.index("learning_rate", name).map_err(fail)?;
            }
        }
        for (name, List([lower, upper])) in &keys.bounds {
            let fail = |message| self.document.error_at(name.span().start, message);
            let i = self.index("bounds", name.get_ref()).map_err(fail)?;
            (variables[i].lower, variables[i].upper) = (*lower, *upper);
        }
        for name in &keys.log {
            let fail = |message| self.document.error_at(name.span().start, message);
            variables[self.index("log", name.get_ref()).map_err(fail)?].logarithmic = true;
        }
        Ok(variables)
    }

    /// The learning rate that a group takes where it has none of its own.
    fn group_rates(&self) -> Result<Vec<f64>, CliError> {
        let optimizer = self.table.get_ref().optimizer.as_ref();
        let default = keys::LearningRate::default();
        let rates = optimizer.map_or(&default, |o| &o.get_ref().learning_rate);
        let rate = |g: &ParameterGroup| match (rates, &g.steps.learning_rate) {
            (keys::LearningRate::All(rate), _) => Ok(*rate),
            (keys::LearningRate::Each(rates), own) => match (rates.get(&g.group.name), own) {
                (Some(rate), _) => Ok(*rate),
                (None, Some(_)) => Ok(0.0),
                (None, None) => {
                    let at = optimizer.map_or(self.table.span().start, |o| o.span().start);
                    let message =
                        format!("`learning_rate` has no entry for group `{}`", g.group.name);
                    Err(self.document.error_at(at, message))
                }
            },
        };
        self.groups.iter().map(rate).collect()
    }

    fn stages(
        &self,
        key: &str,
        list: &[Spanned<List<u32, 2>>],
    ) -> Result<Vec<(u32, u32)>, CliError> {
        let read = |entry: &Spanned<List<u32, 2>>| match entry.get_ref().0 {
            [_, 0] => {
                let message = format!("`{key}`: 0; expected [iteration, at least 1]");
                Err(self.document.error_at(entry.span().start, message))
            }
            [iteration, value] => Ok((iteration, value)),
        };
        list.iter().map(read).collect()
    }
}
