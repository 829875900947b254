//! From a job to the sessions that sample it.

use std::borrow::Cow;

use drt_estimators::{PreparedCache, Scene, Session, Settings, moved};
use drt_motion::Parameter;

use super::Job;
use crate::CliError;
use crate::error::Place;
use crate::files::memory;

/// Least memory that each pixel takes.
const IMAGE_BYTES: u128 = 160;
/// Least memory that each pixel takes more with each derivative.
const DERIVATIVE_BYTES: u128 = 300;

impl Job {
    /// Prepares a `scene` that has this job's items, with derivatives by some parameters.
    ///
    /// # Errors
    /// Names the file, and the line of the parameter, that is to blame.
    pub(crate) fn session(
        &self,
        scene: &Scene,
        parameters: &[Parameter<String>],
        settings: &Settings,
        kept: &mut PreparedCache,
    ) -> Result<Session, CliError> {
        self.check_film(settings.sensor, parameters.len())?;
        Session::with_cache(scene, parameters, settings, kept).map_err(|e| self.blame(&e))
    }

    /// A `scene` that has this job's items, at the parameters' values.
    ///
    /// # Errors
    /// Names the line of the parameter whose effect does not fit.
    pub(crate) fn at_values<'s>(&self, scene: &'s Scene) -> Result<Cow<'s, Scene>, CliError> {
        if self.parameters.iter().all(|p| p.value == 0.0) {
            return Ok(Cow::Borrowed(scene));
        }
        moved(scene, &self.parameters).map(Cow::Owned).map_err(|e| self.blame(&e))
    }

    /// Refuses a film that does not fit into memory, with derivatives by so many parameters, and a scene without a sensor.
    fn check_film(&self, sensor: usize, parameters: usize) -> Result<(), CliError> {
        let place = Place::file(&self.scene_path);
        if self.scene.sensors.is_empty() {
            return Err(CliError::input(&place, "the scene has no <sensor>"));
        }
        let Some(sensor) = self.scene.sensors.get(sensor) else { return Ok(()) };
        let [w, h] = sensor.item.sensor.film();
        let pixel = IMAGE_BYTES + DERIVATIVE_BYTES * parameters as u128;
        memory::check(u128::from(w) * u128::from(h) * pixel).map_err(|e| {
            let message = format!(
                "the film of {w}x{h} pixels, with {parameters} derivatives, would {e}; expected a smaller one (--size)"
            );
            CliError::input(&place, message)
        })
    }
}
