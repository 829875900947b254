//! Parts of a scene that see nothing of each other but through what scatters.
//!
//! Where light goes from one medium (or vacuum) into another it meets an interface, and unless that
//! is a null surface it scatters there. So nothing in a tank of glass is in sight from outside; an edge
//! in it counts for vertices in it, and for those on the glass. Media that a null surface separates
//! are one chamber, and so are those on the two sides of a surface with a rim.

use alloc::vec::Vec;

use drt_geom::Topology;

use super::jumps::{Jump, Jumps};
use crate::transport::{Kind, Vertex, World};

/// The chamber of each medium.
#[derive(Clone, Debug, Default)]
pub(super) struct Chambers {
    /// Of vacuum first; each a name that they share.
    of: Vec<usize>,
}

/// Some of the chambers.
#[derive(Clone, Debug)]
pub(super) struct Among {
    has: Vec<bool>,
}

impl Chambers {
    pub(super) fn new(world: &World) -> Self {
        let mut of: Vec<usize> = (0..=world.scene.media.len()).collect();
        for (shape, boundary) in
            (0..).zip(&world.scene.shapes).filter_map(|(k, s)| Some((k, s.boundary?)))
        {
            let [a, b] = [boundary.interior, boundary.exterior].map(|m| of[number(m)]);
            if a != b && (world.is_null(shape) || !closed(world, shape)) {
                of.iter_mut().filter(|c| **c == b).for_each(|c| *c = a);
            }
        }
        Self { of }
    }

    fn of(&self, medium: Option<usize>) -> usize {
        self.of[number(medium)]
    }

    /// Those around a shape; `None` for any.
    fn around(&self, world: &World, shape: u32) -> Option<[usize; 2]> {
        let media = match world.scene.shapes[shape as usize].boundary {
            Some(b) => [b.interior, b.exterior],
            None => [world.medium_around(shape as usize)?; 2],
        };
        Some(media.map(|m| self.of(m)))
    }

    /// Those in which one of the shapes can be seen.
    pub(super) fn of_shapes(&self, world: &World, shapes: impl Iterator<Item = u32>) -> Among {
        let mut among = Among { has: alloc::vec![false; self.of.len()] };
        shapes.for_each(|s| among.add(self.around(world, s)));
        among
    }

    /// Those in which one of the edges can be seen.
    pub(super) fn of_edges<'a>(
        &self,
        world: &World,
        jumps: &Jumps,
        list: impl Iterator<Item = &'a Jump>,
    ) -> Among {
        let shapes = world.scene.shapes.len();
        let mut met = alloc::vec![false; shapes];
        for jump in list {
            met[jump.edge.shape as usize] = true;
            for (prim, _) in jumps.faces(jump) {
                met[world.point(prim, [0.0; 2]).0.shape as usize] = true;
            }
        }
        self.of_shapes(world, (0..shapes as u32).filter(|s| met[*s as usize]))
    }

    /// True when a vertex sees one of them.
    pub(super) fn in_sight(&self, world: &World, among: &Among, vertex: &Vertex) -> bool {
        let sides = match &vertex.kind {
            Kind::Surface(s) if world.bsdf_of(s.shape).is_transmissive() => {
                let boundary = world.scene.shapes[s.shape as usize].boundary;
                boundary.map_or([vertex.medium; 2], |b| [b.interior, b.exterior])
            }
            _ => [vertex.medium; 2],
        };
        sides.iter().any(|m| among.has[self.of(*m)])
    }
}

impl Among {
    fn add(&mut self, chambers: Option<[usize; 2]>) {
        match chambers {
            Some(some) => some.iter().for_each(|c| self.has[*c] = true),
            None => self.has.fill(true),
        }
    }

    /// Those that are in both.
    pub(super) fn and(&self, other: &Self) -> Self {
        Self { has: self.has.iter().zip(&other.has).map(|(a, b)| *a && *b).collect() }
    }
}

fn number(medium: Option<usize>) -> usize {
    medium.map_or(0, |m| m + 1)
}

/// True when a shape has no rim.
fn closed(world: &World, shape: u32) -> bool {
    let topology = Topology::of(&world.scene.shapes[shape as usize].mesh);
    topology.edges.iter().all(|e| e.faces[1] != drt_geom::NONE)
}
