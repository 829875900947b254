//! Finite differences with common random numbers: the judge of every other estimator.

use alloc::vec::Vec;
use core::cell::Cell;

use drt_math::Rgb;
use drt_motion::Parameter;

use crate::Error;
use crate::contraction::Contraction;
use crate::film::{Blocks, PixelFilm, Tile};
use crate::interior::{AlongRays, PixelSampler};
use crate::parallel::Pool;
use crate::rendering::Layer;
use crate::scene::Scene;
use crate::session::Control;
use crate::settings::Settings;
use crate::tangents;
use crate::transport::World;

/// Pixels of a tile.
const TILE: u32 = 256;

/// Central differences of the image by each parameter, in the order of `parameters`: the difference
/// of the images at value ± `step`, over 2 `step`.
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
    step: f64,
    control: &dyn Control,
) -> Result<Vec<Layer>, Error> {
    if !(step > 0.0 && step.is_finite()) {
        return Err(Error::Setting {
            setting: "step".into(),
            reason: alloc::format!("is {step}; expected a positive number"),
        });
    }
    scene.check()?;
    let pool = Pool::new(settings.threads);
    let mut layers = Vec::new();
    for p in 0..parameters.len() {
        let at = |offset: f64, middle: Option<&World>| {
            let mut moved = parameters.to_vec();
            moved[p].value += offset;
            let (scene, _) = tangents::apply(scene, &moved, settings.sensor)?;
            let depth = settings.max_depth.unwrap_or(scene.integrator.max_depth);
            World::new(scene, settings.sensor, depth, middle)
        };
        let middle = at(0.0, None)?;
        let worlds = [at(-step, Some(&middle))?, at(step, Some(&middle))?];
        let pair = Pair { worlds, step, settings };
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
struct Pair<'a> {
    worlds: [World; 2],
    step: f64,
    settings: &'a Settings,
}

impl Pair<'_> {
    fn difference(
        &self,
        pool: &Pool,
        control: &dyn Control,
        progress: impl Fn(f64),
    ) -> Option<Layer> {
        let size = self.worlds[0].camera.film();
        let count = size[0] * size[1];
        let tiles = count.div_ceil(TILE);
        let blocks = Blocks::new(size);
        let mut film = PixelFilm::new(size, 1);
        let units = self.settings.spp.max(1);
        let cancelled = Cell::new(false);
        pool.ordered(
            0..tiles,
            4,
            |t| self.tile(t * TILE..u32::min(count, (t + 1) * TILE), units, &blocks),
            |t, tile| {
                film.merge(&tile);
                progress(f64::from(t + 1) / f64::from(tiles));
                cancelled.set(control.cancelled());
                !cancelled.get()
            },
        );
        film.advance(units);
        (!cancelled.get()).then(|| film.layer(0, &blocks))
    }

    fn tile(&self, pixels: core::ops::Range<u32>, units: u32, blocks: &Blocks) -> Tile {
        let mut tile = Tile::new(pixels.clone(), 1);
        let seed = self.settings.seed;
        let [mut low, mut high]: [PixelSampler<'_, Contraction<'_>>; 2] = [0, 1].map(|k| {
            PixelSampler::new(&self.worlds[k], None, AlongRays::default(), seed, false, false)
        });
        let mut values = [[Rgb::ZERO]; 2];
        for pixel in pixels {
            for unit in 0..units {
                low.sample(pixel, unit, &mut values[0]);
                high.sample(pixel, unit, &mut values[1]);
                let difference = (values[1][0] - values[0][0]) * (0.5 / self.step);
                tile.push(blocks, pixel, unit, &[difference]);
            }
        }
        tile
    }
}
