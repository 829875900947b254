//! Reverse mode: the gradient of a loss by everything, from the same paths, records and boundary samples as
//! derivative images.
//!
//! With a_i = ∂Loss/∂I_i at pixel i, the gradient by a quantity q is Σ_i a_i ∂I_i/∂q. Forward mode contracts
//! sensitivities (to positions, normals, coefficients) with the tangents of its parameters. Here each is
//! multiplied by its pixel's adjoint and added up where it belongs: at mesh vertices, through the transposed jets
//! of surface points; for points inside a medium, at the vertices of its tetrahedra and from there at those
//! of the shapes around it; at voxels, through the transposed interpolation. The cost does not grow with the number
//! of quantities. With the same seed and without [`guiding`](Settings::guiding), ⟨a, J v⟩ = ⟨Jᵀ a, v⟩ to rounding.

mod sizes;

use alloc::vec::Vec;
use core::ops::Range;

use drt_math::{Rgb, RgbVec, Vec3};
use drt_medium::{CoefficientRates, DepthEstimate};
use drt_motion::surface::JetAdjoint;
use drt_motion::volume::VolumeAdjoint;

use crate::derivative::medium_motion::{InteriorGradients, ReverseMediumMotions};
use crate::derivative::scene_gradient::SceneGradient;
use crate::derivative::sensitivity::{
    ActiveInputs, AdjointSink, CoefficientAdjoint, SurfaceAdjoint, TextureUse, VelocityFunctional,
};
use crate::derivative::tangents;
use crate::model::emitter::EmitterGradient;
use crate::model::error::{Error, SettingError};
use crate::model::rendering::Account;
use crate::model::scene::{Scene, Target, TargetName};
use crate::model::sensor::SensorGradient;
use crate::model::settings::{EstimatorKind, PathSampling, Settings};
use crate::model::shard::Shard;
use crate::model::surface::BsdfParams;
use crate::model::texture::Footprint;
use crate::run::reverse::sizes::OfGradient;
use crate::run::session::{Control, estimators, may_move, seed_of_component, slides};
use crate::sampling::bidirectional::EmissionSampler;
use crate::sampling::film::BATCHES;
use crate::sampling::parallel::Pool;
use crate::sampling::pixels::{Part, Pass, Sampler};
use crate::terms::boundary_segments::BoundarySink;
use crate::terms::guiding::Guiding;
use crate::terms::interior::{PathSink, PixelSampler};
use crate::terms::prepared::Prepared;
use crate::terms::splatting::Checked;
use crate::world::cache::PreparedCache;
use crate::world::lights::EmitterMask;
use crate::world::vertex::MaterialPoint;
use crate::world::{ActiveFactors, MediumActivity, World};

/// The gradient of a loss by the items `wanted`, from `spp` samples per pixel, and boundary samples in
/// [proportion](Settings::boundary_ratio). `adjoint` holds ∂Loss/∂I per pixel and channel, row by row
/// from the top left.
///
/// How the inside of a medium moves with what is around it:
///
/// * By default it is filled with tetrahedra between the shapes that touch it and the cameras and point lights in it. Their
///   gradients are added to those of the shapes. Tetrahedra are made anew by every call, in 0.05 to 0.25 s per 1000 vertices.
/// * It stays at rest, and the flux through the shapes that are wanted is added, where no paths have vertices on what
///   is wanted (null and black surfaces), where shapes pass through each other, where [`Settings::insides`]
///   asks for [`InteriorMotion::Static`](crate::InteriorMotion::Static), and by [`EstimatorKind::Radiative`].
/// * Tetrahedra that [`Settings::insides`] gives are taken, without the velocities given along with them. Other kinds
///   of motion count as not asked for.
///
/// All of these have the same expected value. Forward mode is the exact transpose with the same seed, settings and
/// `spp`, without [`guiding`](Settings::guiding), and with one of the kinds above asked for in both. An exception are shapes that touch and
/// move differently: no field follows both, and the flux through what is left behind is added here.
///
/// # Errors
/// When a name is not that of one item, the adjoint's size is not the film's, the scene or a setting is unusable, or
/// tetrahedra that [`Settings::insides`] asks for cannot be made.
pub fn gradient(
    scene: &Scene,
    wanted: &[impl TargetName],
    settings: &Settings,
    spp: u32,
    adjoint: &[Rgb],
    control: &dyn Control,
) -> Result<SceneGradient, Error> {
    let mut sums: Option<[SceneGradient; 2]> = None;
    let wanted = targets(scene, wanted)?;
    gradient_in_batches(scene, &wanted, settings, spp, adjoint, None, control, &mut |batch| {
        let parts = [batch.pixels, batch.boundary];
        match &mut sums {
            None => sums = Some(parts),
            Some(sums) => sums.iter_mut().zip(&parts).for_each(|(sum, part)| sum.add(part)),
        }
    })?;
    if let Some([mut pixels, boundary]) = sums {
        pixels.add(&boundary);
        return Ok(pixels);
    }
    // It was cancelled before anything was done.
    let (scene, _) = tangents::apply(scene, &[])?;
    let world = World::new(
        scene.clone(),
        settings.sensor,
        None,
        None,
        EmitterMask::All,
        &mut PreparedCache::default(),
    )?;
    Ok(SceneGradient::zeros(&world, &active(&scene, &wanted)))
}

fn targets(scene: &Scene, wanted: &[impl TargetName]) -> Result<Vec<Target>, Error> {
    wanted.iter().map(|w| w.find_in(scene)).collect()
}

/// The settings with the estimator that gradients take where that was left open.
fn of_gradients(settings: &Settings) -> Settings {
    let estimator = match settings.estimator {
        EstimatorKind::Auto => EstimatorKind::PathSpace,
        named => named,
    };
    Settings { estimator, ..settings.clone() }
}

/// What one batch of samples adds to a [`gradient`].
#[derive(Clone, Debug)]
pub struct GradientBatch {
    /// Its number, from 0. The gradient is the sum over all batches in this order: of their pixels and of their boundary
    /// samples, and then of both.
    pub number: u32,
    /// By the paths of pixels.
    pub pixels: SceneGradient,
    /// Samples of each pixel, and those that each has in all batches together.
    pub of_pixels: [u32; 2],
    /// By boundary samples.
    pub boundary: SceneGradient,
    /// Batches of boundary samples, and those of all batches.
    pub of_boundary: [u32; 2],
}

/// A [`gradient`] in parts: calls `each` with every batch of samples, or with those of a shard, as they are finished, in
/// order. The batches do not depend on who takes them. False when `control` cancelled it.
///
/// # Errors
/// As [`gradient`], and when there are more shards than batches.
#[allow(clippy::too_many_arguments)]
pub fn gradient_in_batches(
    scene: &Scene,
    wanted: &[impl TargetName],
    settings: &Settings,
    spp: u32,
    adjoint: &[Rgb],
    shard: Option<Shard>,
    control: &dyn Control,
    each: &mut dyn FnMut(GradientBatch),
) -> Result<bool, Error> {
    let settings = &of_gradients(settings);
    scene.check()?;
    settings.check(scene, true)?;
    let scene = &*scene.expanded()?;
    let wanted = &targets(scene, wanted)?[..];
    if let Some(target) = wanted.first() {
        let slide = slides(scene, wanted.iter().copied(), settings);
        let active = active(scene, wanted);
        scene.refuse_derivatives(&scene.name_of(*target), active.moves_geometry(), slide)?;
        let moves = |t: &Target| !matches!(t, Target::Sensor(_)) && may_move(scene, *t);
        if let Some(target) = wanted.iter().find(|t| moves(t)) {
            scene.refuse_rims(&scene.name_of(*target))?;
        }
    }
    let (scene, _) = tangents::apply(scene, &[])?;
    let film = scene.sensors[settings.sensor].item.sensor.film();
    if adjoint.len() != (film[0] * film[1]) as usize {
        let reason = SettingError::PixelCount { found: adjoint.len(), expected: film };
        return Err(Error::Setting { setting: "adjoint", reason });
    }
    let depth = settings.max_depth.within(scene.integrator.max_depth);
    let mut kept = PreparedCache::default();
    let mut world =
        World::new(scene.clone(), settings.sensor, depth, None, EmitterMask::All, &mut kept)?;
    let estimators = estimators(&scene, wanted.iter().copied(), settings).into_iter();
    let mut components = estimators
        .map(|(settings, lit)| Component::new(world.lit_by(lit)?, wanted, &settings))
        .collect::<Result<Vec<_>, Error>>()?;
    let needs = components.iter().map(Component::needs);
    if let Some(needs) = needs.reduce(|all, needs| all.union(&needs)) {
        world.prepare_for_derivatives(needs);
    }
    let antithetic = components.iter().any(|c| c.prepared.antithetic);
    let pool = Pool::new(settings.threads);
    let seed = settings.seed;
    let mut pilots = Account::default();
    if settings.guiding {
        for (c, component) in components.iter_mut().enumerate() {
            let seed = seed_of_component(seed, c);
            let (account, going) = component.learn(&world, seed, spp, adjoint, &pool, control);
            pilots.add(account);
            if !going {
                return Ok(false);
            }
        }
    }
    let components = &components[..];
    let units = spp.div_ceil(if antithetic { 2 } else { 1 }).max(1);
    let pass = Pass::new(0, units, film);
    if let Some(shard) = shard.filter(|s| s.count() > pass.parts()) {
        let reason = SettingError::TooManyShards { count: shard.count(), most: pass.parts() };
        return Err(Error::Setting { setting: "shard", reason });
    }
    let bidirectional = settings.sampling == PathSampling::Bidirectional;
    let emission = bidirectional.then(|| EmissionSampler::new(&world));
    let emission = emission.as_ref();
    let cancelled = &|| control.cancelled();
    let world = &world;
    let run =
        Reverse { world, components, emission, antithetic, seed, pass, spp, adjoint, cancelled };
    let pieces = run.pieces(shard);
    let mut sums = [run.zeros(), run.zeros()];
    if let Some(first) = sums[1].first_mut() {
        first.scene.counters = pilots.counters;
        first.scene.non_finite += pilots.non_finite_count;
    }
    let finish = |sums: Vec<Sums>| {
        let mut gradient = SceneGradient::zeros(world, &active(&scene, wanted));
        for (component, Sums { scene: mut sum, insides }) in components.iter().zip(sums) {
            component.insides.gather(&component.prepared.world, insides, &mut sum);
            gradient.add(&sum);
        }
        gradient
    };
    let work = |i: u32| run.piece(&pieces[i as usize]);
    Ok(pool.ordered(0..pieces.len() as u32, 1, work, |i, parts| {
        if control.cancelled() {
            return false;
        }
        let piece = &pieces[i as usize];
        let [of_pixels, of_boundary] = &mut sums;
        let to = if matches!(piece.work, Work::Pixels(_)) { of_pixels } else { of_boundary };
        parts.iter().for_each(|(c, part)| to[*c].add(part));
        if piece.last {
            let [pixels, boundary] =
                core::mem::replace(&mut sums, [run.zeros(), run.zeros()]).map(finish);
            let number = piece.part.number;
            let batches = run.batches(number);
            each(GradientBatch {
                number,
                pixels,
                of_pixels: [piece.part.units[1] - piece.part.units[0], units],
                boundary,
                of_boundary: [batches.len() as u32, BATCHES as u32],
            });
        }
        true
    }))
}

/// One estimator's part in a gradient, by the light of some emitters.
struct Component {
    prepared: Prepared,
    active: ActiveInputs,
    insides: ReverseMediumMotions,
    /// What is known of each source of boundary samples.
    guiding: Vec<Guiding>,
}

impl Component {
    fn new(mut world: World, wanted: &[Target], settings: &Settings) -> Result<Self, Error> {
        let lit = world.lit;
        let mut active = active(&world.scene, wanted);
        for (e, emitter) in world.scene.emitters.iter().enumerate() {
            active.emitters[e] &= lit.by(&emitter.item.emitter);
            active.moving_emitters[e] &= lit.by(&emitter.item.emitter);
        }
        let insides = match settings.estimator {
            EstimatorKind::Radiative | EstimatorKind::Warped => {
                ReverseMediumMotions::at_rest(&world)
            }
            _ => ReverseMediumMotions::new(&world, &active, &settings.insides)?,
        };
        active.volumes = insides.volumes();
        world.prepare_for_derivatives(needs(&active));
        let prepared = Prepared::new(world, &active, &insides.flux_shapes, settings, None)?;
        let guiding = prepared.sources.iter().map(|_| Guiding::default()).collect();
        Ok(Self { prepared, active, insides, guiding })
    }

    /// Learns how to guide boundary samples, by the light of all emitters where that counts; false when cancelled.
    fn learn(
        &mut self,
        all: &World,
        seed: u64,
        spp: u32,
        adjoint: &[Rgb],
        pool: &Pool,
        control: &dyn Control,
    ) -> (Account, bool) {
        let mut pilots = Account::default();
        let (prepared, active) = (&self.prepared, &self.active);
        let cancelled = || control.cancelled();
        let splatter = prepared.splatter(all, seed).until(&cancelled);
        for (i, guiding) in self.guiding.iter_mut().enumerate() {
            let samples = f64::from(spp) * prepared.source_ratio(i) * adjoint.len() as f64;
            let (account, going) = guiding.learn(
                &splatter,
                prepared.sources[i],
                samples,
                pool,
                || OfGradient::new(active, adjoint),
                cancelled,
            );
            pilots.add(account);
            if !going {
                return (pilots, false);
            }
        }
        (pilots, true)
    }

    fn needs(&self) -> ActiveFactors {
        needs(&self.active)
    }

    fn zeros(&self) -> Sums {
        let scene = SceneGradient::zeros(&self.prepared.world, &self.active);
        Sums { scene, insides: self.insides.zeros() }
    }

    fn scatter(&self) -> ScatterSink<'_> {
        ScatterSink {
            world: &self.prepared.world,
            active: &self.active,
            insides: &self.insides,
            weights: Rgb::ZERO,
            sums: self.zeros(),
        }
    }
}

/// What must be sampled even where it contributes nothing to the image.
fn needs(active: &ActiveInputs) -> ActiveFactors {
    let need = |w: &bool| if *w { MediumActivity::Vertices } else { MediumActivity::Nothing };
    ActiveFactors {
        media: active.media.iter().map(need).collect(),
        bsdfs: active.bsdfs.clone(),
        roughness: active.bsdfs.clone(),
        index: active.bsdfs.clone(),
    }
}

fn active(scene: &Scene, wanted: &[Target]) -> ActiveInputs {
    fn flags(n: usize, wanted: &[Target], of: impl Fn(usize) -> Target) -> Vec<bool> {
        (0..n).map(|i| wanted.contains(&of(i))).collect()
    }
    let emitters = flags(scene.emitters.len(), wanted, Target::Emitter);
    let placed = |e: usize| {
        let emitter = &scene.emitters[e].item.emitter;
        emitter.is_delta()
    };
    ActiveInputs {
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
    /// By all light, for paths.
    world: &'a World,
    components: &'a [Component],
    /// Where paths of light start, if there are any.
    emission: Option<&'a EmissionSampler>,
    /// Image points come in mirrored pairs.
    antithetic: bool,
    seed: u64,
    pass: Pass,
    spp: u32,
    adjoint: &'a [Rgb],
    /// True when pieces of work shall end before they are done, to be thrown away.
    cancelled: &'a (dyn Fn() -> bool + Sync),
}

/// A piece of work.
struct Piece {
    /// What of the samples of pixels its batch has.
    part: Part,
    work: Work,
    /// The last one of its batch.
    last: bool,
}

enum Work {
    /// Of the pixels from the first one on, up to the second one.
    Pixels([u32; 2]),
    /// Component, source and batch.
    Splats(usize, usize, u32),
}

/// What a piece of work adds to the gradient.
struct Sums {
    scene: SceneGradient,
    insides: InteriorGradients,
}

impl Sums {
    fn add(&mut self, other: &Self) {
        self.scene.add(&other.scene);
        self.insides.add(&other.insides);
    }
}

impl Reverse<'_> {
    fn zeros(&self) -> Vec<Sums> {
        self.components.iter().map(Component::zeros).collect()
    }

    /// The batches of boundary samples that go with a part of those of pixels.
    fn batches(&self, part: u32) -> Range<u32> {
        let at = |k: u32| k * BATCHES as u32 / self.pass.parts();
        at(part)..at(part + 1)
    }

    /// The work of all batches, or of those of a shard, in order.
    fn pieces(&self, shard: Option<Shard>) -> Vec<Piece> {
        let mut parts: Vec<Part> = self.pass.strata(shard).collect();
        parts.sort_by_key(|part| part.number);
        let chunks = (BATCHES as u32).div_ceil(self.pass.parts());
        let n = self.adjoint.len() as u64;
        let at = |c: u32| (n * u64::from(c) / u64::from(chunks)) as u32;
        let mut pieces = Vec::new();
        for part in parts {
            let mut push = |work| pieces.push(Piece { part, work, last: false });
            (0..chunks).for_each(|c| push(Work::Pixels([at(c), at(c + 1)])));
            for (c, component) in self.components.iter().enumerate() {
                for source in 0..component.prepared.sources.len() {
                    self.batches(part.number).for_each(|b| push(Work::Splats(c, source, b)));
                }
            }
            if let Some(piece) = pieces.last_mut() {
                piece.last = true;
            }
        }
        pieces
    }

    /// What a piece of work adds to which component.
    fn piece(&self, piece: &Piece) -> Vec<(usize, Sums)> {
        match piece.work {
            Work::Pixels(pixels) => self.pixels(&piece.part, pixels),
            Work::Splats(component, source, batch) => self.splats(component, source, batch),
        }
    }

    /// Samples of some pixels; what they add to which component.
    fn pixels(&self, part: &Part, [first, last]: [u32; 2]) -> Vec<(usize, Sums)> {
        let per_unit = if self.antithetic { 2 } else { 1 };
        let scale = 1.0 / f64::from(self.pass.all() * per_unit);
        let components = self.components.iter().map(|c| c.prepared.component(c.scatter()));
        let seed = self.seed;
        let start = self.pass.units(part.run).start;
        let units = part.units[0] - start..part.units[1] - start;
        let mut sampler = PixelSampler::new(self.world, components, seed, self.antithetic, false)
            .with_light_paths(self.emission);
        let mut values = [Rgb::ZERO];
        for pixel in first..last {
            for sink in sampler.sinks() {
                sink.weights = self.adjoint[pixel as usize] * scale;
            }
            self.pass.sample(seed, pixel, part.run, units.clone(), 1, |unit, points| {
                if !(self.cancelled)() {
                    sampler.sample(pixel, unit, points, &mut values);
                }
            });
        }
        let (account, sinks) = sampler.finish();
        let mut sums: Vec<_> = sinks.into_iter().map(|sink| sink.sums).enumerate().collect();
        if let Some((_, first)) = sums.first_mut() {
            first.scene.counters = account.counters;
            first.scene.non_finite += account.non_finite_count;
        }
        sums
    }

    /// One batch of a source of boundary samples; what it adds to its component.
    fn splats(&self, c: usize, i: usize, batch: u32) -> Vec<(usize, Sums)> {
        let component = &self.components[c];
        let prepared = &component.prepared;
        let source = prepared.sources[i];
        let share = component.guiding[i].share();
        let per_pixel = f64::from(self.spp) * prepared.source_ratio(i) * share;
        let count = prepared.samples_per_batch(per_pixel);
        let scale = 1.0 / (f64::from(count) * BATCHES as f64);
        let mut receiver = Checked::new(ToGradient {
            scatter: component.scatter(),
            adjoint: self.adjoint,
            functional: VelocityFunctional::default(),
            weight: 0.0,
            scale,
        });
        let stream = source.stream() + u64::from(batch);
        let seed = seed_of_component(self.seed, c);
        let splatter = prepared.splatter(self.world, seed).until(self.cancelled);
        let guide = component.guiding[i].guide();
        let account = splatter.run(source, guide, stream, count, &mut receiver);
        let mut to = receiver.inner;
        to.flush();
        let mut sums = to.scatter.sums;
        sums.scene.counters = account.counters;
        sums.scene.non_finite += account.non_finite_count;
        alloc::vec![(c, sums)]
    }
}

/// Adds sensitivities, weighted by the pixel's adjoint, to the gradient of everything.
pub(crate) struct ScatterSink<'a> {
    world: &'a World,
    active: &'a ActiveInputs,
    insides: &'a ReverseMediumMotions,
    weights: Rgb,
    sums: Sums,
}

#[cfg(all(test, feature = "std"))]
impl<'a> ScatterSink<'a> {
    /// To what is not inside of media.
    pub(crate) fn of_surfaces(world: &'a World, active: &'a ActiveInputs, weights: Rgb) -> Self {
        let insides =
            alloc::boxed::Box::leak(alloc::boxed::Box::new(ReverseMediumMotions::at_rest(world)));
        let sums = Sums { scene: SceneGradient::zeros(world, active), insides: insides.zeros() };
        Self { world, active, insides, weights, sums }
    }

    pub(crate) fn into_gradient(self) -> SceneGradient {
        self.sums.scene
    }
}

impl AdjointSink for ScatterSink<'_> {
    fn active(&self) -> &ActiveInputs {
        self.active
    }

    fn surface(&mut self, point: &MaterialPoint, adjoint: &SurfaceAdjoint) {
        let shape = point.shape as usize;
        let Some(gradient) = &mut self.sums.scene.shapes[shape] else { return };
        let w = self.weights;
        let jet = JetAdjoint {
            u: adjoint.u.weighted(w),
            n: adjoint.n.weighted(w),
            ns: adjoint.ns.weighted(w),
            j: adjoint.j.dot(w),
        };
        if !(jet.u.is_finite() && jet.n.is_finite() && jet.ns.is_finite() && jet.j.is_finite()) {
            self.sums.scene.non_finite += 1;
            return;
        }
        gradient.scatter(&self.world.scene.shapes[shape].mesh, &point.at, &jet);
    }

    fn volume(&mut self, medium: usize, x: Vec3, u: &RgbVec, j: Rgb) {
        let adjoint = VolumeAdjoint { u: u.weighted(self.weights), j: j.dot(self.weights) };
        if adjoint.u.is_finite() && adjoint.j.is_finite() {
            self.insides.scatter(medium, x, &adjoint, &mut self.sums.insides);
        } else {
            self.sums.scene.non_finite += 1;
        }
    }

    fn grid(&mut self, medium: usize, x: Vec3, u: &RgbVec) {
        let Some(gradient) = &mut self.sums.scene.media[medium] else { return };
        let u = u.weighted(self.weights);
        if u.is_finite() {
            gradient.scatter_velocity(x, u);
        } else {
            self.sums.scene.non_finite += 1;
        }
    }

    fn medium(&mut self, medium: usize, x: Vec3, adjoint: &CoefficientAdjoint) {
        let Some(gradient) = &mut self.sums.scene.media[medium] else { return };
        let rates = adjoint.weighted(self.weights);
        if is_finite(&rates) {
            gradient.scatter(self.world.medium(medium), x, &rates);
        } else {
            self.sums.scene.non_finite += 1;
        }
    }

    fn depth(&mut self, medium: usize, depth: &DepthEstimate<'_>, adjoint: Rgb) {
        let Some(gradient) = &mut self.sums.scene.media[medium] else { return };
        let adjoint = adjoint * self.weights;
        if adjoint.is_finite() {
            gradient.scatter_depth(self.world.medium(medium), depth, adjoint);
        } else {
            self.sums.scene.non_finite += 1;
        }
    }

    fn bsdf(&mut self, bsdf: usize, params: &BsdfParams, weight: Rgb) {
        if let Some(gradient) = &mut self.sums.scene.bsdfs[bsdf] {
            gradient.scatter(params, weight * self.weights);
        }
    }

    fn texels(&mut self, of: TextureUse, footprint: &Footprint, adjoint: Rgb) {
        let adjoint = adjoint * self.weights;
        if !adjoint.is_finite() {
            self.sums.scene.non_finite += 1;
            return;
        }
        let sums = &mut self.sums.scene;
        let gradient = match of {
            TextureUse::Bsdf(bsdf, property) => {
                let mut textures = sums.texels[bsdf].iter_mut();
                textures.find(|(p, _)| *p == property).map(|(_, gradient)| gradient)
            }
            TextureUse::Emitter(emitter) => sums.emitter_texels[emitter].as_mut(),
        };
        if let Some(gradient) = gradient {
            gradient.scatter(footprint, adjoint);
        }
    }

    fn emitter(&mut self, emitter: usize, gradient: &[EmitterGradient; 3]) {
        if let Some(sum) = &mut self.sums.scene.emitters[emitter] {
            for (g, w) in gradient.iter().zip(self.weights.to_array()) {
                *sum += g.scaled(w);
            }
        }
    }

    fn sensor(&mut self, gradient: &[SensorGradient; 3]) {
        if let Some(sum) = &mut self.sums.scene.sensor {
            for (g, w) in gradient.iter().zip(self.weights.to_array()) {
                *sum += g.scaled(w);
            }
        }
    }
}

impl PathSink for ScatterSink<'_> {
    fn begin(&mut self) {}
    fn finish(&mut self, _: &mut [Rgb]) {}
    fn functional(&mut self, f: &VelocityFunctional, value: Rgb, _: &mut [Rgb]) {
        f.send(value, self);
    }
    fn layers(&self) -> usize {
        0
    }
}

/// Collects what a boundary sample splats and scatters its functional once.
struct ToGradient<'a> {
    scatter: ScatterSink<'a>,
    adjoint: &'a [Rgb],
    functional: VelocityFunctional,
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

impl<'a> BoundarySink for ToGradient<'a> {
    fn moves(&mut self, functional: &VelocityFunctional) -> bool {
        self.flush();
        self.functional.clone_from(functional);
        true
    }

    fn receive(&mut self, pixel: u32, value: Rgb) {
        self.weight += self.adjoint[pixel as usize].dot(value) * self.scale;
    }

    type Sink = ScatterSink<'a>;

    fn sink(&self) -> &ScatterSink<'a> {
        &self.scatter
    }

    fn spread(&mut self, pixels: &[(u32, f64)], send: impl FnOnce(&mut ScatterSink<'a>)) -> bool {
        self.flush();
        let weights = pixels.iter().map(|(pixel, weight)| self.adjoint[*pixel as usize] * *weight);
        self.scatter.weights = weights.fold(Rgb::ZERO, |sum, w| sum + w) * self.scale;
        send(&mut self.scatter);
        true
    }
}

fn is_finite(r: &CoefficientRates) -> bool {
    r.sigma_t.is_finite() && r.albedo.is_finite() && r.emission.is_finite() && r.g.is_finite()
}
