//! Finite differences with common random numbers: the reference for every other estimator.

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
use crate::run::control::Control;
use crate::run::stencil::Stencil;
use crate::sampling::bidirectional::EmissionSampler;
use crate::sampling::film::{Blocks, PixelFilm, Raster, Splat};
use crate::sampling::parallel::Pool;
use crate::sampling::pixels::{Filling, Sampler};
use crate::terms::interior::{ImageSampling, PixelSampler};
use crate::world::World;
use crate::world::cache::PreparedCache;
use crate::world::lights::EmitterMask;

/// Finite differences of the image with respect to each parameter, in the order of `parameters`: the difference of the
/// images at value ± `step`, over 2 `step`, from `spp` samples per pixel of each image. Where a property's range ends
/// within a step, the difference is taken on the [other side](crate::one_sided_differences): from the images at the
/// value, one step and two steps away, which is of second order, or, where two steps do not fit, from the first two of
/// these, which is of first order.
///
/// All images have common random numbers, and the standard errors are those of the difference. Paths are
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
        let stencil = Stencil::at(scene, parameters, p, step)?;
        let middle = at(0.0, None)?;
        let displaced = |offset: &f64| at(offset * step, Some(&middle));
        let worlds = stencil.offsets.iter().map(displaced).collect::<Result<Vec<_>, _>>()?;
        let both = settings.sampling == PathSampling::Bidirectional;
        let emission = both.then(|| worlds.iter().map(EmissionSampler::new).collect());
        let displaced = Displaced { worlds, emission, stencil, step, spp, seed: settings.seed };
        let progress = |done: f64| {
            control.progress((p as f64 + done) / parameters.len() as f64);
        };
        match displaced.difference(&pool, control, progress) {
            Some(layer) => layers.push(layer),
            None => break,
        }
    }
    Ok(layers)
}

/// A scene displaced by several amounts.
struct Displaced {
    worlds: Vec<World>,
    /// Where paths of light start, if there are any.
    emission: Option<Vec<EmissionSampler>>,
    stencil: Stencil,
    step: f64,
    spp: u32,
    seed: u64,
}

impl Displaced {
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
            sampler: || {
                let weights = self.stencil.weights.iter().enumerate();
                StepImages {
                    samplers: weights.map(|(k, weight)| (self.sampler(k), *weight)).collect(),
                    scale: 0.5 / self.step,
                    splats: Vec::new(),
                }
            },
            cancelled: &|| control.cancelled(),
        };
        let going = |_: StepImages<'_>, part| {
            progress(part);
            !control.cancelled()
        };
        let done = filling.fill(&mut film, units, going, |_, _| {});
        (done == units).then(|| film.layer(0, &Blocks::new(size)))
    }

    /// What samples one of the displaced scenes.
    fn sampler(&self, k: usize) -> PixelSampler<'_, Contraction<'_>> {
        let sampler = PixelSampler::new(&self.worlds[k], None, self.seed, false, false);
        let Some(emission) = &self.emission else { return sampler };
        sampler.with_image(ImageSampling::Squares).with_light_paths(emission.get(k))
    }
}

/// Samples all displaced scenes alike.
struct StepImages<'a> {
    /// What samples each image, and the factor that it counts by.
    samplers: Vec<(PixelSampler<'a, Contraction<'a>>, f64)>,
    scale: f64,
    splats: Vec<Splat>,
}

impl Sampler for StepImages<'_> {
    fn sample(&mut self, pixel: u32, unit: u32, points: SobolSampler, values: &mut [Rgb]) {
        let mut sum = Rgb::ZERO;
        for (sampler, weight) in &mut self.samplers {
            let mut value = [Rgb::ZERO];
            sampler.sample(pixel, unit, points.clone(), &mut value);
            sum += value[0] * *weight;
        }
        values[0] = sum * self.scale;
        self.splats.clear();
        let scale = self.scale;
        let mut last = true;
        for (sampler, weight) in self.samplers.iter().rev() {
            let own = sampler.splats().iter();
            let own = own.map(|s| Splat { value: s.value * (scale * *weight), ..*s });
            if last {
                self.splats.extend(own);
                last = false;
                continue;
            }
            for other in own {
                // What stays where it is differs by little: as one splat it is the small event that it is.
                match self.splats.iter_mut().find(|s| s.point == other.point) {
                    Some(sum) => sum.value += other.value,
                    None => self.splats.push(Splat { weight: 0.0, ..other }),
                }
            }
        }
    }

    fn splats(&self) -> &[Splat] {
        &self.splats
    }
}
