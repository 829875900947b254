//! Finite differences with common random numbers: the judge of every other estimator.

use alloc::vec::Vec;

use drt_math::Rgb;
use drt_math::sobol::SobolSampler;
use drt_motion::Parameter;

use crate::derivative::contraction::Contraction;
use crate::derivative::tangents;
use crate::model::error::{Error, SettingError};
use crate::model::rendering::Layer;
use crate::model::scene::Scene;
use crate::model::settings::{PathSampling, Settings};
use crate::run::session::Control;
use crate::sampling::film::{Blocks, PixelFilm};
use crate::sampling::parallel::Pool;
use crate::sampling::pixels::{Filling, Sampler};
use crate::terms::interior::PixelSampler;
use crate::world::World;
use crate::world::cache::PreparedCache;
use crate::world::lights::EmitterMask;

/// Central differences of the image by each parameter, in the order of `parameters`: the difference
/// of the images at value ± `step`, over 2 `step`, from `spp` samples per pixel of each.
///
/// Both images see the same random numbers, and the standard errors are those of the difference.
/// Returns fewer layers than parameters when `control` cancelled the run.
///
/// # Errors
/// As [`Session::new`](crate::Session::new), at the displaced values too.
pub fn finite_differences(
    scene: &Scene,
    parameters: &[Parameter],
    settings: &Settings,
    spp: u32,
    step: f64,
    control: &dyn Control,
) -> Result<Vec<Layer>, Error> {
    if !(step > 0.0 && step.is_finite()) {
        let reason = SettingError::NotPositive(step);
        return Err(Error::Setting { setting: "step", reason });
    }
    scene.check()?;
    settings.check(scene, true)?;
    if settings.sampling == PathSampling::Bidirectional {
        let reason = SettingError::OtherKinds;
        return Err(Error::Setting { setting: "sampling", reason });
    }
    let pool = Pool::new(settings.threads);
    let mut layers = Vec::new();
    for p in 0..parameters.len() {
        let at = |offset: f64, middle: Option<&World>| {
            let mut moved = parameters.to_vec();
            moved[p].value += offset;
            let (scene, _) = tangents::apply(scene, &moved)?;
            let depth = settings.max_depth.within(scene.integrator.max_depth);
            World::new(
                scene,
                settings.sensor,
                depth,
                middle,
                EmitterMask::All,
                &mut PreparedCache::default(),
            )
        };
        let middle = at(0.0, None)?;
        let worlds = [at(-step, Some(&middle))?, at(step, Some(&middle))?];
        let pair = DisplacedPair { worlds, step, spp, seed: settings.seed };
        let progress = |done: f64| {
            control.progress((p as f64 + done) / parameters.len() as f64);
        };
        match pair.difference(&pool, control, progress) {
            Some(layer) => layers.push(layer),
            None => break,
        }
    }
    Ok(layers)
}

/// A scene displaced both ways.
struct DisplacedPair {
    worlds: [World; 2],
    step: f64,
    spp: u32,
    seed: u64,
}

impl DisplacedPair {
    fn difference(
        &self,
        pool: &Pool,
        control: &dyn Control,
        progress: impl Fn(f64),
    ) -> Option<Layer> {
        let size = self.worlds[0].camera.film();
        let mut film = PixelFilm::new(size, 1);
        let (units, seed) = (self.spp.max(1), self.seed);
        let filling = Filling {
            pool,
            seed,
            allocation: None,
            shard: None,
            sampler: || StepPair {
                samplers: [0, 1]
                    .map(|k| PixelSampler::new(&self.worlds[k], None, seed, false, false)),
                scale: 0.5 / self.step,
            },
        };
        let going = |_: StepPair<'_>, part| {
            progress(part);
            !control.cancelled()
        };
        let done = filling.fill(&mut film, units, going, |_, _| {});
        (done == units).then(|| film.layer(0, &Blocks::new(size)))
    }
}

/// Samples both displaced scenes alike.
struct StepPair<'a> {
    samplers: [PixelSampler<'a, Contraction<'a>>; 2],
    scale: f64,
}

impl Sampler for StepPair<'_> {
    fn sample(&mut self, pixel: u32, unit: u32, points: SobolSampler, values: &mut [Rgb]) {
        let [low, high] = &mut self.samplers;
        let mut below = [Rgb::ZERO];
        low.sample(pixel, unit, points.clone(), &mut below);
        high.sample(pixel, unit, points, values);
        values[0] = (values[0] - below[0]) * self.scale;
    }
}
