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
use crate::sampling::bidirectional::EmissionSampler;
use crate::sampling::film::{Blocks, PixelFilm, Raster, Splat};
use crate::sampling::parallel::Pool;
use crate::sampling::pixels::{Filling, Sampler};
use crate::terms::interior::{ImageSampling, PixelSampler};
use crate::world::World;
use crate::world::cache::PreparedCache;
use crate::world::lights::EmitterMask;

/// Central differences of the image by each parameter, in the order of `parameters`: the difference
/// of the images at value ± `step`, over 2 `step`, from `spp` samples per pixel of each.
///
/// Both images see the same random numbers, and the standard errors are those of the difference. Their paths are
/// from the camera, or from both ends where `settings` ask for these.
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
    settings.check(scene, false)?;
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
        let both = settings.sampling == PathSampling::Bidirectional;
        let emission = both.then(|| worlds.each_ref().map(EmissionSampler::new));
        let pair = DisplacedPair { worlds, emission, step, spp, seed: settings.seed };
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
    /// Where paths of light start, if there are any.
    emission: Option<[EmissionSampler; 2]>,
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
        let camera = &self.worlds[0].camera;
        let size = camera.film();
        // Light's paths reach any pixel.
        let mut film = match self.emission {
            None => PixelFilm::new(size, 1),
            Some(_) => PixelFilm::splatted(Raster::new(camera.filter().clone(), size), 1),
        };
        let (units, seed) = (self.spp.max(1), self.seed);
        let filling = Filling {
            pool,
            seed,
            allocation: None,
            shard: None,
            sampler: || StepPair {
                samplers: [0, 1].map(|k| {
                    let sampler = PixelSampler::new(&self.worlds[k], None, seed, false, false);
                    let Some(emission) = &self.emission else { return sampler };
                    sampler.with_image(ImageSampling::Squares).with_light_paths(Some(&emission[k]))
                }),
                scale: 0.5 / self.step,
                splats: Vec::new(),
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
    splats: Vec<Splat>,
}

impl Sampler for StepPair<'_> {
    fn sample(&mut self, pixel: u32, unit: u32, points: SobolSampler, values: &mut [Rgb]) {
        let [low, high] = &mut self.samplers;
        let mut below = [Rgb::ZERO];
        low.sample(pixel, unit, points.clone(), &mut below);
        high.sample(pixel, unit, points, values);
        values[0] = (values[0] - below[0]) * self.scale;
        let scaled = |s: &Splat, scale| Splat { value: s.value * scale, ..*s };
        self.splats.clear();
        self.splats.extend(high.splats().iter().map(|s| scaled(s, self.scale)));
        for below in low.splats().iter().map(|s| scaled(s, -self.scale)) {
            // What stays where it is differs by little: as one splat it is the small event that it is.
            match self.splats.iter_mut().find(|s| s.point == below.point) {
                Some(above) => above.value += below.value,
                None => self.splats.push(Splat { weight: 0.0, ..below }),
            }
        }
    }

    fn splats(&self) -> &[Splat] {
        &self.splats
    }
}
