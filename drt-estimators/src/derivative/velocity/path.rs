//! The velocities of a recorded path's vertices.

use alloc::sync::Arc;
use alloc::vec::Vec;

use crate::derivative::antithetic::AntitheticPairs;
use crate::derivative::velocity::{Auxiliary, Found, SurfaceHit, VelocityField, VertexVelocity};
use crate::sampling::record::PathRecord;
use crate::sampling::trace::Arrival;
use crate::world::World;
use crate::world::lights::EmitterMask;

/// The velocities of a path's vertices, node by node.
#[derive(Clone, Debug)]
pub(crate) struct PathVelocities {
    field: Arc<dyn VelocityField>,
    vertices: Vec<VertexVelocity>,
    auxiliary: Vec<Auxiliary>,
}

impl PathVelocities {
    pub(crate) fn new(field: Arc<dyn VelocityField>) -> Self {
        Self { field, vertices: Vec::new(), auxiliary: Vec::new() }
    }

    /// Forgets the last path.
    pub(crate) fn begin(&mut self) {
        self.vertices.clear();
        self.auxiliary.clear();
        self.vertices.push(self.field.camera());
    }

    /// Adds that of a vertex just recorded, found by a ray that `hits` some surfaces with a flux.
    pub(crate) fn arrive(
        &mut self,
        world: &World,
        record: &PathRecord,
        arrival: &Arrival,
        hits: &[SurfaceHit],
    ) {
        let parent = arrival.parent as usize;
        let found = Found {
            pixel: record.pixel,
            viewer: record.nodes[parent].vertex(),
            velocity: &self.vertices[parent],
            arrival,
            hits,
        };
        let velocity = self.field.vertex(world, &found, &mut self.auxiliary);
        self.vertices.push(velocity);
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

    /// A vertex's summands from other material points.
    pub(crate) fn auxiliary(&self, velocity: &VertexVelocity) -> &[Auxiliary] {
        &self.auxiliary[velocity.auxiliary.clone()]
    }
}

/// What is to be differentiated of a path: the light of some emitters, by a velocity field.
#[derive(Clone, Copy)]
pub(crate) struct RecordedPath<'p> {
    pub(crate) record: &'p PathRecord,
    pub(crate) velocities: &'p PathVelocities,
    /// Rays beside it, where they are asked for.
    pub(crate) pairs: &'p AntitheticPairs,
    pub(crate) lit: EmitterMask,
}
