//! From `[[view]]` to what a fit sees: a picture, by a sensor, of a scene in a known pose.

use std::path::{Path, PathBuf};

use drt_estimators::Scene;
use drt_motion::Parameter;
use toml::Spanned;

use super::cages::Cages;
use super::document::Document;
use super::{effects, find_sensor, keys};
use crate::CliError;

/// A picture that a scene shall look like in some pose.
#[derive(Clone, Debug)]
pub(super) struct JobView {
    pub(super) target: PathBuf,
    pub(super) mask: Option<PathBuf>,
    /// `None` is the job's own.
    pub(super) sensor: Option<usize>,
    /// Changes that are known, by their values.
    pub(super) pose: Vec<Parameter>,
    /// What to say of a target or mask that cannot be read.
    pub(super) unreadable: Vec<(PathBuf, CliError)>,
}

pub(super) fn views(
    document: &Document<'_>,
    keys: &[Spanned<keys::View>],
    folder: &Path,
    scene: &Scene,
) -> Result<Vec<JobView>, CliError> {
    let mut cages = Cages::default();
    let mut views = Vec::new();
    for (number, spanned) in keys.iter().enumerate() {
        let fail = |message: String| {
            document.error_at(spanned.span().start, format!("[[view]]: {message}"))
        };
        let view = spanned.get_ref();
        let sensor = view.sensor.as_ref().map(|name| find_sensor(scene, name).map_err(fail));
        let mut pose = Vec::new();
        for effect in &view.effect {
            let (at, keys) = (effect.span().start, effect.get_ref());
            let fail = |message| document.error_at(at, format!("[[view.effect]]: {message}"));
            let value = keys.amount.unwrap_or(1.0);
            if !value.is_finite() {
                return Err(fail(format!("`amount` is {value}; expected a finite number")));
            }
            let effect = effects::effect(keys, folder, &mut cages);
            let effect = effect.map_err(|refusal| refusal.told(fail))?;
            let targets = scene.find_all(&effect.target).map_err(|e| fail(e.to_string()))?;
            if keys.voxels.is_some() {
                effects::check_voxels(scene, &targets, &effect).map_err(fail)?;
            }
            let name = format!("view {}, effect {}", number + 1, pose.len() + 1);
            pose.push(Parameter { name, value, effects: vec![effect] });
        }
        let unreadable = |key: &str, file: &Path| {
            let path = folder.join(file);
            let message =
                format!("`{key}`: cannot read {}; expected an image file", path.display());
            (path, fail(message))
        };
        let mut said = vec![unreadable("target", &view.target)];
        said.extend(view.mask.iter().map(|mask| unreadable("mask", mask)));
        views.push(JobView {
            target: folder.join(&view.target),
            mask: view.mask.as_ref().map(|mask| folder.join(mask)),
            sensor: sensor.transpose()?,
            pose,
            unreadable: said,
        });
    }
    Ok(views)
}
