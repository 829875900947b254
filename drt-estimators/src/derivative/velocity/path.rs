//! The velocities of a recorded path's vertices.

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_math::{Rng, Vec3};

use crate::derivative::velocity::{
    Auxiliary, Blend, ChainPart, ChainedRay, Found, Link, Probe, RayBehind, RayTurn, SurfaceHit,
    TurnPart, TurningRay, VelocityField, VertexVelocity,
};
use crate::sampling::record::PathRecord;
use crate::sampling::trace::Arrival;
use crate::world::vertex::Vertex;
use crate::world::{RayPath, World};

/// The velocities of a path's vertices, node by node.
#[derive(Clone, Debug)]
pub(crate) struct PathVelocities {
    field: Arc<dyn VelocityField>,
    vertices: Vec<VertexVelocity>,
    auxiliary: Vec<Auxiliary>,
    /// Rays that turn, the present one last if it is one.
    turns: Vec<RayTurn>,
    turn_parts: Vec<TurnPart>,
    chain_parts: Vec<ChainPart>,
    /// Of the present ray.
    present: Option<u32>,
    probe: Probe,
}

impl PathVelocities {
    pub(crate) fn new(field: Arc<dyn VelocityField>) -> Self {
        Self {
            field,
            vertices: Vec::new(),
            auxiliary: Vec::new(),
            turns: Vec::new(),
            turn_parts: Vec::new(),
            chain_parts: Vec::new(),
            present: None,
            probe: Probe::new(Rng::new(0, 0, 0)),
        }
    }

    /// Forgets the last path; random numbers are for fields that draw some.
    pub(crate) fn begin(&mut self, rng: impl FnOnce() -> Rng) {
        if self.field.is_random() {
            self.probe.rng = rng();
        }
        self.vertices.clear();
        self.auxiliary.clear();
        self.turns.clear();
        self.turn_parts.clear();
        self.chain_parts.clear();
        self.present = None;
        self.vertices.push(self.field.camera());
    }

    /// A ray from a node, at the `viewer`, along the unit vector `dir`, on which vertices may be recorded next.
    #[inline]
    pub(crate) fn ray(
        &mut self,
        world: &World,
        record: &PathRecord,
        node: usize,
        viewer: &Vertex,
        dir: Vec3,
        ray: &RayPath,
    ) {
        let end = ray.end.as_ref().map(|(point, _)| point);
        if record.nodes[node].single {
            let last = RayBehind { dir, distance: ray.length, end: end.copied() };
            self.present = None;
            self.chain(world, record, node, last);
            return;
        }
        let turning = TurningRay {
            viewer,
            moves: self.vertices[node].moves,
            of_camera: (node == 0).then_some(record.camera_ray),
            dir,
            distance: ray.length,
            end,
            emission_alone: false,
            tangent_plane: None,
        };
        let before = self.turn_parts.len();
        let turn = self.field.turn(world, &turning, &mut self.probe, &mut self.turn_parts);
        self.probe.turning_edges += (self.turn_parts.len() - before) as u64;
        self.present = turn.is_some().then_some(self.turns.len() as u32);
        self.turns.extend(turn);
    }

    /// The ray that started a chain of smooth surfaces which a node ends, and the chain's first node. `links` and `rays` are what
    /// follows on the node, last things first: one ray more than links. `eye` is the camera's point.
    pub(crate) fn chained<'a>(
        &self,
        world: &World,
        record: &'a PathRecord,
        eye: &'a Vertex,
        node: usize,
        mut links: Vec<Link>,
        mut rays: Vec<RayBehind>,
    ) -> Option<(usize, ChainedRay<'a>)> {
        let mut first = node;
        let arrival = loop {
            let arrival = record.nodes[first].arrival.as_ref()?;
            let link = Link::at(world, &record.nodes[first])?;
            let end = Some(link.point);
            links.push(link);
            let parent = arrival.parent as usize;
            if !record.nodes[parent].single {
                break arrival;
            }
            rays.push(RayBehind { dir: arrival.dir, distance: arrival.distance, end });
            first = parent;
        };
        links.reverse();
        rays.reverse();
        let parent = arrival.parent as usize;
        let start = TurningRay {
            viewer: record.nodes[parent].vertex().unwrap_or(eye),
            moves: self.vertices[parent].moves,
            of_camera: (parent == 0).then_some(record.camera_ray),
            dir: arrival.dir,
            distance: arrival.distance,
            end: record.nodes[first].vertex().and_then(Vertex::surface),
            emission_alone: false,
            tangent_plane: None,
        };
        Some((first, ChainedRay { start, links, rays }))
    }

    /// Turns the ray that started a chain of smooth surfaces with what is beside the `last` ray of the chain, too, which leaves a node.
    #[cold]
    fn chain(&mut self, world: &World, record: &PathRecord, node: usize, last: RayBehind) {
        let eye = world.eye_at(record.origin);
        let (links, rays) = (Vec::new(), alloc::vec![last]);
        let Some((first, chain)) = self.chained(world, record, &eye, node, links, rays) else {
            return;
        };
        let (parts, chained) = (&mut self.turn_parts, &mut self.chain_parts);
        let turn = self.field.turn_with_chain(world, &chain, parts, chained);
        let Some(turn) = turn else {
            // What turned it before, whatever it would see, does not turn it for what it sees past the chain.
            self.vertices[first].turn = None;
            return;
        };
        self.probe.turning_edges += (turn.parts.len() + turn.chain.len()) as u64;
        let at = self.turns.len() as u32;
        self.turns.push(turn);
        self.vertices[first].turn = Some(at);
        // They are a chain of nodes, each of which the ray before has found.
        let mut k = node;
        while let Some(arrival) = &record.nodes[k].arrival {
            self.vertices[k].moves = true;
            if k == first {
                break;
            }
            k = arrival.parent as usize;
        }
    }

    /// Adds that of a vertex that no ray of the record has found.
    pub(crate) fn unseen(&mut self) {
        let moves = self.field.may_move();
        self.vertices.push(VertexVelocity { moves, ..Default::default() });
    }

    /// Counts rays that were cast for the field.
    pub(crate) fn count(&mut self, rays: u64) {
        self.probe.rays += rays;
    }

    /// The walk leaves a node at a vertex in a single direction, which follows from the ray that found it: nothing else moves the node.
    pub(crate) fn leave_single(&mut self, node: usize, vertex: &Vertex) {
        if self.field.follows_rays() {
            self.vertices[node].blend = Blend::default();
        }
        if vertex.surface().is_some_and(|s| self.field.bends(s)) {
            self.vertices[node].moves = true;
        }
    }

    /// How the present ray turns, if it does, by its index.
    pub(crate) fn present_turn(&self) -> Option<u32> {
        self.present
    }

    /// Adds that of a vertex just recorded, found by a ray that `hits` some surfaces with a flux.
    #[inline]
    pub(crate) fn arrive(
        &mut self,
        world: &World,
        record: &PathRecord,
        arrival: &Arrival,
        hits: &[SurfaceHit],
    ) {
        let parent = arrival.parent as usize;
        let found = Found {
            camera_ray: record.camera_ray,
            viewer: record.nodes[parent].vertex(),
            ray_moves: self.vertices[parent].moves || self.present.is_some(),
            turn: self.present.map(|i| &self.turns[i as usize]),
            arrival,
            hits,
        };
        let mut velocity = self.field.vertex(world, &found, &mut self.probe, &mut self.auxiliary);
        // Where a direction follows from what is before, a vertex cannot move otherwise than with the ray.
        if record.nodes[parent].single {
            velocity.blend = Blend::default();
        }
        self.vertices.push(VertexVelocity { turn: self.present, ..velocity });
    }

    /// What the field has looked at.
    pub(crate) fn probe(&self) -> &Probe {
        &self.probe
    }

    pub(crate) fn field(&self) -> &dyn VelocityField {
        &*self.field
    }

    /// Of a node of the record.
    pub(crate) fn of(&self, node: usize) -> &VertexVelocity {
        &self.vertices[node]
    }

    /// True when a node moves.
    pub(crate) fn moves(&self, node: usize) -> bool {
        self.vertices[node].moves
    }

    /// A ray that turns.
    pub(crate) fn turn(&self, index: Option<u32>) -> Option<&RayTurn> {
        self.turns.get(index? as usize)
    }

    /// Its summands.
    pub(crate) fn turn_parts(&self, turn: &RayTurn) -> &[TurnPart] {
        &self.turn_parts[turn.parts.clone()]
    }

    /// Those from past smooth surfaces.
    pub(crate) fn chain_parts(&self, turn: &RayTurn) -> &[ChainPart] {
        &self.chain_parts[turn.chain.clone()]
    }

    /// A vertex's summands from other material points.
    pub(crate) fn auxiliary(&self, velocity: &VertexVelocity) -> &[Auxiliary] {
        &self.auxiliary[velocity.auxiliary.clone()]
    }
}
