//! A scene prepared for one parameter, paths through it, and mistakes to be found.

use alloc::sync::Arc;
use alloc::vec;

use drt_math::{Rgb, RgbVec, Rng, ValueChange, Vec3};
use drt_medium::{DepthEstimate, PhaseGradient};
use drt_motion::{GeometryChange, Parameter};

use crate::derivative::antithetic::AntitheticPairs;
use crate::derivative::contraction::{Contraction, Motion};
use crate::derivative::medium_motion::MediumMotions;
use crate::derivative::recorded_path::RecordedPath;
use crate::derivative::sensitivity::{
    ActiveInputs, AdjointSink, CoefficientAdjoint, SurfaceAdjoint, TextureUse,
};
use crate::derivative::tangents;
use crate::derivative::tests::scenes::*;
use crate::derivative::velocity::{Material, Movers, PathVelocities, VelocityField};
use crate::model::emitter::EmitterGradient;
use crate::model::scene::Scene;
use crate::model::sensor::SensorGradient;
use crate::model::surface::BsdfParams;
use crate::model::texture::Footprint;
use crate::sampling::record::PathRecord;
use crate::sampling::trace::Tracer;
use crate::terms::interior::{PathView, Probes, Recorder};
use crate::world::World;
use crate::world::cache::PreparedCache;
use crate::world::lights::EmitterMask;
use crate::world::vertex::MaterialPoint;

pub(super) fn set(name: &str, id: &str, property: &str, op: ValueChange) -> Parameter {
    parameter(name, 0.0, vec![changes(id, property, op)])
}

pub(super) fn motion(id: &str, name: &str, change: GeometryChange) -> Parameter {
    parameter(&format!("{id} {name}"), 0.0, vec![moves(id, change)])
}

pub(super) fn coloured() -> ValueChange {
    ValueChange::Add(Rgb::new(0.5, -0.2, 0.3))
}

/// A scene prepared at a parameter's value, as a session does.
pub(super) fn prepare(scene: &Scene, parameter: &Parameter) -> (World, Motion) {
    let (at_value, tangents) =
        tangents::apply(scene, core::slice::from_ref(parameter)).expect("a valid parameter");
    let (tangents, mut kept) = (tangents.seen_by(0), PreparedCache::default());
    let depth = scene.integrator.max_depth;
    let mut world =
        World::new(at_value, 0, depth, None, EmitterMask::All, &mut kept).expect("a valid scene");
    let insides = MediumMotions::plan(&world, &tangents, &[], &mut kept).expect("a valid scene");
    let motion = Motion::new(tangents, insides);
    world.prepare_for_derivatives(motion.factors());
    (world, motion)
}

/// A path and what is recorded of it.
pub(super) struct Recording<'w> {
    pub(super) record: PathRecord,
    pub(super) views: [PathView<'w>; 1],
}

impl<'w> Recording<'w> {
    pub(super) fn new(
        world: &'w World,
        field: Arc<dyn VelocityField>,
        pairs: AntitheticPairs,
    ) -> Self {
        let velocities = PathVelocities::new(field);
        let view = PathView::new(world, velocities, pairs, None);
        Self { record: PathRecord::default(), views: [view] }
    }

    /// In the material form.
    pub(super) fn material(world: &'w World, motion: &Motion) -> Self {
        let field = Material::new(Movers::new(&motion.active));
        Self::new(world, Arc::new(field), AntitheticPairs::default())
    }

    /// Leaves to probes what these are better at.
    pub(super) fn with_probes(self) -> Self {
        let Self { record, views } = self;
        Self { record, views: views.map(PathView::with_probes) }
    }

    pub(super) fn path(&self) -> RecordedPath<'_> {
        self.views[0].of(&self.record)
    }
}

/// Traces a path from some pixel; returns the filter's gradient over the density.
pub(super) fn trace<'w>(
    tracer: &mut Tracer<'w>,
    recording: &mut Recording<'w>,
    pairs: Option<Rng>,
    seed: u64,
    i: u32,
) -> [f64; 2] {
    trace_with(tracer, recording, None, pairs, seed, i)
}

/// Traces a path as [`trace`] does, with probes.
pub(super) fn trace_with<'w>(
    tracer: &mut Tracer<'w>,
    recording: &mut Recording<'w>,
    probes: Option<&mut Probes>,
    pairs: Option<Rng>,
    seed: u64,
    i: u32,
) -> [f64; 2] {
    let pixels = FILM[0] * FILM[1];
    let mut rng = Rng::new(seed, u64::from(i % pixels), i / pixels);
    let place = rng.next_2d();
    trace_at(tracer, recording, probes, pairs, i % pixels, place, rng)
}

/// Traces a path as [`trace_with`] does, through a place in a pixel.
pub(super) fn trace_at<'w>(
    tracer: &mut Tracer<'w>,
    recording: &mut Recording<'w>,
    probes: Option<&mut Probes>,
    pairs: Option<Rng>,
    pixel: u32,
    place: [f64; 2],
    rng: Rng,
) -> [f64; 2] {
    let view = tracer.world.camera.sample_view(pixel, place, true);
    let weight = Rgb::splat(view.weight);
    let pixel = [pixel % FILM[0], pixel / FILM[0]];
    let Recording { record, views } = recording;
    views[0].begin(pairs, || Rng::new(0, 0, 0), || Rng::new(0, 0, 0));
    let mut recorder = Recorder { record, views, camera_ray: None, probes };
    recorder.begin(pixel, &view, weight);
    tracer.rng = rng;
    tracer.trace_camera(&view, weight, &mut recorder);
    recorder.probe(tracer);
    view.slope
}

/// Something done wrong on purpose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Fault {
    None,
    /// The area Jacobian is left out.
    NoJacobian,
    /// The geometric normal's rate has the wrong sign.
    Normal,
    /// Interpolated normals stay.
    ShadingNormal,
    /// Volume vertices stay.
    Volume,
    /// The box of a moving grid stays.
    GridFace,
    /// The grid of a phase function stays.
    PhaseGrid,
}

/// A contraction that makes a mistake.
pub(super) struct Faulty<'a>(pub(super) Contraction<'a>, pub(super) Fault);

impl AdjointSink for Faulty<'_> {
    fn active(&self) -> &ActiveInputs {
        self.0.active()
    }
    fn surface(&mut self, point: &MaterialPoint, adjoint: &SurfaceAdjoint) {
        let mut a = *adjoint;
        match self.1 {
            Fault::NoJacobian => a.j = Rgb::ZERO,
            Fault::Normal => a.n = -a.n,
            Fault::ShadingNormal => a.ns = RgbVec::ZERO,
            Fault::None | Fault::Volume | Fault::GridFace | Fault::PhaseGrid => {}
        }
        self.0.surface(point, &a);
    }
    fn volume(&mut self, medium: usize, x: Vec3, u: &RgbVec, j: Rgb) {
        if self.1 != Fault::Volume {
            self.0.volume(medium, x, u, j);
        }
    }
    fn grid(&mut self, medium: usize, x: Vec3, u: &RgbVec) {
        self.0.grid(medium, x, u);
    }
    fn medium(&mut self, medium: usize, x: Vec3, adjoint: &CoefficientAdjoint) {
        self.0.medium(medium, x, adjoint);
    }
    fn phase(&mut self, medium: usize, x: Vec3, gradient: &PhaseGradient, adjoint: Rgb) {
        let mut gradient = *gradient;
        if self.1 == Fault::PhaseGrid {
            gradient.place = Vec3::ZERO;
        }
        self.0.phase(medium, x, &gradient, adjoint);
    }
    fn depth(&mut self, medium: usize, depth: &DepthEstimate<'_>, adjoint: Rgb) {
        let mut depth = depth.clone();
        if self.1 == Fault::GridFace {
            let of = self.0.world.medium(medium);
            depth = DepthEstimate::inside(of, depth.ray, depth.points, true);
        }
        self.0.depth(medium, &depth, adjoint);
    }
    fn bsdf(&mut self, bsdf: usize, params: &BsdfParams, weight: Rgb) {
        self.0.bsdf(bsdf, params, weight);
    }
    fn texels(&mut self, of: TextureUse, footprint: &Footprint, adjoint: Rgb) {
        self.0.texels(of, footprint, adjoint);
    }
    fn emitter(&mut self, emitter: usize, gradient: &[EmitterGradient; 3]) {
        self.0.emitter(emitter, gradient);
    }
    fn sensor(&mut self, gradient: &[SensorGradient; 3]) {
        self.0.sensor(gradient);
    }
}
