//! A recorded path with the velocities of its vertices.

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_math::{Rgb, Rng, Vec3};

use super::{Auxiliary, Found, Material, Movers, SurfaceHit, VelocityField, VertexVelocity};
use crate::transport::pairs::Pairs;
use crate::transport::record::PathRecord;
use crate::transport::trace::{Arrival, Connection, Leaving, Observer, Pixel};
use crate::transport::world::{Crossing, World};

/// The velocities of a path's vertices, node by node.
#[derive(Clone, Debug)]
pub(crate) struct PathVelocities {
    field: Arc<dyn VelocityField>,
    vertices: Vec<VertexVelocity>,
    auxiliary: Vec<Auxiliary>,
}

impl PathVelocities {
    fn begin(&mut self) {
        self.vertices.clear();
        self.auxiliary.clear();
        self.vertices.push(self.field.camera());
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

    /// Its summands from other material points.
    pub(crate) fn auxiliary(&self, velocity: &VertexVelocity) -> &[Auxiliary] {
        &self.auxiliary[velocity.auxiliary.clone()]
    }
}

/// A path that can be differentiated.
#[derive(Clone, Debug)]
pub(crate) struct RecordedPath {
    pub(crate) record: PathRecord,
    pub(crate) velocities: PathVelocities,
    /// Rays beside it, where they are asked for.
    pub(crate) pairs: Pairs,
}

impl RecordedPath {
    /// Of paths whose vertices move by a field, and whose roughness and narrow lobes are told by `pairs`.
    pub(crate) fn new(field: Arc<dyn VelocityField>, pairs: Pairs) -> Self {
        let (vertices, auxiliary) = (Vec::new(), Vec::new());
        let velocities = PathVelocities { field, vertices, auxiliary };
        Self { record: PathRecord::default(), velocities, pairs }
    }

    /// Empties it for a camera ray of a `pixel` along `dir` with filter weight `value`.
    pub(crate) fn begin(&mut self, pixel: [u32; 2], dir: Vec3, value: Rgb) {
        self.record.begin(pixel, dir, value);
        self.velocities.begin();
    }

    /// Adds a vertex found by a ray that hits some surfaces with a flux; returns its node.
    pub(crate) fn arrive(
        &mut self,
        world: &World,
        arrival: &Arrival,
        crossings: &[Crossing],
        hits: &[SurfaceHit],
    ) -> u32 {
        let node = self.record.arrive(arrival, crossings);
        let parent = arrival.parent as usize;
        let PathVelocities { field, vertices, auxiliary } = &mut self.velocities;
        let found = Found {
            pixel: self.record.pixel,
            viewer: self.record.nodes[parent].vertex(),
            velocity: &vertices[parent],
            arrival,
            hits,
        };
        let velocity = field.vertex(world, &found, auxiliary);
        vertices.push(velocity);
        node
    }
}

impl Default for RecordedPath {
    /// In the material form, with nothing that moves.
    fn default() -> Self {
        Self::new(Arc::new(Material::new(Movers::default())), Pairs::default())
    }
}

impl Observer for RecordedPath {
    const RECORDS: bool = true;

    fn contribution(&mut self, _: Pixel, _: u32, value: Rgb) {
        self.record.value += value;
    }

    fn arrive(&mut self, world: &World, arrival: &Arrival, crossings: &[Crossing]) -> u32 {
        Self::arrive(self, world, arrival, crossings, &[])
    }

    fn scatter(&mut self, world: &World, leaving: &Leaving, value: Rgb, inv_pdf: f64, rng: &Rng) {
        self.record.scatter(leaving, value, inv_pdf);
        let Self { record, velocities, pairs } = self;
        pairs.offer(world, record, velocities, leaving, rng);
    }

    fn connect(&mut self, node: u32, connection: &Connection, crossings: &[Crossing]) {
        self.record.connect(node, connection, crossings);
    }
}
