//! Samples go where noise is.

use drt_math::sobol::SobolSampler;
use drt_math::{Rgb, Rng};

use super::*;
use crate::sampling::parallel::Pool;
use crate::sampling::pixels::{Filling, Sampler};

const SIZE: [u32; 2] = [24, 16];

/// Pixels of the mean 1, with noise in a corner of the film.
struct Noisy;

fn amplitude(pixel: u32) -> f64 {
    let (x, y) = (pixel % SIZE[0], pixel / SIZE[0]);
    if x < 6 && y < 6 { 5.0 } else { 0.05 }
}

impl Sampler for Noisy {
    fn sample(&mut self, pixel: u32, unit: u32, _: SobolSampler, values: &mut [Rgb]) {
        let noise = Rng::new(7, u64::from(pixel), unit).next_f64() - 0.5;
        values[0] = Rgb::splat(1.0 + amplitude(pixel) * noise);
    }
}

fn film(allocation: Option<&Allocation>, units: u32) -> PixelFilm {
    let pool = Pool::new(1);
    let mut film = PixelFilm::new(SIZE, 1);
    let filling = Filling {
        pool: &pool,
        seed: 3,
        allocation,
        shard: None,
        sampler: || Noisy,
        cancelled: &|| false,
    };
    filling.fill(&mut film, units, |_, _| true, |_, _| {});
    film
}

/// Means keep their place, errors tell the truth, and the noise of all pixels together falls.
#[test]
fn samples_go_where_noise_is() {
    let found = Allocation::new(&film(None, 8), core::iter::once(vec![(0, 1.0)]));
    let n = SIZE[0] * SIZE[1];
    let taken: u32 = (0..n).map(|i| found.taken(i, 64)).sum();
    assert!((f64::from(taken) / f64::from(64 * n) - 1.0).abs() < 0.02, "{taken}");
    let spread = |a: Option<&Allocation>| {
        let film = film(a, 256);
        let pixels: Vec<_> = (0..n as usize).map(|i| film.estimate(i, 0)).collect();
        let z = |e: &crate::model::rendering::Estimate| (e.mean.r - 1.0) / e.stderr.r;
        let (squares, sum) = pixels.iter().map(z).fold((0.0, 0.0), |(s, t), z| (s + z * z, t + z));
        // Of runs as few as these, errors scatter.
        assert!((squares / f64::from(n)).sqrt() < 1.4, "{squares}");
        assert!(sum.abs() < 4.0 * squares.sqrt(), "{sum}");
        let error = |e: &crate::model::rendering::Estimate| (e.mean.r - 1.0) * (e.mean.r - 1.0);
        pixels.iter().map(error).sum::<f64>()
    };
    let ratio = |i: u32| f64::from(found.taken(i, 64)) / 64.0;
    assert!(ratio(0) > 2.0 && ratio(SIZE[0] - 1) < 0.5);
    let gain = spread(None) / spread(Some(&found));
    assert!(gain > 3.0, "{gain}");
}

#[test]
fn without_noise_all_are_equal() {
    let pilot = PixelFilm::new(SIZE, 1);
    let found = Allocation::new(&pilot, core::iter::empty());
    assert!((0..SIZE[0] * SIZE[1]).all(|i| found.taken(i, 10) == 10));
}
