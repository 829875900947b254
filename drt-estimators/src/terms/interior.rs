//! The interior term, and the plain forward image: one pixel sample at a time.

mod component;
mod grazing_paths;
mod probe;
mod recorder;

use alloc::vec::Vec;

use drt_math::sobol::SobolSampler;
use drt_math::{Rgb, Rng};

pub(crate) use crate::terms::interior::component::Component;
use crate::terms::interior::component::{Traced, Worker};
pub(crate) use crate::terms::interior::grazing_paths::GrazingPaths;
pub(crate) use crate::terms::interior::probe::Probes;
pub(crate) use crate::terms::interior::recorder::{PathView, Recorder};

use crate::derivative::contraction::Contraction;
use crate::derivative::sensitivity::{AdjointSink, VelocityFunctional};
use crate::model::rendering::{Account, Counters, NonFinite, Term};
use crate::model::sensor::ViewSample;
use crate::sampling::bidirectional::{Bidirectional, EmissionSampler};
use crate::sampling::film::{Splat, SplatDensity};
use crate::sampling::pixels::Sampler;
use crate::sampling::record::PathRecord;
use crate::sampling::record::Radiance;
use crate::sampling::streams::{DIMENSIONS, FLUX_STREAM, PAIR_STREAM, VELOCITY_STREAM};
use crate::sampling::trace::Tracer;
use crate::terms::edge_queries::EdgeQuery;
use crate::world::{RayPath, World};

/// Where the derivatives of a pixel's paths go.
pub(crate) trait PathSink: AdjointSink {
    /// A path's sensitivities follow.
    fn begin(&mut self);
    /// They are complete; layers of `values` may be added to.
    fn finish(&mut self, values: &mut [Rgb]);
    /// A boundary or flux contribution found along the camera ray.
    fn functional(&mut self, f: &VelocityFunctional, value: Rgb, values: &mut [Rgb]);
    /// Layers that each separately kept term takes.
    fn layers(&self) -> usize;
}

impl PathSink for Contraction<'_> {
    fn begin(&mut self) {
        self.clear();
    }
    fn finish(&mut self, values: &mut [Rgb]) {
        for (v, r) in values.iter_mut().zip(&self.rates) {
            *v += *r;
        }
    }
    fn functional(&mut self, f: &VelocityFunctional, value: Rgb, values: &mut [Rgb]) {
        if self.evaluate(f) {
            for (v, r) in values.iter_mut().zip(&self.rates) {
                *v += value * r.r;
            }
        }
    }
    fn layers(&self) -> usize {
        self.rates.len()
    }
}

impl<S: PathSink> Sampler for PixelSampler<'_, S> {
    /// A path, or a pair of paths mirrored at the pixel's centre.
    fn sample(&mut self, pixel: u32, unit: u32, points: SobolSampler, values: &mut [Rgb]) {
        values.fill(Rgb::ZERO);
        self.splats.clear();
        let mut rng = Rng::new(self.seed, u64::from(pixel), unit).led_by(points, DIMENSIONS);
        let u = rng.next_2d();
        if self.antithetic {
            self.path(pixel, unit, u, rng.clone(), values);
            self.path(pixel, unit, u.map(|u| 1.0 - u), rng, values);
            for v in values.iter_mut() {
                *v *= 0.5;
            }
            for splat in &mut self.splats {
                *splat = splat.scaled(0.5);
            }
        } else {
            self.path(pixel, unit, u, rng, values);
        }
        let splats = self.splats.iter().map(|s| &s.value);
        if values.iter().chain(splats).any(|v| !v.is_finite()) {
            self.report(pixel, unit, values);
        }
    }

    fn splats(&self) -> &[Splat] {
        &self.splats
    }
}

/// Which pixels a path of the image counts for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ImageSampling {
    /// The one whose filter its image point was drawn from.
    OwnPixel,
    /// All that its point reaches. Points are drawn from the filters of all pixels, as derivatives want them.
    SharedFilters,
    /// All that its point reaches. Points are drawn evenly.
    Squares,
}

/// Samples pixels and differentiates what it traces.
pub(crate) struct PixelSampler<'a, S> {
    world: &'a World,
    seed: u64,
    antithetic: bool,
    tracer: Tracer<'a>,
    record: PathRecord,
    camera_ray: RayPath,
    /// What differentiates paths, and what each keeps of one.
    workers: Vec<Worker<'a, S>>,
    views: Vec<PathView<'a>>,
    separate: bool,
    image: ImageSampling,
    bidirectional: Option<Bidirectional<'a>>,
    /// Chooses where media are probed, if any are.
    probes: Option<Probes>,
    splats: Vec<Splat>,
    non_finite: Vec<NonFinite>,
    non_finite_count: u64,
    recorded: u64,
}

/// Non-finite samples that are described one by one.
const DESCRIBED: usize = 8;

impl<'a, S: PathSink> PixelSampler<'a, S> {
    /// Of paths by all light of a `world`; without components, of the image alone.
    pub(crate) fn new(
        world: &'a World,
        components: impl IntoIterator<Item = Component<'a, S>>,
        seed: u64,
        antithetic: bool,
        separate: bool,
    ) -> Self {
        let components = components.into_iter().map(|c| Worker::new(c, separate));
        let (workers, views) = components.unzip();
        Self {
            world,
            seed,
            antithetic,
            tracer: Tracer::new(world),
            record: PathRecord::default(),
            camera_ray: RayPath::default(),
            workers,
            views,
            separate,
            image: ImageSampling::OwnPixel,
            bidirectional: None,
            probes: world.has_probes().then(Probes::new),
            splats: Vec::new(),
            non_finite: Vec::new(),
            non_finite_count: 0,
            recorded: 0,
        }
    }

    /// The same with an image that is splatted.
    pub(crate) fn with_image(self, image: ImageSampling) -> Self {
        Self { image, ..self }
    }

    /// The same with paths of light, where these start from something.
    pub(crate) fn with_light_paths(self, emission: Option<&'a EmissionSampler>) -> Self {
        let bidirectional = emission.map(|emission| Bidirectional::new(self.world, emission));
        Self { bidirectional, ..self }
    }

    /// The sinks of the components, in order.
    pub(crate) fn sinks(&mut self) -> impl Iterator<Item = &mut S> {
        self.workers.iter_mut().map(|w| &mut w.sink)
    }

    /// What the work done so far leaves besides its values.
    pub(crate) fn account(self) -> Account {
        self.finish().0
    }

    /// The same, and the sinks of the components.
    pub(crate) fn finish(self) -> (Account, Vec<S>) {
        let sum = |of: fn(&Worker<'a, S>) -> u64| self.workers.iter().map(of).sum();
        let of_paths = self.views.iter().map(|v| v.velocities.probe());
        let probes = of_paths.chain(self.workers.iter().map(|w| w.derivative.sweep.probe()));
        let [rays, turning_edges] = probes
            .fold([0; 2], |[rays, edges], probe| [rays + probe.rays, edges + probe.turning_edges]);
        let account = Account {
            counters: Counters {
                differentiated_paths: sum(|w| w.differentiated),
                recorded_vertices: self.recorded,
                rays: self.tracer.counters.rays + rays,
                turning_edges,
                ..self.tracer.counters
            },
            non_finite: self.non_finite,
            non_finite_count: self.non_finite_count,
            query_rays: sum(|w| w.query_rays),
        };
        (account, self.workers.into_iter().map(|w| w.sink).collect())
    }

    fn path(&mut self, pixel: u32, unit: u32, u: [f64; 2], rng: Rng, values: &mut [Rgb]) {
        let mut rng = rng;
        // What places an edge, or a point of the lens, comes before what the path takes an unknown number of.
        let lens = self.world.camera.draw_lens(&mut rng);
        let camera = &*self.world.camera.at_lens(lens);
        let derivative = self.workers.iter().any(Worker::differentiates_filter);
        let s = match self.image {
            ImageSampling::Squares => camera.sample_square(pixel, u),
            _ => camera.sample_view(pixel, u, derivative),
        };
        let s = ViewSample { lens, ..s };
        let weight = Rgb::splat(s.weight);
        let queries = self.workers.iter().any(|w| w.queries.any());
        let query = queries.then(|| EdgeQuery::reserve(&mut rng));
        self.tracer.rng = rng;
        if self.workers.is_empty() {
            let light = if let Some(both) = &mut self.bidirectional {
                both.trace(&mut self.tracer, &s, weight, &mut self.splats, &mut Radiance::default())
            } else {
                let mut radiance = Radiance::default();
                self.tracer.trace_camera(&s, weight, &mut radiance);
                radiance.0
            };
            self.add_to_image(&s, derivative, light, values);
            return;
        }
        let width = camera.film()[0];
        for view in &mut self.views {
            let stream = |of: u64| Rng::new(self.seed, of | u64::from(pixel), unit);
            let velocities = || stream(VELOCITY_STREAM);
            // What they see would have to be weighed as the path's light is.
            let pairs = self.bidirectional.is_none().then(|| stream(PAIR_STREAM));
            view.begin(pairs, velocities, || stream(FLUX_STREAM));
        }
        if let Some(probes) = &mut self.probes {
            probes.begin(self.seed, pixel, unit);
        }
        let shadows = self.workers.iter().any(|w| w.terms.boundary.shadows.is_some());
        let mut recorder = Recorder {
            record: &mut self.record,
            views: &mut self.views,
            camera_ray: shadows.then_some(&mut self.camera_ray),
            probes: self.probes.as_mut(),
        };
        recorder.begin([pixel % width, pixel / width], &s, weight);
        let light = if let Some(both) = &mut self.bidirectional {
            both.trace(&mut self.tracer, &s, weight, &mut self.splats, &mut recorder)
        } else {
            self.tracer.trace_camera(&s, weight, &mut recorder);
            recorder.record.value
        };
        recorder.probe(&mut self.tracer);
        self.add_to_image(&s, derivative, light, values);
        self.recorded += self.record.nodes.len() as u64;
        let path = Traced {
            record: &self.record,
            camera_ray: &self.camera_ray,
            filter: s.slope,
            seed: self.seed,
            pixel,
            unit,
            query,
        };
        let mut at = 1;
        let several = self.workers.len() > 1;
        let numbers = several.then(|| self.tracer.rng.clone());
        for (worker, view) in self.workers.iter_mut().zip(&mut self.views) {
            let n = worker.sink.layers();
            at = usize::max(at, 1 + n);
            // What one does must not depend on how many numbers another takes.
            if let Some(numbers) = &numbers {
                self.tracer.rng.clone_from(numbers);
            }
            worker.add(&mut self.tracer, &path, view, at, values);
            if self.separate {
                at += n * worker.terms.along_paths(worker.queries).count();
            }
        }
    }

    /// Adds the light of a path to the image.
    fn add_to_image(&mut self, s: &ViewSample, derivative: bool, light: Rgb, values: &mut [Rgb]) {
        let (value, weight, density) = match self.image {
            ImageSampling::OwnPixel => {
                values[0] += light;
                return;
            }
            ImageSampling::Squares => (light, s.weight, SplatDensity::Known),
            // At the very end of a filter there is no weight to take out; no path is there.
            ImageSampling::SharedFilters if s.weight == 0.0 => return,
            ImageSampling::SharedFilters => {
                (light * (1.0 / s.weight), 1.0, SplatDensity::OfFilters { derivative })
            }
        };
        self.splats.push(Splat { point: s.point, value, weight, density });
    }

    /// Notes a sample that is not finite and counts it as zero.
    fn report(&mut self, pixel: u32, unit: u32, values: &mut [Rgb]) {
        self.non_finite_count += 1;
        if self.non_finite.len() < DESCRIBED {
            let nodes = &self.record.nodes;
            let last = nodes.last().and_then(|n| n.vertex()?.surface().map(|s| s.prim));
            let mut image = values.iter().take(1).chain(self.splats.iter().map(|s| &s.value));
            self.non_finite.push(NonFinite {
                term: image.all(|v| v.is_finite()).then_some(Term::Interior),
                seed: self.seed,
                stream: u64::from(pixel),
                index: unit,
                bounces: nodes.len() as u32,
                primitive: last,
            });
        }
        let splats = self.splats.iter_mut().map(|s| &mut s.value);
        for v in values.iter_mut().chain(splats).filter(|v| !v.is_finite()) {
            *v = Rgb::ZERO;
        }
    }
}
