//! The sessions of a job, each prepared when it is first asked for.

use std::collections::BTreeMap;

use drt_estimators::{EstimatorKind, PathSampling, PreparedCache, Scene, Session, Settings};
use drt_motion::Parameter;

use super::Samples;
use crate::{CliError, Job};

/// What a session is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Purpose {
    /// The image alone.
    Image,
    /// The image and derivatives with respect to parameters.
    Derivatives,
    /// Gradients, whose paths are found from the camera where that was left open.
    Gradient,
}

/// One session for each purpose and sensor.
#[derive(Default)]
pub(super) struct Sessions(BTreeMap<(Purpose, usize), Prepared>);

struct Prepared {
    session: Session,
    /// The samples per pixel that it was prepared for, where its preparation depends on them.
    spp: Option<u32>,
    /// False when values have changed since.
    current: bool,
}

impl Sessions {
    /// Notes that values have changed.
    pub(super) fn outdate(&mut self) {
        self.0.values_mut().for_each(|prepared| prepared.current = false);
    }

    /// A session without samples of a scene that has the job's items, with derivatives by some parameters.
    pub(super) fn get(
        &mut self,
        job: &Job,
        purpose: Purpose,
        samples: Samples,
        scene: &Scene,
        parameters: &[Parameter<String>],
    ) -> Result<&mut Session, CliError> {
        let mut settings = settings(job, samples);
        if purpose == Purpose::Gradient {
            settings.sampling = PathSampling::Unidirectional;
        }
        // A pilot is as long as the run lets it be.
        let open = settings.sampling == PathSampling::Auto
            || (purpose != Purpose::Image && settings.estimator == EstimatorKind::Auto);
        let spp = (open || settings.boundary_ratio.is_some()).then_some(samples.spp);
        let key = (purpose, samples.sensor);
        let known = self.0.remove(&key).filter(|prepared| prepared.spp == spp);
        let mut prepared = match known {
            Some(known) => known,
            None => {
                let mut kept = PreparedCache::default();
                let session = job.session(scene, parameters, &settings, &mut kept)?;
                Prepared { session, spp, current: true }
            }
        };
        prepared.session.restart(samples.seed);
        let updated = match prepared.current {
            true => Ok(()),
            false => prepared.session.update(scene, parameters).map_err(|e| job.blame(&e)),
        };
        prepared.current |= updated.is_ok();
        let prepared = self.0.entry(key).or_insert(prepared);
        updated.map(|()| &mut prepared.session)
    }
}

/// The settings of a job for some samples.
pub(super) fn settings(job: &Job, samples: Samples) -> Settings {
    let Samples { spp, seed, sensor } = samples;
    let mut settings = job.settings_for(spp);
    (settings.seed, settings.sensor) = (seed, sensor);
    settings
}
