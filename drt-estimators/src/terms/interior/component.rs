//! One estimator's part in the derivative of a path: the light of some emitters, by a velocity field.

use alloc::sync::Arc;

use drt_math::{Rgb, RgbVec, Rng};

use crate::derivative::adjoint::Differentiator;
use crate::derivative::pairs::{Brought, Pairs};
use crate::derivative::sensitivity::{Rate, SurfaceAdjoint};
use crate::derivative::velocity::{Material, Movers, PathVelocities, VelocityField};
use crate::edges::tree::Options;
use crate::sampling::record::PathRecord;
use crate::sampling::streams::LINE_STREAM;
use crate::sampling::trace::Tracer;
use crate::terms::boundary::shadow;
use crate::terms::interior::recorder::PathView;
use crate::terms::interior::{AlongRays, Looks, PathSink};
use crate::terms::radiative::{Edged, Look, Radiative};
use crate::world::{RayPath, World};

/// What one estimator differentiates of the paths through pixels.
pub(crate) struct Component<'a, S> {
    /// The scene, lit by what this estimator looks at.
    pub(crate) world: &'a World,
    pub(crate) along: AlongRays<'a>,
    pub(crate) sink: S,
}

/// A component at work.
pub(super) struct Worker<'a, S> {
    pub(super) along: AlongRays<'a>,
    pub(super) sink: S,
    differentiator: Differentiator<'a>,
    shadow_buffers: shadow::Buffers,
    brought: Brought,
    /// Of the edge tree.
    options: Options,
    separate: bool,
    pub(super) differentiated: u64,
    /// Rays that looks took.
    pub(super) looking: u64,
}

/// A path just traced.
pub(super) struct Traced<'t> {
    pub(super) record: &'t PathRecord,
    pub(super) camera_ray: &'t RayPath,
    /// The filter's gradient by the pixel position, over the density.
    pub(super) filter: [f64; 2],
    pub(super) seed: u64,
    pub(super) pixel: u32,
    pub(super) unit: u32,
    /// The numbers of a look at edges.
    pub(super) look: Option<Rng>,
}

impl<'a, S: PathSink> Worker<'a, S> {
    /// With what it keeps of each path.
    pub(super) fn new(component: Component<'a, S>, separate: bool) -> (Self, PathView<'a>) {
        let Component { world, along, sink } = component;
        let field: Arc<dyn VelocityField> = match along.radiative {
            Some(radiative) => Arc::clone(&radiative.spatial) as _,
            None => Arc::new(Material::new(Movers::new(sink.interest()))),
        };
        let view = PathView {
            world,
            velocities: PathVelocities::new(field),
            pairs: Pairs::new(along.opposites),
            flux: along.flux.map(crate::terms::flux::Reservoir::new),
        };
        let worker = Self {
            along,
            sink,
            differentiator: Differentiator::new(world),
            shadow_buffers: shadow::Buffers::default(),
            brought: Brought::default(),
            options: Options::default(),
            separate,
            differentiated: 0,
            looking: 0,
        };
        (worker, view)
    }

    /// Whether derivatives of the filter are needed.
    pub(super) fn differentiates_filter(&self) -> bool {
        // At fixed image points they are not.
        self.along.radiative.is_none() && self.sink.interest().moves_geometry()
    }

    /// Adds what a path tells: of the interior to the first layers of a derivative, and of each term found along
    /// its rays to layers of its own from `at` on, in the order of [`AlongRays::terms`], or to the same.
    pub(super) fn add(
        &mut self,
        tracer: &mut Tracer<'a>,
        path: &Traced<'_>,
        view: &mut PathView<'a>,
        mut at: usize,
        values: &mut [Rgb],
    ) {
        // Only some of the light is this estimator's.
        let all = core::mem::replace(&mut tracer.world, view.world);
        let n = self.sink.layers();
        let mut next = |separate: bool| {
            let layer = if separate { at } else { 1 };
            at += n;
            layer..layer + n
        };
        self.interior(tracer, path, view, &mut values[1..=n]);
        if view.flux.is_some() {
            self.flux(tracer, path, view, &mut values[next(self.separate)]);
        }
        if let (Some(radiative), Some(look)) = (self.along.radiative, path.look.clone()) {
            let from = next(self.separate).start;
            let before = tracer.counters.rays;
            self.edges(tracer, radiative, path, view, look, &mut values[from..]);
            self.looking += tracer.counters.rays - before;
        }
        if let Some(shadows) = self.along.shadows {
            let values = &mut values[next(self.separate)];
            let (dir, weight) = (path.record.nodes[0].wi, path.record.nodes[0].value);
            let Self { sink, shadow_buffers, .. } = self;
            shadows.along_camera_ray(tracer, dir, path.camera_ray, shadow_buffers, |f, value| {
                sink.functional(f, value * weight, values);
            });
        }
        tracer.world = all;
    }

    fn interior(
        &mut self,
        tracer: &mut Tracer<'a>,
        path: &Traced<'_>,
        view: &PathView<'_>,
        values: &mut [Rgb],
    ) {
        let Self { sink, differentiator, brought, .. } = self;
        if !sink.interest().any() {
            return;
        }
        self.differentiated += 1;
        let line = Rng::new(path.seed, LINE_STREAM | u64::from(path.pixel), path.unit);
        sink.begin();
        let recorded = view.of(path.record);
        differentiator.differentiate(&recorded, path.filter, line, sink);
        view.pairs.follow(tracer, brought, |pair, chance, other| {
            differentiator.pair(&recorded, pair, chance, other, sink);
        });
        sink.finish(values);
    }

    fn flux(
        &mut self,
        tracer: &mut Tracer<'a>,
        path: &Traced<'_>,
        view: &mut PathView<'a>,
        values: &mut [Rgb],
    ) {
        let Self { sink, differentiator, .. } = self;
        let Some(mut flux) = view.flux.take() else { return };
        let recorded = view.of(path.record);
        flux.evaluate(tracer, |f, swept, value| {
            let Some(swept) = swept else { return sink.functional(f, value, values) };
            sink.begin();
            f.send(value, sink);
            let [origin, turn] = [swept.origin, swept.turn].map(|v| value.outer(v));
            let at = SurfaceAdjoint::of_place(origin);
            differentiator.send_back(&recorded, swept.node, at, RgbVec::ZERO, turn, sink);
            sink.finish(values);
        });
        view.flux = Some(flux);
    }

    /// Looks for edges; the `first` look has the best numbers.
    fn edges(
        &mut self,
        tracer: &mut Tracer<'a>,
        radiative: &Radiative,
        path: &Traced<'_>,
        view: &PathView<'_>,
        mut first: Rng,
        values: &mut [Rgb],
    ) {
        let recorded = &view.of(path.record);
        match self.along.looks {
            Looks::Average(looks) => {
                let mut left = looks;
                while left > 0.0 {
                    // A part of a look is one now and then.
                    let rng = &mut tracer.rng;
                    let taken = left >= 1.0 || rng.next_f64() < left;
                    let numbers = if left == looks { &mut first } else { rng };
                    left -= 1.0;
                    let look = taken.then(|| Look::new(numbers));
                    let edge = look.and_then(|look| {
                        radiative.edge(tracer, recorded, &look, &mut self.options)
                    });
                    self.send(path.record, view, edge, 1.0 / looks, values);
                }
            }
            Looks::EveryVertex => {
                for node in 1..path.record.nodes.len() {
                    let rng = &mut tracer.rng;
                    let look = Look::new(if node == 1 { &mut first } else { rng });
                    let edge =
                        radiative.edge_from(tracer, recorded, node, &look, &mut self.options);
                    self.send(path.record, view, edge, 1.0, values);
                }
            }
        }
    }

    /// Contracts a `share` of what an edge contributes; `values` are of the edges' terms.
    fn send(
        &mut self,
        record: &PathRecord,
        view: &PathView<'_>,
        edge: Option<Edged>,
        share: f64,
        values: &mut [Rgb],
    ) {
        let Some(e) = edge else { return };
        let sink = &mut self.sink;
        let n = sink.layers();
        let layer = if self.separate && e.node > 1 { n } else { 0 };
        sink.begin();
        for (matter, value) in e.matter.iter().flatten() {
            if sink.interest().moves(matter) {
                Rate::of(*matter, e.n).send(*value * share, sink);
            }
        }
        let viewer = (e.viewer * share).outer(e.n);
        let at = SurfaceAdjoint::of_place(viewer);
        let none = RgbVec::ZERO;
        self.differentiator.send_back(&view.of(record), e.node, at, none, none, sink);
        sink.finish(&mut values[layer..layer + n]);
    }
}
