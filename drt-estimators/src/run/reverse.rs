//! Reverse mode: the gradient of a loss by everything, from the same paths, records and boundary samples as
//! derivative images.
//!
//! With a_i = ∂Loss/∂I_i at pixel i, the gradient by a quantity q is Σ_i a_i ∂I_i/∂q. Forward mode contracts
//! sensitivities (to positions, normals, coefficients) with the tangents of its parameters. Here each is
//! multiplied by its pixel's adjoint and added up where it belongs: at mesh vertices, through the transposed jets
//! of surface points; for points inside a medium, at the vertices of its tetrahedra and from there at those
//! of the shapes around it; at voxels, through the transposed interpolation. The cost does not grow with the number
//! of quantities. With the same seed and without [`guiding`](Settings::guiding), ⟨a, J v⟩ = ⟨Jᵀ a, v⟩ to rounding.

use alloc::vec::Vec;

use drt_math::{Rgb, RgbVec, Vec3};
use drt_medium::{CoefficientRates, DepthEstimate};
use drt_motion::surface::JetAdjoint;
use drt_motion::volume::VolumeAdjoint;

use crate::derivative::medium_motion::{InteriorGradients, ReverseMediumMotions};
use crate::derivative::scene_gradient::SceneGradient;
use crate::derivative::sensitivity::{
    ActiveInputs, AdjointSink, CoefficientAdjoint, SurfaceAdjoint, VelocityFunctional,
};
use crate::derivative::tangents;
use crate::model::emitter::EmitterGradient;
use crate::model::error::{Error, SettingError};
use crate::model::scene::{Scene, Target, TargetName};
use crate::model::sensor::SensorGradient;
use crate::model::settings::{EstimatorKind, Settings};
use crate::model::surface::BsdfParams;
use crate::run::session::{Control, estimators, seed_of_component};
use crate::sampling::film::BATCHES;
use crate::sampling::parallel::Pool;
use crate::sampling::pixels::{Pass, Sampler};
use crate::terms::boundary::BoundarySink;
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
    scene.check()?;
    settings.check(scene, true)?;
    let wanted = wanted.iter().map(|w| w.find_in(scene)).collect::<Result<Vec<_>, _>>()?;
    wanted.first().map_or(Ok(()), |target| scene.refuse_smooth(&scene.name_of(*target)))?;
    let wanted = &wanted[..];
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
    let components = estimators
        .map(|(settings, lit)| Component::new(world.lit_by(lit)?, wanted, &settings))
        .collect::<Result<Vec<_>, Error>>()?;
    let needs = components.iter().map(Component::needs);
    if let Some(needs) = needs.reduce(|all, needs| all.union(&needs)) {
        world.prepare_for_derivatives(needs);
    }
    let antithetic = components.iter().any(|c| c.prepared.antithetic);
    let (components, seed) = (&components[..], settings.seed);
    let run = Reverse { world: &world, components, antithetic, seed, spp, adjoint };
    let pool = Pool::new(settings.threads);
    let mut total = run.zeros();
    let mut merge = |_: u32, parts: Vec<(usize, Sums)>| {
        parts.iter().for_each(|(c, part)| total[*c].add(part));
        !control.cancelled()
    };
    let chunks = BATCHES as u32;
    let mut going = pool.ordered(0..chunks, 1, |c| run.pixels(c, chunks), &mut merge);
    for (c, component) in components.iter().enumerate() {
        for i in 0..component.prepared.sources.len() {
            going = going && pool.ordered(0..chunks, 1, |b| run.splats(c, i, b), &mut merge);
        }
    }
    let mut gradient = SceneGradient::zeros(&world, &active(&scene, wanted));
    for (component, sums) in components.iter().zip(total) {
        let Sums { mut scene, insides } = sums;
        component.insides.gather(&component.prepared.world, insides, &mut scene);
        gradient.add(&scene);
    }
    Ok(gradient)
}

/// One estimator's part in a gradient, by the light of some emitters.
struct Component {
    prepared: Prepared,
    active: ActiveInputs,
    insides: ReverseMediumMotions,
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
        Ok(Self { prepared, active, insides })
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
    /// Image points come in mirrored pairs.
    antithetic: bool,
    seed: u64,
    spp: u32,
    adjoint: &'a [Rgb],
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

    /// One of `chunks` parts of the pixels; what it adds to which component.
    fn pixels(&self, chunk: u32, chunks: u32) -> Vec<(usize, Sums)> {
        let per_unit = if self.antithetic { 2 } else { 1 };
        let units = self.spp.div_ceil(per_unit).max(1);
        let scale = 1.0 / f64::from(units * per_unit);
        let n = self.adjoint.len() as u64;
        let at = |c: u32| (n * u64::from(c) / u64::from(chunks)) as u32;
        let components = self.components.iter().map(|c| c.prepared.component(c.scatter()));
        let (seed, film) = (self.seed, self.world.camera.film());
        let mut sampler = PixelSampler::new(self.world, components, seed, self.antithetic, false);
        let mut values = [Rgb::ZERO];
        let pass = Pass::new(0, units, film);
        for pixel in at(chunk)..at(chunk + 1) {
            for sink in sampler.sinks() {
                sink.weights = self.adjoint[pixel as usize] * scale;
            }
            for run in pass.runs() {
                let units = 0..pass.units(run).len() as u32;
                pass.sample(seed, pixel, run, units, 1, |unit, points| {
                    sampler.sample(pixel, unit, points, &mut values);
                });
            }
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
        let per_pixel = f64::from(self.spp) * prepared.source_ratio(i);
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
        let splatter = prepared.splatter(seed_of_component(self.seed, c));
        let account = splatter.run(source, stream, count, &mut receiver);
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

impl BoundarySink for ToGradient<'_> {
    fn moves(&mut self, functional: &VelocityFunctional) -> bool {
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
