//! Recording a path once for all that differentiates it.

use drt_math::{Rgb, Rng};

use crate::derivative::antithetic::AntitheticPairs;
use crate::derivative::recorded_path::RecordedPath;
use crate::derivative::velocity::PathVelocities;
use crate::model::rendering::Counters;
use crate::model::sensor::ViewSample;
use crate::sampling::record::{Joint, JointObserver, LightPath, Node, PathRecord, Role};
use crate::sampling::trace::{Arrival, Connection, Observer, OutgoingRay, Pixel};
use crate::terms::flux::{Flux, Reservoir};
use crate::world::Crossing;
use crate::world::{RayPath, World};

/// A path as one estimator sees it, which differentiates the light of some emitters.
pub(crate) struct PathView<'a> {
    /// The scene as the estimator has prepared it, lit by what it differentiates.
    pub(crate) world: &'a World,
    pub(crate) velocities: PathVelocities,
    pub(crate) pairs: AntitheticPairs,
    /// One of the surfaces with a flux that the path met, if there are such.
    pub(crate) flux: Option<Reservoir>,
    /// A ray that was looked at for nothing else.
    looked: RayPath,
}

impl<'a> PathView<'a> {
    pub(crate) fn new(
        world: &'a World,
        velocities: PathVelocities,
        pairs: AntitheticPairs,
        flux: Option<&Flux>,
    ) -> Self {
        let flux = flux.map(Reservoir::new);
        Self { world, velocities, pairs, flux, looked: RayPath::default() }
    }

    /// Forgets the last path; random numbers are for choosing among pairs, for velocities, and for surfaces with a flux.
    pub(crate) fn begin(
        &mut self,
        pairs: Option<Rng>,
        velocities: impl FnOnce() -> Rng,
        flux: impl FnOnce() -> Rng,
    ) {
        self.velocities.begin(velocities);
        self.pairs.begin(pairs);
        if let Some(reservoir) = &mut self.flux {
            reservoir.begin(flux());
        }
    }

    /// With the record that it belongs to.
    pub(crate) fn of<'p>(&'p self, record: &'p PathRecord) -> RecordedPath<'p> {
        let Self { velocities, pairs, .. } = self;
        RecordedPath { record, velocities, pairs, lit: self.world.lit }
    }
}

/// Listens to the walk of a path whose derivative is wanted.
pub(crate) struct Recorder<'r, 'a> {
    pub(crate) record: &'r mut PathRecord,
    pub(crate) views: &'r mut [PathView<'a>],
    /// Keeps the camera's ray, where that is asked for.
    pub(crate) camera_ray: Option<&'r mut RayPath>,
}

impl Recorder<'_, '_> {
    /// A node has been added that no walk arrived at.
    fn found(&mut self, node: usize) {
        let Node { arrival: Some(arrival), role, .. } = &self.record.nodes[node] else { return };
        let parent = arrival.parent as usize;
        let dir = arrival.dir;
        for PathView { world, velocities, flux, looked, .. } in self.views.iter_mut() {
            let follows = velocities.field().follows_rays();
            if follows && matches!(role, Role::LastOfLight) {
                velocities.unseen();
                continue;
            }
            let mut hits = &[][..];
            if follows {
                let eye = world.eye_at(self.record.origin);
                let viewer = self.record.nodes[parent].vertex().unwrap_or(&eye);
                let mut counters = Counters::default();
                world.cast(viewer, dir, looked, &mut counters);
                velocities.count(counters.rays);
                velocities.ray(world, self.record, parent, viewer, dir, looked);
                if let Some(flux) = flux {
                    let turns = velocities.present_turn().is_some();
                    flux.meet(looked, dir, turns || velocities.moves(parent));
                    hits = flux.hits();
                }
            }
            velocities.arrive(world, self.record, arrival, hits);
        }
    }

    /// Empties the record for a camera ray of a `pixel` with filter weight `value`.
    pub(crate) fn begin(&mut self, pixel: [u32; 2], view: &ViewSample, value: Rgb) {
        self.record.begin(pixel, view, value);
    }
}

impl Observer for Recorder<'_, '_> {
    const RECORDS: bool = true;

    fn contribution(&mut self, _: Pixel, _: u32, value: Rgb) {
        self.record.value += value;
    }

    fn ray(&mut self, _: &World, leaving: &OutgoingRay, ray: &RayPath) {
        if let (0, Some(kept)) = (leaving.node, &mut self.camera_ray) {
            kept.clone_from(ray);
        }
        for PathView { world, velocities, flux, .. } in self.views.iter_mut() {
            let node = leaving.node as usize;
            velocities.ray(world, self.record, node, &leaving.vertex, leaving.dir, ray);
            if let Some(flux) = flux {
                let moves = velocities.moves(node);
                flux.offer(world, leaving, moves, velocities.present_turn(), ray);
            }
        }
    }

    fn arrive(&mut self, _: &World, arrival: &Arrival, crossings: &[Crossing]) -> u32 {
        let node = self.record.arrive(arrival, crossings);
        for view in self.views.iter_mut() {
            let hits = view.flux.as_ref().map_or(&[][..], Reservoir::hits);
            view.velocities.arrive(view.world, self.record, arrival, hits);
        }
        node
    }

    fn scatter(&mut self, _: &World, leaving: &OutgoingRay, value: Rgb, inv_pdf: f64, rng: &Rng) {
        self.record.scatter(leaving, value, inv_pdf);
        for view in self.views.iter_mut() {
            view.pairs.offer(view.world, self.record, &view.velocities, leaving, rng);
        }
    }

    fn connect(&mut self, node: u32, connection: &Connection, crossings: &[Crossing]) {
        self.record.connect(node, connection, crossings);
    }
}

impl JointObserver for Recorder<'_, '_> {
    fn emission(&mut self, node: u32, weight: f64) {
        let arrival = self.record.nodes.get_mut(node as usize).and_then(|n| n.arrival.as_mut());
        if let Some(arrival) = arrival {
            arrival.emission_weight = weight;
        }
    }

    fn join(&mut self, joint: &Joint<'_>, path: &LightPath) {
        let node = self.record.join(joint, path);
        self.found(node);
    }

    fn joined(&mut self, path: &LightPath) {
        for node in self.record.add_light_path(path) {
            self.found(node);
        }
    }
}
