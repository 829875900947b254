//! One estimator's part in the derivative of a path: the light of some emitters, by a velocity field.

use alloc::sync::Arc;

use drt_geom::edges::tree::TreeScratch;
use drt_math::{Rgb, RgbVec, Rng};

use crate::derivative::adjoint::Differentiator;
use crate::derivative::antithetic::{AntitheticPairs, PairedRadiance};
use crate::derivative::sensitivity::{AdjointSink, SurfaceAdjoint, VelocityTerm};
use crate::derivative::velocity::PathVelocities;
use crate::sampling::record::PathRecord;
use crate::sampling::streams::LINE_STREAM;
use crate::sampling::trace::Tracer;
use crate::terms::boundary_segments::shadow;
use crate::terms::edge_queries::{EdgeContribution, EdgeQuery, QueryRate, SeenEdges};
use crate::terms::flux::FluxRay;
use crate::terms::grazing::GrazingTriangles;
use crate::terms::interior::PathSink;
use crate::terms::interior::recorder::PathView;
use crate::terms::level::Levels;
use crate::terms::selected::Terms;
use crate::world::{RayPath, World};

/// The derivative of a recorded path, and of the pairs of rays that tell how lobes turn.
pub(super) struct PathDerivative<'a> {
    pub(super) sweep: Differentiator<'a>,
    incoming: PairedRadiance,
}

impl<'a> PathDerivative<'a> {
    pub(super) fn new(world: &'a World) -> Self {
        Self { sweep: Differentiator::new(world), incoming: PairedRadiance::default() }
    }

    /// Sends the gradient of a record's value to a `sink`. `filter` is the gradient of the pixel's filter, over the density; `line` is for
    /// line integrals.
    pub(super) fn send<S: AdjointSink>(
        &mut self,
        tracer: &mut Tracer<'a>,
        record: &PathRecord,
        view: &PathView<'_>,
        filter: [f64; 2],
        line: Rng,
        sink: &mut S,
    ) {
        let Self { sweep, incoming } = self;
        let recorded = view.of(record);
        sweep.differentiate(&recorded, filter, line, sink);
        view.pairs.follow(tracer, incoming, |pair, chance, other| {
            sweep.pair(&recorded, pair, chance, other, sink);
        });
    }
}

/// What one estimator differentiates of the paths through pixels.
pub(crate) struct Component<'a, S> {
    /// The scene, lit by what this estimator differentiates.
    pub(crate) world: &'a World,
    pub(crate) terms: &'a Terms,
    pub(crate) levels: &'a Levels,
    /// How often paths query edges, which may be other than the terms have it.
    pub(crate) queries: QueryRate,
    pub(crate) sink: S,
}

/// A component at work.
pub(super) struct Worker<'a, S> {
    pub(super) terms: &'a Terms,
    pub(super) levels: &'a Levels,
    pub(super) queries: QueryRate,
    pub(super) sink: S,
    pub(super) derivative: PathDerivative<'a>,
    shadow_buffers: shadow::Buffers,
    /// Of the edge tree.
    options: TreeScratch,
    separate: bool,
    pub(super) differentiated: u64,
    /// Rays of edge queries.
    pub(super) query_rays: u64,
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
    /// The numbers of an edge query.
    pub(super) query: Option<Rng>,
}

impl<'a, S: PathSink> Worker<'a, S> {
    /// With what it keeps of each path.
    pub(super) fn new(component: Component<'a, S>, separate: bool) -> (Self, PathView<'a>) {
        let Component { world, terms, levels, queries, sink } = component;
        let velocities = PathVelocities::new(Arc::clone(&terms.velocity));
        let pairs = AntitheticPairs::new(terms.lobe_pairs);
        let mut view = PathView::new(world, velocities, pairs, terms.flux.as_ref()).with_probes();
        view.keeps_escapes = !levels.is_empty();
        let worker = Self {
            terms,
            levels,
            queries,
            sink,
            derivative: PathDerivative::new(world),
            shadow_buffers: shadow::Buffers::default(),
            options: TreeScratch::default(),
            separate,
            differentiated: 0,
            query_rays: 0,
        };
        (worker, view)
    }

    /// Whether derivatives of the filter are needed.
    pub(super) fn differentiates_filter(&self) -> bool {
        self.terms.velocity.moves_image_points() && self.sink.active().moves_geometry()
    }

    /// Adds what a path tells: of the interior to the first layers of a derivative, and of each term found along
    /// its rays to layers of its own from `at` on, in the order of [`Terms::along_paths`], or to the same.
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
        if self.terms.velocity.follows_edges() && self.separate {
            let mut parts = [alloc::vec![Rgb::ZERO; n], alloc::vec![Rgb::ZERO; n]];
            for (at_rest, part) in [true, false].into_iter().zip(&mut parts) {
                self.derivative.sweep.edges_at_rest = at_rest;
                self.interior(tracer, path, view, part);
            }
            let warp = next(true).start;
            for (k, (at_rest, all)) in parts[0].iter().zip(&parts[1]).enumerate() {
                values[1 + k] += *at_rest;
                values[warp + k] += *all - *at_rest;
            }
        } else {
            self.interior(tracer, path, view, &mut values[1..=n]);
        }
        if view.flux.is_some() {
            self.flux(tracer, path, view, &mut values[next(self.separate)]);
        }
        let edges = self.terms.edges.as_ref().filter(|_| self.queries.any());
        if let (Some(edges), Some(query)) = (edges, path.query.clone()) {
            let from = next(self.separate).start;
            let before = tracer.counters.rays;
            self.edges(tracer, edges, path, view, query, &mut values[from..]);
            self.query_rays += tracer.counters.rays - before;
        }
        if let Some(shadows) = &self.terms.boundary.shadows {
            let values = &mut values[next(self.separate)];
            let (dir, weight) = (path.record.nodes[0].wi, path.record.nodes[0].value);
            let Self { sink, shadow_buffers, .. } = self;
            let eye = path.record.origin;
            shadows.along_camera_ray(
                tracer,
                eye,
                dir,
                path.camera_ray,
                shadow_buffers,
                |f, value| {
                    sink.functional(f, value * weight, values);
                },
            );
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
        let Self { terms, sink, derivative, levels, .. } = self;
        let left_out = |seen: &GrazingTriangles| seen.first_of(path.record).is_some();
        if !sink.active().any() || terms.grazing.as_ref().is_some_and(left_out) {
            return;
        }
        // Rays that do not turn with edges have rates that jump there.
        let turns = !derivative.sweep.edges_at_rest;
        derivative.sweep.level = if turns { levels.of(path.pixel) } else { Rgb::ZERO };
        self.differentiated += 1;
        let line = Rng::new(path.seed, LINE_STREAM | u64::from(path.pixel), path.unit);
        sink.begin();
        derivative.send(tracer, path.record, view, path.filter, line, sink);
        sink.finish(values);
    }

    fn flux(
        &mut self,
        tracer: &mut Tracer<'a>,
        path: &Traced<'_>,
        view: &mut PathView<'a>,
        values: &mut [Rgb],
    ) {
        let Self { sink, derivative, .. } = self;
        let Some(mut flux) = view.flux.take() else { return };
        let recorded = view.of(path.record);
        flux.evaluate(tracer, |f, ray_of_flux, value| {
            let Some(ray_of_flux) = ray_of_flux else { return sink.functional(f, value, values) };
            sink.begin();
            f.send(value, sink);
            let [origin, turn] = [ray_of_flux.origin, ray_of_flux.turn].map(|v| value.outer(v));
            let FluxRay { node, dir, turns, .. } = ray_of_flux;
            derivative.sweep.send_back_ray(&recorded, node, dir, turns, origin, turn, sink);
            sink.finish(values);
        });
        view.flux = Some(flux);
    }

    /// Queries edges; the first query has the best numbers.
    fn edges(
        &mut self,
        tracer: &mut Tracer<'a>,
        edges: &SeenEdges,
        path: &Traced<'_>,
        view: &PathView<'_>,
        mut first: Rng,
        values: &mut [Rgb],
    ) {
        let recorded = &view.of(path.record);
        match self.queries {
            QueryRate::Average(queries) => {
                let mut left = queries;
                while left > 0.0 {
                    // A part of a query is one now and then.
                    let rng = &mut tracer.rng;
                    let taken = left >= 1.0 || rng.next_f64() < left;
                    let numbers = if left == queries { &mut first } else { rng };
                    left -= 1.0;
                    let query = taken.then(|| EdgeQuery::new(numbers));
                    let edge = query
                        .and_then(|query| edges.edge(tracer, recorded, &query, &mut self.options));
                    self.send(path.record, view, edge, 1.0 / queries, values);
                }
            }
            QueryRate::EveryVertex => {
                for node in 1..path.record.nodes.len() {
                    let rng = &mut tracer.rng;
                    let query = EdgeQuery::new(if node == 1 { &mut first } else { rng });
                    let edge = edges.edge_from(tracer, recorded, node, &query, &mut self.options);
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
        edge: Option<EdgeContribution>,
        share: f64,
        values: &mut [Rgb],
    ) {
        let Some(e) = edge else { return };
        let sink = &mut self.sink;
        let n = sink.layers();
        let layer = if self.separate && e.node > 1 { n } else { 0 };
        sink.begin();
        for (matter, n, value) in e.matter.iter().flatten() {
            if sink.active().moves(matter) {
                VelocityTerm::of(*matter, *n).send(*value * share, sink);
            }
        }
        let viewer = (e.viewer * share).outer(e.n);
        let at = SurfaceAdjoint::of_place(viewer);
        let none = RgbVec::ZERO;
        self.derivative.sweep.send_back(&view.of(record), e.node, at, none, none, sink);
        sink.finish(&mut values[layer..layer + n]);
    }
}
