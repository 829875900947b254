//! Recording a path once for all that differentiates it.

use drt_math::{Rgb, Rng};

use crate::derivative::antithetic::AntitheticPairs;
use crate::derivative::recorded_path::RecordedPath;
use crate::derivative::velocity::PathVelocities;
use crate::model::rendering::Counters;
use crate::model::sensor::ViewSample;
use crate::sampling::record::{Joint, JointObserver, LightPath, Node, PathRecord, Role};
use crate::sampling::streams::DIMENSIONS;
use crate::sampling::trace::{Arrival, Connection, Endpoint, Observer, OutgoingRay, Pixel, Tracer};
use crate::terms::flux::{Flux, Reservoir};
use crate::terms::interior::probe::{Probe, Probes};
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
    /// What scattering collects at the path's probe, where extinctions are differentiated by probes as well.
    probed: Option<Rgb>,
    /// Its derivatives have a part in what sees no light at all.
    pub(crate) keeps_escapes: bool,
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
        let (probed, keeps_escapes, looked) = (None, false, RayPath::default());
        Self { world, velocities, pairs, flux, probed, keeps_escapes, looked }
    }

    /// Leaves to probes what these are better at.
    pub(crate) fn with_probes(self) -> Self {
        Self { probed: self.world.has_probes().then_some(Rgb::ZERO), ..self }
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
        let Self { velocities, pairs, probed, .. } = self;
        RecordedPath { record, velocities, pairs, lit: self.world.lit, probed: *probed }
    }
}

/// Listens to the walk of a path whose derivative is wanted.
pub(crate) struct Recorder<'r, 'a> {
    pub(crate) record: &'r mut PathRecord,
    pub(crate) views: &'r mut [PathView<'a>],
    /// Keeps the camera's ray, where that is asked for.
    pub(crate) camera_ray: Option<&'r mut RayPath>,
    /// Chooses where media are probed, if any are.
    pub(crate) probes: Option<&'r mut Probes>,
}

impl<'a> Recorder<'_, 'a> {
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

    /// Adds the probe of a path that has been walked, and traces what it sees.
    pub(crate) fn probe(&mut self, tracer: &mut Tracer<'a>) {
        let Some(probes) = self.probes.take() else { return };
        self.views.iter_mut().for_each(|view| view.probed = view.probed.map(|_| Rgb::ZERO));
        let Some(probe) = probes.choose(tracer) else { return };
        let Probe { arrival, carries, segments, control, paths } = probe;
        let node = self.record.arrive(&arrival, &probes.way().crossings);
        self.record.nodes[node as usize].role = Role::Probe;
        self.record.nodes[node as usize].control = control;
        self.found(node as usize);
        let Endpoint::Volume(vertex, _) = arrival.end else { return };
        let walked = core::mem::replace(&mut tracer.rng, probes.numbers());
        let all = tracer.world;
        for view in self.views.iter_mut().filter(|view| view.probed.is_some()) {
            tracer.rng = probes.numbers();
            tracer.world = view.world;
            let mut seen = Rgb::ZERO;
            for k in 0..paths {
                tracer.rng = tracer.rng.clone().led_by(probes.leading(k), DIMENSIONS);
                seen += tracer.radiance_scattered(vertex, -arrival.dir, carries, segments);
            }
            view.probed = Some(seen * (1.0 / f64::from(paths)));
        }
        (tracer.rng, tracer.world) = (walked, all);
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

    fn ray(&mut self, world: &World, leaving: &OutgoingRay, ray: &RayPath) {
        if let Some(probes) = &mut self.probes {
            probes.offer(world, leaving, ray);
        }
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
        if let Some(probes) = &self.probes {
            let beside =
                matches!(arrival.end, Endpoint::Volume(..)) && arrival.emission_weight == 0.0;
            self.record.nodes[node as usize].control =
                if beside { Rgb::ZERO } else { probes.control };
        }
        for view in self.views.iter_mut() {
            let hits = view.flux.as_ref().map_or(&[][..], Reservoir::hits);
            view.velocities.arrive(view.world, self.record, arrival, hits);
        }
        node
    }

    fn scatter(&mut self, _: &World, leaving: &OutgoingRay, value: Rgb, inv_pdf: f64, rng: &Rng) {
        self.record.scatter(leaving, value, inv_pdf);
        for view in self.views.iter_mut() {
            if leaving.pdf().is_none() {
                view.velocities.leave_single(leaving.node as usize, &leaving.vertex);
            }
            view.pairs.offer(view.world, self.record, &view.velocities, leaving, rng);
        }
    }

    fn keeps_escapes(&self) -> bool {
        self.views.iter().any(|view| view.keeps_escapes)
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
