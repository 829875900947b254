//! Reverse mode: the gradient of a loss with respect to everything, from the same paths, records and
//! boundary samples as the derivative images.
//!
//! With a_i = dLoss/dI_i at pixel i, the gradient is Σ_i a_i dI_i/dq for every quantity q. The
//! sensitivities that forward mode contracts with velocities are scattered instead, each times its
//! pixel's adjoint: to vertices through the transposed jets, to voxels through the transposed
//! interpolation. Cost does not grow with the number of quantities. For the same seed
//! ⟨a, J v⟩ = ⟨Jᵀ a, v⟩ up to rounding.

use alloc::vec::Vec;

use drt_math::{Rgb, RgbVec, Vec3};
use drt_medium::{CoefficientRates, DepthEstimate, MediumGradient};
use drt_motion::{JetAdjoint, SmoothNormals, VertexGradient};

use crate::boundary::Receiver;
use crate::emitter::EmitterGradient;
use crate::film::BATCHES;
use crate::interior::{PathSink, PixelSampler};
use crate::parallel::Pool;
use crate::pixels::{Pass, Sampler};
use crate::prepared::Prepared;
use crate::rendering::Counters;
use crate::scene::{Scene, Target};
use crate::sensitivity::{AdjointSink, CoefficientAdjoint, Functional, Interest, SurfaceAdjoint};
use crate::sensor::SensorGradient;
use crate::session::Control;
use crate::settings::Settings;
use crate::splatting::Checked;
use crate::surface::BsdfParams;
use crate::transport::{MaterialPoint, MediumNeed, Needs, World};
use crate::{Error, tangents};

/// The gradient of a loss with respect to a scene. Entries that were not asked for are `None`.
#[derive(Clone, Debug)]
pub struct SceneGradient {
    /// Per shape: with respect to its vertices (in mesh order), and to its vertex normals where it
    /// has any. [`SceneGradient::vertices`] folds the normals into positions.
    pub shapes: Vec<Option<VertexGradient>>,
    /// Per medium: with respect to coefficients and voxels.
    pub media: Vec<Option<MediumGradient>>,
    /// Per scattering model: with respect to its parameters (scalars: the sum over channels).
    pub bsdfs: Vec<Option<BsdfParams>>,
    /// Per emitter.
    pub emitters: Vec<Option<EmitterGradient>>,
    /// With respect to the camera.
    pub sensor: Option<SensorGradient>,
    /// Work done.
    pub counters: Counters,
    /// Contributions that were not finite; they count as zero.
    pub non_finite: u64,
}

impl SceneGradient {
    fn zeros(world: &World, interest: &Interest) -> Self {
        let scene = &world.scene;
        fn some<T>(wanted: &[bool], make: impl Fn(usize) -> T) -> Vec<Option<T>> {
            wanted.iter().enumerate().map(|(i, w)| w.then(|| make(i))).collect()
        }
        Self {
            shapes: some(&interest.shapes, |i| VertexGradient::zeros(&scene.shapes[i].mesh)),
            media: some(&interest.media, |i| MediumGradient::zeros(&scene.media[i].item)),
            bsdfs: some(&interest.bsdfs, |_| BsdfParams::default()),
            emitters: some(&interest.emitters, |_| EmitterGradient::default()),
            sensor: interest.sensor.then(SensorGradient::default),
            counters: Counters::default(),
            non_finite: 0,
        }
    }

    fn add(&mut self, o: &Self) {
        fn each<T>(a: &mut [Option<T>], b: &[Option<T>], add: impl Fn(&mut T, &T)) {
            for (a, b) in a.iter_mut().zip(b) {
                if let (Some(a), Some(b)) = (a, b) {
                    add(a, b);
                }
            }
        }
        each(&mut self.shapes, &o.shapes, VertexGradient::add);
        each(&mut self.media, &o.media, MediumGradient::add);
        each(&mut self.bsdfs, &o.bsdfs, |a, b| a.scatter(b, Rgb::ONE));
        each(&mut self.emitters, &o.emitters, |a, b| *a += *b);
        if let (Some(a), Some(b)) = (&mut self.sensor, &o.sensor) {
            *a += *b;
        }
        self.counters.add(&o.counters);
        self.non_finite += o.non_finite;
    }

    /// The gradient by a shape's vertex positions, its vertex normals being recomputed from them as
    /// the vertices move; in mesh order. `None` when it was not asked for.
    #[must_use]
    pub fn vertices(&self, scene: &Scene, shape: usize) -> Option<Vec<Vec3>> {
        let mesh = &scene.shapes.get(shape)?.mesh;
        let gradient = self.shapes.get(shape)?.as_ref()?;
        Some(gradient.finish(mesh, &SmoothNormals::new(mesh)))
    }
}

/// The gradient of a loss by the items `wanted`, with `adjoint` holding dLoss/dI for every pixel (row
/// by row from the top left, per channel).
///
/// The insides of media stay static and the flux through moving surfaces is added, which is right
/// for every motion.
///
/// # Errors
/// When the adjoint's size is not the film's, or the scene or a setting is unusable.
pub fn gradient(
    scene: &Scene,
    wanted: &[Target],
    settings: &Settings,
    adjoint: &[Rgb],
    control: &dyn Control,
) -> Result<SceneGradient, Error> {
    settings.check()?;
    scene.check()?;
    let (scene, _) = tangents::apply(scene, &[], settings.sensor)?;
    let depth = settings.max_depth.unwrap_or(scene.integrator.max_depth);
    let mut world = World::new(scene, settings.sensor, depth, None)?;
    let interest = interest(&world.scene, wanted);
    let need = |w: &bool| if *w { MediumNeed::Vertices } else { MediumNeed::Nothing };
    world.prepare_for_derivatives(Needs {
        media: interest.media.iter().map(need).collect(),
        bsdfs: interest.bsdfs.clone(),
    });
    let film = world.camera.film();
    if adjoint.len() != (film[0] * film[1]) as usize {
        return Err(Error::Setting {
            setting: "adjoint".into(),
            reason: alloc::format!(
                "has {} pixels; the film has {}x{}",
                adjoint.len(),
                film[0],
                film[1]
            ),
        });
    }
    let touching = crate::inside::adjacency(&world);
    let flux: Vec<usize> =
        (0..touching.len()).filter(|s| interest.shapes[*s] && !touching[*s].is_empty()).collect();
    let prepared = Prepared::new(world, &interest, &flux, settings)?;
    let run = Reverse { prepared: &prepared, interest: &interest, settings, adjoint };
    let pool = Pool::new(settings.threads);
    let mut total = SceneGradient::zeros(&prepared.world, &interest);
    let mut merge = |_: u32, part: SceneGradient| {
        total.add(&part);
        !control.cancelled()
    };
    let chunks = BATCHES as u32;
    if pool.ordered(0..chunks, 1, |c| run.pixels(c, chunks), &mut merge) {
        for i in 0..prepared.sources.len() {
            pool.ordered(0..chunks, 1, |b| run.splats(i, b), &mut merge);
        }
    }
    Ok(total)
}

fn interest(scene: &Scene, wanted: &[Target]) -> Interest {
    fn flags(n: usize, wanted: &[Target], of: impl Fn(usize) -> Target) -> Vec<bool> {
        (0..n).map(|i| wanted.contains(&of(i))).collect()
    }
    let emitters = flags(scene.emitters.len(), wanted, Target::Emitter);
    let placed = |e: usize| {
        let emitter = &scene.emitters[e].item.emitter;
        emitter.is_delta()
    };
    Interest {
        shapes: flags(scene.shapes.len(), wanted, Target::Shape),
        volumes: alloc::vec![false; scene.media.len()],
        media: flags(scene.media.len(), wanted, Target::Medium),
        grids: flags(scene.media.len(), wanted, Target::Medium),
        bsdfs: flags(scene.bsdfs.len(), wanted, Target::Bsdf),
        moving_emitters: emitters.iter().enumerate().map(|(e, w)| *w && placed(e)).collect(),
        emitters,
        sensor: wanted.iter().any(|t| matches!(t, Target::Sensor(_))),
    }
}

struct Reverse<'a> {
    prepared: &'a Prepared,
    interest: &'a Interest,
    settings: &'a Settings,
    adjoint: &'a [Rgb],
}

impl Reverse<'_> {
    fn scatter(&self) -> Scatter<'_> {
        let world = &self.prepared.world;
        Scatter {
            world,
            interest: self.interest,
            weights: Rgb::ZERO,
            gradient: SceneGradient::zeros(world, self.interest),
        }
    }

    /// One of `chunks` parts of the pixels.
    fn pixels(&self, chunk: u32, chunks: u32) -> SceneGradient {
        let per_unit = if self.prepared.antithetic { 2 } else { 1 };
        let units = self.settings.spp.div_ceil(per_unit).max(1);
        let scale = 1.0 / f64::from(units * per_unit);
        let n = self.adjoint.len() as u64;
        let at = |c: u32| (n * u64::from(c) / u64::from(chunks)) as u32;
        let mut sampler = PixelSampler::new(
            &self.prepared.world,
            Some(self.scatter()),
            self.prepared.along_rays(),
            self.settings.seed,
            self.prepared.antithetic,
            false,
        );
        let mut values = [Rgb::ZERO];
        let (seed, film) = (self.settings.seed, self.prepared.world.camera.film());
        let pass = Pass::new(0, units, film);
        for pixel in at(chunk)..at(chunk + 1) {
            if let Some(sink) = &mut sampler.sink {
                sink.weights = self.adjoint[pixel as usize] * scale;
            }
            for run in pass.runs() {
                pass.sample(seed, pixel, run, pass.units(run), |unit, points| {
                    sampler.sample(pixel, unit, points, &mut values);
                });
            }
        }
        let mut gradient = match sampler.sink.take() {
            Some(sink) => sink.gradient,
            None => SceneGradient::zeros(&self.prepared.world, self.interest),
        };
        let account = sampler.account();
        gradient.counters = account.counters;
        gradient.non_finite += account.non_finite_count;
        gradient
    }

    /// One batch of a splatted source.
    fn splats(&self, source: usize, batch: u32) -> SceneGradient {
        let source = self.prepared.sources[source];
        let count = self.prepared.samples_per_batch(self.settings, self.settings.spp);
        let scale = 1.0 / (f64::from(count) * BATCHES as f64);
        let mut receiver = Checked::new(ToGradient {
            scatter: self.scatter(),
            adjoint: self.adjoint,
            functional: Functional::default(),
            weight: 0.0,
            scale,
        });
        let stream = source.stream() + u64::from(batch);
        let splatter = self.prepared.splatter(self.settings.seed);
        let account = splatter.run(source, stream, count, &mut receiver);
        let mut to = receiver.inner;
        to.flush();
        to.scatter.gradient.counters = account.counters;
        to.scatter.gradient.non_finite = account.non_finite_count;
        to.scatter.gradient
    }
}

/// Adds sensitivities, weighted by the pixel's adjoint, to the gradient of everything.
struct Scatter<'a> {
    world: &'a World,
    interest: &'a Interest,
    weights: Rgb,
    gradient: SceneGradient,
}

impl AdjointSink for Scatter<'_> {
    fn interest(&self) -> &Interest {
        self.interest
    }

    fn surface(&mut self, point: &MaterialPoint, adjoint: &SurfaceAdjoint) {
        let shape = point.shape as usize;
        let Some(gradient) = &mut self.gradient.shapes[shape] else { return };
        let w = self.weights;
        let jet = JetAdjoint {
            u: adjoint.u.weighted(w),
            n: adjoint.n.weighted(w),
            ns: adjoint.ns.weighted(w),
            j: adjoint.j.dot(w),
        };
        if !(jet.u.is_finite() && jet.n.is_finite() && jet.ns.is_finite() && jet.j.is_finite()) {
            self.gradient.non_finite += 1;
            return;
        }
        gradient.scatter(&self.world.scene.shapes[shape].mesh, &point.at, &jet);
    }

    fn volume(&mut self, _: usize, _: Vec3, _: &RgbVec, _: Rgb) {
        // Insides are static in reverse mode; the flux term stands in for their motion.
    }

    fn medium(&mut self, medium: usize, x: Vec3, adjoint: &CoefficientAdjoint) {
        let Some(gradient) = &mut self.gradient.media[medium] else { return };
        let rates = adjoint.weighted(self.weights);
        if is_finite(&rates) {
            gradient.scatter(self.world.medium(medium), x, &rates);
        } else {
            self.gradient.non_finite += 1;
        }
    }

    fn depth(&mut self, medium: usize, depth: &DepthEstimate<'_>, adjoint: Rgb) {
        let Some(gradient) = &mut self.gradient.media[medium] else { return };
        let adjoint = adjoint * self.weights;
        if adjoint.is_finite() {
            gradient.scatter_depth(self.world.medium(medium), depth, adjoint);
        } else {
            self.gradient.non_finite += 1;
        }
    }

    fn bsdf(&mut self, bsdf: usize, params: &BsdfParams, weight: Rgb) {
        if let Some(gradient) = &mut self.gradient.bsdfs[bsdf] {
            gradient.scatter(params, weight * self.weights);
        }
    }

    fn emitter(&mut self, emitter: usize, gradient: &[EmitterGradient; 3]) {
        if let Some(sum) = &mut self.gradient.emitters[emitter] {
            for (g, w) in gradient.iter().zip(self.weights.to_array()) {
                *sum += g.scaled(w);
            }
        }
    }

    fn sensor(&mut self, gradient: &[SensorGradient; 3]) {
        if let Some(sum) = &mut self.gradient.sensor {
            for (g, w) in gradient.iter().zip(self.weights.to_array()) {
                *sum += g.scaled(w);
            }
        }
    }
}

impl PathSink for Scatter<'_> {
    fn begin(&mut self) {}
    fn finish(&mut self, _: &mut [Rgb]) {}
    fn functional(&mut self, f: &Functional, value: Rgb, _: &mut [Rgb]) {
        f.send(value, self);
    }
    fn layers(&self) -> usize {
        0
    }
}

/// Collects what a boundary sample splats and scatters its functional once.
struct ToGradient<'a> {
    scatter: Scatter<'a>,
    adjoint: &'a [Rgb],
    functional: Functional,
    weight: f64,
    scale: f64,
}

impl ToGradient<'_> {
    fn flush(&mut self) {
        if self.weight != 0.0 {
            self.scatter.weights = Rgb::new(self.weight, 0.0, 0.0);
            self.functional.send(Rgb::new(1.0, 0.0, 0.0), &mut self.scatter);
            self.weight = 0.0;
        }
    }
}

impl Receiver for ToGradient<'_> {
    fn moves(&mut self, functional: &Functional) -> bool {
        self.flush();
        self.functional.clone_from(functional);
        true
    }

    fn receive(&mut self, pixel: u32, value: Rgb) {
        self.weight += self.adjoint[pixel as usize].dot(value) * self.scale;
    }
}

fn is_finite(r: &CoefficientRates) -> bool {
    r.sigma_t.is_finite() && r.albedo.is_finite() && r.emission.is_finite() && r.g.is_finite()
}
