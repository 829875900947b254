//! A light known at every point of the image, through a camera, under each filter.

use alloc::vec::Vec;

use drt_math::sobol::SobolSampler;
use drt_math::{Rng, Vec3};

use super::*;
use crate::model::filter::FilterKind;
use crate::model::rendering::{Estimate, Layer};
use crate::model::sensor::{Lens, Sensor};
use crate::model::shard::Shard;
use crate::sampling::film::{Blocks, PixelFilm};
use crate::sampling::parallel::Pool;
use crate::sampling::pixels::{Filling, Pass, Sampler};

const SIZE: [u32; 2] = [19, 13];
const FILTERS: [FilterKind; 4] = [
    FilterKind::Box { radius: 0.8 },
    FilterKind::TENT,
    FilterKind::GAUSSIAN,
    FilterKind::CATMULL_ROM,
];

fn camera(kind: FilterKind) -> Sensor {
    let filter = Filter::new(kind).unwrap();
    Sensor::look_at([Vec3::Z, Vec3::ZERO, Vec3::Y], Lens::default(), SIZE, filter).unwrap()
}

/// A factor of the light: it rises, and jumps within a pixel and beyond the film.
fn along(axis: usize, at: f64) -> f64 {
    let edge = [7.0, 5.6][axis];
    0.5 + 0.05 * at + if at < edge { 0.0 } else { 1.0 } + if at < -0.2 { 0.7 } else { 0.0 }
}

/// The image of that, in closed form but for the quadrature.
fn expected(filter: &Filter) -> Vec<f64> {
    let pixel = |axis: usize, i: u32| {
        let (n, r) = (20_000, filter.radius());
        let at = |k: i32| r * (f64::from(2 * k + 1) / f64::from(n) - 1.0);
        let value = |x: f64| filter.axis(x) * along(axis, f64::from(i) + 0.5 + x);
        (0..n).map(|k| value(at(k))).sum::<f64>() * 2.0 * r / f64::from(n)
    };
    let [x, y] = [0, 1].map(|k| (0..SIZE[k]).map(|i| pixel(k, i)).collect::<Vec<f64>>());
    y.iter().flat_map(|y| x.iter().map(move |x| x * y)).collect()
}

#[derive(Clone, Copy, PartialEq)]
enum From {
    Squares,
    Filters { derivative: bool },
}

/// Paths that return the light of their point, times noise. Some put a part of it somewhere else, as connections
/// of light paths do.
struct Paths<'a> {
    camera: &'a Sensor,
    from: From,
    seed: u64,
    shift: f64,
    splats: Vec<Splat>,
}

impl Sampler for Paths<'_> {
    fn sample(&mut self, pixel: u32, unit: u32, mut points: SobolSampler, _: &mut [Rgb]) {
        let u = points.next_2d();
        let (point, value, density) = match self.from {
            From::Squares => {
                let s = self.camera.sample_square(pixel, u);
                (s.point, s.weight, SplatDensity::Known)
            }
            From::Filters { derivative } => {
                let s = self.camera.sample_view(pixel, u, derivative);
                (s.point, 1.0, SplatDensity::OfFilters { derivative })
            }
        };
        let mut rng = Rng::new(self.seed, u64::from(pixel), unit);
        let light = along(0, point[0]) * along(1, point[1]) * (2.0 * rng.next_f64());
        self.splats.clear();
        let mut put = |point: [f64; 2], value, weight, density| {
            let point = [point[0] + self.shift, point[1]];
            self.splats.push(Splat { point, value: Rgb::splat(value), weight, density });
        };
        put(point, 0.75 * value * light, value, density);
        // Even over an area that holds the supports of all filters.
        let [w, h] = SIZE.map(f64::from);
        let [u, v] = rng.next_2d();
        let (far, area) = ([(w + 6.0) * u - 3.0, (h + 6.0) * v - 3.0], (w + 6.0) * (h + 6.0));
        let of_far = 0.25 * along(0, far[0]) * along(1, far[1]) * area / (w * h);
        put(far, of_far, 0.0, SplatDensity::Known);
    }

    fn splats(&self) -> &[Splat] {
        &self.splats
    }
}

/// `raster` is the camera's own but for planted faults.
fn rendered(paths: &Paths<'_>, raster: Raster, threads: usize) -> Layer {
    let pool = Pool::new(threads);
    let mut film = PixelFilm::splatted(raster, 1);
    let filling = Filling {
        pool: &pool,
        seed: paths.seed,
        allocation: None,
        shard: None,
        sampler: || Paths { splats: Vec::new(), ..*paths },
        cancelled: &|| false,
    };
    for _ in 0..2 {
        filling.fill(&mut film, 20, |_, _| true, |_, _| {});
    }
    film.layer(0, &Blocks::new(SIZE))
}

fn paths(camera: &Sensor, from: From, seed: u64) -> Paths<'_> {
    Paths { camera, from, seed, shift: 0.0, splats: Vec::new() }
}

fn raster(camera: &Sensor) -> Raster {
    Raster::new(camera.filter().clone(), SIZE)
}

/// Mean over pixels, with the spread over seeds.
struct Spread {
    /// Root mean square of errors of the mean over seeds, in its standard errors.
    z: f64,
    /// Mean of squared standard errors, over the variance that there is.
    errors: f64,
}

fn spread<'a>(found: impl Fn(usize) -> Vec<&'a Estimate>, expected: &[f64]) -> Spread {
    let (mut z, mut errors, mut variances) = (0.0, 0.0, 0.0);
    for (i, expected) in expected.iter().enumerate() {
        let found = found(i);
        let n = found.len() as f64;
        let mean = found.iter().map(|e| e.mean.g).sum::<f64>() / n;
        let square = |e: &&Estimate| (e.mean.g - mean) * (e.mean.g - mean);
        let variance = found.iter().map(square).sum::<f64>() / (n - 1.0);
        errors += found.iter().map(|e| e.stderr.g * e.stderr.g).sum::<f64>() / n;
        variances += variance;
        z += (mean - expected) * (mean - expected) * n / variance;
    }
    Spread { z: (z / expected.len() as f64).sqrt(), errors: errors / variances }
}

/// Means are right up to the film's border, and errors those that images of other seeds have.
#[test]
fn means_are_right_and_errors_honest() {
    for kind in FILTERS {
        let camera = camera(kind);
        let expected = expected(camera.filter());
        for from in [From::Squares, From::Filters { derivative: kind == FilterKind::TENT }] {
            let images = |seeds: u64, shift: f64, raster: &Raster| -> Vec<Layer> {
                let image = |seed| {
                    let own = Paths { shift, ..paths(&camera, from, seed) };
                    rendered(&own, raster.clone(), 1)
                };
                (0..seeds).map(image).collect()
            };
            let own = images(64, 0.0, &raster(&camera));
            let pixels = |images: &[Layer]| {
                spread(|i| images.iter().map(|l| &l.pixels[i]).collect(), &expected)
            };
            let found = pixels(&own);
            assert!(found.z < 1.2, "{kind:?}: {}", found.z);
            assert!((found.errors - 1.0).abs() < 0.06, "{kind:?}: {}", found.errors);

            let blocks = Blocks::new(SIZE);
            let mut means = alloc::vec![0.0; BLOCKS * BLOCKS];
            for (b, value) in blocks.of.iter().zip(&expected) {
                means[*b as usize] += value / f64::from(blocks.count[*b as usize]);
            }
            let found = spread(|i| own.iter().map(|l| &l.blocks[i]).collect(), &means);
            assert!(found.z < 1.4, "{kind:?}: blocks {}", found.z);
            // Blocks count one event more, of few.
            assert!((0.9..1.25).contains(&found.errors), "{kind:?}: blocks {}", found.errors);
            let mean = expected.iter().sum::<f64>() / expected.len() as f64;
            let found = spread(|_| own.iter().map(|l| &l.total).collect(), &[mean]);
            assert!(found.z < 4.0 && (0.5..1.7).contains(&found.errors), "{kind:?}: total");

            // Half a pixel to the side.
            assert!(pixels(&images(24, 0.5, &raster(&camera))).z > 2.0, "{kind:?}");
            // Without the outermost taps.
            let mut narrow = raster(&camera);
            narrow.filter = Filter::new(FilterKind::Box { radius: 0.5 }).unwrap();
            assert!(pixels(&images(24, 0.0, &narrow)).z > 2.0, "{kind:?}");
        }
    }
}

/// Pixels have paths in common: as if they had not, blocks would claim too much.
#[test]
fn blocks_know_what_pixels_have_in_common() {
    let camera = camera(FilterKind::GAUSSIAN);
    let image = rendered(&paths(&camera, From::Squares, 1), raster(&camera), 1);
    let apart = Layer::from_pixels(SIZE, image.pixels.clone(), &Blocks::new(SIZE));
    assert!(apart.total.stderr.g < 0.8 * image.total.stderr.g);
}

#[test]
fn threads_make_no_difference() {
    let camera = camera(FilterKind::GAUSSIAN);
    let of = |threads| rendered(&paths(&camera, From::Squares, 5), raster(&camera), threads);
    let one = of(1);
    for other in [2, 3].map(of) {
        assert!(one.pixels == other.pixels && one.blocks == other.blocks);
        assert_eq!(one.total, other.total);
    }
}

/// All strata in shards, put back in order, are the film in one piece; any that is not there is missed.
#[test]
fn strata_put_back_make_the_same_image() {
    let camera = camera(FilterKind::GAUSSIAN);
    let paths = paths(&camera, From::Squares, 5);
    let pool = Pool::new(2);
    let units = 200;
    let filled = |shard| {
        let mut film = PixelFilm::splatted(raster(&camera), 1);
        let sampler = || Paths { splats: Vec::new(), ..paths };
        let filling = Filling {
            pool: &pool,
            seed: 5,
            allocation: None,
            shard,
            sampler,
            cancelled: &|| false,
        };
        assert_eq!(filling.fill(&mut film, units, |_, _| true, |_, _| {}), units);
        film
    };
    let pass = Pass::new(0, units, SIZE);
    let whole = filled(None).layer(0, &Blocks::new(SIZE));
    let mut strata = Vec::new();
    for i in 1..=3 {
        let mut film = filled(Shard::new(i, 3));
        assert_eq!(film.units(), 0);
        strata.extend(film.take_kept());
    }
    assert_eq!(strata.len(), pass.parts() as usize);
    let together = |without: Option<u32>| {
        let mut film = PixelFilm::of_strata(SIZE, 1, true);
        film.begin();
        for part in pass.strata(None) {
            let own = strata.iter().find(|(n, _)| *n == part.number && Some(*n) != without);
            if let Some((_, stratum)) = own {
                assert!(stratum.is_of(SIZE, 1, true) && !stratum.is_of(SIZE, 1, false));
                film.put_back(stratum, part.units[1] - part.units[0]);
            }
            if part.ends_run() {
                film.end_run();
            }
        }
        film.layer(0, &Blocks::new(SIZE))
    };
    let same =
        |a: &Layer, b: &Layer| (&a.pixels, &a.blocks, a.total) == (&b.pixels, &b.blocks, b.total);
    assert!(same(&whole, &together(None)));
    assert!(!same(&whole, &together(Some(5))));
}

/// Every tap of every pixel, wherever a splat lands: on the tile's own pixels or not.
#[test]
fn splats_reach_the_pixels_of_their_footprint() {
    let mut rng = Rng::new(8, 0, 0);
    for kind in FILTERS {
        let camera = camera(kind);
        let raster = Arc::new(raster(&camera));
        let mut image = SplattedImage::new(SIZE);
        let mut expected = alloc::vec![0.0; (SIZE[0] * SIZE[1]) as usize];
        for _ in 0..20 {
            let start = rng.next_u32() % (SIZE[0] * SIZE[1]);
            let mut tile = SplatTile::new(&raster, start..start + 1);
            tile.begin(start);
            for _ in 0..20 {
                let [x, y] = rng.next_2d();
                let point = [x * 25.0 - 3.0, y * 19.0 - 3.0];
                let value = Rgb::splat(1.5);
                tile.add(&Splat { point, value, weight: 1.0, density: SplatDensity::Known });
                for p in camera.footprint(point) {
                    expected[(p.pixel[1] * SIZE[0] + p.pixel[0]) as usize] += 1.5 * p.weight;
                }
            }
            image.add(&tile);
        }
        image.advance(1, Ends::Run);
        for (i, expected) in expected.iter().enumerate() {
            let found = image.estimate(i).mean.g;
            assert!((found - expected).abs() < 1e-12, "{kind:?} {found} {expected}");
        }
    }
}
