//! The path record: what a walk leaves behind when its derivative is wanted.

use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec::Vec;
use core::ops::Range;

use drt_math::{Rgb, Rng, Vec3};

use super::hold::Hold;
use super::pairs::{Paired, Pairs};
use super::tow::{self, Tow};
use super::trace::{Arrival, Connection, Endpoint, Leaving, Observer};
use super::vertex::{Kind, Vertex};
use super::world::{Crossing, RayPath, World};
use crate::flux::Reservoir;

/// A vertex of the record. Node 0 is the camera; every other knows its parent, which comes before.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    /// How the walk got here; `None` at the camera.
    pub(crate) arrival: Option<Arrival>,
    pub(crate) crossings: Range<usize>,
    pub(crate) connections: Range<usize>,
    /// The direction the walk left in.
    pub(crate) wi: Vec3,
    /// The scattering function's value for it.
    pub(crate) value: Rgb,
    /// Its inverse density, Russian roulette included.
    pub(crate) inv_pdf: f64,
    /// It moves, in the spatial form.
    pub(crate) carried: bool,
    /// What keeps it, if it moves, from being carried, in the spatial form.
    pub(crate) hold: Hold,
    /// What tows it, in the spatial form.
    pub(crate) tows: Range<usize>,
    /// The part of its scattering's derivative, relative to the value, that pairs tell of.
    pub(crate) paired: Paired,
}

impl Node {
    /// The vertex, unless this is the camera or the environment.
    pub(crate) fn vertex(&self) -> Option<&Vertex> {
        match &self.arrival.as_ref()?.end {
            Endpoint::Surface(v) | Endpoint::Volume(v, _) => Some(v),
            Endpoint::Environment => None,
        }
    }
}

/// What carries the vertices of a path in the spatial form.
#[derive(Clone, Debug, Default)]
pub(crate) struct Carriers {
    /// Shapes that move.
    pub(crate) shapes: Arc<[bool]>,
    pub(crate) camera: bool,
}

/// A recorded path: a tree, since equiangular side vertices branch off its segments.
#[derive(Clone, Debug, Default)]
pub(crate) struct PathRecord {
    pub(crate) nodes: Vec<Node>,
    pub(crate) crossings: Vec<Crossing>,
    pub(crate) connections: Vec<(Connection, Range<usize>)>,
    /// Column and row that the path serves.
    pub(crate) pixel: [u32; 2],
    /// The path's value.
    pub(crate) value: Rgb,
    /// Where it met surfaces with a flux, if there are such.
    pub(crate) flux: Option<Box<Reservoir>>,
    /// What carries vertices, where that is asked for.
    pub(crate) carriers: Carriers,
    pub(crate) tows: Vec<Tow>,
    /// Rays beside it, where they are asked for.
    pub(crate) pairs: Pairs,
}

impl PathRecord {
    /// Empties the record for a camera ray of a `pixel` along `dir` with filter weight `value`.
    pub(crate) fn begin(&mut self, pixel: [u32; 2], dir: Vec3, value: Rgb) {
        self.pixel = pixel;
        self.nodes.clear();
        self.crossings.clear();
        self.connections.clear();
        self.tows.clear();
        self.value = Rgb::ZERO;
        self.nodes.push(Node {
            arrival: None,
            crossings: 0..0,
            connections: 0..0,
            wi: dir,
            value,
            inv_pdf: 1.0,
            carried: self.carriers.camera,
            hold: Hold::default(),
            tows: 0..0,
            paired: Paired::default(),
        });
    }

    /// The segments up to a node.
    pub(crate) fn segments(&self, mut node: usize) -> u32 {
        let mut n = 0;
        while let Some(a) = &self.nodes[node].arrival {
            n += 1;
            node = a.parent as usize;
        }
        n
    }

    fn keep(&mut self, crossings: &[Crossing]) -> Range<usize> {
        let start = self.crossings.len();
        self.crossings.extend_from_slice(crossings);
        start..self.crossings.len()
    }
}

/// What holds a vertex that was seen from a `viewer`, or from the camera.
pub(crate) fn hold_of(
    world: &World,
    pixel: [u32; 2],
    viewer: Option<&Vertex>,
    arrival: &Arrival,
) -> Hold {
    match (&arrival.end, viewer) {
        (Endpoint::Surface(v), None) => world.hold_in_pixel(v, pixel),
        (Endpoint::Surface(v) | Endpoint::Volume(v, _), Some(viewer)) => {
            world.hold(viewer, v, arrival.dir, arrival.distance)
        }
        _ => Hold::default(),
    }
}

impl Observer for PathRecord {
    const RECORDS: bool = true;

    fn contribution(&mut self, _segments: u32, value: Rgb) {
        self.value += value;
    }

    fn ray(&mut self, world: &World, leaving: &Leaving, ray: &RayPath) {
        let carried = self.nodes[leaving.node as usize].carried;
        if let Some(flux) = &mut self.flux {
            flux.offer(world, leaving, carried, ray);
        }
    }

    fn arrive(&mut self, world: &World, arrival: &Arrival, crossings: &[Crossing]) -> u32 {
        let crossings = self.keep(crossings);
        let c = self.connections.len();
        let on_mover = || match &arrival.end {
            Endpoint::Surface(Vertex { kind: Kind::Surface(s), .. }) => {
                self.carriers.shapes.get(s.shape as usize) == Some(&true)
            }
            _ => false,
        };
        let (brought, on_mover) = (self.nodes[arrival.parent as usize].carried, on_mover());
        let first = self.tows.len();
        if let Endpoint::Volume(Vertex { medium: Some(m), .. }, _) = &arrival.end
            && let Some(reach) = world.reach(*m)
        {
            let met = self.flux.as_ref().map_or(&[][..], |flux| flux.met());
            self.tows.extend(tow::tows(met, arrival.distance, reach));
        }
        let tows = first..self.tows.len();
        let viewer = self.nodes[arrival.parent as usize].vertex();
        let inside = matches!(arrival.end, Endpoint::Volume(..));
        let hold = match brought || on_mover || inside {
            true => hold_of(world, self.pixel, viewer, arrival),
            false => Hold::default(),
        };
        let carried = brought || on_mover || !tows.is_empty() || hold.share > 0.0;
        self.nodes.push(Node {
            arrival: Some(*arrival),
            crossings,
            connections: c..c,
            wi: Vec3::ZERO,
            value: Rgb::ZERO,
            inv_pdf: 0.0,
            carried,
            hold,
            tows,
            paired: Paired::default(),
        });
        self.nodes.len() as u32 - 1
    }

    fn scatter(&mut self, world: &World, leaving: &Leaving, value: Rgb, inv_pdf: f64, rng: &Rng) {
        let node = &mut self.nodes[leaving.node as usize];
        (node.wi, node.value, node.inv_pdf) = (leaving.dir, value, inv_pdf);
        let node = &self.nodes[leaving.node as usize];
        let viewer = node.arrival.as_ref().map_or(0, |arrival| arrival.parent as usize);
        let both = [&self.nodes[viewer], node];
        let paired = self.pairs.offer(world, both, leaving, rng);
        self.nodes[leaving.node as usize].paired = paired;
    }

    fn connect(&mut self, node: u32, connection: &Connection, crossings: &[Crossing]) {
        let crossings = self.keep(crossings);
        self.connections.push((*connection, crossings));
        let end = self.connections.len();
        let node = &mut self.nodes[node as usize];
        if node.connections.is_empty() {
            node.connections.start = end - 1;
        }
        node.connections.end = end;
    }
}

/// Light only: the plain forward renderer.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Radiance(pub(crate) Rgb);

impl Observer for Radiance {
    const RECORDS: bool = false;

    fn contribution(&mut self, _segments: u32, value: Rgb) {
        self.0 += value;
    }
}

/// Light by the number of segments it took.
#[derive(Clone, Debug, Default)]
pub(crate) struct RadianceBySegments(pub(crate) Vec<Rgb>);

impl RadianceBySegments {
    /// The number of segments that some light took at least; `None` without any.
    pub(crate) fn fewest_segments(&self) -> Option<u32> {
        self.0.iter().position(|v| !v.is_zero()).map(|i| i as u32)
    }

    /// True without any light.
    pub(crate) fn is_dark(&self) -> bool {
        self.fewest_segments().is_none()
    }

    /// The light that took at most `segments` segments.
    pub(crate) fn within(&self, segments: u32) -> Rgb {
        let n = self.0.len().min(segments as usize + 1);
        self.0[..n].iter().fold(Rgb::ZERO, |sum, v| sum + *v)
    }
}

impl Observer for RadianceBySegments {
    const RECORDS: bool = false;

    fn contribution(&mut self, segments: u32, value: Rgb) {
        let i = segments as usize;
        if self.0.len() <= i {
            self.0.resize(i + 1, Rgb::ZERO);
        }
        self.0[i] += value;
    }
}
