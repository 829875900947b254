//! The pictures that the loss of a job is about.

use std::collections::BTreeMap;
use std::path::Path;

use drt_estimators::fit::View;
use drt_estimators::loss::Reference;

use crate::error::Place;
use crate::files::image::read_picture;
use crate::job::Optimize;
use crate::{CliError, Job};

/// The pictures that a job's `[optimize]` or its views name, each with its sensor, mask and pose.
pub(super) fn views(job: &Job, plan: &Optimize) -> Result<Vec<View>, CliError> {
    let count = plan.targets.len();
    let sensors = match &plan.sensors {
        Some(sensors) => sensors.clone(),
        None if count == 1 => vec![job.settings.sensor],
        None if count == job.scene.sensors.len() => (0..count).collect(),
        None => {
            let message = format!(
                "`targets` has {count} files, but the scene has {} sensors; expected one target, \
                 one per sensor, or `sensors` with the sensor of each",
                job.scene.sensors.len()
            );
            return Err(CliError::input(&Place::file(&job.path), message));
        }
    };
    let mut used = BTreeMap::new();
    let mut views = Vec::new();
    for (i, (path, sensor)) in plan.targets.iter().zip(sensors).enumerate() {
        let other = used.insert(sensor, path).filter(|_| plan.poses.is_empty());
        if let Some(other) = other {
            let message = format!("sensor {sensor} sees two targets, {} and this", other.display());
            return Err(CliError::input(&Place::file(path), message));
        }
        let mask = plan.masks.get(i).and_then(Option::as_deref);
        let reference = reference(job, Some(plan), sensor, path, mask)?;
        let pose = plan.poses.get(i).cloned().unwrap_or_default();
        views.push(View { sensor, reference, pose });
    }
    Ok(views)
}

/// A picture that the job's own sensor is to see instead of that of the job's one target, if it names one: with the mask of
/// that one, and as its differences are weighed.
pub(super) fn instead(job: &Job, plan: Option<&Optimize>, path: &Path) -> Result<View, CliError> {
    let posed = plan.is_some_and(|plan| !plan.poses.is_empty());
    let masks = plan.map_or(&[][..], |plan| &plan.masks);
    if posed || masks.len() > 1 {
        let message = "it names views or masks of its own; expected `--loss` without a file";
        return Err(CliError::input(&Place::file(&job.path), message));
    }
    let sensor = match plan.and_then(|plan| plan.sensors.as_deref()) {
        Some([sensor]) => *sensor,
        _ => job.settings.sensor,
    };
    let mask = masks.first().and_then(Option::as_deref);
    Ok(View::new(sensor, reference(job, plan, sensor, path, mask)?))
}

fn reference(
    job: &Job,
    plan: Option<&Optimize>,
    sensor: usize,
    path: &Path,
    mask: Option<&Path>,
) -> Result<Reference, CliError> {
    let Some(of) = job.scene.sensors.get(sensor) else {
        return Err(CliError::input(&Place::file(&job.scene_path), "the scene has no <sensor>"));
    };
    let film = of.item.sensor.film();
    let read = |path: &Path| {
        plan.map_or(Ok(()), |plan| plan.check_file(path))?;
        read_picture(path, film)
    };
    let fail = |path, e| CliError::input(&Place::file(path), e);
    let picture = read(path)?;
    let mut reference =
        Reference::new(picture.size, picture.linear()).map_err(|e| fail(path, e))?;
    if let Some(path) = mask {
        reference = reference.with_mask(read(path)?.gray()).map_err(|e| fail(path, e))?;
    }
    match plan.and_then(|plan| plan.relative) {
        Some(part) => reference.relative(part).map_err(|e| fail(path, e)),
        None => Ok(reference),
    }
}
