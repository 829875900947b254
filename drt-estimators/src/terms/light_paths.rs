//! Derivatives of what light paths put on the film.
//!
//! With paths from both ends, the strategies of a path of the image are those that end at a pixel's own image point, and one more: a vertex
//! y of a light path is connected to the camera, and counts for all pixels i whose filters P_i reach its image q(y).
//! These are sampled apart, as boundary segments are: with the light path's contribution f over its density and its MIS weight w,
//!
//! ```text
//! ∂I_i = E[ w/p (P_i(q) ∂f + f ∇P_i(q)·∂q) ],
//! ```
//!
//! so that a path has three values for all pixels that it reaches: ∂f, and f times the rates of the image point's column and
//! row. There is no record but that of the light path: each vertex is the end of a connection from the camera.

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_math::{Rgb, Rng};

use crate::derivative::adjoint::Differentiator;
use crate::derivative::antithetic::AntitheticPairs;
use crate::derivative::velocity::PathVelocities;
use crate::sampling::bidirectional::{Bidirectional, EmissionSampler, SeenFromCamera};
use crate::sampling::record::PathRecord;
use crate::sampling::trace::Tracer;
use crate::terms::boundary_segments::BoundarySink;
use crate::terms::interior::{PathView, Recorder};
use crate::terms::selected::Terms;
use crate::world::World;

/// Light paths at work.
pub(crate) struct LightPaths<'a> {
    world: &'a World,
    paths: Bidirectional<'a>,
    record: PathRecord,
    views: [PathView<'a>; 1],
    differentiator: Differentiator<'a>,
    seen: Vec<SeenFromCamera>,
    /// Pixels that a vertex is seen in, by three weights: the filter, and its slopes.
    pixels: [Vec<(u32, f64)>; 3],
}

impl<'a> LightPaths<'a> {
    /// In the light of `all` emitters, for the `terms` of derivatives by those that light a `world`.
    pub(crate) fn new(
        all: &'a World,
        emission: &'a EmissionSampler,
        world: &'a World,
        terms: &Terms,
    ) -> Self {
        let velocities = PathVelocities::new(Arc::clone(&terms.velocity));
        let pairs = AntitheticPairs::new(false);
        let view = PathView::new(world, velocities, pairs, terms.flux.as_ref()).with_probes();
        Self {
            world,
            paths: Bidirectional::new(all, emission),
            record: PathRecord::default(),
            views: [view],
            differentiator: Differentiator::new(world),
            seen: Vec::new(),
            pixels: <[Vec<_>; 3]>::default(),
        }
    }

    /// Traces a light path. `line` is for line integrals.
    pub(crate) fn sample<R: BoundarySink>(
        &mut self,
        tracer: &mut Tracer<'a>,
        line: &Rng,
        receiver: &mut R,
    ) {
        let mut seen = core::mem::take(&mut self.seen);
        seen.clear();
        self.paths.trace_to_camera::<Recorder<'_, '_>>(tracer, &mut seen);
        for vertex in &seen {
            self.differentiate(vertex, line.clone(), receiver);
        }
        self.seen = seen;
    }

    fn differentiate<R: BoundarySink>(
        &mut self,
        seen: &SeenFromCamera,
        line: Rng,
        receiver: &mut R,
    ) {
        let Self { world, record, views, differentiator, pixels, .. } = self;
        let [width, height] = world.camera.film();
        pixels.iter_mut().for_each(Vec::clear);
        for p in world.camera.footprint(seen.view.point) {
            let pixel = p.pixel[1] * width + p.pixel[0];
            for (list, weight) in pixels.iter_mut().zip([p.weight, p.gradient[0], p.gradient[1]]) {
                list.extend((weight != 0.0).then_some((pixel, weight)));
            }
        }
        if pixels.iter().all(Vec::is_empty) {
            return;
        }
        let column_and_row = [0, 1].map(|k| {
            let inside = f64::max(seen.view.point[k], 0.0) as u32;
            u32::min(inside, [width, height][k].saturating_sub(1))
        });
        views[0].begin(None, || line.clone(), || line.clone());
        let mut recorder = Recorder { record, views, camera_ray: None, probes: None };
        recorder.begin(column_and_row, &seen.view, Rgb::splat(seen.view.weight));
        self.paths.record_seen(seen, &mut recorder);
        let recorded = views[0].of(record);
        let [of_filter, slopes @ ..] = pixels;
        receiver.spread(of_filter, |sink| {
            differentiator.differentiate(&recorded, [0.0; 2], line, sink);
        });
        let moves = views[0].velocities.moves(0) || views[0].velocities.moves(1);
        for (axis, pixels) in slopes.iter().enumerate().filter(|(_, p)| moves && !p.is_empty()) {
            receiver.spread(pixels, |sink| differentiator.image_point(&recorded, axis, sink));
        }
    }
}
